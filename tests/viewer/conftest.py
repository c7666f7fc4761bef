"""Viewers and an app in a framebuffer, without a window."""

import pytest
from viewers import hills, settle, swift

from terrain_gl.camera import Camera
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.viewer.app import App
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.settings import Settings
from terrain_gl.viewer.viewer import Viewer


@pytest.fixture
def target(ctx):
    """Make framebuffers by their size; all are released after the test."""
    made = []

    def make(size):
        made.append(ctx.framebuffer([ctx.texture(size, 4)]))
        return made[-1]

    yield make
    ctx.detect_framebuffer(0).use()  # moderngl must not use a framebuffer that is released
    for each in made:
        each.release()


@pytest.fixture
def empty(ctx, target):
    """A viewer that has no map yet."""
    size = (320, 200)
    viewer = Viewer(ctx, target(size), size, Settings(), budget=swift())
    yield viewer
    viewer.close()


@pytest.fixture
def viewer(empty):
    """A viewer with a map of hills."""
    heightmap = hills()
    empty.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), Opened(heightmap, Camera.default(heightmap)))
    return empty


@pytest.fixture
def make_app(ctx, target):
    """Make apps in a picture as large as a window: with a map of hills, at rest, or without a map."""
    made = []

    def make(size=(900, 640), scale=1.0, with_map=True):
        plain = Settings([FrameOptions(style="lambert")])  # light is slow, and other tests look at it
        made.append(App(ctx, target(size), size, plain, scale=scale, budget=swift()))
        if with_map:
            heightmap = hills()
            opened = Opened(heightmap, Camera.default(heightmap), key="hills")
            made[-1].viewer.show(Renderer(heightmap, (320, 200), ctx=ctx), opened)
            settle(made[-1])
        return made[-1]

    yield make
    errors = [error for app in made for error in app.errors if error not in getattr(app, "expected", [])]
    for app in made:
        app.close()
    assert not errors, errors[0]


@pytest.fixture
def app(make_app):
    """An app with a map of hills, at rest."""
    return make_app()
