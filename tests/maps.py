"""Synthetic maps, each difficult in one way; cameras for any map; and a scene that draws them."""

from dataclasses import dataclass

import numpy as np

from terrain_gl.camera import Camera
from terrain_gl.error import ErrorTables
from terrain_gl.gpu import layout
from terrain_gl.heightmap import Heightmap, bilinear
from terrain_gl.lod import Goal, RingsSelector
from terrain_gl.mesh import captured_triangles
from terrain_gl.terrain import Terrain
from terrain_gl.verify.measure import Measurement

SIZE = (640, 360)


def island(n=193):
    """Hills in a sea of height 0, 30 m between posts, with a lake at 150 m. Returns heights."""
    y, x = np.mgrid[0:n, 0:n] * 1.0
    away, off = np.hypot(x - 96, y - 96), np.hypot(x - 100, y - 104)
    heights = 260 - 3.4 * away + 14 * np.sin(x / 3.1 + y / 4.7) + 260 * np.exp(-(((off - 66) / 14) ** 2))
    return np.where(off < 50, 150.0, np.maximum(heights, 0.0)).astype("f4")


def rough(rows, cols, seed=0, relief=100.0):
    """A fractal surface: noise at every power of two."""
    rng = np.random.default_rng(seed)
    h = np.zeros((rows, cols))
    step = 1
    while step < 2 * max(rows, cols):
        noise = rng.normal(size=(rows // step + 2, cols // step + 2))
        h += step * _smooth(noise, step)[:rows, :cols]
        step *= 2
    return (h * relief / np.ptp(h)).astype("f4")


def _smooth(noise, step):
    """Bilinear interpolation of noise to `step` times its size."""
    for axis in (0, 1):
        t = np.arange(noise.shape[axis] * step - step) / step
        i = t.astype(int)
        t = np.expand_dims(t - i, 1 - axis)
        noise = noise.take(i, axis) * (1 - t) + noise.take(i + 1, axis) * t
    return noise


def spike(n=129):
    h = np.zeros((n, n))
    h[n // 3, n // 2 + 2] = 60
    return h


def checkerboard(n=97):
    return np.indices((n, n)).sum(0) % 2 * 5.0


def ridges(rows, cols, seed, relief=500.0):
    """Mountains with smooth slopes: rough land of eight posts, bilinear in between, and a little of its own noise."""
    coarse = rough(rows // 8 + 2, cols // 8 + 2, seed, relief).astype("f8")
    y, x = np.indices((rows, cols)) / 8
    return (bilinear(coarse, x, y) + rough(rows, cols, seed, 0.01 * relief)).astype("f4")


def cliff(n=131):
    """A step that runs off every lattice, neither straight along an axis nor along a diagonal."""
    y, x = np.indices((n, n))
    return np.where(3 * x + 7 * y > 5.3 * n, 80.0, 0.0) + 0.01 * x


def plane(n=129):
    y, x = np.indices((n, n))
    return 0.37 * x - 0.21 * y


def holes(n=150):
    """Voids of many kinds: a large hole, single posts, a strip to the rim, a corner, a checkered patch."""
    h = rough(n, n + 11, 5)
    rng = np.random.default_rng(6)
    h[40:75, 50:90] = np.nan
    h[rng.integers(0, n, 40), rng.integers(0, n, 40)] = np.nan
    h[100:103, 60:] = np.nan
    h[:9, :9] = np.nan
    patch = h[110:140, 10:40]
    patch[np.indices(patch.shape).sum(0) % 2 == 0] = np.nan
    return h


MAPS = {
    "spike": lambda: Heightmap(spike(), 10.0),
    "checkerboard": lambda: Heightmap(checkerboard(), 10.0),
    "cliff": lambda: Heightmap(cliff(), 10.0),
    "plane": lambda: Heightmap(plane(), 5.0),
    "constant": lambda: Heightmap(np.full((65, 65), 123.4), 7.0),
    "odd": lambda: Heightmap(rough(118, 203, 1), (20.0, 27.0)),
    "two": lambda: Heightmap([[0, 5], [3, -4]], 2.0),
    "long": lambda: Heightmap(rough(3, 1000, 2, 60.0), 10.0),
    "holes": lambda: Heightmap(holes(), 15.0),
    "offset": lambda: Heightmap(8848 + rough(97, 140, 3, 0.05).astype("f8"), 1.0),
    "tiny": lambda: Heightmap(rough(100, 90, 4, 0.02), 0.001),
    "huge": lambda: Heightmap(rough(120, 80, 7, 9e6) - 4e6, 3000.0),
}

# real maps, in the folder that TERRAIN_GL_DEM names, and how to open them
REAL = {
    "N37W123.hgt": {"spacing_m": (73, 93)},
    "greenriver.tif": {"spacing_m": 1},
    "mt_rainier_90m.tif": {"spacing_m": (64, 93)},
    "ps_height_1k.png": {"spacing_m": 160, "z_scale": 0.1},
    "deathvalley_basinrange_4097_u16_off100.png": {"spacing_m": (73, 93), "z_offset_m": -100.0},
    "moon_gld100_lon100-116_lat28-44_4096.png": {"spacing_m": (96, 118), "z_offset_m": -10000.0},
    "narok_srtm_z12_4608_f32.tif": {"spacing_m": 19.1},
}
SMALL_REAL = list(REAL)[:4]  # of about 1000 posts a side
LARGE_REAL = list(REAL)[4:]


def cameras(heightmap, size=SIZE):
    """Eight views of a map, by name."""
    east, north = heightmap.extent_m
    step = max(heightmap.spacing_m)
    low, high = heightmap.range_m
    reach, relief = max(east, north), max(high - low, step)
    row, col = _solid_post(heightmap, heightmap.rows // 2, heightmap.cols // 3)
    x, y, z = _world(heightmap, row, col)
    pit = _world(heightmap, *np.unravel_index(np.nanargmin(heightmap.heights), heightmap.heights.shape))
    return {
        "default": Camera.default(heightmap),
        "grazing": Camera((x, y, z + 0.3 * step), (x + reach, y + 0.2 * reach, z + 0.3 * step)),
        "down": Camera((x, y, high + relief), (x, y, low)),
        "wide": Camera((x, y, z + relief), (x + reach, y - 0.4 * reach, z), 100.0),
        "pit": Camera((pit[0], pit[1], pit[2] + 0.5 * step), (0.5 * east, 0.5 * north, pit[2] + 2 * step), 60.0),
        "outside": Camera((-0.4 * reach, -0.3 * reach, high + 0.1 * reach), (0.5 * east, 0.5 * north, low)),
        "far": Camera((-40 * reach, -90 * reach, 50 * reach), (0.5 * east, 0.5 * north, low), 1.0),
        "corner": Camera(
            (0, 0, _world(heightmap, *_solid_post(heightmap, heightmap.rows - 1, 0))[2] + step), (east, north, low)
        ),
    }


def random_camera(rng, heightmap):
    """Close above the ground, over the map, or far away; rolled half of the time."""
    east, north = heightmap.extent_m
    low, high = heightmap.range_m
    rows, cols = np.nonzero(~np.isnan(heightmap.heights))
    i = rng.integers(0, len(rows))
    ground = heightmap.heights[rows[i], cols[i]]
    over = cols[i] * heightmap.spacing_m[0], (heightmap.rows - 1 - rows[i]) * heightmap.spacing_m[1]
    reach = max(east, north, high - low)
    eye = [
        (*over, ground + min(heightmap.spacing_m) * 10 ** rng.uniform(-2, 1)),
        (*over, high + reach * 10 ** rng.uniform(-1, 1)),
        rng.uniform([-east, -north, low], [2 * east, 2 * north, high + reach]),
        rng.normal(size=3) * reach * 10 ** rng.uniform(0, 3),
    ][rng.integers(0, 4)]
    target = rng.uniform([0, 0, low], [east, north, high + 0.1 * reach])
    up = tuple(rng.normal(size=3)) if rng.random() < 0.5 else None
    return Camera(tuple(eye), tuple(target), float(10 ** rng.uniform(0, 2.15)), up)


def standing(rng, heightmap):
    """A camera above the ground, looking about level, half of them rolled."""
    (east, north), step = heightmap.extent_m, max(heightmap.spacing_m)
    col, row = rng.integers(2, heightmap.cols - 2), rng.integers(2, heightmap.rows - 2)
    around = heightmap.heights[row - 2 : row + 3, col - 2 : col + 3]
    ground = np.nanmax(around) if np.isfinite(around).any() else np.nanmax(heightmap.heights)
    z = ground + step * 10 ** rng.uniform(-0.5, 1)
    x, y = (col + rng.uniform(-0.4, 0.4)) * heightmap.spacing_m[0], (heightmap.rows - 1 - row) * heightmap.spacing_m[1]
    target = rng.uniform(0, east), rng.uniform(0, north), z + rng.normal() * 0.2 * step * heightmap.cols
    up = tuple(rng.normal(size=3)) if rng.random() < 0.5 else None
    return Camera((x, y, float(z)), target, float(rng.uniform(10, 120)), up)


def random_map(rng, rows=None, cols=None):
    """Rough land of any size and relief, high up or deep down, in some cases with voids."""
    rows, cols = rows or int(rng.integers(2, 120)), cols or int(rng.integers(2, 120))
    heights = rough(rows, cols, rng.integers(0, 10**6), 10 ** rng.uniform(-3, 4))
    heights = heights + np.float32(rng.choice([0, 8848, -1e5]))
    if rng.random() < 0.3:
        heights[rng.random(heights.shape) < rng.choice([0.01, 0.3, 0.9])] = np.nan
        heights[0, 0] = 0
    return Heightmap(heights, tuple(10 ** rng.uniform(-2, 2, 2)))


def new_heights(kind):
    """Heights of 20 × 30 posts for an edit: as high as the land, with voids, or far above (`span`)."""
    rng = np.random.default_rng(1)
    new = rng.normal(size=(20, 30)) * 20 + (3000 if kind == "span" else 0)
    if kind == "voids":
        new[rng.random(new.shape) < 0.2] = np.nan
    return new


def _solid_post(heightmap, row, col):
    """The post nearest to (row, col) that is not void."""
    if not np.isnan(heightmap.heights[row, col]):
        return row, col
    rows, cols = np.nonzero(~np.isnan(heightmap.heights))
    i = np.argmin(np.hypot(rows - row, cols - col))
    return rows[i], cols[i]


def _world(heightmap, row, col):
    east, north = heightmap.spacing_m
    return col * east, (heightmap.rows - 1 - row) * north, float(heightmap.heights[row, col])


def surface_m(corners, corners_m, shape):
    """Heights (rows, cols) at whole places in triangles, from their corners' heights; NaN where there is none.

    Corners (n, 3, 2) are columns and rows, heights (n, 3).
    """
    drawn = np.full(shape, np.nan)
    low = np.ceil(corners.min(1)).astype(int)
    size = corners.max(1).astype(int) - low + 1
    for width, height in np.unique(size[(size > 0).all(1)], axis=0):  # all triangles of a size at once
        of_size = (size == (width, height)).all(1)
        rows, cols = np.indices((height, width)).reshape(2, -1)
        x, y = low[of_size, 0, None] + cols, low[of_size, 1, None] + rows
        a, b, c = (corners[of_size, i].astype("f8").T[..., None] for i in range(3))
        weights = [(q[0] - x) * (r[1] - y) - (q[1] - y) * (r[0] - x) for q, r in ((b, c), (c, a), (a, b))]
        inside = np.logical_and.reduce([w <= 0 for w in weights])
        heights = (corners_m[of_size, i, None].astype("f8") for i in range(3))
        at_places = sum(w * h for w, h in zip(weights, heights, strict=True)) / sum(weights)
        drawn[y[inside], x[inside]] = at_places[inside]
    return drawn


@dataclass
class Scene:
    """A map on the GPU with its tables, its levels and what measures them."""

    heightmap: Heightmap
    terrain: Terrain
    tables: ErrorTables
    levels: RingsSelector
    size: tuple[int, int] = SIZE
    _measurement: Measurement | None = None

    @classmethod
    def of(cls, ctx, heightmap, size=SIZE):
        terrain = Terrain(ctx, heightmap)
        tables = ErrorTables(terrain)
        return cls(heightmap, terrain, tables, RingsSelector(tables), size)

    @property
    def near_m(self):
        return 0.1 * min(self.heightmap.spacing_m)

    def select(self, camera, tolerance_px=1.0, metric=None, cull=True, triangles=None):
        metric = metric or ("rms" if triangles else "max")  # as `FrameOptions` has it
        return self.levels.select(camera, self.size, self.near_m, Goal(tolerance_px, metric, cull, triangles))

    def triangles(self, selection):
        return captured_triangles(selection)[0]

    @property
    def measurement(self):
        self._measurement = self._measurement or Measurement(self.terrain)
        return self._measurement

    def achieved(self, selection, camera):
        return self.measurement.achieved(selection, camera, self.size, self.near_m)

    def release(self):
        for part in (self._measurement, self.levels, self.tables, self.terrain):
            if part:
                part.release()


def tessellation_ends(selection, asked_px):
    """Whether a view asks for more than tessellation can do, close to the eye: the bound may then exceed the tolerance.

    The clipmap ends at 32 parts between two posts (16 beyond ring 0).
    """
    data = selection.buffers.patches.read(selection.patches * layout.PATCH.itemsize)
    patches = np.frombuffer(data, layout.PATCH)
    step_log2 = (patches["shape"] >> 5 & 63).astype(int) - 16
    return bool((step_log2[patches["bound_px"] > asked_px] <= -4).all())
