"""Standard views: interesting cameras for any map. They depend on the map alone.

valley   the eye is low, where the land around it rises most; it looks up at the highest place in sight
ridge    the eye is high, where the land falls most; it looks out over the lowest place nearby
high     far above, looking down obliquely over the middle of the map
default  from outside, over the part of the map with the most relief and few voids
"""

import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from ..basics.boxes import over_blocks
from ..basics.exceptions import UsageError
from ..camera import Camera
from ..heightmap import Heightmap
from ..shade.picture import SUN

_BLOCKS = 64  # blocks of posts along a side of the map: a view is searched block by block
_INSIDE = 1 / 8  # part of the map along each rim where no eye is placed, so that there is land on all sides
_REACH = 1 / 8  # land that rises or falls is searched within this part of the map's longer side
_READABLE = 0.07  # ratio of relief to extent at which a picture of the whole map shows the relief well
_SOLID = 0.9  # least share of posts with data, in a block and its neighbours, for a place of the eye
_STEEP = 0.12  # ratio of relief to extent; on steeper maps the sun has its usual height
_LOWEST_SUN = 15.0  # degrees
_FEW = 24  # posts a side of a small map, which the first view shows as a whole
_LEAST_PART = 0.3  # size of the part that the first view looks at, relative to the map
_MOST_PART = 0.75
_IN_FRAME = 0.62  # share of this part whose corners are certainly in the picture
_STANDS_OUT = 0.4  # a summit stands out if it is this share of the relief above nearly all other land
_NEARLY_ALL = 98  # percent of the blocks
_SUMMIT = 0.2  # ratio of relief to extent, in the part around such a summit
_TRIES = 64  # most places that are tried until the line of sight is free
FOV_DEG = 45.0  # of a standard view
Post = tuple[int, int]


def standard_view(heightmap: Heightmap, name: str = "default") -> Camera:
    """The camera of a standard view, one of `VIEWS`; on a very narrow map, the default view."""
    narrow = min(heightmap.rows, heightmap.cols) < 3
    return VIEWS["default" if narrow else name](heightmap, FOV_DEG)


def overview(heightmap: Heightmap, fov_deg: float) -> Camera:
    """Look from the south over the part with the most relief. Its middle is in the picture, from top to bottom.

    The flatter the map, the smaller this part, so that relief is visible. If one summit stands out, such as a volcano,
    it is in the middle of the part. A map of few posts is shown as a whole. For a long map, this is `Camera.default`.
    """
    east, north = heightmap.extent_m
    low_m, high_m = heightmap.range_m
    if min(heightmap.rows, heightmap.cols) < 3 or max(east, north) > 3 * min(east, north):
        return Camera.default(heightmap, fov_deg)
    if max(heightmap.rows, heightmap.cols) <= _FEW:
        return Camera.over((east / 2, north / 2, (low_m + high_m) / 2), (east, north, high_m - low_m), fov_deg)
    blocks = _Blocks(heightmap)
    share = float(np.clip((high_m - low_m) / (_READABLE * max(east, north)), _LEAST_PART, _MOST_PART))
    summit = blocks.summit()
    (top, left), (rows, cols) = blocks.roughest(share) if summit is None else blocks.around_summit(summit)
    lows, highs = (of[top : top + rows, left : left + cols] for of in (blocks.low, blocks.high))
    block_m = np.multiply(heightmap.spacing_m, blocks.side)
    middle_x = min((left + cols / 2) * block_m[0], east)
    middle_y = max(north - (top + rows / 2) * block_m[1], 0.0)
    low_m, high_m = float(lows[np.isfinite(lows)].min()), float(highs[np.isfinite(highs)].max())
    size = _IN_FRAME * cols * block_m[0], _IN_FRAME * rows * block_m[1], high_m - low_m
    camera = Camera.over((middle_x, middle_y, (low_m + high_m) / 2), size, fov_deg)
    x, y, z = camera.eye
    return replace(camera, eye=(x, y, max(z, blocks.highest_around(x, y) + 2 * max(heightmap.spacing_m))))


