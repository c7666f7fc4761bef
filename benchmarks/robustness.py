"""Thousands of damaged files, and commands that are ended at random moments: one line, no half-written file, no hang.

    python benchmarks/robustness.py                        10,000 files and 300 commands
    python benchmarks/robustness.py --files 500 --ends 20 --seed 7

Files: each is a good file of some kind with bytes flipped, cut out, repeated or swapped with those of another file.
A process reads them, one after the other.
Ends: a command gets SIGINT, SIGTERM or SIGHUP at a random moment, or two signals in a row, or a full disk, which is
simulated by a limit on the size of files.
The output counts the outcomes. The exit status is 1 if there is an outcome that is not allowed.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import select
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from terrain_gl.film.parts import JOURNAL

LONGEST_S = 240.0  # time limit; a file or a command takes seconds, but the machine may be busy
READ = """
import json, os, sys
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.film.path import CameraPath
from terrain_gl.heightmap import Heightmap
from terrain_gl.light.laid import read_ground
from terrain_gl.light.sky import read_sky
READERS = {"path": CameraPath.open, "material": read_ground, "sky": read_sky}
for line in sys.stdin:
    path = line.rstrip()
    try:
        READERS.get(os.path.basename(path).split("-")[0], Heightmap.open)(path)
        told = "read"
    except TerrainError as error:
        clean = "\\n" not in str(error) and path in str(error)
        told = "refused" if clean else f"bad line: {error}"
    except MemoryError:
        told = "refused"
    except BaseException as error:
        told = f"traceback: {type(error).__name__}: {error}"
    print(json.dumps(told), flush=True)
