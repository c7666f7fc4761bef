"""Moves the camera by keys and mouse; it knows no window.

Events set the wanted velocity, and `step` moves the camera in time. The motion is the exact solution of
v' = (wanted − v) / τ, so it is the same at any frame rate. There are three modes: `fly` anywhere, `orbit` around the
middle of the picture, and `walk` on the ground at eye height.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, field

import numpy as np

from ..camera import Camera, Vector
from ..heightmap import Heightmap
from ..verify.holes import ground_m

MODES = ("fly", "orbit", "walk")
EASE_S = 0.12  # τ
TRAVEL_S = 0.8  # to a bookmark
LOOK_DEG = 0.1  # per pixel of mouse
ORBIT_DEG = 0.3
TURN_DEG_S = 40.0  # of arrow keys, and of orbiting by keys
APPROACH = 0.6  # in orbit, the distance falls by a factor of e^0.6 each second
WHEEL = 1.25  # speed factor of one notch
FAST = 5.0  # speed factor of Shift
CLEARANCE = 0.3  # least height above ground, in spacings: three times the distance of the near plane
EYE_HEIGHT_M = 1.7  # of a walker; less on maps with a small spacing
STEEPEST_DEG = 89.9
_MOVES = {"w": (0, 0, 1), "s": (0, 0, -1), "d": (1, 0, 0), "a": (-1, 0, 0), "e": (0, 1, 0), "q": (0, -1, 0)}
_TURNS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}
MOVE_KEYS = (*_MOVES, *_TURNS, "shift")


@dataclass(frozen=True)
class Pose:
    """Place and direction of the camera: metres; degrees, azimuth clockwise from north."""

    eye: Vector
    azimuth_deg: float
    elevation_deg: float
    fov_deg: float

    @classmethod
    def of(cls, camera: Camera) -> Pose:
        """The pose of a camera that is not rolled."""
        east, north, up = camera.forward
        _, top, _ = camera.axes
        steep = math.hypot(east, north) < 1e-6  # straight down: the top of the picture gives the azimuth
        azimuth = math.degrees(math.atan2(*(top[:2] if steep else (east, north))))
        return cls(camera.eye, azimuth, _not_too_steep(math.degrees(math.asin(up))), camera.fov_deg)

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): world directions right, up and forward, one a row."""
        a, e = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        right = np.array([math.cos(a), -math.sin(a), 0.0])
        forward = np.array([math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), math.sin(e)])
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def camera(self) -> Camera:
        """The camera with this pose."""
        x, y, z = np.asarray(self.eye) + self.axes[2]
        return Camera(self.eye, (x, y, z), self.fov_deg)

    def towards(self, other: Pose, share: float) -> Pose:
        """A pose on the way to another, `share` 0 to 1; the camera turns the short way."""
        before, after = np.array([*self.eye, *astuple(self)[1:]]), np.array([*other.eye, *astuple(other)[1:]])
        turn = after - before
        turn[3] = (turn[3] + 180) % 360 - 180
        x, y, z, azimuth, elevation, fov = (float(v) for v in before + share * turn)
        return Pose((x, y, z), azimuth % 360, elevation, fov)


