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

    `spacing_m` replaces the spacing in the file. `TerrainError` if GDAL, which alone can read a part of such a file,
    does not open it.
    """
    file = RasterFile(os.fspath(path), reading)
    file.voids_m = file.find_voids()
    rows, cols = file.shape
    if not is_too_large(rows, cols):
        file.guess(spacing_m)  # this reads the whole file
    file.compare_with_the_earth(file.reading)
    size = f"{file.name}: has {cols:,} x {rows:,} posts"
    step = math.ceil(max(rows, cols) / LONGEST)
    heights = file.sample((math.ceil(rows / step), math.ceil(cols / step)))
    if heights is None:
        raise TerrainError(f"{size}, too many to be held in memory: make a store of it with {store_command(file.name)}")
    east, north = both(spacing_m or file.spacing_m or 1.0)
    few_rows, few_cols = heights.shape  # the sample reaches as far as the raster
    few = Heightmap(heights, (east * (cols - 1) / (few_cols - 1), north * (rows - 1) / (few_rows - 1)), file.name)
    few.georeference = file.georeference and file.georeference.resampled(few.cols, few.rows)
    few.notes = file.reading.unanswered(file.notes, spacing_m)
    few.values = file.values
    return few, f"{size}; this is a coarse sample, without a certified bound. For all posts: {store_command(file.name)}"
