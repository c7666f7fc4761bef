"""The view in a notebook: events of the browser move it, frames come when something changes, and a still picture."""

import asyncio
import base64
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

import terrain_gl as tg
from terrain_gl.files.views import standard_sun
from terrain_gl.image import png_bytes, read_image
from terrain_gl.shade.picture import STYLES

rfb = pytest.importorskip("jupyter_rfb", reason="the extra [notebook] is not installed")

from terrain_gl.viewer import notebook  # noqa: E402
from terrain_gl.viewer.notebook import View  # noqa: E402

CAMERA = tg.Camera((640, -200, 400), (640, 640, 100))


pytestmark = pytest.mark.usefixtures("folder")


@pytest.fixture
def view(folder):
    t = np.linspace(0, 9, 97)
    hills = tg.Heightmap(60 * np.sin(t)[:, None] * np.cos(0.7 * t)[None, :] + 100, 13.0, "hills")
    view = View(hills, CAMERA, size=(160, 90))
    yield view
    view.close()


class Browser:
    """A stand-in for the browser: takes frames, confirms them, and sends events."""

    def __init__(self, view):
        self.view, self.sent = view, []
        view.send = lambda content, buffers=None: self.sent.append(content)
        self.event("resize", width=160, height=90, ratio=1.0)
        view._has_visible_views = True

    def event(self, kind, **event):
        event = {"modifiers": [], "x": 80, "y": 45, "timestamp": 0.0} | event
        self.view._rfb_handle_msg(self.view, {"type": kind} | event, [])
        assert self.view._output_context.outputs == (), self.view._output_context.outputs

    async def watch(self, seconds):
        """Receive frames for so many seconds as a browser does; returns their number."""
        before = self.view._rfb_frame_index
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            now = time.time()
            if self.view._rfb_frame_index:
                self.view._frame_feedback = {"index": self.view._rfb_frame_index, "timestamp": now, "localtime": now}
            await asyncio.sleep(0.01)
        assert self.view._output_context.outputs == (), self.view._output_context.outputs
        return self.view._rfb_frame_index - before

    async def rest(self):
        """Look on until nothing changes."""
        deadline = time.monotonic() + 120
        while time.monotonic() < deadline:
            await self.watch(0.5)
            if not self.view.app.busy and self.view.viewer.settled:
                return
        raise AssertionError("the view does not come to rest")

    async def see(self, frames):
        """Look on until so many frames have come, however slow they are."""
        deadline = time.monotonic() + 120
        while frames > 0:
            assert time.monotonic() < deadline
            frames -= await self.watch(0.1)

    @property
    def seen(self):
        return self.view._rfb_last_frame


@pytest.mark.slow
def test_keys_fly(view):
    async def fly():
        browser = Browser(view)
        await browser.rest()
        first = browser.seen.copy()
        assert first.shape == (90, 160, 3) and first.std() > 5
        browser.event("key_down", key="Shift")
        browser.event("key_down", key="w", modifiers=["Shift"])
        while np.subtract(view.camera.eye, CAMERA.eye) @ CAMERA.forward < 100:  # far enough to be seen
            await browser.see(1)
        browser.event("key_up", key="w")
        browser.event("key_up", key="Shift")
        await browser.rest()
        assert np.abs(browser.seen.astype(int) - first).mean() > 1
        assert "image/jpeg" in str(browser.sent) and view.stats["triangles"] > 0

    asyncio.run(fly())


def test_nothing_is_sent_at_rest(view):
    async def wait():
        browser = Browser(view)
        await browser.rest()
        view.viewer.window.message = ""
        view.viewer.window.refresh()
        await browser.rest()
        await browser.watch(0.5)  # a frame in full quality follows the last one
        assert view.app.wait_s <= 1.0 and await browser.watch(1.2) == 0

    asyncio.run(wait())


def test_mouse(view):
    browser = Browser(view)
    browser.event("pointer_down", button=2)
    browser.event("pointer_move", x=100, y=45)
    browser.event("pointer_up", button=2)
    assert view.viewer.scene.controller.azimuth_deg == pytest.approx(2.0) and view.camera.eye == CAMERA.eye
    browser.event("pointer_move", x=0, y=0)
    assert view.viewer.scene.controller.azimuth_deg == pytest.approx(2.0)
    before = view.viewer.scene.controller.speed_m_s
    browser.event("wheel", dx=0, dy=-200, modifiers=["Shift"])
    assert view.viewer.scene.controller.speed_m_s == pytest.approx(before * 1.25**2)
    browser.event("wheel", dx=0, dy=-100, modifiers=["Control"])
    assert view.camera.fov_deg == pytest.approx(45.0) and view.camera.eye == CAMERA.eye
    browser.event("wheel", dx=0, dy=-100, x=80, y=60)
    assert view.camera.eye[2] < CAMERA.eye[2]


