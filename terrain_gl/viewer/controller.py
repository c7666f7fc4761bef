"""Input → camera: what keys and mouse mean, without a window.

The controller holds where the eye is and how fast it moves; events change what is wanted, `step` moves on in time. The
motion is the exact solution of v' = (wanted − v) / τ, so it is the same at any frame rate.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from ..camera import Camera
from ..heightmap import Heightmap
from ..holes import ground_m

EASE_S = 0.12  # time constant of speeding up and slowing down
LOOK_DEG = 0.1  # per pixel of mouse
ORBIT_DEG = 0.3
WHEEL = 1.25  # speed factor of one notch
FAST = 5.0  # speed factor of Shift
CLEARANCE = 0.3  # least height above ground, in spacings: three times the near plane's distance
STEEPEST_DEG = 89.9
_MOVES = {"w": (0, 0, 1), "s": (0, 0, -1), "d": (1, 0, 0), "a": (-1, 0, 0), "e": (0, 1, 0), "q": (0, -1, 0)}


@dataclass
class Controller:
    """State of the flight. Angles in degrees, azimuth clockwise from north; metres; right, up, forward.

    Parameters
    ----------
    heightmap
        The ground to stay above.
    start
        Camera at the beginning, and where `home` leads back.
    """

    heightmap: Heightmap
    start: Camera
    above_ground: bool = True
    held: set[str] = field(default_factory=set)

    def __post_init__(self) -> None:
        self.speed_m_s = 0.03 * max(self.heightmap.extent_m)
        self.home()

    def home(self) -> None:
        """Go back to the first view."""
        self.eye = np.array(self.start.eye)
        east, north, up = self.start.forward
        _, top, _ = self.start.axes
        steep = math.hypot(east, north) < 1e-6  # looking straight down: the picture's top tells the azimuth
        self.azimuth_deg = math.degrees(math.atan2(*(top[:2] if steep else (east, north))))
        self.elevation_deg = min(max(math.degrees(math.asin(up)), -STEEPEST_DEG), STEEPEST_DEG)
        self.fov_deg = self.start.fov_deg
        self._velocity = np.zeros(3)  # m/s in the world
        self._pivot: np.ndarray | None = None

    @property
    def camera(self) -> Camera:
        """The camera as it is now."""
        return Camera(tuple(self.eye), tuple(self.eye + self.axes[2]), self.fov_deg)

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): world directions right, up and forward, one a row."""
        a, e = math.radians(self.azimuth_deg), math.radians(self.elevation_deg)
        right = np.array([math.cos(a), -math.sin(a), 0.0])
        forward = np.array([math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), math.sin(e)])
        return np.stack([right, np.cross(right, forward), forward])

    @property
    def moving(self) -> bool:
        """Whether `step` would change the camera."""
        return bool(self._wanted().any() or self._velocity.any())

    @property
    def height_above_ground_m(self) -> float:
        """Metres; NaN over voids and outside the map."""
        return float(self.eye[2] - ground_m(self.heightmap, self.eye[:2])[0])

    # --- Events -------------------------------------------------------------------------------------------------------

    def press(self, key: str) -> None:
        """A key goes down: w a s d q e move, shift makes them fast."""
        self.held.add(key)

    def let_go(self, key: str) -> None:
        """A key comes up."""
        self.held.discard(key)

    def let_go_all(self) -> None:
        """The window lost the keyboard: nobody will tell of keys that come up."""
        self.held.clear()
        self._pivot = None

    def look(self, dx_px: float, dy_px: float) -> None:
        """Turn the head by a mouse motion, pixels right and down."""
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
        offset = self.axes @ (self._pivot - self.eye)
        self._turn(ORBIT_DEG * dx_px, -ORBIT_DEG * dy_px)
        self.eye = self._pivot - offset @ self.axes
        self._stay_above_ground()

    def release(self) -> None:
        """Let go of what was grabbed."""
        self._pivot = None

    def wheel(self, notches: float) -> None:
        """Change the speed; away from the user is faster."""
        reach = max(self.heightmap.extent_m)
        self.speed_m_s = min(max(self.speed_m_s * WHEEL**notches, 1e-5 * reach), 10 * reach)

    # --- Time ---------------------------------------------------------------------------------------------------------

    def step(self, seconds: float) -> None:
        """Move on in time."""
        wanted = self._wanted()
        kept = math.exp(-seconds / EASE_S)
        self.eye = self.eye + wanted * seconds + (self._velocity - wanted) * EASE_S * (1 - kept)
        self._velocity = wanted + (self._velocity - wanted) * kept
        if not wanted.any() and np.linalg.norm(self._velocity) < 0.002 * self.speed_m_s:
            self._velocity = np.zeros(3)
        self._stay_above_ground()

    def _wanted(self) -> np.ndarray:
        """Velocity that the held keys ask for; up and down are the world's."""
        right, up, forward = np.sum([_MOVES[key] for key in self.held if key in _MOVES] or [(0, 0, 0)], axis=0)
        direction = right * self.axes[0] + forward * self.axes[2] + [0, 0, up]
        length = np.linalg.norm(direction)
        speed = self.speed_m_s * (FAST if "shift" in self.held else 1.0)
        return direction * speed / length if length > 1e-9 else np.zeros(3)

    def _turn(self, azimuth_deg: float, elevation_deg: float) -> None:
        self.azimuth_deg = (self.azimuth_deg + azimuth_deg) % 360
        self.elevation_deg = min(max(self.elevation_deg + elevation_deg, -STEEPEST_DEG), STEEPEST_DEG)

    def _stay_above_ground(self) -> None:
        if self.above_ground:
            lowest = ground_m(self.heightmap, self.eye[:2])[0] + CLEARANCE * min(self.heightmap.spacing_m)
            self.eye[2] = np.fmax(self.eye[2], lowest)


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
