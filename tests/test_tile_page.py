"""`tiles --serve`: a viewer that is not ours shows the tiles, without cracks between levels."""

import signal
import socket
import subprocess
import sys
import urllib.error
import urllib.request
from pathlib import Path

import browser
import numpy as np
import pytest
from commands import refused
from maps import rough

from terrain_gl.files import tiling
from terrain_gl.image import read_image

pytest.importorskip("pydelatin")
MOST_LAND = 8  # blue minus green of land is less, of the background 255: so it is seen where it shows through by a 20th


def free_port():
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        return found.getsockname()[1]


def listening():
    """Jobs in the background of a shell would ignore Ctrl-C."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@pytest.fixture
def served():
    """Call with a folder of tiles: the address of its page."""
    running = []

    def serve(folder):
        words = [sys.executable, "-m", "terrain_gl", "tiles", "none.tif", "-o", folder, "--serve", str(free_port())]
        running.append(subprocess.Popen(words, stderr=subprocess.PIPE, text=True, preexec_fn=listening))
        told = running[-1].stderr.readline()
        assert "shows the tiles; Ctrl-C ends" in told
        return told.split()[2]

    yield serve
    for process in running:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(15)
        except subprocess.TimeoutExpired:  # Python loses an interrupt that arrives while it collects garbage
            process.send_signal(signal.SIGINT)
        assert process.wait(15) == 0
        process.stderr.close()


@pytest.fixture
def flat_tiles(run, folder):
    """Local tiles of a small map."""
    np.save("hills.npy", 300 + rough(257, 257, 4, 400.0))
    return lambda name: run("tiles", "hills.npy", "-o", name, "--spacing", 10, "--max-error-m", 0.4)


def test_the_page_and_its_files(served, flat_tiles, monkeypatch):
    monkeypatch.setattr(tiling, "SIDE", 32)
    assert flat_tiles("t")[0] == 0
    address = served("t")
    with urllib.request.urlopen(address) as answer:
        page = answer.read().decode()
    assert "<title>t</title>" in page and "3d-tiles-renderer" in page and "Apache License" in page
    for name in ("tileset.json", "2-0-0.glb"):
        with urllib.request.urlopen(address + name) as answer:
            assert answer.read() == (Path("t") / name).read_bytes()
            assert answer.headers["Cache-Control"] == "no-store"  # another folder at this port has the same names
    with pytest.raises(urllib.error.HTTPError):
        urllib.request.urlopen(address + "../hills.npy")


def test_a_taken_port_gets_one_line(flat_tiles, run, monkeypatch):
    monkeypatch.setattr(tiling, "SIDE", 64)
    flat_tiles("t")
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        refused(run("tiles", "none.tif", "-o", "t", "--serve", taken.getsockname()[1]), 1, "--serve PORT")
    refused(run("tiles", "none.tif", "-o", "t", "--serve", 99999), 1, "--serve PORT")


def background(path):
    """Pixels of the background in the middle of the picture, where there is land all around."""
    middle = read_image(path)[400:800, 300:980].astype(int)
    return int((middle[..., 2] - middle[..., 1] > MOST_LAND).sum())


@pytest.fixture
def page(tmp_path):
    """A page of tiles in Chromium, in front of magenta: call with its address."""
    if browser.CHROMIUM is None:
        pytest.skip("Chromium is not there: apt-get install chromium")
    opened = browser.Page(tmp_path / "chromium", "--enable-unsafe-swiftshader", sees_this_machine=True)

    def open_page(address):
        opened.open(address)
        opened.value("document.body.style.background = '#f0f'; document.getElementById('error').value = '2'")
        settle(opened)
        return opened

    yield open_page
    opened.close()


def turn_wheel(page, times, row=700):
    """Go nearer to what the picture shows in a row of pixels."""
    for _ in range(times):
        page.ask("Input.dispatchMouseEvent", type="mouseWheel", x=640, y=row, deltaX=0, deltaY=-240)


def settle(page):
    """Wait until the page has drawn what was done so far, with all tiles."""
    page.value(
        "new Promise((done) => { const look = () => document.body.dataset.state === 'drawn' ? done()"
        " : setTimeout(look, 50); requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(look, 1500))); })"
    )


def seen(page, path):
    """Pixels of the background, and what the page tells of its tiles."""
    settle(page)
    page.picture(path)
    return background(path), page.value("drawn.textContent")


@pytest.mark.slow
@pytest.mark.parametrize("skirts", [True, False])
def test_no_crack_is_seen_between_levels(served, flat_tiles, page, monkeypatch, tmp_path, skirts):
    """Against magenta, at two zooms; without skirts, the same tiles show cracks."""
    monkeypatch.setattr(tiling, "SIDE", 16)
    if not skirts:
        monkeypatch.setattr(tiling.Tiling, "_between_tiles", lambda self, key, posts, edges, last: edges[:0])
    assert flat_tiles("t")[0] == 0
    address = served("t")
    shown, views = page(address), []
    for nearer in (3, 2):
        turn_wheel(shown, nearer)
        views.append(seen(shown, tmp_path / f"{nearer}.png"))
    assert views[0][1] != views[1][1], "the zooms have the same tiles"
    assert [cracks for cracks, _ in views] == [0, 0] if skirts else max(cracks for cracks, _ in views) > 0, views
    assert not [each for each in shown.complaints if "Failed" in str(each)]
    assert all(url.startswith((address, "blob:")) for url in shown.requests)


@pytest.mark.slow
def test_no_background_is_seen_through_a_real_map(served, run, folder, page, tmp_path):
    """Views of `alpine`, of several sets of tiles and from two sides."""
    assert run("tiles", "alpine", "-o", "t")[0] == 0
    shown, views = page(served("t")), []
    for i, nearer in enumerate((3, 3, 4, 5)):
        turn_wheel(shown, nearer)
        if i == 2:
            shown.drag((640, 600), (840, 620))
        views.append(seen(shown, tmp_path / f"{i}.png"))
    assert [pixels for pixels, _ in views] == [0] * len(views), views
    assert len({told for _, told in views}) > 2, views


@pytest.mark.slow
def test_the_eye_stays_above_the_land(served, flat_tiles, page, tmp_path):
    """Turning is drawn at once. Whoever goes down to the horizon, and nearer, sees the land, not its back."""
    assert flat_tiles("t")[0] == 0
    shown = page(served("t"))
    shown.drag((640, 800), (640, 500), (640, 200))
    assert seen(shown, tmp_path / "low.png")[0] > 1000, "the horizon is not in the picture"
    turn_wheel(shown, 40, 506)
    seen(shown, tmp_path / "near.png")
    ground = read_image(tmp_path / "near.png")[700:, :, :3].astype(int)
    assert (ground[..., 2] - ground[..., 1]).max() <= MOST_LAND
