"""A lecture: stations, each with a state of the window, sentences in large type and a question.

The lecture that comes with the package is lecture.json.

Sentences may name numbers of the picture, such as {triangles}; the window fills them in, so that they are true.
"""

import json
import math
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..basics.exceptions import UsageError
from ..basics.words import metres
from .ahead import After
from .explainer import BOX, HIDDEN, Explainer
from .frame_stats import achieved_px
from .jumps import JumpMeter
from .layers import Layers
from .painter import Painter
from .pointer import Pointer
from .scene import FrameSpec, Scene
from .sculpting import Sculpting
from .settings import Settings
from .state import FIRST, apply, camera_of, checked, spec_of

NEXT = "space", "right", "page down"
BACK = "left", "page up"
UNKNOWN = "…"  # a number that is not known yet
MEASURING = "being measured"
_OWN = {
    "name",
    "sees",
    "says",
    "asks",
    "answers",
    "click",
    "points",
    "lens",
    "brush",
    "fits",
    "before",
    "store",
    "rows",
}
_NUMBERS = (
    "posts",
    "every",
    "apart",
    "times",
    "triangles",
    "patches",
    "percent",
    "bound",
    "achieved",
    "cracks",
    "hidden",
    "jump",
    "jump_bound",
    "jumps",
)
_NAMES = (*_NUMBERS, "moved", "limit", "tiles", "all_tiles", *(f"{name}_right" for name in _NUMBERS[4:]))


@dataclass(frozen=True)
class Station:
    """A station of a lecture."""

    name: str
    says: tuple[str, ...]
    asks: str
    sees: str  # what a student must see in the picture
    answers: str  # shown by the next key, before the next station; "" for none
    state: dict[str, Any]  # of the window: see `state.apply`
    points: tuple[float, float] | None  # where the cursor is said to be, as shares of the window from the upper left
    click: tuple[float, float] | str | None  # such a place whose patch is explained, or what `Explainer.find` looks for
    lens: float  # magnification of the glass at the cursor; 0 for none
    brush: bool  # whether the brush is taken
    fits: bool  # whether the colours of errors end at the bound of the first side, in a window of any size
    store: bool  # whether a store of the map is shown
    rows: int  # of the window for which its tolerances are meant: they grow with the window; 0 for any window
    before: Any  # the view of the frame before, from which jumps are measured; None for no measurement


def read_lecture(path: str | None = None) -> list[Station]:
    """The stations of a file; by default the stations that come with the package.

    Raises
    ------
    UsageError
        The file is no lecture; the message names the station that is wrong.
    """
    try:
        text = Path(path).read_text("utf-8") if path else files(__package__).joinpath("lecture.json").read_text("utf-8")
        stations = json.loads(text)["stations"]
        return [_station(entry, f"{path or 'lecture.json'}, station {i}") for i, entry in enumerate(stations, 1)]
    except OSError as error:
        raise UsageError(f"{path}: {error.strerror}") from None
    except (ValueError, KeyError, TypeError, IndexError, AttributeError) as error:
        raise UsageError(f'{path}: no lecture, expected {{"stations": [...]}} ({error})') from None


def _station(entry: dict[str, Any], where: str) -> Station:
    rest = {key: value for key, value in entry.items() if key not in _OWN}
    says = tuple(map(str, entry["says"]))
    asks, sees, answers = str(entry["asks"]), *(str(entry.get(name, "")) for name in ("sees", "answers"))
    for sentence in (*says, asks, answers):
        try:
            sentence.format_map(dict.fromkeys(_NAMES, ""))
        except (KeyError, ValueError, IndexError) as error:
            raise UsageError(f"{where}: numbers are {', '.join(_NAMES)}; got {error}") from None
    click = entry.get("click")
    if isinstance(click, str) and click not in (HIDDEN, BOX):
        raise UsageError(f"{where}: click: expected a place, {HIDDEN!r} or {BOX!r}, got {click!r}")
    at = click if isinstance(click, str) else _pair(click)
    own = (
        _pair(entry.get("points")),
        at,
        float(entry.get("lens", 0.0)),
        bool(entry.get("brush")),
        bool(entry.get("fits")),
        bool(entry.get("store")),
        int(entry.get("rows", 0)),
        entry.get("before"),
    )
    checked({"view": entry.get("before") or FIRST}, where)
    return Station(str(entry["name"]), says, asks, sees, answers, checked(rest, where), *own)


def _pair(place: Any) -> tuple[float, float] | None:
    return (float(place[0]), float(place[1])) if place else None


