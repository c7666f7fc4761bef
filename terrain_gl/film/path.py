"""A camera path: keyframes, in a file or in memory, and the flight through them.

The eye follows a centripetal Catmull-Rom curve through the keyframes, at constant speed or at the times that the
keyframes give. Orientation, field of view and sun follow curves of the same kind (terrain_gl/film/spline.py).
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.inputs import check_input
from ..basics.replacing import replacing
from ..camera import UP, Camera, Vector
from . import spline

PIECES = 512  # straight pieces between two keyframes; they differ from the curve by about a millionth of its length
LEVEL_DEG = 70.0  # the horizon stays level if the view is less steep than this
MAX_KEYFRAMES = 10_000
MAX_BYTES = 1 << 24  # largest file of keyframes
_ENTRY = ("eye", "target", "direction", "up", "fov", "sun", "seconds")
_FILE = ("keyframes", "closed", "seconds")


@dataclass(frozen=True)
class Keyframe:
    """A view that a path passes through."""

    camera: Camera
    seconds: float | None = None  # the time from the start; None for constant speed
    sun: tuple[float, float] | None = None  # azimuth and elevation in degrees; None to leave the sun unchanged


class FlightFrame(NamedTuple):
    """The camera of one frame, and the sun if the keyframes have one."""

    camera: Camera
    sun: tuple[float, float] | None


class CameraPath:
    """A flight through keyframes.

    Parameters
    ----------
    keyframes
        At least two.
    closed
        Whether the flight returns from the last keyframe to the first.
    seconds
        The duration. A closed path with timed keyframes needs it. The last timed keyframe of an open path overrides it.

    Attributes
    ----------
    eyes
        (n, 3) world metres: the path of the eye in straight pieces.
    length_m
        The length of that path.

    Raises
    ------
    UsageError
        Too few keyframes or too many; only some of them have a time or a sun; times do not start at 0 and increase; or
        a duration out of range. If a keyframe is wrong, the message names it.
    """

    def __init__(self, keyframes: Sequence[Keyframe], closed: bool = False, seconds: float | None = None) -> None:
        self.keyframes = tuple(keyframes)
        self.closed = closed
        _check(self.keyframes, closed, seconds)
        timed = self.keyframes[0].seconds is not None
        self.seconds = self.keyframes[-1].seconds if timed and not closed else seconds
        self._level = all(keyframe.camera.up is None for keyframe in self.keyframes)
        self._values = _padded(np.array([_values(k) for k in self.keyframes]), closed, spline.lerp)
        self._values[:, 4] = np.unwrap(self._values[:, 4], period=360)
        turns = np.array([spline.quaternion_from_axes(k.camera.axes) for k in self.keyframes])
        self._turns = spline.the_short_way(_padded(spline.the_short_way(turns), closed, spline.slerp))
        self._knots = spline.centripetal_knots(self._values[:, :3])
        self.eyes = self._way()
        self.length_m = float(np.linalg.norm(np.diff(self.eyes, axis=0), axis=1).sum())
        self._paces = self._measured()
        times = [k.seconds for k in self.keyframes] + [seconds] * closed
        self._clock = np.array(times, float) if timed else self._paces[::PIECES]

    @classmethod
    def open(cls, path: str | os.PathLike[str], fov_deg: float = Camera.fov_deg) -> CameraPath:
        """Read a path from a JSON file (docs/flight.md); `fov_deg` is the field of view of keyframes without one.

        Raises
        ------
        TerrainError
            The file is not valid. The message names the file and the entry.
        """
        name = os.fspath(path)
        try:
            return _parsed(_load(name), fov_deg)
        except UsageError as error:
            raise TerrainError(f"{name}: {error}") from None

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a file for `open`; it appears only when it is complete."""
        content: dict[str, Any] = {"closed": self.closed, "seconds": self.seconds}
        content["keyframes"] = [_entry(keyframe) for keyframe in self.keyframes]
        with replacing(path) as part:
            part.write_text(json.dumps(_given(content), indent=1) + "\n", "utf-8")

    @property
    def parts(self) -> np.ndarray:
        """(n,) the time of each keyframe, as a part of the flight's duration, 0 to 1."""
        return (self._clock / self._clock[-1])[: len(self.keyframes)]

    def at(self, part: float) -> FlightFrame:
        """The view at a time, given as a part of the flight's duration, 0 to 1."""
        pace = spline.monotone(self._clock, self._paces[::PIECES], part * self._clock[-1])
        legs = np.interp(pace, self._paces, np.arange(len(self._paces)) / PIECES)
        leg = min(int(legs), len(self._values) - 4)
        t = self._knots[leg + 1] + (legs - leg) * (self._knots[leg + 2] - self._knots[leg + 1])
        _, zoom, azimuth, elevation = np.split(self._curve(self._values, leg, t, spline.lerp), [3, 4, 5])
        turn = self._curve(self._turns, leg, t, spline.slerp)
        eye = np.array([np.interp(pace, self._paces, axis) for axis in self.eyes.T])
        camera = _camera(eye, spline.axes_from_quaternion(turn), float(np.exp(zoom[0])), self._level)
        sun = float(azimuth[0]) % 360, float(np.clip(elevation[0], -90, 90))
        return FlightFrame(camera, sun if self.keyframes[0].sun else None)

    def poses(self, count: int) -> Iterator[FlightFrame]:
        """Yield `count` views at equal time steps.

        On an open path they run from the first keyframe to the last. On a closed path they end one step before the
        first keyframe comes again.
        """
        for i in range(count):
            yield self.at(i / (count if self.closed else max(count - 1, 1)))

    def _curve(self, values: np.ndarray, leg: int, t: Any, blend: spline.Blend) -> np.ndarray:
        return spline.catmull_rom(values[leg : leg + 4], self._knots[leg : leg + 4], t, blend)

    def _way(self) -> np.ndarray:
        """(legs · PIECES + 1, 3) points along the curve."""
        legs = range(len(self._values) - 3)
        u = np.arange(PIECES) / PIECES
        knots = self._knots
        times = [knots[i + 1] + u * (knots[i + 2] - knots[i + 1]) for i in legs]
        places = [self._curve(self._values[:, :3], i, t, spline.lerp) for i, t in zip(legs, times, strict=True)]
        return np.concatenate([*places, self._values[-2:-1, :3]])

    def _measured(self) -> np.ndarray:
        """(n,) distance along the path, for constant speed. Where the eye only turns, the angle counts as distance.

        A leg is the path between two keyframes. A right angle counts as much as an average leg.
        """
        steps = np.linalg.norm(np.diff(self.eyes, axis=0), axis=1).reshape(-1, PIECES)
        moving = np.diff(self._values[1:-1, :3], axis=0).any(1)
        right_angle = steps[moving].sum(1).mean() if moving.any() else 1.0
        cosines = np.abs(np.sum(self._turns[1:-2] * self._turns[2:-1], -1))
        turns = 2 * np.arccos(np.minimum(cosines, 1)) / (0.5 * math.pi)
        steps[~moving] = right_angle * np.maximum(turns, 0.1)[~moving, None] / PIECES
        return np.concatenate([[0.0], np.cumsum(steps)])


