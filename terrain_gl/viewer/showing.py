"""Show a map with one line of code: in a window from a script, in a view from a notebook."""

import os
import sys
from typing import Any, Unpack

from ..basics.exceptions import TerrainError, UsageError
from ..camera import Camera
from ..files.maps import find_bundled, open_map
from ..files.views import standard_view
from ..heightmap import Heightmap
from ..readers import Reading, Spacing
from ..renderer.options import RenderOptions
from ..renderer.overlay import read_overlay
from .advice import OF_FILES, in_python


class ShowOptions(RenderOptions, total=False):
    """The keywords of `show`: options of a frame, and how a file is read; `Heightmap.open` explains these."""

    z_scale: float | None
    z_offset_m: float | None
    nodata: float | None
    encoding: str
    trusted: bool
    band: int | str | None
    raw: tuple[int, int] | None
    byte_order: str | None
    backend: str
    fresh: bool


def show(
    source: Any = "alpine",
    camera: Camera | None = None,
    *,
    spacing_m: float | Spacing | None = None,
    size: tuple[int, int] | None = None,
    overlays: object = (),
    **options: Unpack[ShowOptions],
) -> Any:
    """Show a map: in a notebook as a view, else in a window until the user closes it.

    Parameters
    ----------
    source
        A path, the name of a bundled map, or what `Heightmap.of` takes: a Heightmap, an array, a DataArray of xarray or
        rioxarray, a dataset of rasterio.
    camera
        The first view; by default the map's own.
    spacing_m : float or (east, north), optional
        Metres between posts; by default the spacing in the source.
    size
        Width and height in pixels.
    overlays
        One or several overlays to draw over the land: paths of GeoJSON files, GeoDataFrames, geometries of shapely; see
        `overlay.read_overlay`.
    options
        Fields of `FrameOptions` by name: how the map is drawn at first. `material`, a picture of the ground with
        coordinates, is placed by its coordinates. For a path, also arguments of `Heightmap.open`, such as `nodata`.

    Returns
    -------
    notebook.View or dict
        The view, or the stats of the window's last frame.

    Raises
    ------
    TerrainError
        The map cannot be read, or there is no display, or no OpenGL 4.3. Messages name the arguments of Python.
    UsageError
        An option is outside its range.

    Examples
    --------
    >>> import terrain_gl, rioxarray
    >>> terrain_gl.show(rioxarray.open_rasterio("dem.tif"))  # doctest: +SKIP
    """
    given: dict[str, Any] = dict(options)
    of_file = {name: given.pop(name) for name in OF_FILES.values() if name in given}
    try:
        heightmap = _opened(source, spacing_m, of_file)
        for note in heightmap.notes:
            print(f"terrain-gl: note: {in_python(note)}", file=sys.stderr)
        known = find_bundled(os.fspath(source)) if isinstance(source, str | os.PathLike) else None
        first = camera or (known.camera if known else standard_view(heightmap))
        if known:
            given.setdefault("sun", known.sun)
        several = overlays if isinstance(overlays, list | tuple) else [overlays]
        laid = tuple(read_overlay(each, heightmap) for each in several)
        if _in_notebook():
            from .notebook import View

            return View(heightmap, first, overlays=laid, **given | ({"size": size} if size else {}))
        from . import run

        return run(heightmap, first, size=size, overlays=laid, **given)
    except (TerrainError, UsageError) as error:
        raise type(error)(in_python(str(error))) from None


def _opened(source: Any, spacing_m: float | Spacing | None, of_file: dict[str, Any]) -> Heightmap:
    if isinstance(source, str | os.PathLike):
        return open_map(os.fspath(source), Reading(**of_file), spacing_m)[0]
    if of_file:
        raise UsageError(f"{', '.join(of_file)}: only for a path, not for {type(source).__name__}")
    return Heightmap.of(source, spacing_m)


def _in_notebook() -> bool:
    """Whether the program runs in a kernel that shows widgets."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return shell is not None and hasattr(shell, "kernel")
