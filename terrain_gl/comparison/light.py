"""Compare our shading with the truth and with other prefilters of normals, in one frame, so that nothing else differs.

The truth is `light_truth`; the other prefilters are in `prefilter`. `shade_as_printed` is the supplement's own shading.
All draw every post, so the mesh adds no error.
"""

from typing import Any

import numpy as np

from ..basics.steps import Progress
from ..camera import Camera
from ..light.lighting import Lighting
from ..renderer import Renderer
from ..renderer.options import RenderOptions
from ..shade.picture import Look, Picture
from .compare import Comparison, MethodResult, Truth, inset_of
from .light_truth import FINE, render_light_truth
from .likeness import difference_of, flip, rmse
from .prefilter import BASELINES, Mipmaps, shade_as

PRINTED = 3  # the last step towards the supplement's own shading
LIGHT_LABELS = {
    "lobes": "Merged lobes",
    "printed": "Supplement",
    "mip": "Mipmapped normals",
    "toksvig": "Toksvig",
    "leadr": "LEADR moments",
    "point": "Point samples",
}


def compare_light(
    renderer: Renderer,
    camera: Camera,
    fine: int = FINE,
    progress: Progress | None = None,
    truth: np.ndarray | None = None,
    **options: Any,
) -> Comparison:
    """Shade one view by brute force, by our lobes, as the supplement prints it, and by every baseline.

    Parameters
    ----------
    fine
        The truth lights fine × fine places for each pixel.
    progress
        Called with the progress, 0 to 1.
    truth
        (height, width, 3) uint8 sRGB, if it is known already.
    options
        Sun, sky and material, as fields of `RenderOptions`.

    Returns
    -------
    Comparison
        Its entries have `image_rmse` and `flip` as stats, and the difference of each pixel, 0 to 1, as `error_px`.
    """
    options |= {"method": "full", "style": "shaded", "edge": "none", "grain": "off"}  # light of the land alone
    chosen = RenderOptions(**options)
    image = truth
    if image is None:
        image = render_light_truth(renderer, camera, renderer.size, fine, chosen, progress)[..., :3]
    renderer.resize(renderer.size)
    renderer.draw(camera, **options)
    picture = renderer.picture
    images = {"lobes": picture.read()}
    shade_as_printed(picture, camera, chosen.shading)
    images["printed"] = picture.read()
    of_view = Truth(image, picture.sky_share(), {"places": fine * fine})
    mipmaps = Mipmaps(picture)
    for baseline in BASELINES:
        shade_as(baseline, picture, mipmaps, camera, chosen.shading)
        images[baseline] = picture.read()
    mipmaps.release()
    entries = [_entry(name, image, images[name][..., :3]) for name in LIGHT_LABELS]
    return Comparison(image, of_view.stats, entries, inset_of(of_view, [entry.image for entry in entries]))


def shade_as_printed(picture: Picture, camera: Camera, look: Look, step: int = PRINTED) -> None:
    """Shade the last result of `Picture.see` as the supplement prints it, or by a step towards that.

    Parameters
    ----------
    step
        1: facets are not weighted by their size in the picture. 2: also, visibility is separate from the cosine
        (equation A.5). 3: also, the cosine is the lobe of B.3, merged by C.1 to C.4. See glsl/light/printed.glsl.
    """
    ours = picture.lighting
    picture.lighting = Lighting(picture.terrain, picture.sums, step)
    try:
        picture.light(camera, look)
        picture.colour("comparison/prefilter/printed.frag")
    finally:
        picture.lighting.release()
        picture.lighting = ours


def _entry(name: str, truth: np.ndarray, image: np.ndarray) -> MethodResult:
    stats = {"method": name, "image_rmse": rmse(truth, image), "flip": flip(truth, image)}
    return MethodResult(name, stats, image, difference_of(truth, image))
