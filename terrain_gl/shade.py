"""Shading: from the surface that the mesh draws to a picture.

Two passes. The first draws the patches and notes at each sample which place of the map it sees
(glsl/shade/surface.frag). The second shades each pixel from the map itself, averaged over the pixel's footprint by a
summed-area table of heights (glsl/shade/relief.glsl): what it shows does not depend on the mesh.
"""

from __future__ import annotations

import ctypes
import math
from collections import deque
from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import moderngl
import numpy as np

from . import gl, shaders
from .camera import Camera
from .light.ground import HeightSums, towards_sun
from .light.lighting import Lighting
from .lod import Levels, Selection
from .mesh import MeshDraw, MeshDraws
from .terrain import Rect

SUN = (300.0, 35.0)  # azimuth, clockwise from north, and elevation, in degrees
_LIT = ("shaded", "visibility", "ambient", "direct", "lobes")  # styles of light
_OF_MESH = ("wireframe", "lod", "segments", "promise", "error")  # styles that show the mesh itself
STYLES = (*_LIT, "lambert", *_OF_MESH, "normals", "depth")
UNLIT = "depth"  # the cheapest style, for who wants to know of the mesh alone
TILE_PX = (256, 64)  # shaded between two looks at anything else, by who must not wait for the whole picture
HAZE = 2.0  # distance at which haze lets 1/e through, in diagonals of the map
_TEXTURE_2D, _TEXTURE_2D_MULTISAMPLE = 0x0DE1, 0x9100
_DEPTH_COMPONENT, _DEPTH_COMPONENT32F, _FLOAT = 0x1902, 0x8CAC, 0x1406
Size = tuple[int, int]
Target = TypeVar("Target")


@dataclass(frozen=True)
class Look:
    """How a picture looks.

    Attributes
    ----------
    style
        One of `STYLES`.
    sun
        Azimuth, clockwise from north, and elevation, in degrees.
    sky
        File of a sky, an equirectangular picture of light, instead of the clear sky of that sun; see `sky.read_sky`.
    material
        File of a picture of the ground, north up, instead of the cover that heights and slopes suggest.
    water_m
        Height of standing water in metres; none by default.
    wires
        Draw the triangles' edges over whatever the style shows.
    """

    style: str = "shaded"
    sun: tuple[float, float] = SUN
    sky: str | None = None
    material: str | None = None
    water_m: float | None = None
    wires: bool = False

    @property
    def is_lit(self) -> bool:
        """Whether the style shows light."""
        return self.style in _LIT


PLAIN = Look()


