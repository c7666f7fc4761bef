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

_OWNERS = pytest.StashKey[dict[str, str]]()  # the tests that golden pictures of the session belong to


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the two options."""
    group = parser.getgroup("terrain-gl")
    group.addoption("--regenerate-terrain", action="store_true", help="write golden pictures instead of comparing")
    group.addoption(
        "--terrain-failures",
        metavar="FOLDER",
        default="terrain-failures",
        help="folder for the pictures of tests that fail (default: terrain-failures)",
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
    folder = request.path.parent
    failures = config.invocation_params.dir / config.getoption("--terrain-failures")
    return GoldenPictures(
        _terrain_ctx,
        folder,
        f"{request.path.stem}-{'.'.join(_names_in_file(request.node))}",
        failures / _inside(config.rootpath, folder),
        config.getoption("--regenerate-terrain"),
        config.stash.setdefault(_OWNERS, {}),
    )


def _names_in_file(node: pytest.Item) -> Iterator[str]:
    """The names of the classes around a test, and of the test with its parameters."""
    for part in node.listchain():
        if isinstance(part, pytest.Class) or part is node:
            yield part.name


def _inside(root: Path, folder: Path) -> Path:
    """A folder relative to pytest's root; for a folder outside the root, its path without the drive."""
    return folder.relative_to(root) if folder.is_relative_to(root) else folder.relative_to(folder.anchor)
