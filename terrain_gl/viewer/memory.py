"""Settings that the window remembers from one run to the next, in one small JSON file.

The file is $XDG_STATE_HOME/terrain-gl/view.json, by default under ~/.local/state (XDG Base Directory Specification
0.8). If it cannot be read or written, the window works without it, and `complaint` says why in one line.
"""

import json
import os
from contextlib import suppress
from dataclasses import asdict
from pathlib import Path
from typing import Any

from ..basics.exceptions import TerrainError
from ..basics.replacing import replacing
from ..renderer.options import CHOICES, FrameOptions
from .pose import Pose
from .settings import UI_SCALES, Settings
from .state import checked

MOST_MAPS = 50
MOST_RECENT = 8
_REMEMBERED = ("max_error_px", "metric", "method", "style")  # not `triangles`: a number of triangles suits only one map


class Memory:
    """The size of the window, render options, and the views and look of each map; without a path, nothing is saved."""

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self.complaint = ""  # a line about a problem with the file
        self.window: tuple[int, int] | None = None  # width and height in screen coordinates
        self.options: dict[str, Any] = {}  # fields of `FrameOptions`
        self.panel = True  # whether the panel was shown
        self.ui_scale = 1.0
        self._maps: dict[str, Any] = {}  # by key, the latest last
        if path and path.exists():
            self._read(path)

    def note(self, settings: Settings, options: FrameOptions) -> None:
        """Store the user's choices."""
        self.panel = settings.panel
        self.ui_scale = settings.ui_scale
        self.options = {key: value for key in _REMEMBERED if (value := getattr(options, key)) is not None}

    def knows(self, key: str) -> bool:
        """Whether a map was shown before."""
        return key in self._maps

    def bookmarks(self, key: str) -> dict[int, dict[str, Any]]:
        """The bookmarks of a map by number, as `state.state_of` gives them."""
        stored: Any = self._map(key).get("states")
        found = {}
        for n in range(1, 10):
            try:
                Pose.read(stored[str(n)]["view"])  # a bookmark has a place of its own, not the name of a view
                found[n] = checked(stored[str(n)], "bookmark")
            except (TerrainError, TypeError, ValueError, OverflowError, KeyError):
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
        self._maps.pop(key, None)
        states = {str(n): state for n, state in bookmarks.items()}
        self._maps[key] = {"pose": asdict(pose), "look": look, "states": states}
        self._maps = dict(list(self._maps.items())[-MOST_MAPS:])

    def recent(self, besides: str = "") -> list[str]:
        """Paths of the maps that were shown last, the latest first, without files that are gone."""
        paths = [key for key in reversed(self._maps) if key != besides and os.path.isabs(key)]
        return [path for path in paths if os.path.isfile(path)][:MOST_RECENT]

    def save(self) -> None:
        if self.path is None:
            return
        data: dict[str, Any] = {"window": self.window, "drawing": self.options, "panels": {"panel": self.panel}}
        data |= {"ui_scale": self.ui_scale, "maps": self._maps}
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            with replacing(self.path) as part:
                part.write_text(json.dumps(data, indent=1) + "\n", "utf-8")
        except (OSError, TerrainError) as error:
            self.complaint = f"the window's state was not saved: {error}"

    def _read(self, path: Path) -> None:
        """Read the file; values that cannot be used are left out."""
        try:
            data: Any = json.loads(path.read_text("utf-8"))
        except (OSError, ValueError, RecursionError) as error:
            self.complaint = f"{path} is not readable and was ignored: {error}"
            return
        if not isinstance(data, dict):
            self.complaint = f"{path} holds no settings and was ignored"
            return
        self._maps = _dict(data.get("maps"))
        self.panel = _dict(data.get("panels")).get("panel") is not False
        with suppress(KeyError, TypeError, ValueError, OverflowError):
            width, height = (int(side) for side in data["window"])
            self.window = (width, height) if 64 <= min(width, height) <= max(width, height) <= 16384 else None
        with suppress(KeyError, TypeError, ValueError, OverflowError):
            scale = float(data["ui_scale"])
            self.ui_scale = scale if UI_SCALES[0] <= scale <= UI_SCALES[1] else 1.0
        with suppress(TerrainError, TypeError, ValueError, OverflowError):
            stored = {key: value for key, value in _dict(data.get("drawing")).items() if key in _REMEMBERED}
            FrameOptions(**stored)
            self.options = stored

    def _map(self, key: str) -> dict[str, Any]:
        return _dict(self._maps.get(key))


def _dict(stored: object) -> dict[str, Any]:
    return stored if isinstance(stored, dict) else {}
