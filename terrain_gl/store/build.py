"""Build a store of a map. An interrupted build continues where it stopped, and gives the same bytes."""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.inputs import is_store
from ..basics.locks import locked
from ..basics.version import __version__
from ..readers import Reading
from ..readers.plausible import not_of_the_earth
from ..readers.raster import Spacing, both
from ..readers.values import AS_STORED
from ..readers.windows import WindowedRaster, identity_of, open_windows, windows_of
from . import water
from .checking import Findings, check, noted_of
from .format import VERSION, Arrays, mending, read_about, zarr_library
from .job import BUILT, WORK, BuildJob, Shard, Task
from .pyramid import SHARD, TILE, StoreSizes, areas
from .scheduling import Cluster, Here, Processes, scheduler
from .tasks import of_all, of_source, perform, phases
from .tiles import Checks

Progress = Callable[[float], None]
_OPENING = 0.05  # share of the progress for opening the source
_FOLDERS = ("checks", "ranges", "errors", "marks", "heights")  # of a store; heights last: they show that it is one


def build(
    source: Any,
    output: str | os.PathLike[str],
    spacing_m: float | Spacing | None = None,
    reading: Reading = AS_STORED,
    fill_m: float | None = None,
    workers: int = 1,
    address: str | None = None,
    progress: Progress | None = None,
    tile: int = TILE,
    shard: int = SHARD,
    tell: Callable[[str], None] | None = None,
    look: str = "auto",
    mends: bool = False,
) -> dict[str, Any]:
    """Build a store of a map of any size. The source is read window by window, and is never written.

    A finished store of the same source is checked. Of several builds into one folder, one works, and the others wait.

    Parameters
    ----------
    source
        A file, a list of files on one grid, a DataArray of xarray, or any 2-D object with `shape` and slices, such as a
        Dask array. An object may have `spacing_m`.
    output
        The store's folder. If it holds an unfinished store of the same source, the build continues.
    spacing_m
        Metres between posts; by default the spacing in the source. If it has none, 1, or more if land would be too
        steep: a note says so, as for files. An array that is computed window by window counts as 1, with a note.
    reading
        How files are read.
    fill_m
        A height for all void posts, which then are land. Without it they stay voids, and the store marks them.
    workers, address
        Number of processes on this machine; or the address of a Dask scheduler.
    tile, shard
        Posts along a side of a tile, and along a side of a shard, which one task writes; powers of two.
    tell
        Function that gets lines for the user before the work begins: how the source was interpreted, why it waits.
    look
        How the land is coloured by default: `Heightmap.look`.
    mends
        Write the damaged files of a finished store again, and remove files that are not of the store. The source is
        read once as a whole; errors are measured again only where they are damaged.

    Returns
    -------
    dict
        The store's description.

    Raises
    ------
    TerrainError
        The source cannot be read, the folder holds something else, the store is damaged, or the disk is full.
    """
    zarr_library()
    path = os.fspath(output)
    if tile & tile - 1 or shard & shard - 1 or not 8 <= tile <= shard:
        raise UsageError(f"tile and shard must be powers of two, 8 ≤ tile ≤ shard, got {tile} and {shard}")
    lines = tell or (lambda _: None)
    asked = _asked(source, reading, spacing_m, fill_m, look, tile, shard)
    with locked(path, tell=lambda: lines(f"{path}: waits for another build of this store")):
        findings = _findings(path, progress) if mends else None
        about = findings.about if findings else _finished(path)
        if about and about["asked"] == asked is not None:
            findings = findings or check(path, progress)
            if not mends or not findings.damage:
                return _sound(path, findings, lines)
        windows = _opened(source, reading, spacing_m, progress)
        for note in windows.notes:
            lines(f"{windows.name}: {note}")
        if workers > 1 and windows.identity is None and not address:
            raise UsageError("an object in memory is built in this process: leave workers at 1")
        if min(windows.shape) < 2:
            raise TerrainError(
                f"{windows.name}: {windows.shape[1]} x {windows.shape[0]} posts: expected at least 2 x 2"
            )
        spacing = both(spacing_m if spacing_m is not None else windows.spacing_m or 1.0)
        assumes_spacing = spacing_m is None and windows.assumes_spacing
        sizes = StoreSizes(*windows.shape, tile, shard)
        whole = findings.whole if findings else frozenset()
        job = BuildJob(path, sizes, windows, spacing, fill_m, look, assumes_spacing, whole=whole)
        journal = BuildJournal(job, asked, findings)
        if journal.is_finished:
            return _sound(path, findings or check(path, progress))
        with contextlib.closing(scheduler(workers, address)) as runner:
            return _run(job, journal, runner, progress)


