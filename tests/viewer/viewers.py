"""Helpers for tests of the viewer: a map, budgets, and frames until nothing happens any more."""

import math
import time
from unittest import mock

import numpy as np

from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.frame_budget import FrameBudget


def hills(posts=129, spacing_m=10.0):
    """A small map."""
    t = np.linspace(0, 3 * math.pi, posts)
    return Heightmap(60 * np.sin(t)[:, None] * np.cos(0.7 * t)[None, :] + 100, spacing_m, "hills")


class Ticking:
    """A clock by which every piece of work takes a second."""

    def __init__(self):
        self.now_s = 0.0

    def __call__(self):
        self.now_s += 1.0
        return self.now_s


def swift():
    """The budget of a machine that does everything at once."""
    return FrameBudget(Ticking(), work_s=math.inf, motion_ms=math.inf)


def slow():
    """The budget of a machine that does one step of work a frame, and draws motion at a quarter of the size."""
    return FrameBudget(Ticking(), motion_ms=-1.0)


def set_budget(viewer, budget):
    """Go on with another budget."""
    for name, value in vars(budget).items():
        setattr(viewer.budget, name, value)


def viewer_of(either):
    """The viewer of an app, or the viewer itself."""
    return getattr(either, "viewer", either)


def wait_for_threads(viewer):
    """Wait until everything is read and written."""
    if viewer.loader.job:
        viewer.loader.job.join()
    for thread in (viewer.sculpting, viewer.images, viewer.saver):
        thread.join()


def later(either, seconds=1.0):
    """Do the frame of an app or a viewer after some seconds; returns whether it shows anything new."""
    viewer = viewer_of(either)
    now_s = viewer.window.now_s + seconds
    if either is not viewer:
        return either.frame(now_s)
    stale = viewer.step(now_s)
    if stale:
        viewer.draw()
    return stale


def settle(either):
    """Do frames until nothing happens any more, and the last picture has been measured."""
    viewer = viewer_of(either)
    viewer.window.refresh()
    for _ in range(20_000):
        wait_for_threads(viewer)
        if viewer.scene.has_map and viewer.tiles.are_coming:
            time.sleep(0.005)  # threads read them
        waits = viewer.painter.waits_for_rest or viewer.mouse.waits
        if not (later(either) or either.busy or waits) and viewer.settled:
            return
    raise AssertionError("the viewer does not come to rest")


def seen(either):
    """(height, width, 3): what the window would show."""
    viewer = viewer_of(either)
    width, height = viewer.window.size
    pixels = viewer.target.read((0, 0, width, height))
    return np.frombuffer(pixels, np.uint8).reshape(height, width, 3)[::-1].astype(int)


def drawn_at_once(viewer):
    """What the renderer draws for the viewer, without steps."""
    viewer.scene.renderer.draw(viewer.scene.controller.camera, **vars(viewer.settings.options))
    viewer.painter.canvas.take(viewer.scene.renderer, viewer.window.size)
    viewer.painter.canvas.show(viewer.target)
    return seen(viewer)


def light_is_up_to_date(viewer):
    """Whether all strokes are in the light: then `settle` computes nothing."""
    editor = viewer.scene.renderer.editor
    with mock.patch.object(editor.resources.picture, "settle") as computed:
        editor.settle()
    return not computed.called


def changed(picture, before):
    """Share of pixels that differ visibly."""
    return (np.abs(picture - before).max(-1) > 4).mean()


def stroke(viewer, start, end):
    """Draw the brush from one pixel to another."""
    viewer.mouse.press("left", *start)
    later(viewer)
    for share in (0.5, 1.0):
        viewer.mouse.move(*(a + share * (b - a) for a, b in zip(start, end, strict=True)))
        later(viewer)
    viewer.mouse.release("left", *end)
    settle(viewer)


def with_a_stroke(viewer):
    """Take the brush and do one stroke; returns the heights before and after."""
    settle(viewer)
    before = viewer.scene.renderer.heightmap.heights.copy()
    press(viewer, "b")
    settle(viewer)
    stroke(viewer, (100, 150), (130, 150))
    settle(viewer)
    return before, viewer.scene.renderer.heightmap.heights.copy()


def load(path):
    """(height, width, 3): the picture in a file."""
    return read_image(path)[..., :3].astype(int)


class Listening:
    """Dear ImGui's module, but texts and windows are noted: title, left, top, right, bottom."""

    def __init__(self, imgui):
        self._imgui, self.texts, self.windows, self._open = imgui, [], [], []

    def __getattr__(self, name):
        function = getattr(self._imgui, name)
        if name not in ("text", "text_disabled", "text_colored"):
            return function

        def noting(*arguments):
            self.texts.extend(each for each in arguments if isinstance(each, str))
            return function(*arguments)

        return noting

    def begin(self, title, *arguments):
        self.texts.append(title)
        self._open.append(title)
        return self._imgui.begin(title, *arguments)

    def end(self):
        (x, y), (width, height) = self._imgui.get_window_pos(), self._imgui.get_window_size()
        self.windows.append((self._open.pop(), x, y, x + width, y + height))
        self._imgui.end()


def listen(app):
    """Do a frame, and return what the panels have asked of Dear ImGui."""
    widgets = app.gui.widgets
    imgui, widgets.imgui = widgets.imgui, Listening(widgets.imgui)
    app.viewer.window.refresh()
    later(app, 0.0)
    heard, widgets.imgui = widgets.imgui, imgui
    return heard


def texts(app):
    """All texts and titles of windows that the panels show in the next frame, one a line."""
    return "\n".join(listen(app).texts)
