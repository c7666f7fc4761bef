"""Tiles of a map of any size, as 3D Tiles 1.1 (OGC 22-025): a tile declares the error that it has.

A tile of level k is up to `SIDE` · 2^k cells of the map a side. Its vertices are on a lattice of every 2^k-th post and
the last one. pydelatin chooses them (`files.whole`) for the tolerance `max_error_m` · 2^k. It sees heights above the
tile's own level plane, so the curved ground counts, too. The tile is then rounded to float32, placed, and compared with
*all* posts of the map under it (`files.tilesets`): this is its error.

    rims     have every post of the lattice, so that tiles of one level meet exactly (see `_with_rough_rim`)
    skirts   hang from rims, deeper by a tolerance than any tile of another level is lower: computed post by post
    voids    a cell of the lattice with a void corner is left out
"""

import contextlib
import hashlib
import json
import os
import shutil
import uuid
from collections.abc import Callable, Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError
from ..basics.locks import locked
from ..basics.rect import nodes_along
from ..basics.version import __version__
from ..heightmap import Heightmap
from ..image import file_bytes
from ..mesh import vertex_heights
from ..readers import Reading
from ..readers.raster import Spacing
from ..store import StoredMap, is_store
from ..store.scheduling import scheduler
from ..terrain.filling import fill_voids
from .cutting import cut_voids
from .maps import open_map
from .mesh_formats import Mesh, gltf_head, padded, rim_of, with_whole_rim
from .tile_system import EARTH, TileSystem
from .tilesets import sag_m, tile_error
from .whole import delaunay

SIDE = 256  # cells of the lattice along a side of a tile
_SHARES = 0.95, 0.5, 0.0  # of the tolerance, tried in turn for the finest tiles: new vertices on rims add to the error
_ROUGH = 0.7  # of the tolerance: the mesher's rim is wrong by this; a post between two others is off by twice as much
_PICTURE = "texture.npy"
_RECORDS = ".records"  # folder of an unfinished tile set: a file for each tile that is whole


class TileKey(NamedTuple):
    """A tile: its level, 0 the finest, and its row and column."""

    level: int
    row: int
    col: int

    @property
    def name(self) -> str:
        """Its name, without an ending."""
        return f"{self.level}-{self.row}-{self.col}"

    @property
    def below(self) -> list["TileKey"]:
        """The four tiles of the next finer level."""
        return [TileKey(self.level - 1, 2 * self.row + i, 2 * self.col + j) for i in (0, 1) for j in (0, 1)]