def _asked(source: object, reading: Reading, *options: object) -> Any:
    """What a build of files was asked for, as JSON: builds with equal values make equal stores. None for an object."""
    paths = [source] if isinstance(source, str | os.PathLike) else source
    if not isinstance(paths, Sequence) or not paths or not isinstance(paths[0], str | os.PathLike):
        return None
    return json.loads(json.dumps([[identity_of(os.fspath(path), reading) for path in paths], *options]))


def _opened(
    source: Any, reading: Reading, spacing_m: float | Spacing | None, progress: Progress | None
) -> WindowedRaster:
    def show(part: float) -> None:
        if progress:
            progress(_OPENING * part)

    if isinstance(source, str | os.PathLike):
        return open_windows([source], reading, spacing_m, show)
    if isinstance(source, Sequence) and source and isinstance(source[0], str | os.PathLike):
        return open_windows(source, reading, spacing_m, show)
    windows = windows_of(source, str(getattr(source, "name", None) or type(source).__name__))
    if spacing_m is None:
        windows.guess()
    return windows


def _finished(path: str) -> dict[str, Any] | None:
    """The description of a finished store; None if the folder holds none."""
    if not is_store(path) or (Path(path) / WORK).is_dir():
        return None
    shutil.rmtree(Path(path) / BUILT, ignore_errors=True)
    return read_about(path)


def _findings(path: str, progress: Progress | None) -> Findings | None:
    """The damage of a store that is to be mended; None for a build that has not ended, which only goes on."""
    if (Path(path) / WORK).is_dir():
        return None
    if not (Path(path) / "heights").is_dir():
        raise TerrainError(f"{path}: is not a store: make one with terrain-gl build")
    return check(path, progress)


def _sound(path: str, findings: Findings, tell: Callable[[str], None] | None = None) -> dict[str, Any]:
    """The description of a store without damage; else a `TerrainError`."""
    if findings.damage or not findings.about:
        first = findings.damage[0]
        count = f"{len(findings.damage)} of its files are" if len(findings.damage) > 1 else "a file of it is"
        raise TerrainError(f"{path}: {count} damaged, {first.file}: {first.reason}: {mending(path)}")
    if tell:
        for note in findings.about["notes"]:
            tell(f"{findings.about['name']}: {note}")
    return findings.about


def _run(
    job: BuildJob, journal: BuildJournal, runner: Here | Processes | Cluster, progress: Progress | None
) -> dict[str, Any]:
    first = of_source(job.pyramid)
    done = 0.0
    total = sum(map(_cost, (first, *phases(job.pyramid, (), False))))

    def work(tasks: list[Task]) -> None:
        nonlocal done
        left = [task for task in tasks if task not in journal.results]
        each = _cost(tasks) / len(tasks)
        done += each * (len(tasks) - len(left))
        for task, result in zip(left, runner.in_order(perform, job, left), strict=True):
            journal.add(task, result)
            done += each
            if progress:
                progress(_OPENING + (1 - _OPENING) * done / total)

    work(first)
    job = replace(job, range_m=journal.range_m, voids=journal.voids)
    work(of_all(job.pyramid))
    job = replace(job, has_water=journal.has_water)
    todo = list(phases(job.pyramid, journal.with_voids, job.is_marked))
    total = sum(map(_cost, (first, *todo)))
    if job.is_marked:
        job.arrays.create(is_marked=True)
    for tasks in todo:
        work(tasks)
    return journal.finish()


