"""Large rasters: a coarse sample of a raster, and the command that makes a store of it."""

import math
import os

from ..basics.exceptions import TerrainError
from ..basics.limits import is_too_large, store_command
from ..heightmap import Heightmap
from ..readers import Reading, open_raster
from ..readers.raster import Spacing, both
from ..readers.windows import RasterFile

LONGEST = 1025  # posts along the longer side of a sample


def is_huge(path: str | os.PathLike[str], reading: Reading) -> bool:
    """Whether a file has more posts than a map in memory may have; False if the path is not a file."""
    return os.path.isfile(path) and is_too_large(*posts_of(path, reading))


def posts_of(path: str | os.PathLike[str], reading: Reading) -> tuple[int, int]:
    """Rows and columns of a file."""
    raster = open_raster(path, reading)
    raster.blocks.close()
    return raster.shape[:2]


def sample(
    path: str | os.PathLike[str], reading: Reading, spacing_m: float | Spacing | None = None
) -> tuple[Heightmap, str]:
    """A coarse sample of a large raster, and one line that offers a store.

    Parameters
    ----------
    spacing_m
        Metres between posts, if the caller knows them better than the file.

    Raises
    ------
    TerrainError
        GDAL, which alone can read a part of such a file, does not open it.
    """
    file = RasterFile(os.fspath(path), reading)
    file.voids_m = file.find_voids()
    rows, cols = file.shape
    if not is_too_large(rows, cols):
        file.guess(spacing_m)  # this reads the whole file
    size = f"{file.name}: has {cols:,} x {rows:,} posts"
    step = math.ceil(max(rows, cols) / LONGEST)
    heights = file.sample((math.ceil(rows / step), math.ceil(cols / step)))
    if heights is None:
        raise TerrainError(f"{size}, too many to be held in memory: make a store of it with {store_command(file.name)}")
    few = Heightmap(heights, _spacing_of(file, heights.shape, spacing_m), file.name)
    few.georeference = file.georeference and file.georeference.resampled(few.cols, few.rows)
    few.notes = file.notes
    return few, f"{size}; this is a coarse sample, without a certified bound. For all posts: {store_command(file.name)}"


def _spacing_of(file: RasterFile, size: tuple[int, int], spacing_m: float | Spacing | None) -> Spacing:
    """Metres between the posts of a sample of (rows, cols) posts that reaches as far as the raster."""
    east, north = both(spacing_m or file.spacing_m or 1.0)
    return east * (file.shape[1] - 1) / (size[1] - 1), north * (file.shape[0] - 1) / (size[0] - 1)