class Tiling:
    """The tiles of a map. `source` names the map for workers: a file or store, and how a file is read."""

    def __init__(
        self,
        heightmap: Heightmap,
        max_error_m: float,
        is_local: bool = False,
        source: tuple[str, Reading, Spacing | None] | None = None,
    ) -> None:
        self._again = source, max_error_m, is_local, uuid.uuid4().hex  # a file may change until the next call
        self.heightmap = heightmap
        self.max_error_m = max_error_m
        self.system = TileSystem(heightmap, None if is_local else EARTH)
        self.size = heightmap.rows, heightmap.cols
        self.top = max(0, (nodes_along(max(self.size), 0) - 1) // SIDE).bit_length()
        # between float32 places of two tiles
        self.rounding_m = 0.0 if is_local else float(np.ldexp(max(heightmap.extent_m), -23))

    def __reduce__(self) -> tuple[Any, ...]:
        return _opened, self._again

    def keys(self, level: int) -> list[TileKey]:
        """All tiles of a level."""
        rows, cols = (-(-nodes_along(n, level) // SIDE) for n in self.size)
        return [TileKey(level, row, col) for row in range(rows) for col in range(cols)]

    def lattice(self, level: int, axis: int, first: int, end: int) -> np.ndarray:
        """Rows (axis 0) or columns (axis 1) of the posts `first` to `end` of a lattice, cut at the map's rim."""
        low, high = max(first, 0), min(end, nodes_along(self.size[axis], level))
        return np.minimum(np.arange(low, high + 1) << level, self.size[axis] - 1)

    def make(self, key: TileKey, picture: np.ndarray | None = None) -> tuple[bytes, dict[str, Any]]:
        """The file of a tile, and its record: transformation, box, error and counts. Without land, both are empty.

        `picture` is the map from straight above, half a cell beyond its outermost posts.
        """
        shares = _SHARES if key.level == 0 else _SHARES[:1]
        for share in shares:
            data, record = self._made(key, share * self.max_error_m * 2**key.level, picture)
            if not data or record["declared_m"] <= self.max_error_m:
                break
        return data, record

    def _made(self, key: TileKey, tolerance_m: float, picture: np.ndarray | None) -> tuple[bytes, dict[str, Any]]:
        first = np.array([key.row, key.col]) * SIDE
        rows, cols = (self.lattice(key.level, axis, first[axis] - 1, first[axis] + SIDE + 1) for axis in (0, 1))
        around = self.heightmap.heights[np.ix_(rows, cols)]  # with a post more on each side, for normals
        origin = np.minimum(first, 1)[::-1]  # column and row of the tile's first post in `around`
        inner = np.s_[origin[1] : origin[1] + SIDE + 1, origin[0] : origin[0] + SIDE + 1]
        void = np.isnan(around[inner])
        if void.all():
            return b"", {}
        filled = fill_voids(around)
        last = np.array(void.shape[::-1]) - 1
        axes = self.system.axes(cols[len(cols) // 2], rows[len(rows) // 2], float(filled[inner].mean()))
        on_posts = np.stack(np.meshgrid(cols, rows), -1).reshape(-1, 2)
        near = self._near(axes, on_posts, filled.reshape(-1)).reshape(*filled.shape, 3)
        posts, faces = delaunay(_with_rough_rim(near[inner][..., 2], _ROUGH * tolerance_m), tolerance_m)
        mesh = with_whole_rim(Mesh(posts, faces, filled[inner], (1.0, 1.0)))
        cut = cut_voids(mesh.posts, mesh.faces.astype(np.int64), mesh.tops_m(slice(None)), void)
        used, number = np.unique(cut.faces, return_inverse=True)
        if not len(used):
            return b"", {}
        posts, tops_m, faces = cut.posts[used], cut.heights_m[used], number.reshape(-1, 3)
        of_rim_m, lower_m = self._rims(key)
        skirt_m = lower_m + self.max_error_m * 2**key.level  # about a pixel, which hides that renderers round places
        edges = self._between_tiles(key, posts, rim_of(faces), last)
        hanging, at = np.unique(edges, return_inverse=True)
        (a, b), (c, d) = edges.T, at.reshape(-1, 2).T + len(posts)
        walls = np.concatenate([np.stack([a, c, d], -1), np.stack([a, d, b], -1)]).reshape(-1, 3)
        normals = _normals(near, posts + origin)
        all_posts = np.concatenate([posts, posts[hanging]]) + origin
        on_map = np.stack(
            [np.interp(all_posts[:, i], np.arange(len(each)), each) for i, each in ((0, cols), (1, rows))], -1
        )
        places = self._near(axes, on_map, np.concatenate([tops_m, tops_m[hanging] - skirt_m])).astype("f4")
        faces = np.concatenate([faces, walls])
        world = places.astype(np.float64) @ axes[:3, :3].T + axes[:3, 3]
        sag = sag_m(self.system, tolerance_m)
        posts_m, surface_m, _ = tile_error(self.heightmap, self.system, world[faces], tolerance_m)
        # whoever measures again divides triangles in another way: both are exact to `sag_m`
        error_m = max(posts_m + sag, of_rim_m)
        declared_m = error_m + sag_m(self.system, error_m / (1 - 2e-3))
        extras = {"error_posts_m": posts_m, "error_surface_m": surface_m, "skirt_m": skirt_m, "triangles": len(faces)}
        box = [places.min(0).tolist(), places.max(0).tolist()]
        record = {"declared_m": declared_m, "axes": axes.tolist(), "box": box, "extras": extras}
        cropped = None if picture is None else _cropped(picture, (on_map + 0.5) / self.size[::-1])
        return _glb(places, np.concatenate([normals, normals[hanging]]), faces, cropped), record

    def _near(self, axes: np.ndarray, posts: np.ndarray, tops_m: np.ndarray) -> np.ndarray:
        """Places in a tile's own axes."""
        return (self.system.to_world(posts, tops_m) - axes[:3, 3]) @ axes[:3, :3]

    def _sides(self, key: TileKey) -> Iterator[tuple[int, int, int, np.ndarray]]:
        """The sides of a tile: axis and number of a line of posts, whether it is the last, and the posts on it."""
        length = SIDE << key.level
        first = np.array([key.row, key.col]) * length
        last = np.minimum(first + length, np.array(self.size) - 1)
        for axis in (0, 1):
            at = np.arange(first[1 - axis], last[1 - axis] + 1)
            for end, line in enumerate((first[axis], last[axis])):
                yield axis, int(line), end, at

    def _is_shared(self, axis: int, line: int) -> bool:
        """Whether there are tiles on both sides of a line of posts."""
        return 0 < line < self.size[axis] - 1

    def _between_tiles(self, key: TileKey, posts: np.ndarray, edges: np.ndarray, last: np.ndarray) -> np.ndarray:
        """The edges of a tile's rim that lie on a side shared with other tiles."""
        shared = np.zeros(len(edges), bool)
        for axis, line, end, _ in self._sides(key):
            if self._is_shared(axis, line):
                shared |= (posts[edges][:, :, 1 - axis] == end * last[1 - axis]).all(1)
        return edges[shared]

    def _rims(self, key: TileKey) -> tuple[float, float]:
        """The largest error on a tile's rims, and how far a tile of any level may be lower there."""
        error_m = lower_m = 0.0
        for axis, line, _, at in self._sides(key):
            own = self._rim(key.level, axis, line, at)
            error_m = max(error_m, float(np.nanmax(np.abs(own - self._line(axis, line, at)), initial=0.0)))
            for level in range(self.top + 1):
                if self._is_shared(axis, line) and line % (SIDE << level) == 0:
                    step_m = self.heightmap.spacing_m[axis] * (1 << max(level, key.level))
                    beside = self.system.sag_m(step_m) + self.rounding_m
                    below = own - self._rim(level, axis, line, at)
                    lower_m = max(lower_m, float(np.nanmax(below, initial=0.0)) + beside)
        return error_m + self.system.sag_m(max(self.heightmap.spacing_m) * (1 << key.level)), lower_m

    def _rim(self, level: int, axis: int, line: int, at: np.ndarray) -> np.ndarray:
        """Heights of the rim of a level's tiles at posts of a line; NaN beside a void."""
        posts = self.lattice(level, 1 - axis, at[0] >> level, -(-at[-1] >> level))
        return np.interp(at, posts, self._line(axis, line, posts))

    def _line(self, axis: int, line: int, at: np.ndarray) -> np.ndarray:
        """True heights of posts of a row (axis 0) or column (axis 1), float64."""
        index = (np.array([line]), at) if axis == 0 else (at, np.array([line]))
        return self.heightmap.heights[np.ix_(*index)].reshape(-1).astype(np.float64)


@lru_cache(maxsize=1)
def _opened(source: tuple[str, Reading, Spacing | None], max_error_m: float, is_local: bool, run: str) -> Tiling:
    """The tiling of a map in a worker, which opens the map once for each run."""
    heightmap = StoredMap(source[0]) if is_store(source[0]) else open_map(*source)[0]
    return Tiling(heightmap, max_error_m, is_local, source)


def _with_rough_rim(tops_m: np.ndarray, by_m: float) -> np.ndarray:
    """Heights for the mesher, which then takes nearly all posts of the rim while it keeps triangles wide.

    Vertices that are added later, by `with_whole_rim`, may be many between two of the mesher's. Their triangles are
    then thinner than a pixel, and some renderers (SwiftShader) leave such triangles out.
    """
    rough = tops_m + by_m * (np.indices(tops_m.shape).sum(0) % 2 * 2 - 1)
    rough[1:-1, 1:-1] = tops_m[1:-1, 1:-1]
    return rough.astype("f4")


def _cropped(picture: np.ndarray, at: np.ndarray) -> tuple[np.ndarray, bytes]:
    """The part of a picture with all places `at` and a pixel more around, as JPEG, and the places in it; 0 to 1."""
    size = np.array(picture.shape[1::-1])
    low = np.maximum(np.floor(at.min(0) * size).astype(int) - 1, 0)
    high = np.minimum(np.ceil(at.max(0) * size).astype(int) + 1, size)
    part = np.ascontiguousarray(picture[low[1] : high[1], low[0] : high[0]])
    return (at * size - low) / (high - low), file_bytes(part, ".jpg")


def _glb(places: np.ndarray, normals: np.ndarray, faces: np.ndarray, cropped: tuple[np.ndarray, bytes] | None) -> bytes:
    """Binary glTF of a tile, y up: a place (x, y, z) is stored as (x, z, -y)."""
    stored = [(each[:, [0, 2, 1]] * [1, 1, -1]).astype("<f4") for each in (places, normals)]
    box = stored[0].min(0), stored[0].max(0)
    at, texture = cropped or (np.zeros((0, 2)), b"")
    head = gltf_head(len(places), len(faces), box, {"mesh": 0}, texture, cropped is not None)
    parts = *stored, at.astype("<f4"), faces.astype("<u4")
    return head + b"".join(each.tobytes() for each in parts) + padded(texture)


def _normals(near: np.ndarray, posts: np.ndarray) -> np.ndarray:
    """(n, 3) unit normals at columns and rows of a lattice of places, from the next posts on both sides."""
    last = np.array(near.shape[1::-1]) - 1
    steps = []
    for step in ((1, 0), (0, -1)):
        ends = [np.clip(posts + sign * np.array(step), 0, last) for sign in (1, -1)]
        high, low = (np.stack([vertex_heights(near[..., i], end) for i in range(3)], -1) for end in ends)
        steps.append(high - low)
    normals = np.cross(*steps)
    return normals / np.linalg.norm(normals, axis=1, keepdims=True)


def write_tiles(
    tiling: Tiling,
    output: str | os.PathLike[str],
    progress: Callable[[float], None] | None = None,
    picture: np.ndarray | None = None,
    workers: int = 1,
    address: str | None = None,
) -> dict[str, Any]:
    """Write all tiles of a map, and `tileset.json`. The folder appears when it is complete.

    Until then the tiles are in a folder beside it. The same call continues an interrupted one.

    Parameters
    ----------
    picture
        The map from above as a texture: see `Tiling.make`.
    workers, address
        Processes of this machine, or a Dask scheduler whose workers see the same files.

    Returns
    -------
    dict
        The numbers of docs/stats.md.

    Raises
    ------
    TerrainError
        The folder exists, or cannot be written; or another process writes it.
    """
    output = Path(output)
    if output.exists():
        raise TerrainError(f"{output}: exists already: remove it, or name another folder")
    if not output.absolute().parent.is_dir():
        raise TerrainError(f"{output}: there is no folder {output.parent}: make it first")
    part = output.with_name(f".{output.name}.partial")
    with locked(part, waits=False) as is_ours:
        if not is_ours:
            raise TerrainError(f"{output}: another process is writing it")
        _start(tiling, part, picture)
        keys = [key for level in range(tiling.top + 1) for key in tiling.keys(level)]
        records = {}
        with contextlib.closing(scheduler(workers, address)) as runner:
            for key, record in zip(keys, runner.in_order(_kept, (tiling, part.absolute()), keys), strict=True):
                records[key] = record
                if progress:
                    progress(len(records) / len(keys))
        root = _tree(tiling, records, TileKey(tiling.top, 0, 0))
        assert root
        low_m, high_m = tiling.heightmap.range_m
        asset = {"version": "1.1", "generator": "terrain-gl", "extras": {"is_local": tiling.system.is_local}}
        whole = {"asset": asset, "geometricError": max(root["geometricError"], high_m - low_m), "root": root}
        (part / "tileset.json").write_text(json.dumps(whole, separators=(",", ":")), "utf-8")
        shutil.rmtree(part / _RECORDS)
        os.rename(part, output)
    land = {key: record for key, record in records.items() if record}
    finest_m = [record["declared_m"] for key, record in land.items() if key.level == 0]
    return {
        "map": tiling.heightmap.name,
        "tiles": len(land),
        "levels": tiling.top + 1,
        "triangles": sum(record["extras"]["triangles"] for record in land.values()),
        "bytes": sum(file.stat().st_size for file in output.iterdir()),
        "is_local": tiling.system.is_local,
        "requested_max_error_m": tiling.max_error_m,
        "max_error_m": {"finest": max(finest_m), "coarsest": root["geometricError"]},
    }


def _start(tiling: Tiling, part: Path, picture: np.ndarray | None) -> None:
    """Make the folder of an unfinished tile set, and empty it unless it is of the same map and options."""
    heightmap = tiling.heightmap
    heights = getattr(heightmap, "identity", None) or hashlib.sha256(heightmap.heights.data).hexdigest()
    look = None if picture is None else hashlib.sha256(picture.tobytes()).hexdigest()
    options = tiling.max_error_m, tiling.system.is_local, SIDE
    same = [heights, look, heightmap.spacing_m, heightmap.georeference, *options]
    told = part / _RECORDS / "of.json"
    text = json.dumps([__version__, repr(same)])
    if not told.exists() or told.read_text("utf-8") != text:
        for old in part.iterdir():
            shutil.rmtree(old) if old.is_dir() else old.unlink()
        told.parent.mkdir()
        if picture is not None:
            np.save(part / _RECORDS / _PICTURE, picture)
        told.write_text(text, "utf-8")


def _kept(job: tuple[Tiling, Path], key: TileKey) -> dict[str, Any]:
    """The record of a tile that is written, now or by an interrupted call."""
    tiling, part = job
    file, texture = part / _RECORDS / f"{key.name}.json", part / _RECORDS / _PICTURE
    if not file.exists():
        data, record = tiling.make(key, np.load(texture, mmap_mode="r") if texture.exists() else None)
        if data:
            (part / f"{key.name}.glb").write_bytes(data)
        beside = file.with_suffix(".partial")
        beside.write_text(json.dumps(record), "utf-8")
        beside.rename(file)
    kept: dict[str, Any] = json.loads(file.read_text("utf-8"))
    return kept


def _tree(
    tiling: Tiling, records: dict[TileKey, dict[str, Any]], key: TileKey, above: np.ndarray | None = None
) -> dict[str, Any] | None:
    """A tile and those below it, as in `tileset.json`; None without land. `above` is the transformation above it."""
    record = records.get(key, {})
    axes = np.array(record["axes"]) if record else np.eye(4) if above is None else above
    below = key.below if key.level else []
    children = [child for each in below if (child := _tree(tiling, records, each, axes))]
    if not record and not children:
        return None
    boxes = [np.array(record["box"])] if record else []
    boxes += [_box_above(child) for child in children]
    low, high = np.min([box[0] for box in boxes], 0), np.max([box[1] for box in boxes], 0)
    error_m = max([record.get("declared_m", 0.0), *(child["geometricError"] for child in children)])
    half = (high - low) / 2
    tile: dict[str, Any] = {
        "boundingVolume": {"box": [*((low + high) / 2).tolist(), half[0], 0, 0, 0, half[1], 0, 0, 0, half[2]]},
        "geometricError": error_m,
        "refine": "REPLACE",
        "transform": (axes if above is None else np.linalg.solve(above, axes)).T.ravel().tolist(),
    }
    if record:
        tile |= {"content": {"uri": f"{key.name}.glb"}, "extras": record["extras"]}
    return tile | ({"children": children} if children else {})


def _box_above(tile: dict[str, Any]) -> np.ndarray:
    """Lowest and highest corner of a tile's box in the axes of the tile above."""
    box, matrix = np.array(tile["boundingVolume"]["box"]), np.array(tile["transform"]).reshape(4, 4).T
    signs = np.stack(np.meshgrid(*[(-1, 1)] * 3), -1).reshape(-1, 3)
    corners = (box[:3] + signs * box[[3, 7, 11]]) @ matrix[:3, :3].T + matrix[:3, 3]
    return np.stack([corners.min(0), corners.max(0)])
