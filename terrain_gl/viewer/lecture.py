"""A lecture: stations, each with a state of the window, sentences in large type and a question.

The lecture that comes with the package is lecture.json.

Sentences may name numbers of the picture, such as {triangles}; the window fills them in, so that they are true.
"""

import json
from dataclasses import dataclass, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from ..basics.exceptions import UsageError
from .explainer import Explainer
from .frame_stats import achieved_px
from .painter import Painter
from .scene import Scene
from .settings import Settings
from .state import apply, checked

NEXT = "space", "right", "page down"
BACK = "left", "page up"
UNKNOWN = "…"  # a number that is not measured yet
_NUMBERS = ("posts", "every", "triangles", "patches", "percent", "bound", "achieved", "cracks", "hidden")
_NAMES = (*_NUMBERS, *(f"{name}_right" for name in _NUMBERS[2:]))


@dataclass(frozen=True)
class Station:
    """A station of a lecture."""

    name: str
    says: tuple[str, ...]
    asks: str
    state: dict[str, Any]  # of the window: see `state.apply`
    click: tuple[float, float] | None  # the place whose patch is explained, as shares of the window from the upper left


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
    rest = {key: value for key, value in entry.items() if key not in ("name", "says", "asks", "click")}
    says = tuple(map(str, entry["says"]))
    for sentence in (*says, entry["asks"]):
        try:
            sentence.format_map(dict.fromkeys(_NAMES, ""))
        except (KeyError, ValueError, IndexError) as error:
            raise UsageError(f"{where}: numbers are {', '.join(_NAMES)}; got {error}") from None
    click = entry.get("click")
    at = (float(click[0]), float(click[1])) if click else None
    return Station(str(entry["name"]), says, str(entry["asks"]), checked(rest, where), at)


class Lecture:
    """Shows the stations one after the other."""

    def __init__(self, stations: list[Station], scene: Scene, painter: Painter, explainer: Explainer) -> None:
        self.stations = stations
        self.number: int | None = None  # of the shown station, from 0 on
        self._scene = scene
        self._painter = painter
        self._explainer = explainer
        self._before: Settings | None = None  # the user's own choices
        self._click: tuple[float, float] | None = None  # a patch that is explained when the picture is complete

    @property
    def station(self) -> Station | None:
        return None if self.number is None else self.stations[self.number]

    def begin(self) -> None:
        """Show the first station. If another map was opened, show the same station again."""
        settings = self._scene.settings
        if self._before is None:
            self._before = replace(settings, sides=list(settings.sides))
        settings.panel = settings.help = False
        settings.lens = 0.0
        self._show(self.number or 0, travels=False)

    def press(self, key: str) -> bool:
        """If a key belongs to the lecture, show the next or the previous station; returns whether it does."""
        if self.number is None or key not in (*NEXT, *BACK):
            return False
        number = self.number + (1 if key in NEXT else -1)
        self._show(min(max(number, 0), len(self.stations) - 1), travels=True)
        return True

    def end(self) -> None:
        """Restore the user's own choices; the camera stays."""
        self.number = None
        self._scene.frozen = None
        self._explainer.explanation = None
        if before := self._before:
            self._explainer.take_sides(before.sides)
            settings = self._scene.settings
            settings.panel, settings.divider, settings.sums = before.panel, before.divider, before.sums
        self._before = None

    def step(self, settled: bool) -> None:
        """Explain the patch of the station when the picture is complete."""
        if settled and self._click and not self._scene.controller.moving:
            width, height = self._scene.window.size
            x, y = self._click
            self._click = None
            self._explainer.explain(x * width, y * height)

    def texts(self) -> tuple[list[str], str]:
        """The sentences and the question, with the numbers of the picture."""
        station = self.station
        assert station
        numbers = self._numbers()
        return [sentence.format_map(numbers) for sentence in station.says], station.asks.format_map(numbers)

    def _show(self, number: int, travels: bool) -> None:
        self.number = number
        self._explainer.explanation = None
        self._click = self.stations[number].click
        apply(self._scene, self._explainer, self.stations[number].state, travels)
        self._scene.window.refresh()

    def _numbers(self) -> dict[str, str]:
        """The numbers of the last full picture; unknown while another picture is drawn."""
        columns, rows = self._painter.frame.posts
        every = 2 * (columns - 1) * (rows - 1)
        numbers = dict.fromkeys(_NAMES, UNKNOWN) | {"posts": f"{columns * rows:,}", "every": f"{every:,}"}
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
                f"achieved{end}": UNKNOWN if error_px is None else f"{error_px:.3g} px",
            }
        return numbers