@dataclass
class Controller:
    """Moves the camera over one map.

    Parameters
    ----------
    heightmap
        The ground.
    start
        The first camera; `home` goes back to it.
    bookmarks
        Poses by number, 1 to 9.

    Attributes
    ----------
    pivot
        The point in world metres that the camera swings around; None if there is none.
    """

    heightmap: Heightmap
    start: Camera
    above_ground: bool = True
    bookmarks: dict[int, Pose] = field(default_factory=dict)
    held: set[str] = field(default_factory=set)
    mode: str = "fly"
    eye: np.ndarray = field(init=False)
    azimuth_deg: float = field(init=False)
    elevation_deg: float = field(init=False)
    fov_deg: float = field(init=False)

    def __post_init__(self) -> None:
        afoot = max(2.0, max(self.heightmap.spacing_m)) if self.eye_height_m == EYE_HEIGHT_M else self.eye_height_m
        self._speeds_m_s = {"fly": 0.03 * max(self.heightmap.extent_m), "walk": afoot}
        self.pose = Pose.of(self.start)

    @property
    def pose(self) -> Pose:
        """Place and direction of the camera; setting it stops all motion."""
        x, y, z = (float(v) for v in self.eye)
        return Pose((x, y, z), self.azimuth_deg, self.elevation_deg, self.fov_deg)

    @pose.setter
    def pose(self, pose: Pose) -> None:
        self._take(pose)
        self._velocity = np.zeros(3)  # m/s; in orbit: azimuth and elevation in °/s, log distance in 1/s
        self.pivot: np.ndarray | None = None
        self._travel: tuple[Pose, Pose, float] | None = None

    @property
    def camera(self) -> Camera:
        """The camera; at first exactly the one that was given, to the last digit."""
        return self.start if self.pose == Pose.of(self.start) else self.pose.camera

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): world directions right, up and forward, one a row."""
        return self.pose.axes

    @property
    def moving(self) -> bool:
        """Whether `step` would change the camera."""
        return bool(self._travel or self._turning or self._wanted().any() or self._velocity.any())

    @property
    def height_above_ground_m(self) -> float:
        """Metres; NaN over voids and outside the map."""
        return float(self.eye[2] - ground_m(self.heightmap, self.eye[:2])[0])

    @property
    def speed_m_s(self) -> float:
        """Speed of the moving keys; a walker has another one."""
        return self._speeds_m_s["walk" if self.mode == "walk" else "fly"]

    @speed_m_s.setter
    def speed_m_s(self, speed: float) -> None:
        self._speeds_m_s["walk" if self.mode == "walk" else "fly"] = speed

    @property
    def eye_height_m(self) -> float:
        """Height of a walker's eye above ground, in metres."""
        return min(EYE_HEIGHT_M, 3 * min(self.heightmap.spacing_m))

    @property
    def near_m(self) -> float | None:
        """Distance of the near plane that a walker needs to see the ground; None in other modes."""
        return 0.2 * self.eye_height_m if self.mode == "walk" else None

    # --- Places -------------------------------------------------------------------------------------------------------

    def home(self) -> None:
        """Go back to the first view."""
        self.mode = "fly"
        self.pose = Pose.of(self.start)

    def set_bookmark(self, number: int) -> None:
        """Set a bookmark, 1 to 9, at this pose."""
        self.bookmarks[number] = self.pose

    def go_to(self, number: int) -> bool:
        """Travel to a bookmark; False if it is not set."""
        if number in self.bookmarks:
            self.mode = "fly"
            self.pivot = None
            self._travel = self.pose, self.bookmarks[number], 0.0
        return number in self.bookmarks

    def change_mode(self, mode: str) -> None:
        """Fly, orbit around the middle of the picture, or walk on the ground below."""
        self.mode, self._velocity, self.pivot, self._travel = mode, np.zeros(3), None, None
        if mode == "orbit":
            self.grab(0.0, 0.0)
        elif mode == "walk":
            self._step_on_ground(self.eye)

    # --- Events -------------------------------------------------------------------------------------------------------

    def press(self, key: str) -> None:
        """A key goes down: w a s d q e move, arrows turn, shift makes moves fast."""
        self.held.add(key)
        self._travel = self._travel if key == "shift" else None

    def let_go(self, key: str) -> None:
        """A key comes up."""
        self.held.discard(key)

    def let_go_all(self) -> None:
        """Release all keys, because the window has lost the keyboard."""
        self.held.clear()
        self.release()

    def look(self, dx_px: float, dy_px: float) -> None:
        """Turn the camera by a motion of the mouse, in pixels right and down."""
        self._travel = None
        self._turn(LOOK_DEG * dx_px, -LOOK_DEG * dy_px)

    def grab(self, x: float, y: float) -> None:
        """Take the ground at a point of the picture as the pivot; x and y are tangents right and up from its middle.

        In the sky, the pivot is the ground in the middle; without that, a point as far away as the map is wide.
        """
        rays = ((x, y), (0.0, 0.0))
        hits = (hit_ground(self.heightmap, self.eye, np.array([*at, 1.0]) @ self.axes) for at in rays)
        beyond = self.eye + max(self.heightmap.extent_m) * self.axes[2]
        self.pivot = next((hit for hit in hits if hit is not None), beyond)

    def orbit(self, dx_px: float, dy_px: float) -> None:
        """Swing around the pivot, which keeps its place in the picture."""
        if self.pivot is None:
            self.grab(0.0, 0.0)
        self._swing(ORBIT_DEG * dx_px, -ORBIT_DEG * dy_px, 0.0)

    def release(self) -> None:
        """Forget the pivot, except in orbit."""
        self.pivot = self.pivot if self.mode == "orbit" else None

    def zoom(self, notches: float) -> None:
        """Change the field of view; positive notches magnify."""
        self.fov_deg = min(max(self.fov_deg * 0.9**notches, 1.0), 120.0)

    def wheel(self, notches: float) -> None:
        """Change the speed; positive notches are faster."""
        reach = max(self.heightmap.extent_m)
        self.speed_m_s = min(max(self.speed_m_s * WHEEL**notches, 1e-5 * reach), 10 * reach)

    # --- Time ---------------------------------------------------------------------------------------------------------

    def step(self, seconds: float) -> None:
        """Move for some seconds."""
        if self._travel:
            self._travel_on(seconds)
            return
        azimuth, elevation = self._turning or (0, 0)
        self._turn(TURN_DEG_S * seconds * azimuth, TURN_DEG_S * seconds * elevation)
        moved = self._ease(seconds)
        if not moved.any():
            return
        if self.mode == "orbit":
            self._swing(*moved)
        elif self.mode == "walk":
            self._step_on_ground(self.eye + moved)
        else:
            self.eye = self.eye + moved
            self._stay_above_ground()

    def _ease(self, seconds: float) -> np.ndarray:
        """The integral of the velocity, which approaches the wanted one."""
        wanted = self._wanted()
        kept = math.exp(-seconds / EASE_S)
        moved = wanted * seconds + (self._velocity - wanted) * EASE_S * (1 - kept)
        self._velocity = wanted + (self._velocity - wanted) * kept
        slow = 0.002 * (1.0 if self.mode == "orbit" else self.speed_m_s)
        if not wanted.any() and np.linalg.norm(self._velocity) < slow:
            self._velocity = np.zeros(3)
        return moved

    def _wanted(self) -> np.ndarray:
        """The velocity that the held keys ask for."""
        right, up, forward = np.sum([_MOVES[key] for key in self.held if key in _MOVES] or [(0, 0, 0)], axis=0)
        fast = FAST if "shift" in self.held else 1.0
        if self.mode == "orbit":
            return fast * np.array([-TURN_DEG_S * right, -TURN_DEG_S * up, APPROACH * forward])
        flat = self.mode == "walk"
        ahead = np.cross([0, 0, 1], self.axes[0]) if flat else self.axes[2]
        direction = right * self.axes[0] + forward * ahead + [0, 0, 0 if flat else up]
        length = np.linalg.norm(direction)
        return direction * fast * self.speed_m_s / length if length > 1e-9 else np.zeros(3)

    @property
    def _turning(self) -> tuple[int, int] | None:
        """Right and up, −1 to 1, by the arrow keys; None if they hold still."""
        turns = [_TURNS[key] for key in self.held if key in _TURNS]
        right, up = (sum(turn[i] for turn in turns) for i in (0, 1))
        return (right, up) if right or up else None

    def _travel_on(self, seconds: float) -> None:
        assert self._travel
        start, end, share = self._travel
        share = min(1.0, share + seconds / TRAVEL_S)
        self._take(start.towards(end, share * share * (3 - 2 * share)))
        self._travel = (start, end, share) if share < 1 else None

    def _take(self, pose: Pose) -> None:
        self.eye = np.array(pose.eye)
        self.azimuth_deg, self.elevation_deg, self.fov_deg = pose.azimuth_deg, pose.elevation_deg, pose.fov_deg

    def _turn(self, azimuth_deg: float, elevation_deg: float) -> None:
        self.azimuth_deg = (self.azimuth_deg + azimuth_deg) % 360
        self.elevation_deg = _not_too_steep(self.elevation_deg + elevation_deg)

    def _swing(self, azimuth_deg: float, elevation_deg: float, closer: float) -> None:
        """Turn around the pivot, and divide the distance by e^closer; the pivot keeps its place in the picture."""
        assert self.pivot is not None
        offset = self.axes @ (self.pivot - self.eye)
        self._turn(azimuth_deg, elevation_deg)
        self.eye = self.pivot - math.exp(-closer) * offset @ self.axes
        self._stay_above_ground()

    def _stay_above_ground(self) -> None:
        if self.above_ground:
            lowest = ground_m(self.heightmap, self.eye[:2])[0] + CLEARANCE * min(self.heightmap.spacing_m)
            self.eye[2] = np.fmax(self.eye[2], lowest)

    def _step_on_ground(self, eye: np.ndarray) -> None:
        """Go there if there is ground; voids and the edge of the map stop a walker."""
        ground = ground_m(self.heightmap, eye[:2])[0]
        if np.isfinite(ground):
            self.eye = np.array([eye[0], eye[1], ground + self.eye_height_m])


def _not_too_steep(elevation_deg: float) -> float:
    return min(max(elevation_deg, -STEEPEST_DEG), STEEPEST_DEG)


def hit_ground(heightmap: Heightmap, eye: np.ndarray, ray: np.ndarray) -> np.ndarray | None:
    """The first place where a ray meets the ground, or None: ray marching with growing steps, then bisection."""
    near, far = min(heightmap.spacing_m), 4 * np.hypot(*heightmap.extent_m) + 2 * np.linalg.norm(eye)
    t = np.geomspace(near, max(far, 2 * near), 4000) / np.linalg.norm(ray)
    points = eye + t[:, None] * ray
    below = np.flatnonzero(points[:, 2] < ground_m(heightmap, points[:, :2]))
    if not len(below):
        return None
    first, last = t[max(below[0] - 1, 0)], t[below[0]]
    for _ in range(30):
        middle = 0.5 * (first + last)
        point = eye + middle * ray
        under = point[2] < ground_m(heightmap, point[:2])[0]
        first, last = (first, middle) if under else (middle, last)
    return eye + last * ray
