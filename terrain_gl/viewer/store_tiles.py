"""The tiles of a store in the window: whether tiles are still coming, and the message about missing ones."""

from ..pages.streaming import Streaming
from ..renderer import Renderer
from .painter import Painter
from .scene import Scene


class StoreTiles:
    """The state of the map's tiles, for the window. A map in memory has none."""

    def __init__(self, scene: Scene, painter: Painter) -> None:
        self._scene = scene
        self._painter = painter

    @property
    def _streaming(self) -> Streaming | None:
        return self._scene.renderer.streaming if self._scene.has_map else None

    @property
    def are_coming(self) -> bool:
        """Whether tiles are missing in the picture that may still come."""
        return self._streaming is not None and self._streaming.is_loading

    @property
    def is_rebuilding(self) -> bool:
        """Whether bounds are wide after edits, and become exact soon."""
        return self._streaming is not None and self._streaming.is_rebuilding

    def step(self) -> None:
        """If missing tiles were read, let the picture be drawn again; if not, let light be made."""
        if not self._streaming:
            return
        if self._streaming.has_news:
            self._painter.forget()
        elif self.lacks_light and not self._painter.light.is_due(self._scene.frame_spec().lit_look):
            self._painter.light.stop()  # the light begins anew, with the tiles that have come

    @property
    def lacks_light(self) -> bool:
        """Whether tiles in the picture still get light of their own."""
        if self._streaming is None:
            return False
        return self._scene.frame_spec().lit_look.is_lit and self._scene.renderer.picture.lighting.is_coming

    @property
    def text(self) -> str:
        return f"loading: missing tiles: {len(self._missing):,}"

    @property
    def share(self) -> float:
        """Share of the picture within its tolerance, on the side that has less."""
        return min((float(stats.get("within_tolerance", 0.0)) for stats in self._painter.side_stats), default=0.0)

    @property
    def note(self) -> str:
        """One line about tiles that cannot be loaded, or an offer to build a store; otherwise ""."""
        if not self._scene.has_map or self.are_coming:
            return ""
        if missing := self._missing:
            return f"not complete: missing tiles: {len(missing):,}; {missing[0]['tile']}: {missing[0]['reason']}"
        return self._scene.opened.offer

    @property
    def _missing(self) -> list[dict[str, str]]:
        sides = [stats.get("tiles_missing", ()) for stats in self._painter.side_stats]
        return list({tile["tile"]: tile for missing in sides for tile in missing}.values())


def never_wait(renderer: Renderer) -> None:
    """Let a window's renderer, and all readers of its map's heights, use the loaded tiles without waiting."""
    if renderer.streaming:
        renderer.streaming.waits = False
        renderer.heightmap.heights = renderer.streaming.terrain.known  # type: ignore[assignment]