def _padded(values: np.ndarray, closed: bool, blend: spline.Blend) -> np.ndarray:
    """Values (n, k) with the neighbours that the curve needs: of the other end, or extrapolated on an open path."""
    if closed:
        return np.concatenate([values[-1:], values, values[:2]])
    before, after = blend(values[1], values[0], np.array(2.0)), blend(values[-2], values[-1], np.array(2.0))
    return np.concatenate([before[None], values, after[None]])


def _values(keyframe: Keyframe) -> list[float]:
    """Eye, logarithm of the field of view (so that zooms are even), and sun."""
    return [*keyframe.camera.eye, math.log(keyframe.camera.fov_deg), *(keyframe.sun or (0.0, 0.0))]


def _camera(eye: np.ndarray, axes: np.ndarray, fov_deg: float, level: bool) -> Camera:
    """A camera with these axes; if it does not look steeply up or down, the horizon is made level."""
    _, up, forward = axes
    share = min(math.hypot(*forward[:2]) / math.cos(math.radians(LEVEL_DEG)), 1.0)
    if level:
        share *= share * (3 - 2 * share)
        up = share * np.array(UP) + (1 - share) * up
    return Camera(_vector(eye), _vector(eye + forward), min(max(fov_deg, 0.1), 170.0), _vector(up))


