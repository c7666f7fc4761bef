"""A mesh as a page: one file without the network, and in Chromium the land turns under a real mouse."""

import base64
import json
import re
from dataclasses import replace

import browser
import numpy as np
import pytest
from commands import spawn
from maps import MAPS

from terrain_gl.files.export import make_mesh, write_mesh
from terrain_gl.image import file_bytes, read_image
from terrain_gl.mesh import vertex_heights

SPACING_M = (30.0, 20.0)


def of_squares(heights):
    """A mesh of all posts, with a texture that is red in the west and blue in the east."""
    rows, cols = np.mgrid[: heights.shape[0] - 1, : heights.shape[1] - 1].reshape(2, -1, 1, 1)
    corners = np.array([[[0, 0], [0, 1], [1, 1]], [[0, 0], [1, 1], [1, 0]]])
    triangles = np.concatenate([np.stack([cols, rows], -1).reshape(-1, 1, 2) + each for each in corners])
    east = np.linspace(0, 1, 64)
    ramp = np.stack([1 - east, 0 * east, east], -1)[None].repeat(48, 0)
    texture = file_bytes((255 * ramp).astype("u1"), ".jpg")
    return replace(make_mesh(triangles, heights, SPACING_M), texture=texture, within_m=2.5)


@pytest.fixture
def hill():
    return np.outer(np.hanning(33), np.hanning(41)).astype("f4") * 250


def parts_of(path):
    text = path.read_text("utf-8")
    return text, json.loads(re.search(r'<script type="application/json" id="mesh">(.*?)</script>', text)[1])


def numbers(text, kind):
    return np.frombuffer(base64.b64decode(text), kind)


def test_the_page_holds_the_mesh(hill, tmp_path):
    mesh = of_squares(hill)
    write_mesh(tmp_path / "land.html", mesh)
    text, data = parts_of(tmp_path / "land.html")
    assert "2,560 triangles, nowhere more than 2.5 m above or below the map" in text
    places = numbers(data["places"], "<f4").reshape(-1, 3)
    faces = numbers(data["faces"], "<u4").reshape(-1, 3)
    assert len(faces) == 2560
    corners = places[faces]
    assert (np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])[:, 1] > 0).all()  # seen from above
    col, row = (mesh.posts - np.array(hill.shape[::-1]) / 2 + 0.5).T
    expected = np.stack([col * SPACING_M[0], vertex_heights(hill, mesh.posts), row * SPACING_M[1]], -1)
    np.testing.assert_allclose(*(np.unique(each, axis=0) for each in (places, expected.astype("f4"))), atol=1e-3)
    rim = numbers(data["rim"], "<u4")
    assert len(rim) == 2 * 2 * (32 + 40)  # every edge of the map once


def test_nothing_is_loaded(hill, tmp_path):
    write_mesh(tmp_path / "a <b> & c.html", of_squares(hill))
    text, _ = parts_of(tmp_path / "a <b> & c.html")
    assert "default-src 'none'" in text and not re.search(r"(?:src|href)=\"?[a-z]+:", text)
    assert "<title>a &lt;b&gt; &amp; c</title>" in text
    assert "The MIT License" in text and "three.js authors" in text


@pytest.mark.slow
def test_the_command(tmp_path):
    np.save(tmp_path / "dem.npy", MAPS["odd"]().heights)
    done = spawn("mesh", "dem.npy", "-o", "land.html", "--texture", "64", "--voids", "hole", cwd=tmp_path)
    assert done.returncode == 0 and ", within" in done.stdout, done
    text, data = parts_of(tmp_path / "land.html")
    assert (tmp_path / "land.html").stat().st_size < 3e6 and [*tmp_path.glob("*.png")] == []
    at_posts, between = re.search(r"within ([\d.e+-]+) m at posts, ([\d.e+-]+) m between", done.stdout).groups()
    assert f"at most {at_posts} m above or below the map's posts, {between} m between them" in text
    assert len(numbers(data["faces"], "<u4")) % 3 == 0


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    if browser.CHROMIUM is None:
        pytest.skip("Chromium is not there: apt-get install chromium")
    opened = browser.Page(tmp_path_factory.mktemp("chromium"), "--enable-unsafe-swiftshader")
    yield opened
    opened.close()


def test_the_land_turns_under_a_mouse(page, hill, tmp_path):
    write_mesh(tmp_path / "land.html", of_squares(hill))
    page.open((tmp_path / "land.html").as_uri())
    page.value(
        "new Promise((done) => { const look = () => document.body.dataset.state ? done() : setTimeout(look, 20);"
        " look(); })"
    )

    def seen():
        page.picture(tmp_path / "seen.png")
        return read_image(tmp_path / "seen.png")[..., :3].astype(int)

    before = seen()
    red, blue = (((before @ by) > 90).nonzero()[1].mean() for by in ([1, 0, -1], [-1, 0, 1]))
    assert red + 100 < blue  # the west is on the left
    needle = "document.getElementById('needle').getAttribute('transform')"
    length = "document.querySelector('#scale span').textContent"
    assert abs(float(page.value(needle)[7:-1])) < 1e-3
    page.drag((640, 500), (760, 500), (900, 520))
    turned = seen()
    assert (turned != before).any(-1).mean() > 0.05 and abs(float(page.value(needle)[7:-1])) > 20
    near = page.value(length)
    for _ in range(8):
        page.ask("Input.dispatchMouseEvent", type="mouseWheel", x=640, y=500, deltaX=0, deltaY=-240)
    assert page.value(f"new Promise((done) => setTimeout(() => done({length}), 300))") != near
    page.value("document.getElementById('edges').click()")
    assert page.value("document.getElementById('edges').checked")
    assert all(url.startswith(("file:", "data:image/jpeg")) for url in page.requests)
    of_speed = [each for each in page.complaints if isinstance(each, dict) and each.get("source") == "rendering"]
    assert [each for each in page.complaints if each not in of_speed] == []  # WebGL in software warns that it is slow