def standard_sun(heightmap: Heightmap) -> tuple[float, float]:
    """Azimuth and elevation of the sun in a first picture. It is at the side; the flatter the map, the lower it is.

    A low sun makes gentle relief visible; steep land would be in shadow.
    """
    low_m, high_m = heightmap.range_m
    relief = (high_m - low_m) / max(heightmap.extent_m)
    elevation = SUN[1] * (relief / _STEEP) ** (1 / 3) if relief > 0 else SUN[1]
    return SUN[0], float(round(min(max(elevation, _LOWEST_SUN), SUN[1])))


def valley(heightmap: Heightmap, fov_deg: float) -> Camera:
    """Look up from a low place at the highest visible place within an eighth of the map."""
    blocks = _Blocks(heightmap)
    rise = blocks.around(blocks.high, _REACH) - blocks.low
    places = blocks.best(np.where(blocks.inside, rise, -np.inf))[:_TRIES]
    lows = [blocks.floor(place) for place in places]
    sights = [(low, blocks.away(low, blocks.high, lowest=False)) for low in lows]
    eye, target = next((sight for sight in sights if _in_sight(heightmap, *sight)), sights[0])
    x, y, z = _world(heightmap, target)
    ground = _world(heightmap, eye)[2]
    return _look(heightmap, eye, (x, y, ground + 0.4 * (z - ground)), fov_deg)


def ridge(heightmap: Heightmap, fov_deg: float) -> Camera:
    """Look from a high place towards the lowest place within an eighth of the map, 8 degrees downwards."""
    blocks = _Blocks(heightmap)
    drop = blocks.high + blocks.around(-blocks.low, _REACH / 3)
    eye = blocks.post(blocks.best(np.where(blocks.inside, blocks.high + drop, -np.inf))[0], lowest=False)
    # towards the map's middle, where there is more land to see
    inward = blocks.off_middle <= blocks.off_middle[eye[0] // blocks.side, eye[1] // blocks.side]
    x, y, _ = _world(heightmap, blocks.away(eye, np.where(inward, -blocks.low, -np.inf), lowest=True))
    stand = _stand(heightmap, eye)
    down = math.tan(math.radians(8.0)) * math.hypot(x - stand[0], y - stand[1])
    return _look(heightmap, eye, (x, y, stand[2] - down), fov_deg)


def high(heightmap: Heightmap, fov_deg: float) -> Camera:
    """Look down at the middle, 35 degrees below the horizon, from a third of the map away; further over high relief."""
    yaw, pitch = math.radians(15.0), math.radians(35.0)
    away = max(heightmap.extent_m) / 3 + (heightmap.range_m[1] - heightmap.range_m[0]) / math.sin(pitch)
    forward = np.array([math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch), -math.sin(pitch)])
    middle = np.array([*np.divide(heightmap.extent_m, 2), heightmap.range_m[0]])
    return Camera(tuple(middle - away * forward), tuple(middle), fov_deg)


def stand_at(heightmap: Heightmap, camera: Camera, lon: float, lat: float, above_m: float | None = None) -> Camera:
    """The camera, moved to a longitude and latitude in degrees, `above_m` above the ground (default: two spacings)."""
    x, y = _on_map(heightmap, lon, lat)
    above_m = 2 * max(heightmap.spacing_m) if above_m is None else above_m
    return replace(camera, eye=(x, y, _ground_m(heightmap, x, y) + above_m))


def look_at(heightmap: Heightmap, camera: Camera, lon: float, lat: float, above_m: float = 0.0) -> Camera:
    """The camera, turned to look at a place `above_m` above the ground, at a longitude and latitude in degrees."""
    x, y = _on_map(heightmap, lon, lat)
    return replace(camera, target=(x, y, _ground_m(heightmap, x, y) + above_m))


