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
MOST_LAND = 90  # green of a pixel of the background, or of one that it shows through by half, is less


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
    return int((read_image(path)[400:800, 300:980, 1] < MOST_LAND).sum())


@pytest.mark.slow
@pytest.mark.parametrize("skirts", [True, False])
def test_no_crack_is_seen_between_levels(served, flat_tiles, monkeypatch, tmp_path, skirts):
    """Against magenta, at two zooms; without skirts, the same tiles show cracks."""
    if browser.CHROMIUM is None:
        pytest.skip("Chromium is not there: apt-get install chromium")
    monkeypatch.setattr(tiling, "SIDE", 16)
    if not skirts:
        monkeypatch.setattr(tiling.Tiling, "_between_tiles", lambda self, key, posts, edges, last: edges[:0])
    assert flat_tiles("t")[0] == 0
    address = served("t")
    page = browser.Page(tmp_path / "chromium", "--enable-unsafe-swiftshader", sees_this_machine=True)
    try:
        page.open(address)
        page.value("document.body.style.background = '#f0f'; document.getElementById('error').value = '2'")
        seen = []
        for nearer in (3, 2):  # turns of the wheel
            for _ in range(nearer):
                page.ask("Input.dispatchMouseEvent", type="mouseWheel", x=640, y=700, deltaX=0, deltaY=-240)
            page.value(
                "new Promise((done) => { const look = () => document.body.dataset.state === 'drawn' ? done()"
                " : setTimeout(look, 50); setTimeout(look, 1500); })"
            )
            page.picture(tmp_path / f"{nearer}.png")
            seen.append((background(tmp_path / f"{nearer}.png"), page.value("drawn.textContent")))
        assert seen[0][1] != seen[1][1], "the zooms have the same tiles"
        assert [cracks for cracks, _ in seen] == [0, 0] if skirts else max(cracks for cracks, _ in seen) > 0, seen
        assert not [each for each in page.complaints if "Failed" in str(each)]
        assert all(url.startswith((address, "blob:")) for url in page.requests)
    finally:
        page.close()
