"""The ground's merged lobes: summed-area tables over normals, half-vectors and albedo. A texel is 2 × 2 cells.

Values: glsl/light/record.comp. Lookups in shaders: glsl/light/merged.glsl. Specification: `reference.lobe_values`.
"""

from typing import Any

import moderngl
import numpy as np

from ..basics.rect import Rect
from ..gpu.passes import Resources, Uniforms
from ..sat import Table
from ..terrain import Terrain
from .climate import AUTO, LOOKS, RAMP, Climate, climates, look_of
from .ground import HeightSums
from .ramps import Ramp, ramp_for
from .recorded import RecordedTable

LAYERS = 9
_NO_RAMP = [(0.0, 0.0, 0.0, 0.0)] * 10  # glsl/shade/cover.glsl
REACH = 2  # the values of a cell depend on posts up to this far away: a spline takes 4 × 4 of them


class Cover:
    """The cover of the ground: a look of the land, or a picture of the ground."""

    def __init__(self, terrain: Terrain) -> None:
        self.ctx = terrain.ctx
        self.terrain = terrain
        self.look = look_of(terrain.heightmap)
        self.ramp: Ramp | None = None
        self.picture: moderngl.Texture | None = None
        self._none = self.ctx.texture((1, 1), 3)

    def take_look(self, look: str | Ramp) -> bool:
        """Colour the land by a look, one of `climate.NAMES`, or by a ramp; returns whether this is a change."""
        before = self.look, self.ramp
        self.look = look.name if isinstance(look, Ramp) else look
        self.look = look_of(self.terrain.heightmap) if self.look == AUTO else self.look
        self.ramp = look if isinstance(look, Ramp) else None
        if self.ramp is None and self._shader == RAMP:
            self.ramp = ramp_for(*self.terrain.heightmap.range_m, self.look)
        return before != (self.look, self.ramp)

    @property
    def _shader(self) -> int:
        """The number of the look in glsl/shade/cover.glsl."""
        return RAMP if self.ramp else LOOKS[self.look].shader

    def take_picture(self, albedo: np.ndarray | None) -> None:
        """Use a picture of linear albedo, north up, over the whole map; with None, the look of the land.

        Parameters
        ----------
        albedo
            (rows, cols, 3); or (rows, cols, 4), with the share of a texel that the picture covers.
        """
        if self.picture:
            self.picture.release()
        self.picture = None
        if albedo is not None:
            rows, cols, channels = albedo.shape
            self.picture = self.ctx.texture(
                (cols, rows), channels, np.ascontiguousarray(albedo, "f2").tobytes(), dtype="f2", alignment=1
            )
            self.picture.build_mipmaps()
            self.picture.repeat_x = self.picture.repeat_y = False
            self.picture.filter = (moderngl.LINEAR_MIPMAP_LINEAR, moderngl.LINEAR)

    @property
    def climates(self) -> tuple[Climate, ...]:
        """The climate at the map's corners."""
        return climates(self.terrain.heightmap, self.look)

    @property
    def defines(self) -> dict[str, object]:
        """Macros for a program that only contains the code for this kind of cover."""
        dry = [each.dryness for each in self.climates]
        known = {"PICTURED": self.picture is not None, "MARKED": self.terrain.is_marked}
        known |= {"GREEN": min(dry) < 1, "ARID": max(dry) > 0}
        return {"LOOK": self._shader} | {name: str(is_so).lower() for name, is_so in known.items()}

    @property
    def uniforms(self) -> dict[str, Any]:
        """Uniforms of glsl/shade/cover.glsl."""
        values = {"climate": list(self.climates), "base_m": self.terrain.base_m, "look": self._shader}
        values["ramp"] = self.ramp.stops if self.ramp else _NO_RAMP
        values["exaggeration"] = self.terrain.heightmap.exaggeration
        return values | {"pictured": self.picture is not None, "marked": self.terrain.is_marked}

    @property
    def resources(self) -> Resources:
        """The picture of the ground, for shaders that include glsl/shade/cover.glsl."""
        return {"u_albedo": self.picture or self._none}

    def release(self) -> None:
        """Release GPU resources."""
        self.take_picture(None)
        self._none.release()


def lobe_table(cols: int, rows: int) -> Table:
    """The size of the tables of a map."""
    return Table(cols // 2, rows // 2, LAYERS)


class LobeTables(RecordedTable):
    """The summed-area tables of nine values of each texel: 9 bytes a post."""

    def __init__(self, terrain: Terrain, sums: HeightSums, cover: Cover, build: bool = True) -> None:
        size = lobe_table(terrain.heightmap.cols, terrain.heightmap.rows)
        super().__init__(terrain.ctx, size, "light/record.comp", "tables of lobes", lambda: cover.defines)
        self.terrain = terrain
        self.sums = sums
        self.cover = cover
        if build:
            self.build()

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        last = self.table.width - 1, self.table.height - 1
        x0, y0 = (max(0, (posts[i] - REACH - 1) // 2) for i in (0, 1))
        x1, y1 = (min(last[i], (posts[i + 2] + REACH) // 2) for i in (0, 1))
        self._rewrite(x0, y0, x1 - x0 + 1, y1 - y0 + 1)

    def read(self) -> np.ndarray:
        """(9, rows, cols) values of the texels, recovered from the sums."""
        return self.values().view("i4") / 32767.0

    def _feed(self, buffer: moderngl.Buffer, where: Uniforms) -> tuple[Resources, Uniforms]:
        read = {**self.terrain.resources, **self.sums.resources, **self.cover.resources}
        return {**read, "Values": buffer}, {**where, **self.cover.uniforms}
