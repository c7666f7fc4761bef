"""Golden pictures of maps, for tests: draw a map, and compare it with a picture that someone checked and stored.

`terrain_gl.pytest_plugin` makes one `GoldenPictures` for each test.
"""

import hashlib
import os
import re
from pathlib import Path
from typing import Any
from urllib.parse import quote

import moderngl
import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..camera import Camera
from ..files.maps import open_map
from ..files.views import standard_sun, standard_view
from ..heightmap import Heightmap
from ..image import difference, read_image, write_png
from ..renderer import Renderer
from ..renderer.frame import Frame
from .difference import OTHER_DRIVER, Difference, Tolerance, check_alike, differ

FOLDER = "golden"
LONGEST = 200  # characters of a file's name; most file systems allow 255 bytes
_OF_A_FAILURE = ("-golden", "-difference")  # endings of the pictures beside the drawn one


class GoldenPictures:
    """Compares pictures of one test with golden ones.

    Attributes
    ----------
    folder
        The folder of the test's file. Golden pictures are in its subfolder `golden`. Names of maps are relative to it.
    test
        pytest's name of the test, with its class and parameters. Names of golden pictures begin with it.
    failures
        Folder for the pictures of this folder's tests that fail.
    regenerate
        Write golden pictures instead of comparing.
    owners
        The test that each golden picture of the session belongs to, by the path of the picture in lower case.
    """

    def __init__(
        self,
        ctx: moderngl.Context,
        folder: Path,
        test: str,
        failures: Path,
        regenerate: bool,
        owners: dict[str, str],
    ) -> None:
        self._ctx = ctx
        self.folder = folder
        self.test = test
        self.failures = failures
        self.regenerate = regenerate
        self.owners = owners
        self._used: set[str] = set()

    def __call__(
        self,
        terrain: str | os.PathLike[str] | np.ndarray | Heightmap,
        camera: Camera | None = None,
        *,
        name: str = "",
        size: tuple[int, int] = (320, 180),
        spacing_m: float | tuple[float, float] | None = None,
        tolerance: float = OTHER_DRIVER.steps,
        share: float = OTHER_DRIVER.share,
        **options: Any,
    ) -> Frame:
        """Draw a map, and compare the picture with the golden one.

        Parameters
        ----------
        terrain
            A file, the name of a bundled map, heights in metres, or a `Heightmap`.
        camera
            The view; by default that of `terrain-gl shot`. It depends on the highest and the lowest post, among others.
        name
            Needed for a second picture in one test.
        size
            Width and height in pixels.
        spacing_m
            Metres between posts, if `terrain` is a file or heights.
        tolerance, share
            At most `share` of the pixels may differ by more than `tolerance` steps of 255.
        options
            Options of `Renderer.render`: `max_error_px`, `style`, `sun`, ….

        Returns
        -------
        Frame
            `image` and `stats`, for further assertions.

        Raises
        ------
        AssertionError
            The picture differs, or there is no golden picture.
        """
        __tracebackhide__ = True  # pytest shows the line of the test
        heightmap, usual = self._opened(terrain, spacing_m)
        given = usual | options | ({"camera": camera} if camera else {})
        with self._ctx, Renderer(heightmap, size, ctx=self._ctx) as renderer:
            frame = renderer.render(**given)
        self.compare(frame.image, name, tolerance, share)
        return frame

    def compare(
        self,
        image: np.ndarray,
        name: str = "",
        tolerance: float = OTHER_DRIVER.steps,
        share: float = OTHER_DRIVER.share,
    ) -> None:
        """Compare any picture, (height, width, 3 or 4) uint8, with the golden one; alpha is left out."""
        __tracebackhide__ = True
        golden = self.golden(name)
        image = np.ascontiguousarray(image[..., :3])
        if self.regenerate:
            golden.parent.mkdir(exist_ok=True)
            write_png(golden, image)
            return
        if not golden.exists():
            drawn = self._write_failure(golden, image, None)
            raise AssertionError(
                f"there is no golden picture {golden}: make it by --regenerate-terrain, and look at it\n"
                f"  drawn       {drawn}"
            )
        expected = read_image(golden)
        try:
            check_alike((expected, image), (golden, "the drawn picture"))
        except TerrainError as error:
            drawn = self._write_failure(golden, image, expected)
            raise AssertionError(f"{error}\n  drawn       {drawn}") from None
        found = differ(expected, image, Tolerance(tolerance, share), with_flip=False)
        if not found.is_within:
            raise AssertionError(self._report(golden, expected, image, found))

    def golden(self, name: str = "") -> Path:
        """The file of a golden picture. A test may use a name only once, and no two tests have the same file."""
        whole = _file_name(self.test, name)
        if whole in self._used:
            raise UsageError(f'{whole}: is the second picture of that name in this test: give it a name="…"')
        if whole.endswith(_OF_A_FAILURE):
            raise UsageError(f"{whole}: this ending is kept for the pictures of a failure: give it another name")
        self._used.add(whole)
        path = self.folder / FOLDER / f"{whole}.png"
        owner = self.owners.setdefault(os.fspath(path).casefold(), self.test)
        if owner != self.test:
            raise UsageError(
                f"{path}: belongs to {owner} and to {self.test}, because many systems ignore case: rename one of them"
            )
        return path

    def _opened(
        self, terrain: str | os.PathLike[str] | np.ndarray | Heightmap, spacing_m: float | tuple[float, float] | None
    ) -> tuple[Heightmap, dict[str, Any]]:
        """The map, and its usual camera and sun."""
        known = None
        if isinstance(terrain, Heightmap):
            heightmap = terrain
        elif isinstance(terrain, np.ndarray):
            heightmap = Heightmap(terrain, 1.0 if spacing_m is None else spacing_m)
        else:
            beside = self.folder / terrain
            heightmap, known = open_map(os.fspath(beside if beside.exists() else terrain), spacing_m=spacing_m)
        if known:
            return heightmap, {"camera": known.camera, "sun": known.sun}
        return heightmap, {"camera": standard_view(heightmap), "sun": standard_sun(heightmap)}

    def _report(self, golden: Path, expected: np.ndarray, image: np.ndarray, found: Difference) -> str:
        """Write the pictures of a failure, and say in a few lines what differs."""
        drawn = self._write_failure(golden, image, expected)
        col, row = found.worst
        return "\n".join(
            [
                f"{found.share:.2%} of the pixels differ by more than {found.tolerance.steps:g} of 255 from the golden"
                f" picture, {found.tolerance.share:.2%} are allowed",
                f"  golden      {golden}",
                f"  drawn       {drawn}",
                f"  difference  {_beside(drawn, '-difference')}",
                f"  most        {found.largest:g} of 255, at column {col}, row {row}",
                f"  driver      {self._ctx.info['GL_RENDERER']}",
                "  If the change is right: pytest --regenerate-terrain, look at the picture, and commit it.",
            ]
        )

    def _write_failure(self, golden: Path, image: np.ndarray, expected: np.ndarray | None) -> Path:
        """Write the drawn picture; beside it the golden one, if there is one, and if their sizes agree the difference.

        Returns the path of the drawn picture.
        """
        self.failures.mkdir(parents=True, exist_ok=True)
        drawn = self.failures / golden.name
        for ending in _OF_A_FAILURE:  # they may be left from an earlier failure
            _beside(drawn, ending).unlink(missing_ok=True)
        write_png(drawn, image)
        if expected is not None:
            write_png(_beside(drawn, "-golden"), expected)
            if expected.shape == image.shape:
                write_png(_beside(drawn, "-difference"), difference(expected, image))
        return drawn


def _beside(drawn: Path, ending: str) -> Path:
    return drawn.with_name(f"{drawn.stem}{ending}.png")


def _file_name(test: str, name: str) -> str:
    """The name of a file, another one for every test and name; characters that a system may refuse are `%2F` and so on.

    A long name is cut, and ends with a digest.
    """
    whole = f"{test}-{name}" if name else test
    safe = re.sub(r"[^\w.+=,@\[\]-]", lambda found: quote(found[0], safe=""), whole)
    if len(safe) <= LONGEST:
        return safe
    return f"{safe[: LONGEST - 17]}-{hashlib.sha256(safe.encode()).hexdigest()[:16]}"
