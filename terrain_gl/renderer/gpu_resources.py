"""Everything that a renderer holds on the GPU: heights, tables, selectors, picture."""

from contextlib import AbstractContextManager
from typing import Any, cast

from ..basics.exceptions import UsageError
from ..basics.steps import Steps
from ..camera.pieces import Piece
from ..error import ErrorTables
from ..gpu.gl import limits
from ..gpu.selftest import check_driver
from ..gpu.session import Session, steps_in_session
from ..gpu.timing import StageTimer
from ..heightmap import Heightmap
from ..lod import ViewBlock
from ..pages.map import PagedMap
from ..pages.streaming import Streaming
from ..pages.terrain import PagedTables, PagedTerrain
from ..shade.picture import Picture
from ..terrain import Terrain
from .methods import Selectors

Size = tuple[int, int]


class GpuResources:
    """A map on the GPU, with all that drawing needs.

    Attributes
    ----------
    session, timer
        The OpenGL context, and times of all stages.
    terrain, tables, view, selectors, picture
        Made by `build_steps`, in this order.
    streaming
        Loads the pages of a store that views need; None for other maps.
    """

    terrain: Terrain
    tables: ErrorTables
    view: ViewBlock
    selectors: Selectors
    picture: Picture
    streaming: Streaming | None = None

    def __init__(self, session: Session) -> None:
        self.session = session
        self.timer = session.keep(StageTimer(session.ctx))

    @steps_in_session
    def build_steps(self, heightmap: Heightmap, size: Size) -> Steps[None]:
        """Make everything; yields progress from 0 to 1. If it fails or is abandoned, everything is released.

        Raises
        ------
        TerrainError
            Too little GPU memory, or a driver that computes wrongly.
        UsageError
            A size of no pixels, or beyond what the GPU can draw.
        """
        try:
            check_driver(self.session.ctx, self.session.keep)
            self.check_size(size)
            with self._memory_for_map(heightmap):
                yield from self._table_steps(heightmap)
                self.view = self.session.keep(ViewBlock(self.session.ctx))
                self.selectors = self.session.keep(Selectors(self.tables, self.view))
                yield 0.85
            with self._memory_for_picture(size), self.timer.stage("sat"):
                self.picture = self.session.keep(Picture(self.terrain, self.view, size))
            yield 1.0
        except BaseException:  # a step failed, or the generator was closed
            self.session.release()
            raise

    def resize(self, size: Size) -> None:
        """Change the picture's size; its pixels are lost."""
        with self._memory_for_picture(size):
            self.picture.resize(size)

    def crop(self, piece: Piece) -> None:
        """Select the piece of the picture to draw next: `picture` gets its size, the projection its window."""
        if self.picture.size != piece.drawn_size:
            self.resize(piece.drawn_size)
        self.view.crop(piece)

    def exaggerate(self, factor: float) -> None:
        """Draw the relief `factor` times as high. Only the light is made again."""
        self.terrain.exaggerate(factor)
        self.picture.settle(self.terrain.all_posts)

    def check_size(self, size: Size) -> None:
        """Raise `UsageError` for a picture size that the GPU cannot draw at once."""
        most = min(limits(self.session.ctx)[name] for name in ("viewport_size", "renderbuffer_size", "texture_size"))
        if min(size) < 1 or max(size) > most:
            raise UsageError(f"picture size must be from 1x1 to {most}x{most} on this GPU, got {size[0]}x{size[1]}")

    @property
    def gpu_bytes(self) -> dict[str, int]:
        """GPU memory in bytes, by content: heights, summed-area tables, error table, shading, and the total."""
        heightmap = self.terrain.heightmap
        tables = self.tables
        if isinstance(tables, PagedTables):
            paged = {"heights": tables.terrain.bytes, "sat": tables.bytes, "error": 0, "shade": self.picture.bytes}
            return paged | {"total": sum(paged.values()) + self.selectors.bytes}
        heights = heightmap.rows * heightmap.cols * (5 if self.terrain.is_marked else 4)
        sat = tables.counters.size + tables.squares.size
        error = tables.bytes - sat
        parts = {"heights": heights, "sat": sat, "error": error, "shade": self.picture.bytes}
        return parts | {"total": sum(parts.values()) + self.selectors.bytes}

    def _table_steps(self, heightmap: Heightmap) -> Steps[None]:
        """Upload the heights and build the error tables; yields progress as a part of `build_steps`."""
        if isinstance(heightmap, PagedMap):
            paged: Any = self.session.keep(PagedTerrain(self.session.ctx, heightmap))
            tables = self.session.keep(PagedTables(paged))
            self.terrain = paged
            self.tables = cast(Any, tables)
            self.streaming = self.session.keep(Streaming(tables))
            return
        self.terrain = self.session.keep(Terrain(self.session.ctx, heightmap))
        yield 0.05
        with self.timer.stage("error"):
            self.tables = self.session.keep(ErrorTables(self.terrain, build=False))
            for share in self.tables.build_steps():
                self.session.ctx.finish()  # a step ends when the GPU has finished it
                yield 0.05 + 0.75 * share

    def _memory_for_map(self, heightmap: Heightmap) -> AbstractContextManager[None]:
        posts = heightmap.rows * heightmap.cols
        if isinstance(heightmap, PagedMap):
            return self.session.needs_memory(f"{heightmap.name}: needs", heightmap.gpu_bytes, "give less --gpu-memory")
        what = f"{heightmap.name}: its {posts} posts need"
        return self.session.needs_memory(what, 16 * posts, "draw it from a store (terrain-gl build)")

    def _memory_for_picture(self, size: Size) -> AbstractContextManager[None]:
        what = f"a picture of {size[0]}x{size[1]} needs"
        return self.session.needs_memory(what, 64 * size[0] * size[1], "use a smaller one")
