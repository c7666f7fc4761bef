"""Input → camera: what keys and mouse mean, without a window.

The controller holds where the eye is and how fast it moves; events change what is wanted, `step` moves on in time. The
motion is the exact solution of v' = (wanted − v) / τ, so it is the same at any frame rate. There are three ways to
move: `fly` anywhere, `orbit` around what was in the middle of the picture, `walk` on the ground at eye height.
"""

from __future__ import annotations

import math
from dataclasses import astuple, dataclass, field

import numpy as np

from ..camera import Camera, Vector
from ..heightmap import Heightmap
from ..holes import ground_m

MODES = ("fly", "orbit", "walk")
EASE_S = 0.12  # time constant of speeding up and slowing down
TRAVEL_S = 0.8  # to a bookmark
LOOK_DEG = 0.1  # per pixel of mouse
ORBIT_DEG = 0.3
TURN_DEG_S = 40.0  # of arrow keys, and of orbiting by keys
APPROACH = 0.6  # e-foldings of the distance a second
WHEEL = 1.25  # speed factor of one notch
FAST = 5.0  # speed factor of Shift
CLEARANCE = 0.3  # least height above ground in flight, in spacings: three times the near plane's distance
EYE_HEIGHT_M = 1.7  # on foot; less on maps whose posts are closer together than that
STEEPEST_DEG = 89.9
_MOVES = {"w": (0, 0, 1), "s": (0, 0, -1), "d": (1, 0, 0), "a": (-1, 0, 0), "e": (0, 1, 0), "q": (0, -1, 0)}
_TURNS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}
MOVE_KEYS = (*_MOVES, *_TURNS, "shift")


@dataclass(frozen=True)
class Pose:
    """Where the eye is and where it looks: metres; degrees, azimuth clockwise from north."""

    eye: Vector
    azimuth_deg: float
    elevation_deg: float
    fov_deg: float

    @classmethod
    def of(cls, camera: Camera) -> Pose:
        """The pose of a camera whose `up` is up."""
        east, north, up = camera.forward
        _, top, _ = camera.axes
        steep = math.hypot(east, north) < 1e-6  # looking straight down: the picture's top tells the azimuth
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
        """The camera there."""
        x, y, z = np.asarray(self.eye) + self.axes[2]
        return Camera(self.eye, (x, y, z), self.fov_deg)

    def towards(self, other: Pose, share: float) -> Pose:
        """On the way to another pose, turning the short way."""
        before, after = np.array([*self.eye, *astuple(self)[1:]]), np.array([*other.eye, *astuple(other)[1:]])
        turn = after - before
        turn[3] = (turn[3] + 180) % 360 - 180
        x, y, z, azimuth, elevation, fov = (float(v) for v in before + share * turn)
        return Pose((x, y, z), azimuth % 360, elevation, fov)