class Lecture:
    """Shows the stations one after the other."""

    def __init__(
        self,
        stations: list[Station],
        scene: Scene,
        painter: Painter,
        explainer: Explainer,
        layers: Layers,
        sculpting: Sculpting,
        pointer: Pointer,
    ) -> None:
        self.stations = stations
        self.number: int | None = None  # of the shown station, from 0 on
        self.is_wanted = True  # whether stations are shown, also after another map was opened
        self._last = 0  # the station that was shown last
        self._fits = False  # whether the colours of errors are still to be fitted
        self._is_answered = False  # whether the answer of this station is shown
        self.jumps = JumpMeter(scene, painter)
        self.lacks = ""  # a sentence that says why a store is not shown
        self._scene = scene
        self._painter = painter
        self._explainer = explainer
        self._layers = layers
        self._sculpting = sculpting
        self._pointer = pointer
        self._before: Settings | None = None  # the user's own choices
        self._click: tuple[float, float] | str | None = None  # a patch that is explained when the picture is complete
        self._scales: dict[int, float] = {}  # by station, the end of the colours of errors that was found ahead

    @property
    def station(self) -> Station | None:
        return None if self.number is None else self.stations[self.number]

    @property
    def coming(self) -> Station | None:
        """The next station."""
        return None if self.number is None else next(iter(self.stations[self.number + 1 :]), None)

    def begin(self) -> None:
        """Show the first station, or the station that was shown last."""
        settings = self._scene.settings
        if self._before is None:
            self._before = replace(settings, sides=list(settings.sides))
        if self.number is None:  # otherwise another map is shown at this station
            settings.panel = settings.help = False
        self._show(self._last, travels=False)

    def go_to(self, number: int) -> None:
        """Travel to a station; the panel stays."""
        settings = self._scene.settings
        if self._before is None:
            self._before = replace(settings, sides=list(settings.sides))
        self._show(number, travels=True)

    def press(self, key: str) -> bool:
        """If a key belongs to the lecture, show the answer, the next or the previous station; whether it does."""
        if self.station is None or key not in (*NEXT, *BACK):
            return False
        if key in NEXT and self.station.answers and not self._is_answered:
            self._is_answered = True
            self._scene.window.refresh()
            return True
        number = (self.number or 0) + (1 if key in NEXT else -1)
        if 0 <= number < len(self.stations):
            self._show(number, travels=True)
        return True

    def end(self) -> None:
        """Restore the user's own choices; the camera stays."""
        self.number = None
        self.is_wanted = False
        self.jumps.follow(None)
        self._scene.frozen = None
        self._sculpting.brushing = False
        self._explainer.explanation = None
        if before := self._before:
            self._explainer.take_sides(before.sides)
            settings = self._scene.settings
            settings.panel, settings.divider, settings.sums = before.panel, before.divider, before.sums
            settings.lens, settings.swapped, settings.centred = before.lens, before.swapped, before.centred
        self._before = None
        self._scene.window.refresh()

    def step(self, settled: bool) -> None:
        """When the picture is complete, fit the colours of errors, explain the station's patch, and measure jumps."""
        self.jumps.step(settled)
        if settled and self._fits and not self._scene.controller.moving:
            self._fits = False
            if bound_px := self._painter.side_stats[0]["certified_max_error_px"]:
                self._scale(bound_px)
        if settled and self._click and not self._scene.controller.moving:
            click, self._click = self._click, None
            at = self._explainer.find(click) if isinstance(click, str) else self._px(click)
            if at:
                self._explainer.explain(*at)
        if settled and self.shows_all:
            self._prepare()

    @property
    def shows_all(self) -> bool:
        """Whether the present station shows all that it has, if its picture is complete."""
        station = self.station
        if station is None or self._fits or self._click or (station.store and not self._scene.is_paged):
            return False
        return not station.before or bool(self.jumps.sides)

    def _prepare(self) -> None:
        """Let the picture of the next station be drawn ahead, with what it shows over the land."""
        number, station, ahead = (self.number or 0) + 1, self.coming, self._painter.ahead
        if station is None or self._scene.is_paged or station.store or station.state.get("layers") is not None:
            return
        spec = spec_of(self._scene, self._state(station))
        if station.fits and ahead.done == spec and (bound_px := ahead.meshes[0].stats["certified_max_error_px"]):
            self._scales[number] = bound_px
        if station.fits and number in self._scales:
            spec = _fitted(spec, self._scales[number])
        ahead.want(spec, self._jumps_ahead(station))

    def _jumps_ahead(self, station: Station) -> After | None:
        if not station.before:
            return None
        before = self._scene.for_renderer(camera_of(self._scene, station.before))
        return partial(self.jumps.ahead_steps, before)

    @property
    def next_words(self) -> str:
        """What the next key shows."""
        return "answer" if self.station and self.station.answers and not self._is_answered else "next"

    def texts(self) -> tuple[list[str], str, str]:
        """The sentences, the question, and the answer if it is shown, with the numbers of the picture."""
        station = self.station
        assert station
        numbers = self._numbers()
        answer = station.answers if self._is_answered else ""
        says = [sentence.format_map(numbers) for sentence in station.says]
        if station.store and not self._scene.is_paged:
            says = [self.lacks]
        return says, station.asks.format_map(numbers), answer.format_map(numbers)

    def _px(self, share: tuple[float, float]) -> tuple[float, float]:
        width, height = self._scene.window.size
        return share[0] * width, share[1] * height

    def _show(self, number: int, travels: bool) -> None:
        station = self.stations[number]
        self.number = self._last = number
        self.is_wanted = True
        self._is_answered = False
        self._fits = station.fits
        self._explainer.explanation = None
        self._click = station.click
        apply(self._scene, self._explainer, self._layers, self._state(station), travels)
        if station.fits and (bound_px := self._scales.pop(number, None)):
            self._scale(bound_px)
        before = station.before and self._scene.for_renderer(camera_of(self._scene, station.before))
        self.jumps.follow(before or None)
        self._scene.settings.lens = station.lens
        if station.points:
            self._pointer.last = self._pointer.over_land = self._px(station.points)
        if station.brush != self._sculpting.brushing:
            self._sculpting.toggle()
        self._scene.window.refresh()

    def _state(self, station: Station) -> dict[str, Any]:
        """The state of a station for this window: a larger one shows the same mesh, if the station asks for that."""
        if not station.rows:
            return station.state
        larger = self._scene.window.size[1] / station.rows
        sides = [
            side | {"max_error_px": float(f"{larger * side['max_error_px']:.2g}")} if "max_error_px" in side else side
            for side in station.state.get("sides", [{}])
        ]
        return station.state | {"sides": sides}

    def _scale(self, end_px: float) -> None:
        """Let the colours of errors end there."""
        settings = self._scene.settings
        settings.sides = [side.otherwise(error_scale_px=end_px) for side in settings.sides]

    def _numbers(self) -> dict[str, str]:
        """The numbers of the last full picture; unknown while another picture is drawn."""
        columns, rows = self._painter.frame.posts
        every = 2 * (columns - 1) * (rows - 1)
        numbers = dict.fromkeys(_NAMES, UNKNOWN) | {"posts": f"{columns * rows:,}", "every": f"{every:,}"}
        numbers["apart"] = metres(min(self._scene.heightmap.spacing_m))
        if self._painter.drawn is None or not self._painter.frame.way.is_full:
            return numbers
        measured: list[dict[str, float] | None] = [*self._painter.side_measured, None, None]
        for end, stats, found_px in zip(("", "_right"), self._painter.side_stats, measured, strict=False):
            bound_px = stats.get("certified_max_error_px")
            error_px = achieved_px(stats, found_px)
            numbers |= {
                f"triangles{end}": f"{stats['triangles']:,}",
                f"patches{end}": f"{stats['patches']:,}",
                f"hidden{end}": f"{stats['patches_hidden']:,}",
                f"percent{end}": f"{100 * stats['triangles'] / every:.2g} %",
                f"bound{end}": "no bound" if bound_px is None else f"{bound_px:.3g} px",
                f"cracks{end}": f"{stats['cracks']:,}" if "cracks" in stats else "no",
                f"achieved{end}": MEASURING if error_px is None else f"{error_px:.3g} px",
            }
        if streaming := self._scene.renderer.streaming:
            stored = streaming.terrain.heightmap
            every_tile = sum(math.prod(stored.pages(level)) for level in range(stored.top + 1))
            resident = max(int(stats.get("tiles_resident", 0)) for stats in self._painter.side_stats)
            numbers |= {"tiles": f"{resident:,}", "all_tiles": f"{every_tile:,}"}
        jumps = self.jumps
        for side, (end, found) in enumerate(zip(("", "_right"), jumps.sides, strict=False)):
            bound_px = found.bound_px
            numbers |= {
                f"jump{end}": f"{found.largest_px:.3g} px",
                f"jump_bound{end}": "no bound" if bound_px is None else f"{bound_px:.3g} px",
                f"jumps{end}": f"{jumps.over(side):,}",
            }
        if jumps.sides:
            numbers |= {"moved": metres(jumps.moved_m), "limit": f"{jumps.limit_px:.3g} px"}
        if len(self._painter.side_stats) > 1:
            left, right = (stats["triangles"] for stats in self._painter.side_stats)
            numbers["times"] = f"{max(left, right) / max(min(left, right), 1):.3g}"
        return numbers


def _fitted(spec: FrameSpec, end_px: float) -> FrameSpec:
    """The same picture, with colours of errors that end there."""
    return replace(spec, sides=tuple(side.otherwise(error_scale_px=end_px) for side in spec.sides))