def _cost(tasks: list[Task]) -> float:
    """Rough cost of a phase; measuring errors takes longest."""
    return {"read": 1.0, "measure": 6.0}.get(tasks[0].phase, 0.3) * len(tasks)


class BuildJournal:
    """The finished tasks of a build: one line each, written after the task's shards."""

    def __init__(self, job: BuildJob, asked: object = None, findings: Findings | None = None) -> None:
        self.job = job
        self.folder = Path(job.path) / WORK
        self._built = self.folder.with_name(BUILT)
        self._asked = asked
        self._findings = findings
        self.results: dict[Task, dict[str, Any]] = {}
        self.is_finished = False
        identity = {
            **job.pyramid._asdict(),
            "spacing_m": job.spacing_m,
            "fill_m": job.fill_m,
            "look": job.look,
            "assumes_spacing": job.assumes_spacing,
            "source": job.source.identity,
        }
        self._identity = json.loads(json.dumps(identity))
        self._begun = {"format": VERSION, "written_by": __version__, **self._identity}
        if findings:
            self._begin_mending(findings)
        elif is_store(job.path) and not self.folder.is_dir():
            self._check_same(read_about(job.path))
            self.is_finished = True
        else:
            self._begin_or_continue()

    @property
    def range_m(self) -> tuple[float, float]:
        """Lowest and highest height of the map."""
        ranges = [found["range_m"] for found in self._of_source() if found["range_m"]]
        if not ranges:
            name = self.job.source.name
            raise TerrainError(f"{name}: every post is void (no-data, NaN or Inf): check the no-data value")
        return min(low for low, _ in ranges), max(high for _, high in ranges)

    @property
    def voids(self) -> int:
        """Number of posts without data."""
        return sum(found["voids"] for found in self._of_source())

    @property
    def has_water(self) -> bool:
        """Whether water was found in the map's heights."""
        return any(self.results[task]["has_water"] for task in of_all(self.job.pyramid))

    @property
    def sea_m(self) -> float | None:
        """The height of the sea."""
        found = [each for result in self.results.values() for each in result.get("water_on_rim", ())]
        return water.sea(self.job.pyramid, found)

    @property
    def with_voids(self) -> list[Task]:
        """The tasks of the first phase that found voids."""
        return [task for task in of_source(self.job.pyramid) if self.results[task]["voids"]]

    def add(self, task: Task, result: dict[str, Any]) -> None:
        """Write a finished task to the journal."""
        self.results[task] = result
        with open(self.folder / "done", "a", encoding="utf-8") as file:
            file.write(json.dumps([task, result]) + "\n")

    def finish(self) -> dict[str, Any]:
        """Write the store's description, and remove the files that only the build needed."""
        job = self.job
        checks = Checks(job.pyramid, self.voids > 0 or self.has_water)
        for result in self.results.values():
            for name, level, row, col, noted in result["checks"]:
                checks.note(name, level, (row // job.pyramid.tile, col // job.pyramid.tile), np.array(noted))
        shards = of_source(job.pyramid)
        filled = [task._replace(phase="replace") for task in shards]
        pairs = zip(shards, filled, strict=True)
        hashes = "".join(self.results.get(last, self.results[first])["sha256"] for first, last in pairs)
        source = job.source
        place = source.georeference
        about = self._identity | {
            "asked": self._asked,
            "name": os.path.basename(source.name),
            "range_m": list(self.range_m),
            "georeference": {"transform": list(place.grid), "crs": place.crs} if place else None,
            "of_earth": source.is_told or place is not None or not not_of_the_earth(self.range_m),
            "notes": list(source.notes),
            "values": source.values,
            "voids": self.voids,
            "has_water": self.has_water,
            "sea_m": self.sea_m,
            "filled_voids": sum(found["filled"] for found in self._of_source()),
            "sha256": hashlib.sha256(hashes.encode()).hexdigest(),
            "checks_sha256": checks.sha256,
        }
        before = self._findings and self._findings.checks
        if before and before.sha256 != checks.sha256:
            raise TerrainError(
                f"{job.path}: {source.name} gives other heights than before: remove the store, build anew"
            )
        for partial in Path(job.path).rglob("*.partial"):  # left by tasks that were killed
            partial.unlink()
        arrays = Arrays(job.path, job.pyramid)
        arrays.write_checks(checks.values)
        arrays.write_about(about)
        os.replace(self.folder, self._built)  # in one step: an interrupted build leaves no half-removed folder
        shutil.rmtree(self._built)
        return read_about(job.path)

    def _of_source(self) -> Iterator[dict[str, Any]]:
        return (self.results[task] for task in of_source(self.job.pyramid))

    def _check_same(self, about: dict[str, Any]) -> None:
        same = all(about.get(key) == value for key, value in self._identity.items())
        if not same or self.job.source.identity is None:
            raise TerrainError(f"{self.job.path}: is a store of another map or a changed one: remove it first")

    def _begin_mending(self, findings: Findings) -> None:
        """Remove what is damaged, and begin a build; measuring is done again only where its results are damaged."""
        path = Path(self.job.path)
        if findings.about:
            self._check_same(findings.about)
        if findings.about and not findings.damage:
            self.is_finished = True
            return
        damaged = [damage.file for damage in findings.damage] if findings.checks else ["zarr.json", *_FOLDERS]
        for harmed in (path / name for name in damaged):
            if harmed.is_dir() and not harmed.is_symlink():
                shutil.rmtree(harmed)
            else:
                harmed.unlink(missing_ok=True)
        self._begin()
        self._create()
        if findings.checks:
            self._skip_measuring(findings.checks)

    def _skip_measuring(self, checks: Checks) -> None:
        """Note the tasks that measure errors, if these are whole."""
        pyramid = self.job.pyramid
        coarse = {
            Task("gather", level, *at): [Shard(name, level, *at) for name in ("errors", "ranges")]
            for level in range(pyramid.fine + 1, pyramid.top + 1)
            for at in areas(pyramid.nodes(level), pyramid.shard)
        }
        fine = {
            Task("measure", 0, *at): [
                Shard(name, level, *at) for level in range(1, pyramid.fine + 1) for name in ("errors", "ranges")
            ]
            for at in areas(pyramid.nodes(0), pyramid.shard)
        }
        if not all(self.job.whole.issuperset(shards) for shards in coarse.values()):
            return  # all measured records are needed
        for task, shards in (coarse | fine).items():
            if self.job.whole.issuperset(shards):
                self.add(task, {"checks": [noted_of(checks, pyramid, shard) for shard in shards]})

    def _begin_or_continue(self) -> None:
        path = Path(self.job.path)
        begun = self.folder / "identity.json"
        if begun.is_file():
            if json.loads(begun.read_text("utf-8")) != self._begun or self._identity["source"] is None:
                raise TerrainError(f"{path}: was begun from another map, or with other options: remove it first")
            self._read()
        else:
            if (path / "heights").is_dir():
                raise TerrainError(f"{path}: its zarr.json is missing: {mending(path)}")
            if path.is_dir() and any(entry.name != WORK for entry in path.iterdir()):
                raise TerrainError(f"{path}: is a folder that holds something else: name another one")
            self._begin()
        self._create()

    def _begin(self) -> None:
        begun = self.folder / "identity.json"
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            beside = begun.with_suffix(".partial")
            beside.write_text(json.dumps(self._begun), "utf-8")
            os.replace(beside, begun)
        except OSError as error:
            raise TerrainError(f"{self.job.path}: cannot write: {error.strerror or error}") from None

    def _create(self) -> None:
        Arrays(self.job.path, self.job.pyramid).create()

    def _read(self) -> None:
        """The finished tasks; an incomplete line does not count."""
        journal = self.folder / "done"
        if not journal.is_file():
            return
        whole = journal.read_bytes().split(b"\n")[:-1]
        for task, result in map(json.loads, filter(None, whole)):
            self.results[Task(*task)] = result
        journal.write_bytes(b"".join(line + b"\n" for line in whole))
