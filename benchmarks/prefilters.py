"""Our shading, the supplement's, and other prefilters of normals, beside light by brute force (`light_truth`).

lobes     ours
printed   the supplement's own shading, as printed: glsl/prefilter/printed.frag
mip       mipmaps of normals, normalised after the lookup
toksvig   mipmaps of normals; a mean shorter than 1 widens the highlight (Toksvig 2005)
leadr     mipmaps of slopes and their products: Gaussians of slopes, weighted by projected area (Dupuy et al. 2013)
point     no prefilter: the normal at the footprint's centre

All are drawn in one frame with every post, so nothing but the shading differs.
"""

import moderngl
from light_truth import render_light_truth

from terrain_gl.gpu.passes import ComputePass
from terrain_gl.light.horizon import SUN_RADIUS, Sweep, horizon_texture, lattice_direction, sun_uniforms
from terrain_gl.light.lighting import Lighting
from terrain_gl.renderer.options import FrameOptions

GLSL = "../benchmarks/glsl/prefilter/"
PRINTED = 2  # the last step towards the supplement's own shading
LIGHT_LABELS = {
    "lobes": "Merged lobes",
    "printed": "Supplement",
    "mip": "Mipmapped normals",
    "toksvig": "Toksvig",
    "leadr": "LEADR moments",
    "point": "Point samples",
}
BASELINES = ("mip", "toksvig", "leadr", "point")
OF_LAND = {"method": "full", "style": "shaded", "surroundings": "none", "grain": "off"}  # light of the land alone
_TEXTURES = ("u_normals", "u_slopes", "u_products")


def compare_light(renderer, camera, fine, truth=None, **options):
    """Shade one view in each way of `LIGHT_LABELS`: the truth, and a picture by name, (height, width, 3) uint8 sRGB.

    The truth lights fine × fine places for each pixel, unless it is given; `options` are sun, sky and material.
    """
    options |= OF_LAND
    chosen = FrameOptions(**options)
    size = renderer.size
    if truth is None:
        truth = render_light_truth(renderer, camera, size, fine, chosen)[..., :3]
    renderer.resize(size)
    renderer.draw(camera, **options)
    picture = renderer.picture
    images = {"lobes": picture.read()}
    shade_as_printed(picture, camera, chosen.shading)
    images["printed"] = picture.read()
    mipmaps = Mipmaps(picture)
    for baseline in BASELINES:
        shade_as(baseline, picture, mipmaps, camera, chosen.shading)
        images[baseline] = picture.read()
    mipmaps.release()
    return truth, {name: image[..., :3] for name, image in images.items()}


def shade_as_printed(picture, camera, look, step=PRINTED):
    """Shade the last result of `Picture.see` as the supplement prints it, or by a step of printed.frag towards that."""
    ours = picture.lighting
    picture.lighting = Lighting(picture.terrain, picture.sums, step)
    picture.light(camera, look)
    picture.colour(GLSL + "printed.frag")
    picture.lighting.release()
    picture.lighting = ours


def shade_as(baseline, picture, mipmaps, camera, look):
    """Shade the last result of `Picture.see` with one of `BASELINES`."""
    picture.light(camera, look)
    mipmaps.follow(tuple(float(v) for v in picture.lighting.sky.sun["axis"]))
    picture.colour(f"{GLSL}{baseline}.frag", mipmaps.textures)


class Mipmaps:
    """Mipmaps of normals, slopes, their products and the sun's visibility, for one sun."""

    def __init__(self, picture):
        self.ctx = picture.ctx
        self.terrain = picture.terrain
        size = self.terrain.heightmap.cols - 1, self.terrain.heightmap.rows - 1
        self._record = ComputePass(self.ctx, GLSL + "record.comp")
        self._sweep = Sweep(self.ctx)
        self._horizon = horizon_texture(self.terrain, 1)
        self.textures = {name: self._texture(size) for name in _TEXTURES}

    def follow(self, sun, radius=SUN_RADIUS):
        """Build the mipmaps for a sun: a unit vector and its angular radius."""
        towards = lattice_direction(sun, self.terrain.heightmap.spacing_m)
        self._sweep.run(self.terrain, towards, self._horizon)
        read = {**self.terrain.resources, "u_horizons": self._horizon, **self.textures}
        normals = self.textures["u_normals"]
        groups = -(-normals.width // 64), normals.height, 1
        self._record.run(groups, read, {**sun_uniforms(sun, radius), "towards": towards})
        self.ctx.memory_barrier(moderngl.TEXTURE_FETCH_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT)
        for texture in self.textures.values():
            texture.build_mipmaps()

    def release(self):
        """Release GPU resources."""
        for resource in (self._record, self._sweep, self._horizon, *self.textures.values()):
            resource.release()

    def _texture(self, size):
        texture = self.ctx.texture(size, 4, dtype="f4")
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        return texture