def _vector(values: np.ndarray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def _check(keyframes: Sequence[Keyframe], closed: bool, seconds: float | None) -> None:
    if not 2 <= len(keyframes) <= MAX_KEYFRAMES:
        raise UsageError(f"a path takes 2 to {MAX_KEYFRAMES} keyframes, got {len(keyframes)}")
    for i, keyframe in enumerate(keyframes, 1):
        if keyframe.camera.lens:
            raise UsageError(f"keyframe {i}: a path has no lenses: give Camera(eye, target, fov_deg)")
    for name in ("seconds", "sun"):
        named = [getattr(keyframe, name) is not None for keyframe in keyframes]
        if any(named) and not all(named):
            raise UsageError(f"keyframe {named.index(False) + 1}: no {name}, but others have it: give all or none")
    if seconds is not None and not 0 < seconds < 1e6:
        raise UsageError(f"seconds: expected more than 0 and less than a million, got {seconds:g}")
    if keyframes[0].seconds is not None:
        _check_times([float(k.seconds or 0) for k in keyframes], closed, seconds)


def _check_times(times: Sequence[float], closed: bool, seconds: float | None) -> None:
    if times[0] != 0:
        raise UsageError(f"keyframe 1: the flight starts at second 0, not {times[0]:g}")
    for i in range(1, len(times)):
        if not times[i - 1] < times[i] < 1e6:
            raise UsageError(f"keyframe {i + 1}: second {times[i]:g} does not come after {times[i - 1]:g}")
    if closed and (seconds is None or seconds <= times[-1]):
        raise UsageError(f'"seconds" must say when the path is back at keyframe 1, after {times[-1]:g}')


def _load(name: str) -> Any:
    check_input(name, "name a file of keyframes", MAX_BYTES)
    try:
        with open(name, encoding="utf-8") as file:
            return json.load(file)
    except json.JSONDecodeError as error:
        raise UsageError(f"not JSON: line {error.lineno}, column {error.colno}: {error.msg}") from None
    except (ValueError, RecursionError):  # not UTF-8, a number of thousands of digits, or too many brackets
        raise UsageError("not JSON: its text cannot be read") from None
    except OSError as error:
        raise UsageError(f"cannot read: {error.strerror}") from None


def _parsed(content: Any, fov_deg: float) -> CameraPath:
    entries = content.get("keyframes") if isinstance(content, dict) else content
    if not isinstance(entries, list):
        raise UsageError('expected {"keyframes": [...]}, a list of views')
    settings = content if isinstance(content, dict) else {}
    _check_names("the path", settings, _FILE)
    keyframes = [_keyframe(f"keyframe {i}", entry, fov_deg) for i, entry in enumerate(entries, 1)]
    closed = settings.get("closed", False)
    if not isinstance(closed, bool):
        raise UsageError(f"closed: expected true or false, got {_shown(closed)}")
    return CameraPath(keyframes, closed, _numbers("seconds", settings.get("seconds"), 1))


def _keyframe(name: str, entry: Any, fov_deg: float) -> Keyframe:
    if not isinstance(entry, dict):
        raise UsageError(f'{name}: expected {{"eye": [X, Y, Z], "target": [X, Y, Z]}}, got {_shown(entry)}')
    _check_names(name, entry, _ENTRY)
    eye, target, direction, up = (_numbers(f"{name}: {key}", entry.get(key), 3) for key in _ENTRY[:4])
    if eye is None or (target is None) == (direction is None):
        raise UsageError(f"{name}: expected an eye, and either a target or a direction")
    fov = _numbers(f"{name}: fov", entry.get("fov", fov_deg), 1)
    if target is None:
        target = tuple(np.add(eye, direction).tolist())
    sun = _numbers(f"{name}: sun", entry.get("sun"), 2)
    if sun and abs(sun[1]) > 90:
        raise UsageError(f"{name}: sun: expected [azimuth, elevation], the elevation from -90 to 90, got {sun[1]:g}")
    try:
        camera = Camera(eye, target, fov, up)
    except UsageError as error:
        raise UsageError(f"{name}: {error}") from None
    return Keyframe(camera, _numbers(f"{name}: seconds", entry.get("seconds"), 1), sun)


def _check_names(name: str, found: dict[str, Any], known: Sequence[str]) -> None:
    for key in found:
        if key not in known:
            raise UsageError(f"{name}: does not know {_shown(key)}: expected {', '.join(known)}")


def _numbers(name: str, value: Any, count: int) -> Any:
    """None, a finite number, or a tuple of `count` numbers if `count` is more than 1."""
    if value is None:
        return None
    values = value if isinstance(value, list) else [value]
    real = all(isinstance(v, (int, float)) and not isinstance(v, bool) and abs(v) < 1e12 for v in values)
    if len(values) != count or isinstance(value, list) != (count > 1) or not real:
        expected = "a number" if count == 1 else f"a list of {count} numbers"
        raise UsageError(f"{name}: expected {expected}, got {_shown(value)}")
    return tuple(map(float, values)) if count > 1 else float(value)


def _shown(value: object) -> str:
    text = json.dumps(value)
    return text if len(text) <= 40 else text[:37] + "..."


def _entry(keyframe: Keyframe) -> dict[str, Any]:
    camera = keyframe.camera
    values = {"eye": camera.eye, "target": camera.target, "up": camera.up, "fov": camera.fov_deg}
    return _given(values | {"sun": keyframe.sun, "seconds": keyframe.seconds})


def _given(values: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in values.items() if value is not None}