@pytest.mark.parametrize("ratio", [1.0, 2.0])
def test_what_is_grabbed_stays_under_the_cursor(view, ratio):
    browser = Browser(view)
    browser.event("resize", width=160, height=90, ratio=ratio)
    assert view.viewer.window.size == (160 * ratio, 90 * ratio)
    browser.event("pointer_down", button=1, x=100, y=70)
    pivot = view.viewer.scene.controller.pivot
    browser.event("pointer_move", x=120, y=60)
    browser.event("pointer_up", button=1)
    right, up, forward = view.camera.axes @ (pivot - view.camera.eye)
    focal = view.camera.focal_px(90)
    assert (80 + focal * right / forward, 45 - focal * up / forward) == pytest.approx((100, 70), abs=1e-6)
    assert view.camera.eye != CAMERA.eye


def test_keys_are_those_of_the_window(view):
    browser = Browser(view)
    browser.event("key_down", key="Tab")
    assert view.viewer.settings.options.style == STYLES[1]
    browser.event("key_down", key="+", modifiers=["Shift"])
    assert view.viewer.settings.options.max_error_px == pytest.approx(2**0.5)
    browser.event("key_down", key="!", modifiers=["Shift"])
    assert 1 in view.viewer.scene.bookmarks
    browser.event("key_down", key="ArrowLeft")
    view.viewer.scene.controller.step(0.1)
    assert view.viewer.scene.controller.azimuth_deg > 180
    browser.event("hide")
    assert not view.viewer.scene.controller.moving
    browser.event("key_down", key="Escape")
    assert not view.viewer.window.closing
    for key in ("Dead", "€", "F5", "Unidentified", "AltGraph"):
        browser.event("key_down", key=key)
        browser.event("key_up", key=key)
    browser.event("something new")


def test_size_zero_and_back(view):
    async def fold():
        browser = Browser(view)
        await browser.rest()
        browser.event("resize", width=0, height=0, ratio=1.0)
        assert await browser.watch(0.5) == 0
        browser.event("resize", width=100.4, height=50.2, ratio=1.5)
        await browser.rest()
        assert browser.seen.shape == (75, 151, 3)

    asyncio.run(fold())


def test_drawn_otherwise(view):
    shaded = view.picture()
    view.draw(style="normals", max_error_px=3.0)
    assert np.abs(view.picture().astype(int) - shaded).mean() > 5
    assert view.stats["requested_max_error_px"] == 3.0
    with pytest.raises(tg.UsageError, match="style"):
        view.draw(style="cubist")


def test_a_higher_relief_keeps_the_camera_over_the_land(view):
    heightmap = view.viewer.scene.renderer.heightmap
    view.draw(exaggeration=3.0)
    assert view.camera.eye == pytest.approx(CAMERA.eye)  # at true heights, as `Renderer` takes it
    with tg.Renderer(heightmap, (160, 90)) as renderer:
        frame = renderer.render(view.camera, sun=standard_sun(heightmap), exaggeration=3.0)
    differs = np.abs(view.picture().astype(int) - frame.image[..., :3]).max(-1) > 1
    assert differs.mean() < 0.002


def test_the_picture_is_the_renderers(view):
    heightmap = view.viewer.scene.renderer.heightmap
    with tg.Renderer(heightmap, (160, 90)) as renderer:
        frame = renderer.render(CAMERA, sun=standard_sun(heightmap))
    differs = np.abs(view.picture().astype(int) - frame.image[..., :3]).max(-1) > 1
    assert differs.mean() < 0.002


def test_two_views_and_a_renderer_side_by_side(view):
    other = View("canyon-15m", size=(100, 60), style="normals")
    first, second = view.picture(), other.picture()
    with tg.Renderer(view.viewer.scene.renderer.heightmap, (32, 32)) as renderer:
        renderer.render(CAMERA)
        assert np.array_equal(view.picture(), first) and np.array_equal(other.picture(), second)
    other.close()
    other.close()
    assert np.array_equal(view.picture(), first)
    assert other.get_frame() is None


