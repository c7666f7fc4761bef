"""Ground truth for light: outgoing radiance by brute force (equation A.2 of the supplement).

Every pixel is drawn as many small pixels, on the full-resolution mesh. Each small pixel sees one place, which is lit
with the true cosine and material. Rays that march over the map find the shares of the sun's disc and of the sky that
the place sees (glsl/truth/light.frag). This is slow: use small pictures.
"""

import math

import numpy as np

from terrain_gl.camera.pieces import cut
from terrain_gl.image import srgb_from_linear
from terrain_gl.light.atmosphere import LUMINANCE
from terrain_gl.light.gaussians import SUN_RADIUS_DEG
from terrain_gl.light.lighting import exposure
from terrain_gl.light.sky import dome
from terrain_gl.renderer.options import FrameOptions

RAYS = 512  # rays to the sky for a pixel, about; more if a pixel has very many places
WHITE = 2.2  # glsl/shade/tone.glsl


def render_light_truth(renderer, camera, size, fine, options):
    """Draw the truth of a shaded picture: (height, width, 4) uint8 sRGB, first row on top.

    Each pixel is lit at fine × fine places. Each place sends `rays_of(fine)` rays to the sky, half as many in the
    direction of the mirror reflection, and one to the sun. `options` (`FrameOptions`) give sun, sky and material;
    method and tolerance are not used.
    """
    near_m, curvature, refraction = options.near_m, options.curvature, options.refraction
    ground = FrameOptions(method="full", near_m=near_m, curvature=curvature, refraction=refraction)
    frame = renderer.select(camera, size, ground)
    parts = cut(size, fine, largest=2048)  # each part draws the whole mesh
    image = np.empty((size[1], size[0], 4), np.uint8)
    for i, piece in enumerate(parts):
        picture = renderer.picture
        renderer.resources.crop(piece)
        picture.see(frame.selection)
        picture.light(camera, options.shading)
        sky = picture.lighting.sky
        directions, weights = dome(*sky.radiance.shape[:2])
        below = directions[:, 2] < 0
        hidden = np.average(sky.radiance.reshape(-1, 3)[below], axis=0, weights=weights[below])
        disc = math.radians(SUN_RADIUS_DEG)
        uniforms = {"hidden": tuple(hidden), "sun_disc": disc, "run": i, "rays": rays_of(fine)}
        light = picture.note("../benchmarks/glsl/truth/light.frag", 4, "f4", **uniforms)
        image[piece.rows, piece.cols] = developed(light, fine, exposure(sky))
    return image


def rays_of(fine):
    """Rays to the sky for one place: an even number, at least 2; the more places a pixel has, the smaller it is."""
    return 2 * max(1, round(RAYS / fine**2 / 2))


def developed(light, fine, gain):
    """Average fine × fine pixels of light, land and sky separately, and apply the renderer's tone mapping.

    `light` is (fine · height, fine · width, 4) radiance; its last channel is 1 for land, 0 for sky. `gain` is the
    exposure (`lighting.exposure`). The result is (height, width, 4) uint8 sRGB.
    """
    blocks = light.reshape(light.shape[0] // fine, fine, light.shape[1] // fine, fine, 4).astype(np.float64)
    land = blocks[..., 3:]
    share = land.mean((1, 3))
    of_land = (blocks[..., :3] * land).sum((1, 3)) / np.maximum(land.sum((1, 3)), 1)
    of_sky = (tone_mapped(gain * blocks[..., :3]) * (1 - land)).mean((1, 3))
    shown = srgb_from_linear(share * tone_mapped(gain * of_land) + of_sky)
    return np.concatenate([shown, np.full_like(shown[..., :1], 255)], -1)


def tone_mapped(light):
    """The curve of glsl/shade/tone.glsl (Reinhard et al. 2002), (..., 3) to 0 to 1."""
    luminance = light @ LUMINANCE
    shown = luminance * (1 + luminance / WHITE**2) / (1 + luminance)
    by_luminance = light * (shown / np.maximum(luminance, 1e-6))[..., None]
    by_channel = light * (1 + light / WHITE**2) / (1 + light)
    return np.clip(by_luminance + 0.35 * (by_channel - by_luminance), 0, 1)