class Picture:
    """Draws what a surface selected into a picture.

    Parameters
    ----------
    levels
        Whose terrain and view are drawn.
    size
        Width and height in pixels.
    samples
        Samples a pixel; the driver may take fewer.
    """

    def __init__(self, levels: Levels, size: Size, samples: int = 4) -> None:
        self.ctx, self.levels = levels.ctx, levels
        self.samples = max(1, min(samples, self.ctx.max_samples))
        self.sums = HeightSums(levels.terrain)
        self.lighting = Lighting(levels.terrain, self.sums)
        self._surface = MeshDraws("PICTURE", fragment="shade/surface.frag")
        self._surface.of(levels)  # compiled now, not with the first frame
        self._detail = MeshDraws("PICTURE", geometry="shade/detail.geom", fragment="shade/detail.frag")
        self._promise = MeshDraws("PICTURE", geometry="shade/detail.geom", fragment="shade/detail_promise.frag")
        self._screens: dict[tuple[str, bool], tuple[Any, moderngl.VertexArray]] = {}
        self._targets: list[Any] = []
        self.resize(size)

    waits_for_light = True
    """Whether light is made before anything is drawn in it. If not, a picture is lit as it was before, or flatly, until
    somebody has gone through `lighting_up`."""

    @property
    def bytes(self) -> int:
        """GPU memory that shading needs for the map; the picture's own pixels do not count."""
        return self.sums.bytes + self.lighting.bytes

    @property
    def depth(self) -> moderngl.Texture:
        """Depth of each sample of the last picture: near plane over view depth, 0 for the sky."""
        return self._depth

    def resize(self, size: Size) -> None:
        """Change the picture's size; what was drawn is lost."""
        self._release_targets()
        self.size = (0, 0)  # until all is there: memory may not suffice
        samples = self.samples if self.samples > 1 else 0
        self._posts = self._target(self.ctx.texture(size, 2, samples=samples, dtype="f4"))
        self._depth = self._target(_depth_texture(self.ctx, size, samples))
        self._picture = self._target(self.ctx.texture(size, 4))
        self._seen = self._target(self.ctx.framebuffer([self._posts], self._depth))
        self._screen = self._target(self.ctx.framebuffer([self._picture]))
        self._drawn: moderngl.Texture | None = None
        self.size = size

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1), all but the light."""
        self.sums.update(posts)

    def settle(self, posts: Rect, moved: bool = True) -> None:
        """Have the light follow edits within a rectangle; `moved`: heights, and not only the span of their sums."""
        self.lighting.update(posts, moved)

    def draw(self, selection: Selection, camera: Camera, look: Look = PLAIN) -> None:
        """Draw what a surface selected last."""
        self.see(selection, look)
        self.shade(camera, look)

    def see(self, selection: Selection, look: Look = PLAIN) -> None:
        """First pass, over the mesh: find the post that each sample sees."""
        deque(self.seeing(selection, look, max(1, selection.draws)), maxlen=0)

    def seeing(self, selection: Selection, look: Look = PLAIN, commands: int = 1) -> Generator[float, None, None]:
        """The same in portions of so many draw commands, after each the share that is done."""
        of_mesh = look.style in _OF_MESH or look.wires
        meshes = self._surface if not of_mesh else self._promise if look.style == "promise" else self._detail
        mesh, target = meshes.of(selection.surface), self._detail_target() if of_mesh else self._seen
        target.use()
        target.clear(-1.0, -1.0, depth=0.0)  # no place on the map: the sky
        for first in range(0, selection.draws, commands):
            self._draw_mesh(mesh, target, selection, slice(first, first + commands))
            yield min(1.0, (first + commands) / selection.draws)

    def shade(self, camera: Camera, look: Look = PLAIN) -> None:
        """Second pass, over the pixels: colour what the first one saw."""
        deque(self.shading(camera, look, self.size), maxlen=0)

    def shading(self, camera: Camera, look: Look = PLAIN, tile: Size = TILE_PX) -> Generator[float, None, None]:
        """The same in tiles of so many columns and rows, after each the share that is done."""
        if look.style in _LIT and self.waits_for_light:
            self.lighting.follow(look.sun, look.sky, look.material)
        elif look.style in _LIT and not self.lighting.is_there:
            look = replace(look, style="lambert")
        if look.style in _LIT:
            self.lighting.describe(self._haze_m(camera), look.water_m)
        corners = [(x, y) for y in range(0, self.size[1], tile[1]) for x in range(0, self.size[0], tile[0])]
        for done, corner in enumerate(corners, 1):
            self._screen.scissor = (*corner, *tile)
            self._colour(look)
            self._screen.scissor = (0, 0, *self.size)
            yield done / len(corners)

    def _colour(self, look: Look) -> None:
        """Colour what the scissor lets through."""
        self._fill(self._screen, f"shade/{look.style}.frag", look.water_m is not None, sun=towards_sun(*look.sun))
        if look.wires and look.style != "wireframe":
            self.ctx.enable(moderngl.BLEND)
            self.ctx.blend_func = moderngl.SRC_ALPHA, moderngl.ONE_MINUS_SRC_ALPHA
            self._fill(self._screen, "shade/wires.frag")
            self.ctx.disable(moderngl.BLEND)

    def light(self, camera: Camera, look: Look = PLAIN) -> None:
        """Make what a look is lit with, if it is not there yet."""
        self.lighting.follow(look.sun, look.sky, look.material)
        self.lighting.describe(self._haze_m(camera), look.water_m)

    def colour(self, fragment: str, **uniforms: Any) -> None:
        """Colour every pixel of the picture by a fragment shader."""
        self._fill(self._screen, fragment, **uniforms)

    def read(self) -> np.ndarray:
        """(height, width, 4) uint8 sRGB, first row on top."""
        return _from_top(self._picture.read(alignment=1), "u1", self.size, 4)

    def lighting_up(self, look: Look) -> Generator[float, None, None]:
        """Make the light for a look in portions, after each the share that is done; nothing where it is there."""
        if look.style in _LIT:
            yield from self.lighting.following(look.sun, look.sky, look.material)

    def coverage(self) -> np.ndarray:
        """(height, width) bool, first row on top: the surface covers all of the pixel's samples."""
        return self.note("shade/coverage.frag", 1, "u1")[..., 0] == self.samples

    def sky_share(self) -> np.ndarray:
        """(height, width) float32, first row on top: how much of each pixel is sky, 0 to 1."""
        return 1 - self.note("shade/coverage.frag", 1, "u1")[..., 0] / np.float32(self.samples)

    def places(self) -> np.ndarray:
        """(samples, height, width, 2) float32, first row on top: column and row of the map; negative for the sky."""
        return np.stack([self.note("shade/places.frag", 2, "f4", sample=i) for i in range(self.samples)])

    def note(self, fragment: str, components: int, dtype: str, **uniforms: Any) -> np.ndarray:
        """What a fragment shader says of every pixel: (height, width, components), first row on top."""
        texture = self.ctx.texture(self.size, components, dtype=dtype)
        target = self.ctx.framebuffer([texture])
        self._fill(target, fragment, **uniforms)
        noted = _from_top(texture.read(alignment=1), dtype, self.size, components)
        self._screen.use()
        target.release()
        texture.release()
        return noted

    def show(self, framebuffer: moderngl.Framebuffer) -> None:
        """Copy the finished picture to a window's framebuffer, stretched to its viewport."""
        program, vao = self._screen_program("shade/show.frag")
        framebuffer.use()
        self.ctx.disable(moderngl.DEPTH_TEST)
        program["u_window"] = framebuffer.viewport
        self._picture.use(2)
        vao.render(vertices=3)

    def release(self) -> None:
        """Give the GPU's memory back."""
        self._release_targets()
        self._surface.release()
        self._detail.release()
        self._promise.release()
        self.sums.release()
        self.lighting.release()
        for program, vao in self._screens.values():
            vao.release()
            program.release()

    def _haze_m(self, camera: Camera) -> float:
        """Air as clear as it takes to see the whole map from where the eye is."""
        (east, north), (low, high) = self.levels.terrain.heightmap.extent_m, self.levels.terrain.heightmap.range_m
        return HAZE * max(math.hypot(east, north), math.dist(camera.eye, (east / 2, north / 2, (low + high) / 2)))

    def _detail_target(self) -> moderngl.Framebuffer:
        """Where the surface is drawn with what styles of the mesh want to know; takes more memory, and time."""
        if self._drawn is None:
            self._drawn = self._target(self.ctx.texture(self.size, 4, samples=self._posts.samples, dtype="f2"))
            self._seen_detail = self._target(self.ctx.framebuffer([self._posts, self._drawn], self._depth))
        return self._seen_detail

    def _draw_mesh(self, mesh: MeshDraw, target: moderngl.Framebuffer, selection: Selection, part: slice) -> None:
        self.levels.tables.bind()
        gl.clip_control_zero_to_one(self.ctx)  # without it distant depths are coarser, and in order all the same
        target.use()
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func = ">="
        mesh.draw(selection, part)

    def _fill(self, target: moderngl.Framebuffer, fragment: str, wet: bool = False, **uniforms: Any) -> None:
        """Run a fragment shader over every pixel of the target."""
        program, vao = self._screen_program(fragment, wet)
        for name, value in uniforms.items():
            if f"u_{name}" in program:
                program[f"u_{name}"] = value
        self.levels.terrain.bind()
        self.levels.view.bind()
        self.sums.buffer.bind_to_storage_buffer(0)
        self._posts.use(2)
        if self._drawn:
            self._drawn.use(3)
        if "Lights" in program:
            self.lighting.bind(program)
        target.use()
        self.ctx.disable(moderngl.DEPTH_TEST)
        vao.render(vertices=3)

    def _screen_program(self, fragment: str, wet: bool = False) -> tuple[Any, moderngl.VertexArray]:
        if (fragment, wet) not in self._screens:
            defines = {"SAMPLES": self.samples, "WATER_LEVEL": wet} | self.lighting.defines
            program = shaders.program(self.ctx, vertex="shade/screen.vert", fragment=fragment, defines=defines)
            self._screens[fragment, wet] = program, self.ctx.vertex_array(program, [])
        return self._screens[fragment, wet]

    def _target(self, made: Target) -> Target:
        """Note what a picture of another size has no use for."""
        self._targets.append(made)
        return made

    def _release_targets(self) -> None:
        gl.use_default_framebuffer(self.ctx)  # the one in use must not be one that is gone
        while self._targets:
            self._targets.pop().release()


def _depth_texture(ctx: moderngl.Context, size: Size, samples: int) -> moderngl.Texture:
    """A depth texture of 32-bit floats, which moderngl alone does not make."""
    texture = ctx.depth_texture(size, samples=samples)
    i, u = ctypes.c_int, ctypes.c_uint
    target = _TEXTURE_2D_MULTISAMPLE if samples else _TEXTURE_2D
    gl.function(ctx, "glBindTexture", None, u, u)(target, texture.glo)
    if samples:
        define = gl.function(ctx, "glTexImage2DMultisample", None, u, i, u, i, i, ctypes.c_ubyte)
        define(target, samples, _DEPTH_COMPONENT32F, *size, 1)
    else:
        define = gl.function(ctx, "glTexImage2D", None, u, i, i, i, i, i, u, u, ctypes.c_void_p)
        define(target, 0, _DEPTH_COMPONENT32F, *size, 0, _DEPTH_COMPONENT, _FLOAT, None)
    return texture


def _from_top(data: bytes, dtype: str, size: Size, components: int) -> np.ndarray:
    """Pixels as read from OpenGL, whose first row is the lowest, to (height, width, components)."""
    return np.frombuffer(data, dtype).reshape(size[1], size[0], components)[::-1].copy()
