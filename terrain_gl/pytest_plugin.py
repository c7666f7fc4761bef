"""The fixture `terrain_picture` for tests of your own maps: docs/testing.md.

pytest loads this module in every project that has terrain-gl installed. So it imports nothing else until a test uses
the fixture.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from .comparison.golden import GoldenPictures, Software


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
def _terrain_software() -> Iterator[Software]:
    from .comparison.golden import Software

    software = Software()
    yield software
    software.release()


@pytest.fixture
def terrain_picture(request: pytest.FixtureRequest, _terrain_software: Software) -> GoldenPictures:
    """Draw a map, and compare the picture with a golden one beside the test: `terrain_picture("hill.tif")`."""
    from .comparison.golden import GoldenPictures

    if not _terrain_software.is_software:
        pytest.skip(f"golden pictures are of software OpenGL, this is {_terrain_software.gl_renderer}: docs/testing.md")
    config = request.config
    failures = Path(config.getoption("--terrain-failures"))
    return GoldenPictures(
        _terrain_software,
        request.path.parent,
        f"{request.path.stem}-{request.node.name}",
        config.invocation_params.dir / failures,
        config.getoption("--regenerate-terrain"),
    )