"""


# --- Files ------------------------------------------------------------------------------------------------------------


def good_files(folder: Path) -> dict[str, bytes]:
    """A small good file of each kind, by name."""
    rng = np.random.default_rng(0)
    heights = np.cumsum(rng.integers(-9, 10, (40, 50)), 1).astype("i2")
    np.save(folder / "map.npy", heights)
    np.save(folder / "map-f.npy", np.asfortranarray(heights.astype("f8")))
    np.abs(heights[:40, :40]).astype(">i2").tofile(folder / "map.hgt")
    pixels = {"grey": np.abs(heights).astype("u2"), "rgb": rng.integers(0, 255, (40, 50, 3), "u1")}
    for name in ("map.png", "map.tif", "map.pgm", "map.jpg", "map.bmp"):
        _image(folder / name, pixels["grey"] if "jpg" not in name and "bmp" not in name else pixels["rgb"])
    for name in ("map.exr", "map.hdr", "sky-a.hdr", "sky-b.exr"):
        _image(folder / name, np.repeat(rng.random((32, 64, 1), "f4"), 3, 2))
    _image(folder / "material-a.jpg", pixels["rgb"])
    _image(folder / "material-b.png", pixels["rgb"])
    (folder / "map.asc").write_text("ncols 5\nnrows 4\nxllcorner 0\nyllcorner 0\ncellsize 2\n" + "1 2 3 4 5\n" * 4)
    (folder / "map.xyz").write_text("".join(f"{x} {y} {x * y}\n" for y in range(5) for x in range(5)))
    keyframes = [{"eye": [0, i, 9], "target": [i, 0, 0], "seconds": i} for i in range(4)]
    (folder / "path-a.json").write_text(json.dumps({"keyframes": keyframes, "closed": False}))
    _through_gdal(folder, heights)
    return {path.name: path.read_bytes() for path in sorted(folder.iterdir())}


def _image(path: Path, pixels: np.ndarray) -> None:
    assert oiio.ImageBuf(np.ascontiguousarray(pixels if pixels.ndim == 3 else pixels[..., None])).write(str(path))


def _through_gdal(folder: Path, heights: np.ndarray) -> None:
    """Kinds that GDAL writes, if it is installed."""
    try:
        import rasterio
    except ImportError:
        return
    profile = {"width": 50, "height": 40, "count": 1, "dtype": "int16", "nodata": -32768, "crs": "EPSG:32610"}
    grid = rasterio.Affine(30, 0, 5e5, 0, -30, 4e6)
    for name, driver in (("geo.tif", "GTiff"), ("geo.img", "HFA"), ("geo.bil", "EHdr"), ("geo.rst", "RST")):
        with rasterio.open(folder / name, "w", driver=driver, transform=grid, **profile) as out:
            out.write(heights, 1)
    rect = 'xOff="0" yOff="0" xSize="50" ySize="40"'
    (folder / "geo.vrt").write_text(
        '<VRTDataset rasterXSize="50" rasterYSize="40"><SRS>EPSG:32610</SRS><GeoTransform>0,30,0,0,0,-30</GeoTransform>'
        '<VRTRasterBand dataType="Int16" band="1"><NoDataValue>-1</NoDataValue><ComplexSource><SourceFilename '
        f'relativeToVRT="1">geo.tif</SourceFilename><SourceBand>1</SourceBand><SrcRect {rect}/><DstRect {rect}/>'
        "<NODATA>3</NODATA></ComplexSource></VRTRasterBand></VRTDataset>"
    )


def damaged(data: bytes, other: bytes, chance: random.Random) -> bytes:
    """A damaged copy of a file; most damage is near its start, where the headers are."""
    spoilt = bytearray(data)
    for _ in range(chance.choice((1, 1, 2, 5, 20))):
        at = int(len(spoilt) * chance.random() ** 3)
        length = chance.choice((1, 1, 2, 4, 8, 64))
        way = chance.randrange(6)
        if way == 0:
            spoilt[at : at + length] = chance.randbytes(length)
        elif way == 1:
            spoilt[at : at + length] = chance.choice((b"\x00", b"\xff", b"\x7f", b"-", b"9")) * length
        elif way == 2:
            del spoilt[at : at + length]
        elif way == 3:
            spoilt[at:at] = spoilt[at : at + length] * chance.randrange(1, 4)
        elif way == 4:
            spoilt[at : at + length] = other[at : at + length]
        elif way == 5 and chance.random() < 0.3:
            del spoilt[at:]
    return bytes(spoilt)


class Reader:
    """A process that reads files, one at a time; it is started again if it dies."""

    def __init__(self) -> None:
        self._process: subprocess.Popen[bytes] | None = None
        self._noise = tempfile.TemporaryFile()  # noqa: SIM115  as long as this lives

    def read(self, path: Path) -> str:
        """The outcome of reading a file."""
        process = self._process = self._process or self._start()
        assert process.stdin and process.stdout
        process.stdin.write(os.fsencode(path) + b"\n")
        process.stdin.flush()
        if not select.select([process.stdout], [], [], LONGEST_S)[0]:
            self.close()
            return "hang"
        line = process.stdout.readline()
        if not line:
            status = process.wait()
            self._process = None
            return f"crash: status {status}"
        return json.loads(line)

    def noise(self) -> bytes:
        """What was written to standard error so far."""
        self._noise.seek(0)
        return self._noise.read()

    def close(self) -> None:
        """End the process."""
        if self._process:
            self._process.kill()
            self._process.wait()
        self._process = None

    def _start(self) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-c", READ]
        return subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self._noise)


def read_damaged(count: int, seed: int, folder: Path) -> Iterator[tuple[str, str, Path]]:
    """Damage and read files: yields the kind, the outcome and the file."""
    chance = random.Random(seed)
    good = folder / "good"
    good.mkdir()
    kinds = good_files(good)
    reader = Reader()
    try:
        for i in range(count):
            name = chance.choice(list(kinds))
            place = folder / f"{i:05d}"
            place.mkdir()
            for beside in ("geo.tif", "geo.hdr", "geo.rdc"):
                if beside in kinds:
                    (place / beside).write_bytes(kinds[beside])
            path = place / name
            path.write_bytes(damaged(kinds[name], chance.choice(list(kinds.values())), chance))
            told = reader.read(path)
            yield path.suffix, told, path
            if told in ("read", "refused"):
                for each in place.iterdir():
                    each.unlink()
                place.rmdir()
        if noise := reader.noise():
            yield "all", f"standard error: {noise[:300]!r}", folder
    finally:
        reader.close()


# --- Ends -------------------------------------------------------------------------------------------------------------

COMMANDS = {
    "shot map.npy -o out.png --size 320x180": 2.5,
    "mesh map.npy -o out.ply --max-error 0.2": 2.5,
    "generate out.tif --size 300": 2.5,
    "fly map.npy -o out.gif --size 64x36 --seconds 8": 6.0,
    "fly map.npy -o frames/ --size 64x36 --seconds 8": 6.0,
    "shot map.npy -o out.exr --size 320x180 --json out.json": 2.5,
}
ENDS = ("INT", "TERM", "HUP", "INT TERM", "TERM TERM", "HUP TERM", "full")
KEPT = b"what was there before"


def end_commands(count: int, seed: int, folder: Path) -> Iterator[tuple[str, str, Path]]:
    """End commands: yields the way, the outcome and the folder."""
    chance = random.Random(seed)
    heights = np.random.default_rng(1).random((200, 200)).astype("f4")
    for i in range(count):
        place = folder / f"end-{i:04d}"
        place.mkdir()
        np.save(place / "map.npy", heights)
        command, seconds = chance.choice(list(COMMANDS.items()))
        how = chance.choice(ENDS)
        yield how, _ended(command, how, chance.random() ** 0.7 * seconds, place, chance), place


def _ended(command: str, how: str, after_s: float, place: Path, chance: random.Random) -> str:
    words = command.split()
    output = next(word for word in words if word.startswith(("out", "frames")))
    if kept := chance.random() < 0.5 and output != "frames/":
        (place / output).write_bytes(KEPT)
    limit = (chance.randrange(1, 60_000), resource.RLIM_INFINITY)
    full = (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit)) if how == "full" else None
    process = subprocess.Popen(
        [sys.executable, "-m", "terrain_gl", *words],
        cwd=place,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        preexec_fn=full,
    )
    if full is None:
        time.sleep(after_s)
        for name in how.split():
            process.send_signal(getattr(signal, f"SIG{name}"))
            time.sleep(chance.choice((0, 0.001, 0.004, 0.05)))
    try:
        error = process.communicate(timeout=LONGEST_S)[1]
    except subprocess.TimeoutExpired:
        process.kill()
        process.communicate()
        return "hang"
    return _left(place, output, kept, error, process.returncode)


def _left(place: Path, output: str, kept: bool, error: bytes, status: int) -> str:
    """The outcome of a command, by the files that it has left."""
    if b"KeyboardInterrupt" in error and b"/terrain_gl/cli/" not in error:
        return "python's own start"  # before the command line listens; nothing is written yet
    if b"Traceback" in error or error.count(b"\n") > 1:
        return f"traceback: {error[-300:]!r}"
    names = sorted(path.name for path in place.rglob("*") if path.is_file())
    if orphans := [name for name in names if name.startswith(".") and name != JOURNAL]:  # a flight's journal may stay
        return f"orphans: {orphans}"
    half = [path for path in place.rglob("*.*") if path.name.startswith(("out", "frame-")) and not _whole(path, kept)]
    if half:
        return f"half-written: {half[0].name}"
    if status < 0 and signal.Signals(-status) not in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        return f"crash: status {status}"
    return "done" if status == 0 else "ended"


def _whole(path: Path, kept: bool) -> bool:
    data = path.read_bytes()
    if kept and data == KEPT:
        return True
    if path.suffix == ".json":
        return isinstance(json.loads(data), dict)
    if path.suffix == ".gif":
        return data.startswith(b"GIF8") and data.endswith(b";")
    if path.suffix == ".ply":
        head, _, body = data.partition(b"end_header\n")
        counts = [int(line.split()[-1]) for line in head.split(b"\n") if line.startswith(b"element")]
        of_vertex = sum(
            {b"double": 8, b"float": 4}.get(line.split()[1], 0) for line in head.split(b"\n") if b"property" in line
        )
        return len(body) == of_vertex * counts[0] + 13 * counts[1]
    image = oiio.ImageBuf(str(path))
    return bool(image.read(0, 0, True)) and not image.has_error


# --- Both -------------------------------------------------------------------------------------------------------------


def tally(results: Iterator[tuple[str, str, Path]], total: int) -> tuple[Counter[str], list[str]]:
    """Count the outcomes, and list those that are not allowed."""
    seen: Counter[str] = Counter()
    wrong = []
    for i, (kind, told, path) in enumerate(results, 1):
        seen[told if told in FINE else told.split(":")[0]] += 1
        if told not in FINE:
            wrong.append(f"{kind} {path}: {told}")
            print(wrong[-1], flush=True)
        if sys.stderr.isatty() and i % 50 == 0:
            sys.stderr.write(f"\r{i} of {total}\x1b[K")
    return seen, wrong


FINE = ("read", "refused", "done", "ended", "python's own start")


def main() -> int:
    """Run both parts, and print the counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--files", type=int, default=10_000)
    parser.add_argument("--ends", type=int, default=300)
    parser.add_argument("--seed", type=int, default=1)
    args = parser.parse_args()
    folder = Path(tempfile.mkdtemp(prefix="robustness-"))
    started = time.monotonic()
    files, wrong_files = tally(read_damaged(args.files, args.seed, folder), args.files)
    print(f"{args.files} damaged files: {dict(files)}, {time.monotonic() - started:.0f} s", flush=True)
    ends, wrong_ends = tally(end_commands(args.ends, args.seed, folder), args.ends)
    print(f"{args.ends} ends: {dict(ends)}, {time.monotonic() - started:.0f} s; what is left is in {folder}")
    return 1 if wrong_files or wrong_ends else 0


if __name__ == "__main__":
    sys.exit(main())
