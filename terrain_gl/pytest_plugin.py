"""The fixture `terrain_picture` for tests of your own maps: docs/testing.md.

pytest loads this module in every project that has terrain-gl installed. So it imports nothing else until a test uses
the fixture.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    import moderngl

    from .comparison.golden import GoldenPictures


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the two options."""
    group = parser.getgroup("terrain-gl")
    group.addoption("--regenerate-terrain", action="store_true", help="write golden pictures instead of comparing")
    group.addoption(
        "--terrain-failures",
        metavar="FOLDER",
        default="terrain-failures",
        help="folder for pictures that differ (default: terrain-failures)",
    )


@pytest.fixture(scope="session")
def _terrain_ctx() -> Iterator[moderngl.Context]:
    """The OpenGL context of all tests; on Mesa's software renderer if the system has it."""
    from .gpu.context import create_context

    os.environ.setdefault("LIBGL_ALWAYS_SOFTWARE", "1")  # Mesa reads it when the context is made
    ctx = create_context()
    yield ctx
    ctx.release()


@pytest.fixture
def terrain_picture(request: pytest.FixtureRequest, _terrain_ctx: moderngl.Context) -> GoldenPictures:
    """Draw a map, and compare the picture with a golden one beside the test: `terrain_picture("hill.tif")`."""
    from .comparison.golden import GoldenPictures
    from .gpu import gl

    if not gl.is_software(_terrain_ctx):
        driver = _terrain_ctx.info["GL_RENDERER"]
        pytest.skip(f"golden pictures are of software OpenGL, this is {driver}: docs/testing.md")
    config = request.config
    failures = Path(config.getoption("--terrain-failures"))
    return GoldenPictures(
        _terrain_ctx,
        request.path.parent,
        f"{request.path.stem}-{request.node.name}",
        config.invocation_params.dir / failures,
        config.getoption("--regenerate-terrain"),
    )
