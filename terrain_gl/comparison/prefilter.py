"""Other prefilters of normals, which we compare ours with. Each runs inside glsl/comparison/prefilter/frame.glsl.

point     no prefilter: the normal at the footprint's centre
mip       mipmaps of normals, normalised after the lookup
toksvig   mipmaps of normals; a mean shorter than 1 widens the highlight (Toksvig 2005)
leadr     mipmaps of slopes and their products: Gaussians of slopes, weighted by projected area (Dupuy et al. 2013)
"""

import moderngl

from ..camera import Camera
from ..gpu import gl, shaders
from ..gpu.bindings import bind
from ..gpu.session import Resource
from ..light.horizon import SUN_RADIUS, Sweep, horizon_texture, lattice_direction, sun_uniforms
from ..shade.picture import Look, Picture

BASELINES = ("point", "mip", "toksvig", "leadr")
_TEXTURES = ("u_normals", "u_slopes", "u_products")


class Mipmaps:
    """Mipmaps of normals, slopes, their products and the sun's visibility, for one sun."""

    def __init__(self, picture: Picture) -> None:
        self.ctx = picture.ctx
        self.terrain = picture.terrain
        size = self.terrain.heightmap.cols - 1, self.terrain.heightmap.rows - 1
        self._record = shaders.compute(self.ctx, "comparison/prefilter/record.comp")
        self._sweep = Sweep(self.ctx)
        self._horizon = horizon_texture(self.terrain, 1)
        self.textures = [self._texture(size) for _ in range(3)]

    def follow(self, sun: tuple[float, float, float], radius: float = SUN_RADIUS) -> None:
        """Build the mipmaps for a sun: a unit vector and its angular radius."""
        towards = lattice_direction(sun, self.terrain.heightmap.spacing_m)
        self._sweep.run(self.terrain, towards, self._horizon)
        self.terrain.bind()
        textures = dict(zip(_TEXTURES, self.textures, strict=True))
        bind("comparison/prefilter/record.comp", u_horizons=self._horizon, **textures)
        gl.write_uniforms(self._record, **sun_uniforms(sun, radius), towards=towards)
        self._record.run(-(-self.textures[0].width // 64), self.textures[0].height)
        self.ctx.memory_barrier(moderngl.TEXTURE_FETCH_BARRIER_BIT | moderngl.TEXTURE_UPDATE_BARRIER_BIT)
        for texture in self.textures:
            texture.build_mipmaps()

    def bind(self) -> None:
        """Bind the mipmaps for the shaders of glsl/comparison/prefilter."""
        bind("comparison/prefilter/frame.glsl", **dict(zip(_TEXTURES, self.textures, strict=True)))

    def release(self) -> None:
        """Release GPU resources."""
        made: list[Resource] = [self._record, self._sweep, self._horizon, *self.textures]
        for resource in made:
            resource.release()

    def _texture(self, size: tuple[int, int]) -> moderngl.Texture:
        texture = self.ctx.texture(size, 4, dtype="f4")
        texture.build_mipmaps()
        texture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)
        texture.repeat_x = texture.repeat_y = False
        return texture


def shade_as(baseline: str, picture: Picture, mipmaps: Mipmaps, camera: Camera, look: Look) -> None:
    """Shade the last result of `Picture.see` with one of `BASELINES`."""
    picture.light(camera, look)
    assert picture.lighting.sky
    east, north, up = (float(v) for v in picture.lighting.sky.sun["axis"])
    mipmaps.follow((east, north, up))
    mipmaps.bind()
    picture.colour(f"comparison/prefilter/{baseline}.frag")
