"""The camera: where the eye is, where it looks, and how metres become pixels."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import pyrr
from numpy.typing import ArrayLike

from ..basics.exceptions import UsageError
from .lens import Lens, lens_of_intrinsics, lens_of_projection, rigid

if TYPE_CHECKING:
    from ..heightmap import Heightmap

Vector = tuple[float, float, float]
UP = (0.0, 0.0, 1.0)
NORTH = (0.0, 1.0, 0.0)
NEAREST_M = 1e-9  # limits of distances and coordinates, so that squares of them are normal floats
FARTHEST_M = 1e12


@dataclass(frozen=True)
class Camera:
    """A pinhole camera in world metres (x east, y north, z up), or an orthographic camera.

    `from_opencv`, `from_matrices` and `orthographic` make cameras with a `lens`.

    Parameters
    ----------
    eye, target
        The position of the camera, and the point in the middle of its picture.
    fov_deg
        Vertical field of view in degrees.
    up
        The direction that points up in the picture; by default z, and north when the camera looks straight down or up.
    bend_per_m
        Curvature of the ground: at the distance r it is drawn ``bend_per_m · r²`` lower, and between posts it is
        bilinear, like the heights. `Renderer` sets this value by `Heightmap.bend_per_m`.
    lens
        What the picture shows, if that is not the symmetric field of view `fov_deg`.

    Raises
    ------
    UsageError
        Eye and target coincide, `up` is parallel to the view, the field of view is not from 0.1 to 170 degrees, or a
        coordinate is not finite or larger than `FARTHEST_M`.
    """

    eye: Vector
    target: Vector
    fov_deg: float = 50.0
    up: Vector | None = None
    bend_per_m: float = 0.0
    lens: Lens | None = None

    def __post_init__(self) -> None:
        for name in ("eye", "target", "up"):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, _vector(name, value))
        if self.lens is None and not 0.1 <= self.fov_deg <= 170:
            raise UsageError(f"field of view must lie between 0.1 and 170 degrees, got {self.fov_deg:g}")
        if math.dist(self.eye, self.target) < NEAREST_M:
            raise UsageError(f"eye and target are the same point {_text(self.eye)}: move one of them")
        if self.up is not None and _parallel(self.up, self.forward):
            raise UsageError(f"up {_text(self.up)} is parallel to the view: give another direction")

    @classmethod
    def from_opencv(cls, K: ArrayLike, R: ArrayLike, t: ArrayLike, size: tuple[int, int]) -> Camera:  # noqa: N803
        """The camera of a calibration, with the conventions of OpenCV.

        A world point X is at R X + t in the camera's axes (right, down, forward). Its place in the picture, in pixels,
        is (u, v), with (u w, v w, w) = K (R X + t). The middle of the first pixel, in the upper left corner, is (0, 0).

        Parameters
        ----------
        K
            (3, 3) intrinsic matrix: fx, fy, cx, cy. The focal lengths may differ, and the principal point may be
            anywhere.
        R, t
            (3, 3) rotation and (3,) translation. The eye is at -Rᵀ t, in world metres.
        size
            Width and height of the pictures in pixels. `Renderer.render` refuses pictures of another shape.

        Raises
        ------
        UsageError
            R is no rotation; or K has skew, or is no intrinsic matrix.
        """
        turn = rigid("R", R)
        lens = lens_of_intrinsics(K, size, turn * [[1.0], [-1.0], [1.0]])
        return cls._with_lens(-turn.T @ np.array(_vector("t", t)), lens)

    @classmethod
    def from_matrices(cls, view: ArrayLike, projection: ArrayLike) -> Camera:
        """The camera of two OpenGL matrices, for column vectors: clip = projection · view · (x, y, z, 1).

        Parameters
        ----------
        view
            (4, 4): a rotation and a translation, from world metres to the camera's axes (right, up, backward).
        projection
            (4, 4): perspective, also off-axis, or orthographic. Its third row, the depth, is not used: the near plane
            is the option `near_m`, and nothing is cut off far away.

        Raises
        ------
        UsageError
            `view` scales or shears, or `projection` is no projection of these kinds.
        """
        matrix = np.asarray(view, np.float64)
        if matrix.shape != (4, 4) or np.abs(matrix[3] - [0, 0, 0, 1]).max() > 1e-6:
            raise UsageError("view: expected a matrix of 4 x 4 whose last row is 0, 0, 0, 1")
        turn = rigid("view", matrix[:3, :3])
        lens = lens_of_projection(projection, turn * [[1.0], [1.0], [-1.0]])
        return cls._with_lens(-turn.T @ matrix[:3, 3], lens)

    @classmethod
    def orthographic(
        cls, eye: Vector, target: Vector, height_m: float, up: Vector | None = None, aspect: float | None = None
    ) -> Camera:
        """A camera with parallel rays: everything has the same scale, however far away it is.

        It shows all land in front of the plane through the eye. Curvature and haze have no effect on its pictures.

        Parameters
        ----------
        eye, target, up
            As for `Camera`: the picture's middle is on the line from the eye to the target.
        height_m
            Metres from the picture's lower to its upper edge, measured across the view.
        aspect
            Width over height; by default that of each picture, so its pixels are square.

        Raises
        ------
        UsageError
            A height that is not positive; or what `Camera` refuses.
        """
        if not NEAREST_M <= height_m <= FARTHEST_M:
            raise UsageError(f"orthographic: expected a height of more than 0 metres, got {height_m:g}")
        if aspect is not None and not 1e-6 <= aspect <= 1e6:
            raise UsageError(f"orthographic: expected an aspect of more than 0, got {aspect:g}")
        half = 0.5 * height_m
        wide = half * (aspect or 0.0)
        return cls(eye, target, up=up, lens=Lens((-wide, -half), (wide, half), is_orthographic=True))

    @classmethod
    def _with_lens(cls, eye: np.ndarray, lens: Lens) -> Camera:
        """The camera at a place that looks along the lens's own axes."""
        assert lens.axes is not None
        _, up, forward = np.array(lens.axes)
        away = 1.0 + float(np.abs(eye).max())  # so that rounding turns the direction no further than that of the eye
        fov_deg = Camera.fov_deg if lens.is_orthographic else lens.fov_deg
        return cls(_vector("eye", eye), _vector("target", eye + away * forward), fov_deg, _vector("up", up), lens=lens)

    @classmethod
    def default(cls, terrain: Heightmap, fov_deg: float = 45.0) -> Camera:
        """A view over the middle of the map, from the south, or from the west if the map is long from south to north.

        The picture shows about half of each side of the map, around its middle. It shows nearly all of a narrow map.
        """
        east, north = terrain.extent_m
        low, high = terrain.range_m
        yaw_deg = 105.0 if north > 1.5 * east else 15.0
        share = 0.45 if max(east, north) < 3 * min(east, north) else 0.9
        middle = (0.5 * east, 0.5 * north, 0.5 * (low + high))
        return cls.over(middle, (share * east, share * north, high - low), fov_deg, yaw_deg)

    @classmethod
    def over(cls, middle: Vector, size_m: Vector, fov_deg: float = 45.0, yaw_deg: float = 15.0) -> Camera:
        """A view from above in which a box fills a picture of 16:9.

        Parameters
        ----------
        middle, size_m
            Middle and size of the box, in world metres.
        yaw_deg
            The direction of the view, clockwise from north.
        """
        yaw, pitch = math.radians(yaw_deg), math.radians(17.0)
        forward = (math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch), -math.sin(pitch))
        view = cls((0.0, 0.0, 0.0), forward, fov_deg)
        corners = (np.indices((2, 2, 2)).reshape(3, 8) - 0.5) * np.asarray(size_m)[:, None]
        x, y, z = view.axes @ corners
        tan_x, tan_y = view.half_extent((16, 9))
        away = float(np.max([np.abs(x) / tan_x - z, np.abs(y) / tan_y - z]))
        eye = (middle[0] - away * forward[0], middle[1] - away * forward[1], middle[2] - away * forward[2])
        return cls(eye, middle, fov_deg)

    @cached_property
    def forward(self) -> np.ndarray:
        """(3,) unit vector of the view."""
        towards = np.subtract(self.target, self.eye)
        return towards / np.linalg.norm(towards)

    @cached_property
    def axes(self) -> np.ndarray:
        """(3, 3) float64: the world directions right, up and forward of the picture, one a row."""
        if self.lens and self.lens.axes:
            return np.array(self.lens.axes)
        up = self.up or (NORTH if _parallel(UP, self.forward) else UP)
        look = pyrr.matrix44.create_look_at(np.zeros(3), self.forward, np.asarray(up), dtype="f8")
        return look[:3, :3].T * [[1.0], [1.0], [-1.0]]

    @property
    def is_orthographic(self) -> bool:
        """Whether the rays are parallel."""
        return self.lens is not None and self.lens.is_orthographic

    def focal_px(self, height: int) -> float:
        """Pixels per unit of ``y/w`` in a picture `height` pixels high: the focal length K. See `w_at`."""
        if self.lens:
            return 0.5 * height / self.lens.half[1]
        return 0.5 * height / math.tan(0.5 * math.radians(self.fov_deg))

    def half_extent(self, size: tuple[int, int]) -> tuple[float, float]:
        """Half of a picture of size (width, height), across and up, in units of ``x/w`` and ``y/w``."""
        if self.lens:
            return self.lens.half_of(size)
        tan_y = math.tan(0.5 * math.radians(self.fov_deg))
        return tan_y * size[0] / size[1], tan_y

    @property
    def centre(self) -> tuple[float, float]:
        """``x/w`` and ``y/w`` in the middle of the picture."""
        return self.lens.centre if self.lens else (0.0, 0.0)

    def aspect(self, size: tuple[int, int]) -> float:
        """Pixels per unit of ``x/w``, relative to those of ``y/w``: 1 if pixels are square."""
        if self.lens is None:
            return 1.0
        across, above = self.lens.half_of(size)
        aspect = size[0] * above / (size[1] * across)
        return 1.0 if abs(aspect - 1) < 1e-12 else aspect

    def w_at(self, depth_m: np.ndarray) -> np.ndarray:
        """What ``x`` and ``y`` are divided by, at a view depth: the depth, or 1 m if the camera is orthographic."""
        return np.ones_like(depth_m) if self.is_orthographic else depth_m

    @property
    def vertical(self) -> np.ndarray:
        """(3,) how ``x``, ``y`` and ``w`` of a point grow where it rises by one metre."""
        right, up, forward = self.axes[:, 2]
        return np.array([right, up, 0.0 if self.is_orthographic else forward])

    def check_picture(self, size: tuple[int, int]) -> None:
        """Raise `UsageError` if the camera was calibrated for pictures of another shape."""
        if self.lens:
            self.lens.check_picture(size)

    def pixels(self, points: ArrayLike, size: tuple[int, int]) -> np.ndarray:
        """Where world points (..., 3) are in a picture of `size`: (..., 2) columns and rows, NaN behind the eye.

        The middle of the first pixel, in the upper left corner, is (0, 0).
        """
        x, y, z = np.moveaxis((np.asarray(points, np.float64) - self.eye) @ self.axes.T, -1, 0)
        w = self.w_at(np.where(z > 0, z, np.nan))
        (across, above), (middle_x, middle_y) = self.half_extent(size), self.centre
        right, up = (x / w - middle_x) / across, (y / w - middle_y) / above
        return 0.5 * np.stack([size[0] * (1 + right), size[1] * (1 - up)], -1) - 0.5

    def to_opencv(self, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """K, R and t of a picture of `size`: the inverse of `from_opencv`, whose conventions it has.

        `UsageError` if the camera is orthographic.
        """
        if self.is_orthographic:
            raise UsageError("to_opencv: an orthographic camera has no intrinsic matrix")
        return self.matrices(size)

    def matrices(self, size: tuple[int, int]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """K, R and t of a picture of `size`, as for `from_opencv`, also for an orthographic camera.

        A place is at (x, y, z) = R X + t, and in the picture at K (x, y, z), divided by its third number. If the camera
        is orthographic, it is at K (x, y, 1), and K has pixels per metre.
        """
        half, middle = np.array(self.half_extent(size)), np.array(self.centre) * [1, -1]
        intrinsics = np.diag([*0.5 * np.array(size) / half, 1.0])
        intrinsics[:2, 2] = 0.5 * np.array(size) * (1 - middle / half) - 0.5
        turn = self.axes * [[1.0], [-1.0], [1.0]]
        return intrinsics, turn, -turn @ np.array(self.eye)

    def over_exaggerated(self, factor: float) -> Camera:
        """The camera that gives, for a map of `Heightmap.exaggerated`, the picture of this camera with higher relief.

        All heights, also those of the eye and of the target, are stretched with the relief.
        """
        eye, target = ((x / factor, y / factor, z) for x, y, z in (self.eye, self.target))
        lens = self.lens.shrunk(factor) if self.lens else None
        return replace(self, eye=eye, target=target, bend_per_m=factor * self.bend_per_m, lens=lens)

    def drop_m(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """How much lower posts at these world places are drawn, because the Earth is round."""
        return self.bend_per_m * (np.square(x - self.eye[0]) + np.square(y - self.eye[1]))

    def drop_between_m(self, heightmap: Heightmap, cols: np.ndarray, rows: np.ndarray) -> np.ndarray:
        """The drop at places between posts, given as fractional columns and rows: bilinear, like the heights."""
        east, north = heightmap.spacing_m
        bulge = sum(
            np.square(step) * (part := at - np.floor(at)) * (1 - part) for step, at in ((east, cols), (north, rows))
        )
        return self.drop_m(cols * east, (heightmap.rows - 1 - rows) * north) + self.bend_per_m * bulge

    def lowered(self, points: np.ndarray) -> np.ndarray:
        """World points (n, 3) as they are drawn: lower by their drop."""
        return points - np.stack([0 * points[:, 0], 0 * points[:, 1], self.drop_m(points[:, 0], points[:, 1])], -1)


def clip_from_eye(camera: Camera, size: tuple[int, int], near_m: float, span_m: float = 0.0) -> np.ndarray:
    """(4, 4) float64 projection of column vectors, world metres relative to the eye, to clip space.

    Depth is near/z: 1 at the near plane, 0 at infinity. In floating point this reversed depth has the same relative
    precision at any distance (Reed 2015, "Depth precision visualized"). For an orthographic camera it is 1 - z/span.
    """
    right, up, forward = camera.axes
    tan_x, tan_y = camera.half_extent(size)
    x, y = camera.centre
    matrix = np.zeros((4, 4))
    if camera.is_orthographic:
        matrix[0] = [*right / tan_x, -x / tan_x]
        matrix[1] = [*up / tan_y, -y / tan_y]
        matrix[2] = [*-forward / span_m, 1.0]
        matrix[3, 3] = 1.0
        return matrix
    matrix[0, :3] = (right - x * forward) / tan_x
    matrix[1, :3] = (up - y * forward) / tan_y
    matrix[2, 3] = near_m
    matrix[3, :3] = forward
    return matrix


def depth_span_m(camera: Camera, heightmap: Heightmap) -> float:
    """For an orthographic camera: a view depth beyond all land. For others 0."""
    if not camera.is_orthographic:
        return 0.0
    (east, north), (low, high) = heightmap.extent_m, heightmap.range_m
    corners = np.array(np.meshgrid([0.0, east], [0.0, north], [low, high])).reshape(3, -1).T - camera.eye
    margin_m = 0.01 * math.hypot(east, north, high - low)  # the surface may be drawn a little higher or lower
    return max(float((corners @ camera.axes[2]).max()), 0.0) + margin_m


def _vector(name: str, value: Any) -> Vector:
    try:
        x, y, z = (float(v) for v in value)
    except (TypeError, ValueError):
        raise UsageError(f"{name}: expected three numbers X,Y,Z in metres, got {value!r}") from None
    if not all(abs(v) <= FARTHEST_M for v in (x, y, z)):
        raise UsageError(f"{name}: expected metres up to {FARTHEST_M:g}, got {_text((x, y, z))}")
    return x, y, z


def _text(vector: Vector) -> str:
    return ",".join(f"{v:g}" for v in vector)


def _parallel(a: Any, b: Any) -> bool:
    return math.hypot(*_cross(a, b)) <= 1e-6 * math.hypot(*a) * math.hypot(*b)


def _cross(a: Any, b: Any) -> Vector:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def screen_shift_px(
    camera: Camera, size: tuple[int, int], points: np.ndarray, rise_m: np.ndarray, near_m: float
) -> tuple[np.ndarray, np.ndarray]:
    """Distance in pixels by which points move on the screen when they are moved up; exact formula in float64.

    Parameters
    ----------
    points
        (n, 3) world metres.
    rise_m
        (n,) metres, upward.

    Returns
    -------
    px
        (n,) pixels; infinite if the point moves behind the eye.
    seen
        (n,) bool, whether the point is in the picture.
    """
    at = camera.axes @ (camera.lowered(points) - np.asarray(camera.eye)).T
    seen = in_picture(camera, size, [*at], near_m)
    return shift_px(camera, size, [*np.where(seen, at, np.array([[0.0], [0.0], [1.0]]))], rise_m), seen


def in_picture(camera: Camera, size: tuple[int, int], at: Sequence[np.ndarray], near_m: float) -> np.ndarray:
    """Whether points are in the picture; `at` holds their coordinates along the camera's axes, in metres."""
    x, y, z = at
    (tan_x, tan_y), (middle_x, middle_y) = camera.half_extent(size), camera.centre
    w = camera.w_at(z)
    return (z >= near_m) & (np.abs(x - middle_x * w) <= tan_x * w) & (np.abs(y - middle_y * w) <= tan_y * w)


def shift_px(camera: Camera, size: tuple[int, int], at: Sequence[np.ndarray], rise_m: np.ndarray) -> np.ndarray:
    """Distance in pixels by which points in the picture move when they are moved up: see `screen_shift_px`."""
    x, y, z = at
    right, up, forward = camera.vertical
    w = camera.w_at(z)
    moved = w + rise_m * forward
    shift = np.hypot((right - x / w * forward) * camera.aspect(size), up - y / w * forward) * np.abs(rise_m)
    return np.where(moved > 0, camera.focal_px(size[1]) * shift / np.where(moved > 0, moved, 1.0), np.inf)


def boxes_in_picture(
    camera: Camera, size: tuple[int, int], near_m: float, low: np.ndarray, high: np.ndarray
) -> np.ndarray:
    """Whether boxes may be in the picture: (n,) bool, False if a box lies outside one of the view's planes.

    Parameters
    ----------
    low, high
        (n, 3) world metres, smallest and largest corners.
    """
    eye = np.asarray(camera.eye)
    low, high = low - eye, high - eye
    if camera.bend_per_m:
        farthest = np.where(-low > high, low, high)
        nearest = np.clip(0.0, low, high)
        low[:, 2] -= camera.bend_per_m * np.square(farthest[:, :2]).sum(1)
        high[:, 2] -= camera.bend_per_m * np.square(nearest[:, :2]).sum(1)
    planes = picture_planes(camera, size, near_m)
    normals = np.array([-normal for normal, _ in planes])[:, None]  # outward normals of the view's planes
    tan_x, tan_y = camera.half_extent(size)
    steep = 1 + tan_x + tan_y + abs(camera.centre[0]) + abs(camera.centre[1])
    slack = 1e-6 * np.array([1.0 if camera.is_orthographic else steep] * 4 + [1.0])[:, None, None]  # float32 vertices
    least = np.minimum(*(normals * side - slack * np.abs(side) for side in (low, high))).sum(-1)  # of all corners
    return ~(least > [[-d] for _, d in planes]).any(0)


def picture_planes(camera: Camera, size: tuple[int, int], near_m: float) -> list[tuple[np.ndarray, float]]:
    """The five planes around what a picture shows, as pairs (n, d): a point p is inside where n · (p - eye) ≥ d."""
    right, up, forward = camera.axes
    planes = []
    for axis, half, middle in zip((right, up), camera.half_extent(size), camera.centre, strict=True):
        for side in (1, -1):  # side * (axis - middle * w) <= half * w
            reach = half + side * middle
            planes.append((-side * axis, -reach) if camera.is_orthographic else (reach * forward - side * axis, 0.0))
    return [*planes, (forward, near_m)]
