"""Shading: from the mesh to the colours of a picture, in two passes.

The first pass draws the mesh and stores the depth of each sample. For styles that show the mesh, it also stores facts
about the mesh (glsl/shade/detail.glsl). The depth and the ray of a sample give the place on the map that the sample
sees (glsl/shade/seen.glsl). The second pass shades each pixel from the map itself: a summed-area table of
heights gives the mean normal over the pixel's footprint (glsl/shade/relief.glsl). So the colours do not depend on the
mesh. Each pixel is of one of a few kinds (glsl/shade/kind.glsl), and each kind has a program of its own.
"""

import math
from dataclasses import dataclass, replace
from typing import Any

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..basics.steps import Steps, drain
from ..camera import Camera
from ..gpu.current import check_current
from ..gpu.passes import NOTHING_MORE, Box, Resource, Resources, State, clear, drawn_colours_kept
from ..gpu.textures import from_top
from ..image import linear_from_srgb
from ..light.climate import AUTO
from ..light.ground import towards_sun
from ..light.lighting import NO_HAZE_M
from ..light.ramps import LOOKS as RAMPS
from ..light.ramps import Ground, Ramp, Range, ramp_for
from ..lod import Selection, ViewBlock
from ..lod.hiding import ROUGH_PX, is_above_ground
from ..mesh import MeshDraws
from ..pages.light import light_of
from ..terrain import Terrain
from . import contours, surroundings
from .programs import KINDS, PixelPasses, Wanted
from .targets import Targets

SUN = (300.0, 35.0)  # azimuth, clockwise from north, and elevation, in degrees
_OF_LIGHT = ("visibility", "ambient", "direct", "lobes")  # styles that show parts of the light
_LIT = ("shaded", *_OF_LIGHT)  # styles that need light
_OF_MESH = ("wireframe", "lod", "segments", "cracks", "promise", "error")  # styles that show the mesh
_DETAILED = ("cracks", "promise")  # styles of the mesh that have a first pass of their own
STYLES = ("shaded", "lambert", *_OF_MESH, "normals", "voids", "depth", *_OF_LIGHT)
_NUMBERS = ("normals", "depth")
_EXACT = (*_LIT, "lambert", *_NUMBERS)  # styles that show light or numbers: `Picture.exact`
GRAINS = ("on", "off")
VOIDS = ("fill", "hole")  # how posts without data are drawn
UNLIT = "depth"  # the cheapest style, when only the mesh matters
TILE_PX = (256, 64)  # pixels that one step of `shade_steps` shades
AIR_M = 70e3  # distance over which clear air absorbs all but 1/e of the light
FARTHEST = 2.0**-70  # least depth of land: for slivers, a driver may compute 0 or less, which would be sky
HAZE = 2.0  # least distance over which haze absorbs as much: see `_haze_m`
_NOTHING_LISTED = np.array([0, 1, 1, 0], "u4").tobytes()  # the head of `Listed` in glsl/shade/seen.glsl
Size = tuple[int, int]


@dataclass(frozen=True)
class Look:
    """How a picture looks: the options of shading. `FrameOptions` explains the fields that are not listed here.

    Attributes
    ----------
    sky
        File of a sky, an equirectangular picture of light; by default the clear sky of that sun. See `sky.read_sky`.
    material
        A picture of the ground, north up, or values with a ramp. By default, heights and slopes decide the
        colour.
    water_m
        Height of standing water in metres; none by default.
    wires
        Draw the triangles' edges on top of the style.
    land_colours
        The option `look`, one of `light.climate.NAMES`.
    is_clear
        Alpha is 0 where there is only sky, and between 0 and 1 in pixels that see both sky and land.
    """

    style: str = "shaded"
    sun: tuple[float, float] = SUN
    sky: str | None = None
    material: Ground | None = None
    water_m: float | None = None
    wires: bool = False
    land_colours: str = AUTO
    voids: str = "fill"
    surroundings: str = "block"
    grain: str = "on"
    contour_m: float | None = None
    units: str = "m"
    ramp_range: Range | None = None
    error_scale_px: float | None = None
    haze: float = 1.0
    is_clear: bool = False

    @property
    def cover(self) -> str | Ramp:
        """The look of the land, or its ramp."""
        is_ramp = self.land_colours in RAMPS and self.ramp_range is not None
        return (
            ramp_for(*self.ramp_range, self.land_colours, self.ramp_range)
            if is_ramp and self.ramp_range
            else self.land_colours
        )

    @property
    def is_lit(self) -> bool:
        """Whether the style needs light."""
        return self.style in _LIT