@pytest.mark.slow
def test_panels():
    pytest.importorskip("imgui_bundle", reason="the extra [gui] is not installed")
    view = View("canyon-15m", size=(640, 360), panels=True, style="normals")
    browser = Browser(view)
    browser.event("resize", width=640, height=360, ratio=1.0)
    with_panels = view.picture().astype(int)
    azimuth, label = view.viewer.scene.controller.azimuth_deg, "tolerance"
    x0, y0, x1, y1 = view.app.gui.widgets.places[label]
    browser.event("pointer_move", x=(x0 + x1) / 2, y=(y0 + y1) / 2)
    view.picture()
    browser.event("pointer_down", button=1, x=(x0 + x1) / 2, y=(y0 + y1) / 2)
    view.picture()
    browser.event("pointer_move", x=x1 - 5, y=(y0 + y1) / 2)
    view.picture()
    browser.event("pointer_up", button=1, x=x1 - 5, y=(y0 + y1) / 2)
    view.picture()
    assert view.viewer.settings.options.max_error_px > 1 and view.viewer.scene.controller.azimuth_deg == azimuth
    assert np.abs(with_panels - view.picture()).max() > 50
    view.close()


def test_a_still_picture_is_an_output_of_its_own_until_a_browser_is_live(view, monkeypatch):
    shown = []

    class Handle:
        def update(self, data, raw):
            shown.append(data)

    monkeypatch.setattr(notebook, "display", lambda data, raw, display_id: shown.append(data) or Handle())
    data = view._repr_mimebundle_()
    data = data[0] if isinstance(data, tuple) else data
    assert "application/vnd.jupyter.widget-view+json" in data and "image/png" not in data
    Path("still.png").write_bytes(base64.b64decode(shown[0]["image/png"]))
    assert np.array_equal(read_image("still.png"), view.picture())
    browser = Browser(view)
    browser.event("resize", width=160, height=90, ratio=1.0)
    assert len(shown) == 2 and shown[1]["text/html"].startswith("<details>")
    assert shown[0]["image/png"] in shown[1]["text/html"]
    view._repr_mimebundle_()
    assert len(shown) == 2, "a live widget needs no still picture"


def test_frames_show_themselves():
    with tg.Renderer(tg.Heightmap([[0, 1], [2, 3]]), (20, 10)) as renderer:
        assert renderer._repr_png_() is None
        frame = renderer.render(tg.Camera((0.5, -2, 3), (0.5, 0.5, 1)))
        assert frame._repr_png_() == renderer._repr_png_() == png_bytes(frame.image)
    Path("frame.png").write_bytes(frame._repr_png_())
    assert np.array_equal(read_image("frame.png"), frame.image)


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        ({"source": "nowhere"}, tg.TerrainError),
        ({"size": (0, 5)}, tg.UsageError),
        ({"style": "cubist"}, tg.UsageError),
        ({"backend": "none"}, tg.UsageError),
    ],
)
def test_bad_arguments(arguments, error):
    with pytest.raises(error):
        View(**{"source": "canyon-15m"} | arguments)


def test_without_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "jupyter_rfb", None)
    monkeypatch.delitem(sys.modules, "terrain_gl.viewer.notebook")
    with pytest.raises(ImportError, match=r"pip install 'terrain-gl\[notebook\]'"):
        import terrain_gl.viewer.notebook  # noqa: F401


# the same land of an eighth of the posts a side: its tables and its light are soon made
_FEWER_POSTS = """
from terrain_gl.files import maps
from terrain_gl.heightmap import Heightmap
opened = maps.open_map
def with_fewer_posts(name):
    whole, known = opened(name)
    return Heightmap(whole.heights[::8, ::8], tuple(8 * side for side in whole.spacing_m), name), known
maps.open_map = with_fewer_posts
"""


@pytest.mark.slow
def test_the_example_runs_without_a_front_end(monkeypatch):
    """As CI runs it: every cell, without a display, and with a still picture instead of the widget."""
    nbformat = pytest.importorskip("nbformat", reason="the extra [test] is not installed")
    nbclient = pytest.importorskip("nbclient", reason="the extra [test] is not installed")
    pytest.importorskip("ipykernel", reason="the extra [test] is not installed")
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    example = Path(__file__).parent.parent / "examples" / "notebook.ipynb"
    notebook = nbformat.read(example, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)
    notebook.cells.insert(0, nbformat.v4.new_code_cell(_FEWER_POSTS))
    nbclient.NotebookClient(notebook, timeout=300, resources={"metadata": {"path": os.getcwd()}}).execute()
    outputs = [output for cell in notebook.cells for output in cell.get("outputs", ())]
    pictures = [output.data["image/png"] for output in outputs if "image/png" in output.get("data", {})]
    assert len(pictures) == 3
    for i, picture in enumerate(pictures):
        Path(f"{i}.png").write_bytes(base64.b64decode(picture))
        pixels = read_image(f"{i}.png")
        assert pixels.shape[:2] == (360, 640) and pixels[..., :3].std() > 10
    told = "".join(output.text for output in outputs if output.output_type == "stream")
    assert told.count("asked") == 3 and "Traceback" not in told
    assert _pictures_of_page(notebook) == [each.replace("\n", "") for each in pictures], (
        "a page that nbconvert makes has the same pictures"
    )


