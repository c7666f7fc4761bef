"""Settings that the window remembers from one run to the next, in one small JSON file.

The file is $XDG_STATE_HOME/terrain-gl/view.json, by default under ~/.local/state (XDG Base Directory Specification
0.8). If it cannot be read or written, the window works without it, and `complaint` says why in one line.
"""

import json
import os
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..basics.exceptions import TerrainError
from ..basics.replacing import replacing
from ..renderer.options import CHOICES, RenderOptions
from .pose import Pose
from .settings import UI_SCALES
from .state import checked

MOST_MAPS = 50
MOST_RECENT = 8
_REMEMBERED = ("max_error_px", "metric", "method", "style")  # not `triangles`: a number of triangles suits only one map


class Memory:
    """The size of the window, render options, and the views and look of each map.

    Parameters
    ----------
    path
        The file; None to remember nothing.

    Attributes
    ----------
    complaint
        A line about a problem with the file; "" if there is none.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.complaint = ""
        self._data: dict[str, Any] = {}
        if path and path.exists():
            self._read(path)

    @property
    def window(self) -> tuple[int, int] | None:
        """Width and height of the window in screen coordinates."""
        try:
            width, height = (int(side) for side in self._data["window"])
        except (KeyError, TypeError, ValueError, OverflowError):
            return None
        return (width, height) if 64 <= min(width, height) <= max(width, height) <= 16384 else None

    @window.setter
    def window(self, size: tuple[int, int]) -> None:
        self._data["window"] = list(size)

    @property
    def options(self) -> dict[str, Any]:
        """Fields of `RenderOptions` as the last run left them."""
        stored = self._part("drawing")
        given = {key: stored[key] for key in _REMEMBERED if key in stored}
        try:
            RenderOptions(**given)
        except (TerrainError, TypeError, ValueError):
            return {}
        return given

    @options.setter
    def options(self, options: RenderOptions) -> None:
        lasting = {key: getattr(options, key) for key in _REMEMBERED}
        self._data["drawing"] = {key: value for key, value in lasting.items() if value is not None}

    @property
    def panel(self) -> bool:
        """Whether the panel was shown."""
        return self._part("panels").get("panel") is not False

    @panel.setter
    def panel(self, shown: bool) -> None:
        self._data["panels"] = {"panel": shown}

    @property
    def ui_scale(self) -> float:
        """Factor of the sizes of type and panels."""
        stored = self._data.get("ui_scale")
        if isinstance(stored, int | float) and UI_SCALES[0] <= stored <= UI_SCALES[1]:
            return float(stored)
        return 1.0

    @ui_scale.setter
    def ui_scale(self, scale: float) -> None:
        self._data["ui_scale"] = scale

    def knows(self, key: str) -> bool:
        """Whether a map was shown before."""
        return key in self._part("maps")

    def bookmarks(self, key: str) -> dict[int, dict[str, Any]]:
        """The bookmarks of a map by number, as `state.state_of` gives them."""
        stored: Any = self._map(key).get("states")
        found = {}
        for n in range(1, 10):
            try:
                Pose.read(stored[str(n)]["view"])  # a bookmark has a place of its own, not the name of a view
                found[n] = checked(stored[str(n)], "bookmark")
            except (TerrainError, TypeError, ValueError, KeyError):
                continue
        return found

    def last_pose(self, key: str) -> Pose | None:
        """The last view of a map."""
        try:
            pose = Pose.read(self._map(key)["pose"])
            _ = pose.camera  # checks its numbers
        except (KeyError, TypeError, ValueError, OverflowError, TerrainError):
            return None
        return pose

    def look(self, key: str) -> str | None:
        """The last look of a map's land, one of `light.climate.NAMES`; None if it is not known."""
        stored = self._map(key).get("look")
        return stored if stored in CHOICES["look"] else None

    def note_map(self, key: str, pose: Pose, bookmarks: dict[int, dict[str, Any]], look: str) -> None:
        """Store the views and the look of a map. Only the latest maps are remembered."""
        maps = self._part("maps")
        maps.pop(key, None)
        states = {str(n): state for n, state in bookmarks.items()}
        maps[key] = {"pose": asdict(pose), "look": look, "states": states}
        self._data["maps"] = dict(list(maps.items())[-MOST_MAPS:])

    def recent(self, besides: str = "") -> list[str]:
        """Paths of the maps that were shown last, the latest first, without files that are gone."""
        paths = [key for key in reversed(self._part("maps")) if key != besides and os.path.isabs(key)]
        return [path for path in paths if os.path.isfile(path)][:MOST_RECENT]

    def save(self) -> None:
        if self.path is None:
            return
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(self.path) as part:
                part.write_text(json.dumps(self._data, indent=1) + "\n", "utf-8")
        except (OSError, TerrainError) as error:
            self.complaint = f"the window's state was not saved: {error}"

    def _read(self, path: Path) -> None:
        try:
            data = json.loads(path.read_text("utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            self.complaint = f"{path} is not readable and was ignored: {error}"
            return
        if isinstance(data, dict):
            self._data = data
        else:
            self.complaint = f"{path} holds no settings and was ignored"

    def _part(self, name: str) -> dict[str, Any]:
        part = self._data.get(name)
        return dict(part) if isinstance(part, dict) else {}

    def _map(self, key: str) -> dict[str, Any]:
        entry = self._part("maps").get(key)
        return entry if isinstance(entry, dict) else {}
