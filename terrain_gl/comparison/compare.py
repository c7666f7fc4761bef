"""Every method side by side, after Fig. D.1 of the supplement of Li et al. 2021.

For the mesh that each method draws, we report its triangles, its screen error over the surface in the picture
(`Renderer.measure`), and the difference of its picture from the true one (`likeness`). The truth is every post of the
map with the bilinear surface in between (`bilinear`). All pictures are supersampled: by default, each pixel is
drawn as 4 × 4 pixels of 4 samples. Shading reads the map and not the mesh, so pictures differ only by geometry.
`own_surface` can shade baselines from their own meshes instead.

Many parameters of a baseline give the same number of triangles. We report the smallest RMS screen error among them,
and the picture nearest to the truth.
"""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass
from statistics import median
from typing import Any

import numpy as np

from ..basics.boxes import box_sums
from ..basics.steps import Progress, drain
from ..camera import Camera
from ..camera.pieces import Piece
from ..renderer import Renderer
from ..shade.picture import UNLIT
from .likeness import difference_of, flip, rmse, skyline
from .own_surface import shaded_from_mesh

LABELS = {
    "clipmap": "Geometry clipmaps",
    "tessellated": "Tessellated clipmap",
    "sat": "Summed-area tables",
}
COMPARED = tuple(LABELS)
FINE = 4  # each pixel is drawn as FINE × FINE pixels
_INSET = 0.24  # size of the inset, as a part of the picture's width and height
_SKY_IN_INSET = (0.08, 0.55)  # least and largest share of sky in the inset, if some place has it
_FRAMES = 3  # timed frames


@dataclass
class Truth:
    """The true picture of a view."""

    image: np.ndarray  # (height, width, 3) uint8 sRGB
    sky: np.ndarray  # (height, width) share of sky in each pixel
    stats: dict[str, Any]  # of the frame with every post


@dataclass
class MethodResult:
    """One method's results.

    `stats` has the numbers of its frame, its achieved error, `image_rmse`, `flip`, `skyline_px`, `max_skyline_px`; of a
    baseline also `parameters` and `picture_parameters`: docs/stats.md.
    """

    method: str
    stats: dict[str, Any]
    image: np.ndarray  # (height, width, 3) uint8 sRGB
    error_px: np.ndarray  # (height, width) screen error of the surface in each pixel; NaN for the sky


def truth_of(
    renderer: Renderer, camera: Camera, fine: int = FINE, progress: Progress | None = None, **options: Any
) -> Truth:
    """Draw every post, with each pixel drawn as fine × fine pixels."""
    return Truth(*_picture(renderer, camera, fine, progress, method="truth", **options))


def entry_of(
    renderer: Renderer,
    camera: Camera,
    truth: Truth,
    method: str,
    fine: int = FINE,
    progress: Progress | None = None,
    pictured: dict[str, Any] | None = None,
    from_mesh: bool = False,
    **options: Any,
) -> MethodResult:
    """Draw and measure one method; `options` are fields of `FrameOptions`, for its picture changed by `pictured`."""
    times = [renderer.render(camera, method=method, **options).stats["ms"] for _ in range(_FRAMES)]
    stats = dict(renderer.measure())
    stats["ms"] = {stage: median(ms[stage] for ms in times) for stage in times[0]}
    error_px = renderer.inspector.error_map()
    shown = options | (pictured or {})
    image, likeness = likeness_of(renderer, camera, truth, fine, progress, from_mesh, method=method, **shown)
    if options.get("parameters"):
        stats |= {"parameters": asdict(options["parameters"]), "picture_parameters": asdict(shown["parameters"])}
    return MethodResult(method, stats | likeness, image, error_px)


def best_pictured(
    renderer: Renderer, camera: Camera, truth: Truth, method: str, tried: Sequence[dict[str, Any]], **options: Any
) -> dict[str, Any]:
    """The options among `tried` whose picture has the smallest RMSE, without supersampling."""
    if len(tried) == 1:
        return tried[0]
    off = [likeness_of(renderer, camera, truth, 1, method=method, **each, **options)[1]["image_rmse"] for each in tried]
    return tried[int(np.argmin(off))]


def likeness_of(
    renderer: Renderer,
    camera: Camera,
    truth: Truth,
    fine: int,
    progress: Progress | None = None,
    from_mesh: bool = False,
    **options: Any,
) -> tuple[np.ndarray, dict[str, Any]]:
    """A picture, (height, width, 3) uint8, supersampled like the truth, and its difference from the truth."""
    with shaded_from_mesh(renderer, camera, **options) if from_mesh else nullcontext():
        image, sky, _ = _picture(renderer, camera, fine, progress, **options)
    off = skyline(truth.sky, sky)
    shapes = {"skyline_px": off.mean_px, "max_skyline_px": off.max_px}
    return image, {"image_rmse": rmse(truth.image, image), "flip": flip(truth.image, image)} | shapes


def measured(renderer: Renderer, camera: Camera, **options: Any) -> dict[str, Any]:
    """Stats of one frame, with its achieved error."""
    renderer.draw(camera, **(options | {"style": UNLIT}))
    return dict(renderer.measure())


def part(progress: Progress | None, i: int, parts: int) -> Progress | None:
    """A function that reports the progress of part i as progress of the whole."""
    return (lambda done: progress((i + done) / parts)) if progress else None


def _picture(
    renderer: Renderer, camera: Camera, fine: int, progress: Progress | None, **options: Any
) -> tuple[np.ndarray, np.ndarray, dict[str, Any]]:
    """A supersampled picture, (height, width, 3) uint8, the share of sky in its pixels, and its stats."""
    width, height = renderer.size
    image = np.empty((height, width, 3), np.uint8)
    sky = np.empty((height, width), np.float32)

    def receive(piece: Piece, pixels: np.ndarray) -> None:
        image[piece.rows, piece.cols] = pixels[..., :3]
        share = renderer.picture.sky_share()
        sky[piece.rows, piece.cols] = share.reshape(piece.size[1], fine, piece.size[0], fine).mean((1, 3))

    steps = renderer.draw_steps(camera, size=renderer.size, fine=fine, receive=receive, gradual=False, **options)
    stats = drain(steps, progress)
    return image, sky, dict(stats)


def inset_of(truth: Truth, images: Sequence[np.ndarray]) -> tuple[slice, slice]:
    """Rows and columns of the part where the pictures differ most, with some of the skyline if land meets the sky."""
    height, width = (max(1, round(_INSET * side)) for side in truth.sky.shape)
    squares = sum((np.square(difference_of(truth.image, image)) for image in images), np.zeros(truth.sky.shape))
    off = box_sums(squares, height, width)
    share = box_sums(truth.sky, height, width) / (height * width)
    fits = (share >= _SKY_IN_INSET[0]) & (share <= _SKY_IN_INSET[1])
    best = np.argmax(np.where(fits, off, -1.0) if fits.any() else off)
    row, col = int(best) // off.shape[1], int(best) % off.shape[1]
    return slice(row, row + height), slice(col, col + width)
