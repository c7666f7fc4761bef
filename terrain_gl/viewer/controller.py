"""Moves the camera by keys and mouse, independent of the window system.

Events set the wanted velocity, and `step` moves the camera in time. The motion is the exact solution of
v' = (wanted − v) / τ, so it is the same at any frame rate. There are three modes: `fly` anywhere, `orbit` around the
middle of the picture, and `walk` on the ground at eye height.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

from ..camera import Camera
from ..heightmap import Heightmap, ground_m
from .pose import Pose, hit_ground, not_too_steep, on_map, raised, vector

MODES = ("fly", "orbit", "walk")
EASE_S = 0.12  # τ
TRAVEL_S = 0.8  # duration of a travel to a bookmark
LOOK_DEG = 0.1  # degrees that the camera turns for each pixel of the mouse
ORBIT_DEG = 0.3  # degrees around the pivot for each pixel of the mouse
TURN_DEG_S = 40.0  # speed of turning, or orbiting, by keys
APPROACH = 0.6  # in orbit, the distance falls by a factor of e^0.6 each second
WHEEL = 1.25  # factor of one notch: of the speed, or of the distance to the place under the cursor
HEIGHTS_S = 0.4  # speed of flying: heights above the ground in a second
LOWEST = 5.0  # below this height above the ground, in spacings, flying gets no slower
NEARER = 0.3  # part of the distance that is left after flying to a place
FROM_ABOVE_DEG = -25.0  # elevation at which a place that the user names is seen, or steeper
OVER_PLACE = 0.1  # its distance, in lengths of the map's longer side
FARTHEST_PAN = 4.0  # a drag reaches at most this many times the distance of the place where it began
FARTHEST_MAPS = 30.0  # largest distance of the eye from the middle of the map, in lengths of its longer side
FAST = 5.0  # speed factor of Shift
CLEARANCE = 0.3  # least height above ground, in spacings: three times the distance of the near plane
EYE_HEIGHT_M = 1.7  # height of a walker's eye; less on maps with a small spacing
_MOVES = {"w": (0, 0, 1), "s": (0, 0, -1), "d": (1, 0, 0), "a": (-1, 0, 0), "e": (0, 1, 0), "q": (0, -1, 0)}
_TURNS = {"left": (-1, 0), "right": (1, 0), "up": (0, 1), "down": (0, -1)}
MOVE_KEYS = (*_MOVES, *_TURNS, "shift")


@dataclass
class Controller:
    """Moves the camera over one map. All places are those of the ground as it is drawn."""

    heightmap: Heightmap
    start: Camera  # the first camera; `home` goes back to it
    above_ground: bool = True  # whether the camera must stay above the ground
    held: set[str] = field(default_factory=set)  # keys that are down
    mode: str = "fly"
    exaggeration: float = 1.0  # the ground is drawn this many times as high as the heightmap says
    bend_per_m: float = 0.0  # of the ground in the picture: `Camera.bend_per_m`
    tour_deg_s: float = 0.0  # a tour: the turn around the middle without a key, in mode orbit
    eye: np.ndarray = field(init=False)
    azimuth_deg: float = field(init=False)
    elevation_deg: float = field(init=False)
    fov_deg: float = field(init=False)

    def __post_init__(self) -> None:
        afoot = max(2.0, max(self.heightmap.spacing_m)) if self.eye_height_m == EYE_HEIGHT_M else self.eye_height_m
        self._paces = {"fly": HEIGHTS_S, "walk": afoot}  # in a second: heights above the ground, or metres
        self.pose = Pose.of(self.start)

    @property
    def pose(self) -> Pose:
        """Place and direction of the camera; setting it stops all motion, except that of keys that are held.

        In orbit, the pivot is then what is in the middle of the picture.
        """
        x, y, z = (float(v) for v in self.eye)
        return Pose((x, y, z), self.azimuth_deg, self.elevation_deg, self.fov_deg)

    @pose.setter
    def pose(self, pose: Pose) -> None:
        self._take(pose)
        self._velocity = np.zeros(3)  # m/s; in orbit: azimuth and elevation in °/s, log distance in 1/s
        self.pivot: np.ndarray | None = None  # the point that the camera swings around
        self._grabbed_m = 0.0  # distance of the pivot when it was taken
        self._travel: tuple[Pose, Pose, float] | None = None
        if self.mode == "orbit":
            self.grab(0.0, 0.0)

    @property
    def camera(self) -> Camera:
        """The camera. At first it is the given camera, to the last digit."""
        return self.camera_at(self.pose)

    def camera_at(self, pose: Pose) -> Camera:
        """The camera at a pose."""
        return replace(self.start if pose == Pose.of(self.start) else pose.camera, bend_per_m=self.bend_per_m)

    @property
    def axes(self) -> np.ndarray:
        """(3, 3): world directions right, up and forward, one a row."""
        return self.pose.axes

    @property
    def moving(self) -> bool:
        """Whether `step` would change the camera."""
        return bool(self._travel or self._turning.any() or self._wanted().any() or self._velocity.any())

    @property
    def height_above_ground_m(self) -> float:
        """Height of the eye above the ground in metres; NaN over voids and outside the map."""
        return float(self.eye[2] - self._ground_m(self.eye))

    @property
    def speed_m_s(self) -> float:
        """Speed at which keys move the camera. It grows with the height above the ground, except for a walker."""
        return self._paces["walk"] if self.mode == "walk" else self._paces["fly"] * self._altitude_m

    @speed_m_s.setter
    def speed_m_s(self, speed: float) -> None:
        if self.mode == "walk":
            self._paces["walk"] = speed
        else:
            self._paces["fly"] = speed / self._altitude_m

    @property
    def _altitude_m(self) -> float:
        """Height that sets the speed: above the ground, or above the map's lowest post where there is no ground."""
        height_m = self.height_above_ground_m
        height_m = float(self.eye[2]) - self._lowest_m if math.isnan(height_m) else height_m
        return max(abs(height_m), LOWEST * min(self.heightmap.spacing_m))

    def _ground_m(self, place: np.ndarray) -> float:
        """Height of the drawn ground; NaN over voids and outside the map."""
        return self.exaggeration * float(ground_m(self.heightmap, place[:2])[0])

    @property
    def _lowest_m(self) -> float:
        return self.exaggeration * self.heightmap.range_m[0]

    @property
    def eye_height_m(self) -> float:
        """Height of a walker's eye above ground, in metres."""
        return min(EYE_HEIGHT_M, 3 * min(self.heightmap.spacing_m))

    @property
    def near_m(self) -> float | None:
        """Distance of the near plane that a walker needs to see the ground; None in other modes."""
        return 0.2 * self.eye_height_m if self.mode == "walk" else None

    # --- Places -------------------------------------------------------------------------------------------------------

    def exaggerate(self, factor: float) -> None:
        """Draw the ground `factor` times as high as it is; the eye keeps its place over it."""
        ratio = factor / self.exaggeration
        self.exaggeration = factor
        self.start = replace(self.start, eye=raised(self.start.eye, ratio), target=raised(self.start.target, ratio))
        self.pose = replace(self.pose, eye=raised(self.pose.eye, ratio))
        self.change_mode(self.mode)

    def home(self) -> None:
        """Go back to the first view."""
        self.mode = "fly"
        self.pose = Pose.of(self.start)

    def change_mode(self, mode: str) -> None:
        """Fly, orbit around the middle of the picture, or walk on the ground below."""
        self.mode = mode
        self._velocity = np.zeros(3)
        self.pivot = None
        self._travel = None
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
        """Take the ground at a point of the picture as the pivot.

        x and y are tangents, to the right and up from the middle. For a point in the sky, the pivot is the ground in
        the picture's middle. If this is sky, too, the pivot is in the air there, as far away as the map is long.
        """
        hits = (self.ground_at(*at) for at in ((x, y), (0.0, 0.0)))
        beyond = self.eye + max(self.heightmap.extent_m) * self.axes[2]
        self.pivot = next((hit for hit in hits if hit is not None), beyond)
        self._grabbed_m = float(np.linalg.norm(self.pivot - self.eye))

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

    def approach(self, x: float, y: float, notches: float) -> None:
        """Come nearer to the ground at a point of the picture, which stays where it is; tangents as of `grab`.

        In orbit, the camera comes nearer to its pivot instead. A walker does not move.
        """
        if self.mode == "walk":
            return
        self._travel = None
        kept = self.pivot
        if self.mode != "orbit":
            self.grab(x, y)
        self._swing(0.0, 0.0, notches * math.log(WHEEL))
        self.pivot = kept

    def pan(self, x: float, y: float) -> None:
        """Move horizontally until the pivot is seen at a point of the picture; tangents as of `grab`.

        The distance at the start of the drag limits how far the camera moves. The present distance would grow with each
        event above the horizon.
        """
        if self.pivot is None:
            self.grab(x, y)
        assert self.pivot is not None
        if self.mode == "walk":
            return
        away = self.pivot - self.eye
        ray = np.array([x, y, 1.0]) @ self.axes
        # distance at which the ray reaches the pivot's height; a ray above the horizon never does
        reach = away[2] / ray[2] if away[2] * ray[2] > 0 else math.inf
        reach = min(reach, FARTHEST_PAN * self._grabbed_m / float(np.linalg.norm(ray)))
        moved = away - reach * ray
        self._move_to(self.eye + [moved[0], moved[1], 0.0])

    def fly_to(self, x: float, y: float) -> bool:
        """Travel to the ground at a point of the picture, and look at it; False for the sky, and for a walker."""
        if (seen := self.ground_at(x, y)) is None or self.mode == "walk":
            return False
        place = on_map(seen, self.eye, self.bend_per_m)
        eye = place + NEARER * (self.eye - place)
        lowest = np.fmax(self._ground_m(eye), place[2]) + 2 * min(self.heightmap.spacing_m)
        eye[2] = np.fmax(eye[2], lowest)
        self.travel_to(Pose.of(Camera(vector(eye), vector(place), self.fov_deg)))
        return True

    def above(self, place: np.ndarray) -> Camera:
        """A camera that sees a place of the land, (3,) in world metres at true height, from above."""
        elevation = math.radians(min(self.elevation_deg, FROM_ABOVE_DEG))
        azimuth = math.radians(self.azimuth_deg)
        flat = math.cos(elevation)
        ahead = np.array([math.sin(azimuth) * flat, math.cos(azimuth) * flat, math.sin(elevation)])
        there = np.array(raised(vector(place), self.exaggeration))
        eye = there - OVER_PLACE * max(self.heightmap.extent_m) * ahead
        eye[2] = np.fmax(eye[2], self._ground_m(eye) + 2 * min(self.heightmap.spacing_m))
        return Camera(vector(eye), vector(there), self.fov_deg)

    def travel_to(self, pose: Pose) -> None:
        """Travel to a pose, flying."""
        self.mode = "fly"
        self.pivot = None
        self._travel = self.pose, pose, 0.0

    # --- Time ---------------------------------------------------------------------------------------------------------

    def step(self, seconds: float) -> None:
        if self._travel:
            self._travel_on(seconds)
            return
        self._turn(*TURN_DEG_S * seconds * self._turning)
        moved = self._ease(seconds)
        if not moved.any():
            return
        if self.mode == "orbit":
            self._swing(*moved)
        elif self.mode == "walk":
            self._step_on_ground(self.eye + moved)
        else:
            self._move_to(self.eye + moved)

    def _ease(self, seconds: float) -> np.ndarray:
        """The way in some seconds: the integral of the velocity, which approaches the wanted velocity."""
        wanted = self._wanted()
        kept = math.exp(-seconds / EASE_S)
        moved = wanted * seconds + (self._velocity - wanted) * EASE_S * (1 - kept)
        self._velocity = wanted + (self._velocity - wanted) * kept
        slow = 0.002 * (1.0 if self.mode == "orbit" else self.speed_m_s)
        if not wanted.any() and np.linalg.norm(self._velocity) < slow:
            self._velocity = np.zeros(3)
        return moved

    def _wanted(self) -> np.ndarray:
        """The velocity that the held keys demand."""
        right, up, forward = np.sum([_MOVES[key] for key in self.held if key in _MOVES] or [(0, 0, 0)], axis=0)
        fast = FAST if "shift" in self.held else 1.0
        if self.mode == "orbit":
            return fast * np.array([-TURN_DEG_S * right - self.tour_deg_s, -TURN_DEG_S * up, APPROACH * forward])
        flat = self.mode == "walk"
        ahead = np.cross([0, 0, 1], self.axes[0]) if flat else self.axes[2]
        direction = right * self.axes[0] + forward * ahead + [0, 0, 0 if flat else up]
        length = np.linalg.norm(direction)
        return direction * fast * self.speed_m_s / length if length > 1e-9 else np.zeros(3)

    @property
    def _turning(self) -> np.ndarray:
        """Right and up, −1 to 1, by the arrow keys."""
        return np.sum([_TURNS[key] for key in self.held if key in _TURNS] or [(0, 0)], axis=0)

    def _travel_on(self, seconds: float) -> None:
        assert self._travel
        start, end, share = self._travel
        share = min(1.0, share + seconds / TRAVEL_S)
        self._take(start.towards(end, share * share * (3 - 2 * share)))
        self._travel = (start, end, share) if share < 1 else None

    def _take(self, pose: Pose) -> None:
        self.eye = np.array(pose.eye)
        self.azimuth_deg = pose.azimuth_deg
        self.elevation_deg = pose.elevation_deg
        self.fov_deg = pose.fov_deg

    def _turn(self, azimuth_deg: float, elevation_deg: float) -> None:
        self.azimuth_deg = (self.azimuth_deg + azimuth_deg) % 360
        self.elevation_deg = not_too_steep(self.elevation_deg + elevation_deg)

    def _swing(self, azimuth_deg: float, elevation_deg: float, closer: float) -> None:
        """Turn around the pivot, and divide the distance by e^closer; the pivot keeps its place in the picture."""
        assert self.pivot is not None
        offset = self.axes @ (self.pivot - self.eye)
        self._turn(azimuth_deg, elevation_deg)
        self._move_to(self.pivot - math.exp(-closer) * offset @ self.axes)

    def _move_to(self, eye: np.ndarray) -> None:
        """Move the eye, but not far away from the map, and not below the ground if the camera must stay above it."""
        middle = np.array([*(0.5 * side for side in self.heightmap.extent_m), self._lowest_m])
        farthest = np.maximum(FARTHEST_MAPS * max(self.heightmap.extent_m), np.abs(self.eye - middle))
        self.eye = np.clip(eye, middle - farthest, middle + farthest)
        if self.above_ground:
            self.eye[2] = np.fmax(self.eye[2], self._ground_m(self.eye) + CLEARANCE * min(self.heightmap.spacing_m))

    def _step_on_ground(self, eye: np.ndarray) -> None:
        """Move the eye if there is ground. Voids and the edge of the map stop a walker."""
        ground = self._ground_m(eye)
        if math.isfinite(ground):
            self.eye = np.array([eye[0], eye[1], ground + self.eye_height_m])

    def ground_at(self, x: float, y: float) -> np.ndarray | None:
        """The ground at a point of the picture, as it is drawn; None for the sky. Tangents as of `grab`."""
        ray = np.array([x, y, 1.0]) @ self.axes
        return hit_ground(self.heightmap, self.eye, ray, self.bend_per_m, self.exaggeration)