@dataclass
class Controller:
    """State of the flight.

    Parameters
    ----------
    heightmap
        The ground to stay above.
    start
        Camera at the beginning, and where `home` leads back.
    bookmarks
        Poses by number, 1 to 9.
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
        """Where the eye is; setting it stops all motion."""
        x, y, z = (float(v) for v in self.eye)
        return Pose((x, y, z), self.azimuth_deg, self.elevation_deg, self.fov_deg)

    @pose.setter
    def pose(self, pose: Pose) -> None:
        self._take(pose)
        self._velocity = np.zeros(3)  # flying: m/s in the world; in orbit: degrees a second, twice, and e-foldings
        self._pivot: np.ndarray | None = None
        self._travel: tuple[Pose, Pose, float] | None = None

    @property
    def camera(self) -> Camera:
        """The camera as it is now: at the beginning just the one that was given, not one that looks the same way."""
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
        """Of held keys; on foot another than in flight."""
        return self._speeds_m_s["walk" if self.mode == "walk" else "fly"]

    @speed_m_s.setter
    def speed_m_s(self, speed: float) -> None:
        self._speeds_m_s["walk" if self.mode == "walk" else "fly"] = speed

    @property
    def eye_height_m(self) -> float:
        """Metres above ground on foot."""
        return min(EYE_HEIGHT_M, 3 * min(self.heightmap.spacing_m))

    @property
    def near_m(self) -> float | None:
        """Where the near plane must stand so that the ground in front of the feet is seen; None: anywhere."""
        return 0.2 * self.eye_height_m if self.mode == "walk" else None

    # --- Places -------------------------------------------------------------------------------------------------------

    def home(self) -> None:
        """Go back to the first view."""
        self.mode = "fly"
        self.pose = Pose.of(self.start)

    def set_bookmark(self, number: int) -> None:
        """Remember this view."""
        self.bookmarks[number] = self.pose

    def go_to(self, number: int) -> bool:
        """Travel to a view that was remembered; False if there is none."""
        if number in self.bookmarks:
            self.mode = "fly"
            self._pivot = None
            self._travel = self.pose, self.bookmarks[number], 0.0
        return number in self.bookmarks

    def change_mode(self, mode: str) -> None:
        """Fly, orbit around what is in the middle of the picture, or walk on the ground below."""
        self.mode, self._velocity, self._pivot, self._travel = mode, np.zeros(3), None, None
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
        """The window lost the keyboard: nobody will tell of keys that come up."""
        self.held.clear()
        self.release()

    def look(self, dx_px: float, dy_px: float) -> None:
        """Turn the head by a mouse motion, pixels right and down."""
        self._travel = None
        self._turn(LOOK_DEG * dx_px, -LOOK_DEG * dy_px)

    def grab(self, x: float, y: float) -> None:
        """Take hold of the ground under a point of the picture, x and y as tangents right and up from its middle.

        Where there is only sky, of the ground in the middle, and else of a point as far away as the map is wide.
        """
        rays = ((x, y), (0.0, 0.0))
        hits = (hit_ground(self.heightmap, self.eye, np.array([*at, 1.0]) @ self.axes) for at in rays)
        beyond = self.eye + max(self.heightmap.extent_m) * self.axes[2]
        self._pivot = next((hit for hit in hits if hit is not None), beyond)

    def orbit(self, dx_px: float, dy_px: float) -> None:
        """Swing around what was grabbed, which stays where it is in the picture."""
        if self._pivot is None:
            self.grab(0.0, 0.0)
        self._swing(ORBIT_DEG * dx_px, -ORBIT_DEG * dy_px, 0.0)

    def release(self) -> None:
        """Let go of what was grabbed, unless it is what one orbits around."""
        self._pivot = self._pivot if self.mode == "orbit" else None

    def zoom(self, notches: float) -> None:
        """Change the field of view; away from the user is nearer."""
        self.fov_deg = min(max(self.fov_deg * 0.9**notches, 1.0), 120.0)

    def wheel(self, notches: float) -> None:
        """Change the speed; away from the user is faster."""
        reach = max(self.heightmap.extent_m)
        self.speed_m_s = min(max(self.speed_m_s * WHEEL**notches, 1e-5 * reach), 10 * reach)

    # --- Time ---------------------------------------------------------------------------------------------------------

    def step(self, seconds: float) -> None:
        """Move on in time."""
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
        """What the velocity adds up to on its way to the wanted one."""
        wanted = self._wanted()
        kept = math.exp(-seconds / EASE_S)
        moved = wanted * seconds + (self._velocity - wanted) * EASE_S * (1 - kept)
        self._velocity = wanted + (self._velocity - wanted) * kept
        slow = 0.002 * (1.0 if self.mode == "orbit" else self.speed_m_s)
        if not wanted.any() and np.linalg.norm(self._velocity) < slow:
            self._velocity = np.zeros(3)
        return moved

    def _wanted(self) -> np.ndarray:
        """Velocity that the held keys ask for; up and down are the world's."""
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
        """Right and up, as the arrow keys say."""
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
        """Turn around the pivot, which stays where it is in the picture, and come nearer by e-foldings."""
        assert self._pivot is not None
        offset = self.axes @ (self._pivot - self.eye)
        self._turn(azimuth_deg, elevation_deg)
        self.eye = self._pivot - math.exp(-closer) * offset @ self.axes
        self._stay_above_ground()

    def _stay_above_ground(self) -> None:
        if self.above_ground:
            lowest = ground_m(self.heightmap, self.eye[:2])[0] + CLEARANCE * min(self.heightmap.spacing_m)
            self.eye[2] = np.fmax(self.eye[2], lowest)

    def _step_on_ground(self, eye: np.ndarray) -> None:
        """Go where there is ground to stand on; voids and the map's edge stop the walker."""
        ground = ground_m(self.heightmap, eye[:2])[0]
        if np.isfinite(ground):
            self.eye = np.array([eye[0], eye[1], ground + self.eye_height_m])


def _not_too_steep(elevation_deg: float) -> float:
    return min(max(elevation_deg, -STEEPEST_DEG), STEEPEST_DEG)


def hit_ground(heightmap: Heightmap, eye: np.ndarray, ray: np.ndarray) -> np.ndarray | None:
    """Where a ray from the eye first meets the ground, if it does: marched in growing steps, then halved."""
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