def _pictures_of_page(notebook):
    """The pictures in a notebook's page, as `jupyter nbconvert --to html` makes it."""
    nbconvert = pytest.importorskip("nbconvert", reason="nbconvert is not installed")
    try:
        html, _ = nbconvert.HTMLExporter().from_notebook_node(notebook)
    except ValueError as error:
        pytest.skip(f"nbconvert does not find its templates: {error}")
    return re.findall(r'<img[^>]* src="data:image/png;base64,([^"]*)"', html.replace("\n", ""))


DROPPED = """
import gc, os, weakref
import numpy as np
import terrain_gl as tg
from terrain_gl.gpu.current import current
from terrain_gl.viewer.notebook import View

def resident():
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") >> 20

land, before, contexts, sizes = tg.Heightmap(np.outer(*[np.hanning(129)] * 2) * 50, 10.0), current(), [], []
for i in range(30):
    view = View(land, size=(320, 240), style="normals")
    view.picture()
    contexts.append(weakref.ref(view.ctx))
    del view
    gc.collect()
    assert current() == before
    sizes.append(resident())
shown = View(land, size=(32, 24), style="normals")
shown._repr_mimebundle_()
contexts.append(weakref.ref(shown.ctx))
del shown
gc.collect()
print(sum(each() is not None for each in contexts), sizes[9], sizes[29])
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_a_dropped_view_gives_its_memory_back_unless_it_was_shown(folder):
    done = subprocess.run([sys.executable, "-c", DROPPED], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0 and "Exception" not in done.stderr, done.stderr
    contexts, early, late = map(int, done.stdout.split()[-3:])
    assert contexts == 1  # that of the view that was shown
    assert late - early < 60, "MiB of 20 views"


CELL = """
import weakref
import numpy as np
import terrain_gl as tg
from terrain_gl.viewer.notebook import View
try: views
except NameError: views = []
view = View(tg.Heightmap(np.outer(*[np.hanning(33)] * 2) * 50, 10.0), size=(32, 24), style="normals")
views.append(weakref.ref(view))
view
"""
ALIVE = "print([each() is not None for each in views])"


@pytest.fixture
def kernel(folder):
    """A function that runs a cell of a notebook, named as Jupyter names it, and returns what it prints."""
    manager = pytest.importorskip("jupyter_client", reason="the extra [notebook] is not installed")
    _, client = manager.manager.start_new_kernel(kernel_name="python3")

    def ran(code, cell):
        content = {"code": code, "silent": False, "store_history": True, "user_expressions": {}, "allow_stdin": False}
        message = client.session.msg("execute_request", content, metadata={"cellId": cell} if cell else {})
        client.shell_channel.send(message)
        printed = ""
        while True:
            reply = client.get_iopub_msg(timeout=120)
            if reply["parent_header"].get("msg_id") != message["header"]["msg_id"]:
                continue
            if reply["msg_type"] == "stream" and reply["content"]["name"] == "stdout":
                printed += reply["content"]["text"]
            assert reply["msg_type"] != "error", reply["content"]
            if reply["msg_type"] == "status" and reply["content"]["execution_state"] == "idle":
                return printed.strip()

    yield ran
    client.shutdown()


@pytest.mark.slow
@pytest.mark.parametrize("cell", ["a", ""])
def test_a_cell_that_runs_again_gives_back_the_memory_of_its_views(kernel, cell):
    """The views of earlier runs go; without the name of the cell, nobody knows what the page shows, and all stay."""
    for _ in range(4):
        kernel(CELL, cell)
    assert kernel(ALIVE, "b") == str([not cell] * 3 + [True])
    kernel("other = view; other", "c")  # shown in two cells
    kernel(CELL, cell)
    assert kernel(ALIVE, "b") == str([not cell] * 3 + [True, True])
    kernel("other = None; 1", "c")
    assert kernel(ALIVE, "b") == str([not cell] * 3 + [True, True]), "the page may still show it"
