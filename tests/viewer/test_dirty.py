"""State of OpenGL that another part of the program leaves on between two frames of the window changes no picture."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from screen import Screen
from viewers import hills

_DIRTY = """
import sys
import numpy as np
sys.path.insert(0, sys.argv[1])
from test_guest import DIRT, Dirt
from terrain_gl.gpu.state import state_of
from terrain_gl.heightmap import Heightmap
from terrain_gl.viewer import window

class Dirty(window.Window):
    shown, expected, found, clean, dirt = b"", b"", "no error", None, None
    names = ["", *DIRT]

    def _frame(self):
        app = self._app
        if app.frame(self._glfw.get_time()):
            self.found = self.found if self.ctx.error == "GL_NO_ERROR" else "an error"
            saved, found = state_of(self.ctx), state_of(self.ctx).found()
            saved.make_plain()  # for this test's own reading
            self.shown = app.viewer.target.read((0, 0, *app.viewer.window.size))
            saved.give_back(found)
            self.ctx.error  # moderngl asks to read an attachment, which a window has not
            self._glfw.swap_buffers(self._handle)

    def _turn(self):
        self._frame()
        self._glfw.poll_events()
        viewer = self._app.viewer
        if self._app.busy or not viewer.settled or viewer.window.message:
            return
        if viewer.settings.options.style == "lambert":  # what must not come back
            self.clean = self.clean or state_of(self.ctx).found()
            self.dirt = self.dirt or Dirt(self.ctx)
            if self.names[0]:
                DIRT[self.names[0]](self.dirt)
            viewer.settings.change_all(style="normals")
            return
        self.expected = self.expected or self.shown
        name = self.names.pop(0)
        colours = len(set(self.shown[i : i + 3] for i in range(0, len(self.shown), 3)))
        print(name or "clean", self.shown == self.expected, colours > 99, self.found, flush=True)
        state_of(self.ctx).give_back(self.clean)
        for setting in (("wireframe", False), ("front_face", "ccw"), ("cull_face", "back")):
            setattr(self.ctx, *setting)
        self.ctx.polygon_offset = 0.0, 0.0
        viewer.settings.change_all(style="lambert")
        if not self.names:
            self._glfw.set_window_should_close(self._handle, True)

window.Window = Dirty
heights = Heightmap(np.load("hills.npy"), 10.0, "hills")
window.run(heights, size=(320, 240), style="lambert", fresh=True, panel=False)
"""


@pytest.mark.slow
@pytest.mark.skipif(not shutil.which("Xvfb"), reason="no Xvfb here; apt install xvfb")
def test_the_window_draws_the_same_whatever_state_it_finds(tmp_path):
    np.save(tmp_path / "hills.npy", hills().heights)
    screen = Screen(tmp_path)
    try:
        with screen.running("-c", _DIRTY, Path(__file__).parents[1], cwd=tmp_path) as process:
            told, errors = process.communicate(timeout=200)
    finally:
        screen.server.terminate()
        screen.server.wait()
    lines = told.splitlines()
    assert len(lines) > 40 and not process.returncode, errors
    assert [line for line in lines if not line.endswith("True True no error")] == []