PLAIN = Look()


class Picture:
    """Draws the mesh of a selection into a picture of `size` pixels with some `samples` a pixel, and shades it."""

    def __init__(self, terrain: Terrain, view: ViewBlock, size: Size, samples: int = 4) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        self.view = view
        self.samples = max(1, min(samples, self.ctx.max_samples))
        self.sums, self.lighting = light_of(self.terrain)
        self._seeing: dict[tuple[str, bool], MeshDraws] = {}  # by fragment shader, and whether voids are holes
        self.programs = PixelPasses(self.view, self.samples, self.terrain.defines)
        self.targets = Targets(self.ctx, self.samples)  # of the last picture
        self.resize(size)

    has_bar = True
    """Whether the style "error" has a bar with its colours in the picture."""

    waits_for_light = True
    """Whether a picture waits until its light is complete. If not, it shows earlier light, or the style "lambert" if
    there is none, until `light_steps` is done."""

    @property
    def bytes(self) -> int:
        """GPU memory that shading needs for the map, without the picture's pixels."""
        return self.sums.bytes + self.lighting.bytes

    @property
    def depth(self) -> moderngl.Texture:
        """Depth of each sample of the last picture: near plane over view depth, 0 for the sky."""
        return self.targets.depth

    @property
    def size(self) -> Size:
        """Width and height in pixels."""
        return self.targets.size

    def resize(self, size: Size) -> None:
        """Change the picture's size; its pixels are lost."""
        self.targets.resize(size)
        self.targets.shaded = self.targets.shaded or (PLAIN, surroundings.NONE)

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1), without the light."""
        self.sums.update(posts)

    def settle(self, posts: Rect) -> None:
        """Update the light after edits inside a rectangle."""
        self.lighting.update(posts)

    def draw(self, selection: Selection, camera: Camera, look: Look = PLAIN) -> None:
        """Draw and shade a selection, the last one that was made."""
        self.see(selection, look)
        self.shade(camera, look)

    def see(self, selection: Selection, look: Look = PLAIN) -> None:
        """First pass, over the mesh: find the depth of each sample."""
        drain(self.see_steps(selection, look, max(1, selection.draws)))

    def see_steps(self, selection: Selection, look: Look = PLAIN, commands: int = 1) -> Steps[None]:
        """Incremental `see`, `commands` draw commands a step; yields progress from 0 to 1."""
        mesh = self._meshes(look).of(selection.surface)
        state = self._seeing_state(selection, look)
        assert state.framebuffer
        of_mesh = state.framebuffer is not self.targets.seen
        clear(state.framebuffer, depth=0.0, colour=(0.0, 0.0, 0.0, 0.0) if of_mesh else None)  # infinitely far: the sky
        for first in range(0, selection.draws, commands):
            mesh.draw(selection, state, part=slice(first, first + commands))
            yield min(1.0, (first + commands) / selection.draws)

    def shade(self, camera: Camera, look: Look = PLAIN) -> None:
        """Second pass, over the pixels: colour the places that the samples see."""
        drain(self.shade_steps(camera, look, self.size))

    def shade_steps(self, camera: Camera, look: Look = PLAIN, tile: Size = TILE_PX) -> Steps[None]:
        """Incremental `shade`, one tile (width, height) a step; yields progress from 0 to 1."""
        if look.style in _LIT and self.waits_for_light:
            self.lighting.follow(look.sun, look.sky, look.material, look.cover)
        around = look.style == "shaded" and look.surroundings != "none"
        edge = surroundings.seen_from(camera, self.terrain) if around else surroundings.NONE
        if look.style in _LIT and not self.lighting.is_there:
            if self.waits_for_light and self.lighting.rehearse():
                self._colour(look, edge, (0, 0, *self.size))  # compiles the programs of the style
            look = replace(look, style="lambert")
            edge = surroundings.NONE
        if look.style in _LIT:
            self.lighting.describe(self._haze_m(camera, look.haze), look.water_m)
        self.targets.shaded = look, edge  # the look, and the surroundings in it
        corners = [(x, y) for y in range(0, self.size[1], tile[1]) for x in range(0, self.size[0], tile[0])]
        for done, corner in enumerate(corners, 1):
            self._colour(look, edge, (*corner, *tile))
            yield done / len(corners)

    def _has_holes(self, look: Look) -> bool:
        return look.voids == "hole" and self.terrain.heightmap.voids > 0

    def _meshes(self, look: Look) -> MeshDraws:
        """The programs of the first pass that record what the style needs, and no more."""
        holes = self._has_holes(look)
        if look.style in _DETAILED:
            what = f"detail_{look.style}"
        elif look.style in _OF_MESH or look.wires:
            what = "detail"
        else:
            what = "surface" if holes else "solid"
        if (what, holes) not in self._seeing:
            geometry = {"geometry": "shade/detail.geom"} if what.startswith("detail") else {}
            stages = geometry | {"fragment": f"shade/{what}.frag"}
            self._seeing[what, holes] = MeshDraws("PICTURE", {"HOLES": holes}, **stages)
        return self._seeing[what, holes]

    def _seeing_state(self, selection: Selection, look: Look) -> State:
        """The state in which the first pass draws."""
        target = self.targets.detail if look.style in _OF_MESH or look.wires else self.targets.seen
        culls = not self._may_show_underside(look, selection)
        return State(target, self.view.viewport, depth=">=", least_depth=FARTHEST, clips=True, culls=culls)

    def _colour(self, look: Look, edge: int, tile: Box) -> None:
        """Colour the pixels of a tile (column and row of its lower left corner, width, height), kind by kind."""
        style = f"shade/{look.style}.frag"
        wanted = self._wanted(look, edge)
        read = self._resources
        self.targets.listed.write(_NOTHING_LISTED)
        find_kind = wanted._replace(wet=False)
        self.programs.draw("shade/kind.frag", "ANY", find_kind, State(self.targets.kind, scissor=tile, depth="1"), read)
        of_kind = State(self.targets.screen, scissor=tile, depth="==")
        for kind in ("OPEN", "SKY", "NEAR") if edge else ("SKY", "NEAR"):
            self.programs.draw(style, kind, wanted, of_kind, read)
        self.ctx.memory_barrier()
        self.programs.run_listed(style, wanted, self.targets.listed, {**read, "u_picture": self.targets.picture})
        self.ctx.memory_barrier()
        if look.wires and look.style != "wireframe":
            plain = Wanted(self.lighting.defines, wanted.uniforms)
            over = State(self.targets.screen, scissor=tile, blends=True)
            self.programs.draw("shade/wires.frag", "ANY", plain, over, read)

    def light(self, camera: Camera, look: Look = PLAIN) -> None:
        """Make the light of a look, if it is missing."""
        self.lighting.follow(look.sun, look.sky, look.material, look.cover)
        self.lighting.describe(self._haze_m(camera, look.haze), look.water_m)

    def colour(self, fragment: str, resources: Resources = NOTHING_MORE, **uniforms: object) -> None:
        """Colour every pixel of the picture by a fragment shader; `resources` are those that it reads beside ours."""
        self._fill(self.targets.screen, fragment, "ANY", Wanted(self.lighting.defines, uniforms), resources)

    def read(self) -> np.ndarray:
        """(height, width, 4) uint8 sRGB, first row on top."""
        check_current(self.ctx)
        return from_top(self.targets.picture.read(alignment=1), "u1", self.size, 4)

    def exact(self) -> np.ndarray:
        """The last picture, coloured again without clipping at white: (height, width, 4) float32, first row on top.

        Colours are linear light times the exposure, and times alpha, which is 1 unless the look is clear. In the style
        "normals", they are unit vectors east, north, up; in "depth", metres along the view. In the sky of both, alpha
        is 0, normals are 0, and depths are infinite. Lines over the picture are left out. Styles that are diagrams have
        the colours of the screen.
        """
        look, edge = self.targets.shaded
        if look.style not in _EXACT:
            shown = self.read()
            alpha = shown[..., 3:] / 255
            return np.concatenate([alpha * linear_from_srgb(shown[..., :3]), alpha], -1).astype("f4")
        clear = look.is_clear and look.style not in _NUMBERS  # the alpha of numbers is 0 in the sky anyway
        wanted = self._wanted(look, edge)._replace(exact=True, clear=clear)
        wanted.uniforms["exaggeration"] = self.terrain.heightmap.exaggeration
        return self._read_back(f"shade/{look.style}.frag", "ANY", wanted, 4, "f4")

    def facts(self) -> list[np.ndarray]:
        """What the last picture shows: two arrays (height, width, 4) float32, the parts of glsl/shade/facts.frag."""
        return [self._read_back("shade/facts.frag", "ANY", self._facts_wanted(part), 4, "f4") for part in (0, 1)]

    def _facts_wanted(self, part: int) -> Wanted:
        """The settings of glsl/shade/facts.frag for the last picture."""
        look, edge = self.targets.shaded
        is_wet = look.style == "shaded" and look.water_m is not None
        level_m = look.water_m - self.terrain.base_m if is_wet and look.water_m is not None else -1e30
        wanted = self._wanted(look, edge)
        wanted.uniforms.update(level_m=level_m)
        return wanted._replace(light={**wanted.light, "FACTS": part})

    def draw_into(self, state: State, uniforms: dict[str, Any]) -> None:
        """Draw the finished picture with its depth: glsl/shade/into.frag; `uniforms` are about the caller's clip space.

        The framebuffer's choice of colours to draw to stays as it was.
        """
        facts = self.ctx.texture(self.size, 4, dtype="f4")
        target = self.ctx.framebuffer([facts])
        try:
            self._fill(target, "shade/facts.frag", "ANY", self._facts_wanted(0))
            wanted = Wanted(self.lighting.defines, uniforms)
            read: Resources = {"u_picture": self.targets.picture, "u_facts": facts}
            assert state.framebuffer
            with drawn_colours_kept(state.framebuffer):
                self.programs.draw("shade/into.frag", "ANY", wanted, state, read)
        finally:
            target.release()
            facts.release()

    @property
    def target(self) -> moderngl.Framebuffer:
        """The framebuffer of the finished picture, for drawing over it."""
        return self.targets.screen

    def light_steps(self, look: Look) -> Steps[None]:
        """Incremental `light`; yields progress from 0 to 1, or nothing if no light is missing."""
        if look.style in _LIT:
            yield from self.lighting.follow_steps(look.sun, look.sky, look.material, look.cover)

    def coverage(self) -> np.ndarray:
        """Whether the surface covers all samples of each pixel: (height, width) bool, first row on top."""
        return self.sky_share() == 0

    def sky_share(self) -> np.ndarray:
        """The share of sky in each pixel, 0 to 1: (height, width) float32, first row on top."""
        return 1 - self.note("shade/coverage.frag", 2, "f4")[..., 0]

    def sees_land(self) -> bool:
        """Whether any sample of the last picture sees the map."""
        kinds = np.rint(8 * np.frombuffer(self.targets.kinds.read(), "f4"))
        return bool(np.isin(kinds, [KINDS["NEAR"], KINDS["MIXED"]]).any())

    def depths(self) -> np.ndarray:
        """The depth buffer's value of each pixel's furthest sample: (height, width) float32, first row on top."""
        return self.note("shade/coverage.frag", 2, "f4")[..., 1]

    def depths_m(self) -> np.ndarray:
        """View depth of each pixel's furthest sample: (height, width) float64 metres; infinite for the sky."""
        return self.view.depths_m(self.depths())

    def places(self) -> np.ndarray:
        """Column and row that each sample sees: (samples, height, width, 2) float32, first row on top; sky negative."""
        return np.stack([self.note("shade/places.frag", 2, "f4", sample=i) for i in range(self.samples)])

    def sees_hidden(self, selection: Selection, look: Look = PLAIN) -> np.ndarray:
        """Where the last picture would show the patches that its selection left out as hidden: (height, width) bool.

        They are drawn over the picture's depths; then the selection is drawn again, so the picture stays as it was.
        """
        before = self.places()
        self._meshes(look).of(selection.surface).draw_hidden(selection, self._seeing_state(selection, look))
        changed: np.ndarray = (self.places() != before).any((0, -1))
        self.see(selection, look)
        return changed

    def note(self, fragment: str, components: int, dtype: str, kind: str = "ANY", **uniforms: object) -> np.ndarray:
        """Output of a fragment shader for pixels of one of `KINDS`: (height, width, components), first row on top."""
        return self._read_back(fragment, kind, Wanted(self.lighting.defines, uniforms), components, dtype)

    def show(self, framebuffer: moderngl.Framebuffer, viewport: Box | None = None) -> None:
        """Copy the finished picture to a framebuffer, enlarged to a viewport (by default, the whole framebuffer)."""
        window = viewport or (0, 0, *framebuffer.size)
        copy = "shade/show.frag" if window[2:] == self.size else "shade/enlarge.frag"
        state = State(framebuffer, window)
        wanted = Wanted(self.lighting.defines, {"window": window})
        self.programs.draw(copy, "ANY", wanted, state, {"u_picture": self.targets.picture})

    def release(self) -> None:
        """Release GPU resources."""
        self.targets.release()
        for draws in self._seeing.values():
            draws.release()
        self.sums.release()
        self.lighting.release()
        self.programs.release()

    def _haze_m(self, camera: Camera, haze: float) -> float:
        """Distance over which haze absorbs all but 1/e of the light: `AIR_M`, or more if the map is large or far.

        `haze` times as much haze makes it shorter.
        """
        if haze == 0:
            return NO_HAZE_M
        east, north = self.terrain.heightmap.extent_m
        low, high = self.terrain.heightmap.range_m
        away_m = math.dist(camera.eye, (east / 2, north / 2, (low + high) / 2))
        clear_m = AIR_M / self.terrain.heightmap.exaggeration
        return max(clear_m, HAZE * max(math.hypot(east, north), away_m)) / haze

    def _may_show_underside(self, look: Look, selection: Selection) -> bool:
        """Whether a pixel may show the land from below: through a gap, or from an eye that is not above the mesh."""
        is_above = is_above_ground(self.terrain, self.view.eye[0], self.view.eye[2], self.view.reach_m)
        has_gaps = self._has_holes(look) or look.style == "cracks"
        farthest_px = selection.farthest_px or selection.certified_px or 0.0
        return has_gaps or not is_above or farthest_px > ROUGH_PX

    def _read_back(self, fragment: str, kind: str, wanted: Wanted, components: int, dtype: str) -> np.ndarray:
        """Output of a fragment shader: (height, width, components), first row on top."""
        texture = self.ctx.texture(self.size, components, dtype=dtype)
        target = self.ctx.framebuffer([texture])
        self._fill(target, fragment, kind, wanted)
        noted = from_top(texture.read(alignment=1), dtype, self.size, components)
        target.release()
        texture.release()
        return noted

    def _fill(
        self,
        target: moderngl.Framebuffer,
        fragment: str,
        kind: str,
        wanted: Wanted,
        resources: Resources = NOTHING_MORE,
    ) -> None:
        """Run a fragment shader over all pixels of one of `KINDS`."""
        uniforms = wanted.uniforms | (self.lighting.uniforms if self.lighting.is_there else {})
        self.programs.draw(
            fragment, kind, wanted._replace(uniforms=uniforms), State(target), {**self._resources, **resources}
        )

    def _wanted(self, look: Look, edge: int) -> Wanted:
        """The settings that all programs which colour a look share."""
        uniforms = {
            "sun": towards_sun(look.sun[0] + self.terrain.heightmap.north_deg, look.sun[1])
        } | surroundings.uniforms(self.terrain, look.water_m)
        uniforms["error_scale_px"] = look.error_scale_px or 0.0
        uniforms["bar"] = self.has_bar
        if look.contour_m is not None:
            uniforms |= contours.uniforms(self.terrain, look.contour_m, look.units, look.water_m)
        if look.style in _LIT:
            uniforms |= self.lighting.uniforms
        grained = look.style == "shaded" and look.grain == "on"
        lined = look.contour_m is not None
        wet = look.water_m is not None or self.terrain.has_water
        return Wanted(self.lighting.defines, uniforms, wet, edge, grained, lined, clear=look.is_clear)

    @property
    def _resources(self) -> Resources:
        """Everything that shading may read."""
        seen: dict[str, Resource] = {"Listed": self.targets.listed, "u_depth": self.targets.depth}
        if self.targets.drawn:
            seen["u_drawn"] = self.targets.drawn
        map_read = {**self.terrain.resources, **self.view.resources, **self.sums.resources}
        return {**map_read, **self.lighting.resources, **seen}