def drawn_near(heightmap: Heightmap, camera: Camera) -> Camera:
    """The camera, moved on its line of sight to a quarter of the map's longer side from its target, above ground."""
    target = np.asarray(camera.target, np.float64)
    back = camera.eye - target
    x, y, z = target + 1 / 4 * max(heightmap.extent_m) * (back / max(float(np.linalg.norm(back)), 1e-9))
    clear = _ground_m(heightmap, x, y) + 2 * max(heightmap.spacing_m)
    return replace(camera, eye=(float(x), float(y), float(max(z, clear))))


def depth_below_ground(heightmap: Heightmap, camera: Camera) -> float:
    """Metres of the eye below the lowest of the four posts around; 0 if it is above, beside a void or off the map."""
    x, y, z = camera.eye
    east, north = heightmap.spacing_m
    col, row = math.floor(x / east), heightmap.rows - 2 - math.floor(y / north)
    if not (0 <= col < heightmap.cols - 1 and 0 <= row < heightmap.rows - 1):
        return 0.0
    ground_m = float(heightmap.heights[row : row + 2, col : col + 2].min())
    return max(0.0, ground_m - z) if math.isfinite(ground_m) else 0.0


def straight_down(heightmap: Heightmap, fov_deg: float) -> Camera:
    """Look straight down at the middle, the whole map in the picture and north up."""
    width, depth = heightmap.extent_m
    top = heightmap.range_m[1]
    away = 0.55 * max(width, depth) / math.tan(math.radians(0.5 * fov_deg))
    return Camera((width / 2, depth / 2, top + away), (width / 2, depth / 2, top), fov_deg)


VIEWS: dict[str, Callable[[Heightmap, float], Camera]] = {
    "default": overview,
    "valley": valley,
    "ridge": ridge,
    "high": high,
}


class _Blocks:
    """Lowest and highest post of each block of the map; voids are neither."""

    def __init__(self, heightmap: Heightmap) -> None:
        self.heightmap = heightmap
        self.side = max(1, -(-max(heightmap.rows, heightmap.cols) // _BLOCKS))
        rows, cols = np.arange(0, heightmap.rows, self.side), np.arange(0, heightmap.cols, self.side)
        heights = heightmap.heights
        self.low, self.high = (over_blocks(of, heights, self.side).astype(np.float64) for of in (np.fmin, np.fmax))
        self.low = np.where(np.isnan(self.low), np.inf, self.low)
        self.high = np.where(np.isnan(self.high), -np.inf, self.high)
        y, x = np.meshgrid(_from_middle(len(rows)), _from_middle(len(cols)), indexing="ij")
        self.off_middle = np.hypot(x, y)
        self.inside = np.maximum(np.abs(x), np.abs(y)) <= 1 - 2 * _INSIDE
        self.inside &= np.isfinite(self.low)
        solid = self.inside & (self._data(rows, cols) > _SOLID)  # leaves out small land between voids
        self.inside = solid if solid.any() else self.inside
        if not self.inside.any():
            self.inside = np.isfinite(self.low)

    def _data(self, rows: np.ndarray, cols: np.ndarray) -> np.ndarray:
        """Share of the posts with data: for each block, the smallest among itself and its neighbours."""
        if not self.heightmap.voids:
            return np.ones((len(rows), len(cols)))
        known = ~np.isnan(self.heightmap.heights)
        sums = over_blocks(np.add, known.astype(np.float64), self.side)
        counts = np.outer(np.diff([*rows, self.heightmap.rows]), np.diff([*cols, self.heightmap.cols]))
        return -self.around(-sums / counts, 1 / max(sums.shape))

    def roughest(self, share: float) -> tuple[Post, Post]:
        """First block, and rows and columns of blocks, of the part of the map with the most relief and few voids."""
        size = tuple(max(1, round(share * n)) for n in self.low.shape)
        windows = [np.lib.stride_tricks.sliding_window_view(of, size) for of in (self.low, self.high)]
        relief = windows[1].max((2, 3)) - windows[0].min((2, 3))
        land = np.isfinite(windows[0]).mean((2, 3))
        middle = np.lib.stride_tricks.sliding_window_view(self.off_middle, size).mean((2, 3))
        score = np.where(np.isfinite(relief), relief, 0.0) * land**2 * (1.2 - 0.2 * middle)
        at = np.unravel_index(int(score.argmax()), score.shape)
        return (int(at[0]), int(at[1])), (size[0], size[1])

    def summit(self) -> Post | None:
        """The highest block, if nearly all others are much lower, and the part around it has enough posts to show."""
        known = np.isfinite(self.high)
        relief = self.high[known].max() - self.low[known].min()
        block = self.best(self.high)[0]
        stands_out = self.high[block] - np.percentile(self.high[known], _NEARLY_ALL) > _STANDS_OUT * relief
        is_fine = relief / _SUMMIT >= _FEW * max(self.heightmap.spacing_m)
        return block if stands_out and is_fine else None

    def around_summit(self, block: Post) -> tuple[Post, Post]:
        """First block, and rows and columns of blocks, of a part of the map whose middle is at a summit."""
        low_m, high_m = self.heightmap.range_m
        east, north = self.heightmap.spacing_m
        side_m = (high_m - low_m) / _SUMMIT
        rows = min(max(1, round(side_m / (self.side * north))), self.low.shape[0])
        cols = min(max(1, round(side_m / (self.side * east))), self.low.shape[1])
        top = min(max(0, block[0] - rows // 2), self.low.shape[0] - rows)
        left = min(max(0, block[1] - cols // 2), self.low.shape[1] - cols)
        return (top, left), (rows, cols)

    def highest_around(self, x: float, y: float) -> float:
        """The highest post of the blocks around a place in world metres; -inf off the map."""
        east, north = self.heightmap.spacing_m
        col, row = int(x / east) // self.side, int(self.heightmap.rows - 1 - y / north) // self.side
        part = self.high[max(0, row - 1) : max(0, row + 2), max(0, col - 1) : max(0, col + 2)]
        return float(part.max()) if part.size else -math.inf

    def around(self, values: np.ndarray, share: float) -> np.ndarray:
        """For each block, the largest value in the square around it that reaches `share` of the map's longer side."""
        reach = max(1, round(share * max(values.shape)))
        for axis in (0, 1):
            padding = [(reach, reach) if axis == a else (0, 0) for a in (0, 1)]
            padded = np.pad(values, padding, constant_values=-np.inf)
            values = np.lib.stride_tricks.sliding_window_view(padded, 2 * reach + 1, axis).max(-1)
        return values

    def best(self, score: np.ndarray) -> list[Post]:
        """Blocks in falling order of score. Of equal blocks, the one nearest to the middle comes first."""
        order = np.lexsort((self.off_middle.ravel(), -score.ravel()))
        return [(int(i) // score.shape[1], int(i) % score.shape[1]) for i in order]

    def post(self, block: Post, lowest: bool) -> Post:
        """Row and column of a block's lowest or highest post."""
        row, col = block[0] * self.side, block[1] * self.side
        heights = self.heightmap.heights[row : row + self.side, col : col + self.side]
        at = int(np.nanargmin(heights) if lowest else np.nanargmax(heights))
        return row + at // heights.shape[1], col + at % heights.shape[1]

    def floor(self, block: Post) -> Post:
        """Row and column of the post in a block whose highest neighbour is lowest: it is not at the foot of a cliff."""
        row, col = max(0, self.side * block[0] - 1), max(0, self.side * block[1] - 1)
        heights = self.heightmap.heights[row : self.side * (block[0] + 1) + 1, col : self.side * (block[1] + 1) + 1]
        if min(heights.shape) >= 3:
            solid = np.where(np.isnan(heights), np.inf, heights)
            walls = np.lib.stride_tricks.sliding_window_view(solid, (3, 3)).max((2, 3))
            at = int(walls.argmin())
            if np.isfinite(walls.flat[at]):
                return row + 1 + at // walls.shape[1], col + 1 + at % walls.shape[1]
        return self.post(block, lowest=True)

    def away(self, post: Post, score: np.ndarray, lowest: bool) -> Post:
        """The lowest or highest post of the block with the best score, from a third of `_REACH` to `_REACH` away."""
        rows, cols = np.indices(score.shape)
        away = np.hypot(rows - post[0] // self.side, cols - post[1] // self.side) / max(score.shape)
        score = np.where((away >= _REACH / 3) & (away <= _REACH), score, -np.inf)
        block = self.best(score)[0]
        middle = self.heightmap.rows // 2, self.heightmap.cols // 2
        return self.post(block, lowest) if np.isfinite(score[block]) else middle


def _on_map(heightmap: Heightmap, lon: float, lat: float) -> tuple[float, float]:
    """World metres of a place on the map."""
    place = heightmap.place
    if place is None:
        raise UsageError(f"{heightmap.name}: its place on the Earth is not known: give places in metres, X,Y,Z")
    x, y = place.from_lonlat(lon, lat)
    width, depth = heightmap.extent_m
    if not (0 <= x <= width and 0 <= y <= depth):
        west, south = place.to_lonlat(0.0, 0.0)
        east, north = place.to_lonlat(width, depth)
        raise UsageError(
            f"{heightmap.name}: {lon:g},{lat:g} lies off the map, which reaches from {west:.5g},{south:.5g} to "
            f"{east:.5g},{north:.5g} (longitude, latitude)"
        )
    return x, y


def _ground_m(heightmap: Heightmap, x: float, y: float) -> float:
    """Height of the post nearest to a place, which may be off the map; the map's lowest height for a void."""
    east, north = heightmap.spacing_m
    rows, cols = heightmap.heights.shape
    row, col = rows - 1 - round(y / north), round(x / east)
    height = float(heightmap.heights[min(max(row, 0), rows - 1), min(max(col, 0), cols - 1)])
    return heightmap.range_m[0] if math.isnan(height) else height


def _from_middle(n: int) -> np.ndarray:
    return (np.arange(n) + 0.5) / n * 2 - 1


def _world(heightmap: Heightmap, post: Post) -> np.ndarray:
    """(3,) world metres of a post; over a void, at the map's lowest height."""
    east, north = heightmap.spacing_m
    z = float(heightmap.heights[post])
    return np.array(
        [post[1] * east, (heightmap.rows - 1 - post[0]) * north, heightmap.range_m[0] if np.isnan(z) else z]
    )


def _stand(heightmap: Heightmap, post: Post) -> np.ndarray:
    """(3,) world metres of an eye: a spacing above all posts next to this one."""
    x, y, z = _world(heightmap, post)
    around = heightmap.heights[max(0, post[0] - 1) : post[0] + 2, max(0, post[1] - 1) : post[1] + 2]
    return np.array([x, y, np.fmax.reduce(around, axis=None, initial=z) + min(heightmap.spacing_m)])


def _in_sight(heightmap: Heightmap, eye: Post, target: Post) -> bool:
    """Whether the ground is below the line from eye to target, except close to the target."""
    t = np.linspace(0.02, 0.95, 128)
    rows, cols = (np.round(a + t * (b - a)).astype(int) for a, b in zip(eye, target, strict=True))
    a, b = _stand(heightmap, eye)[2], _world(heightmap, target)[2]
    return not (heightmap.heights[rows, cols] > a + t * (b - a)).any()


def _look(heightmap: Heightmap, eye: Post, target: tuple[float, float, float], fov_deg: float) -> Camera:
    """Stand at a post and look at a point, or north if the point is straight above or below."""
    stand = _stand(heightmap, eye)
    if np.hypot(target[0] - stand[0], target[1] - stand[1]) < min(heightmap.spacing_m):
        target = stand[0], stand[1] + max(heightmap.extent_m), stand[2]
    return Camera((stand[0], stand[1], stand[2]), target, fov_deg)
