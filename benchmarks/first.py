"""The first picture: programs, processor seconds, and events to pixels, with and without a cache of shaders.

    python benchmarks/first.py                              programs, `shot alpine`, and the window, under Xvfb
    python benchmarks/first.py --pyvista FOLDER/bin/python  also pyvista's first picture, by a Python that has it;
                                                            this Python is taken if it has pyvista
    python benchmarks/first.py --programs                   a line for each program

Each run is a process of its own, from its start to the file or the end of the window. "Cold" runs have an empty cache
of compiled shaders (MESA_SHADER_CACHE_DIR), "warm" runs that of the run before. Python's compiled modules are there in
all runs, as after an installation by pip: a first run of each kind, which does not count, makes them. All kinds take
turns, so that the load is the same for all; numbers are medians.
"""

from __future__ import annotations

import argparse
import os
import resource
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from table import head, row

from terrain_gl import cli
from terrain_gl.files.maps import open_map
from terrain_gl.files.views import standard_view
from terrain_gl.gpu import shaders

SIZE = (1280, 720)
MAP = "alpine"
STAGES = ("vertex", "tess_control", "tess_evaluation", "geometry", "fragment")
PYVISTA = """
import sys, numpy as np, pyvista
path, east, north, out, *numbers = sys.argv[1:]
h = np.load(path)
rows, cols = h.shape
x, y = np.meshgrid(np.arange(cols) * float(east), (rows - 1 - np.arange(rows)) * float(north))
numbers = [float(v) for v in numbers]
plotter = pyvista.Plotter(off_screen=True, window_size=[1280, 720])
plotter.add_mesh(pyvista.StructuredGrid(x, y, h), color="white", smooth_shading=True)
plotter.camera.position, plotter.camera.focal_point = numbers[:3], numbers[3:6]
plotter.camera.up, plotter.camera.view_angle = (0, 0, 1), numbers[6]
plotter.reset_camera_clipping_range()
plotter.show(auto_close=False)
plotter.screenshot(out)
"""


class Program(NamedTuple):
    """A program that was compiled: its files, the macros of the call, and the bytes of its expanded text."""

    files: str
    defines: str
    bytes: int


def compiled(words: Sequence[str]) -> list[Program]:
    """All programs that a command of the command line compiles, in their order."""
    found: list[Program] = []
    compute, program = shaders.compute, shaders.program

    def note(paths: Sequence[str], defines: shaders.Defines) -> None:
        told = " ".join(f"{name}={value}" for name, value in defines.items())
        found.append(Program(" ".join(paths), told, sum(len(shaders.source(path, defines)) for path in paths)))

    def noted_compute(ctx: Any, path: str, defines: shaders.Defines = shaders.NO_DEFINES) -> Any:
        note([path], defines)
        return compute(ctx, path, defines)

    def noted_program(ctx: Any, *, defines: shaders.Defines = shaders.NO_DEFINES, **how: Any) -> Any:
        note([how[stage] for stage in STAGES if how.get(stage)], defines)
        return program(ctx, defines=defines, **how)

    shaders.compute, shaders.program = noted_compute, noted_program
    try:
        if cli.main(list(words)):
            raise SystemExit(f"terrain-gl {' '.join(words)} failed")
    finally:
        shaders.compute, shaders.program = compute, program
    return found


def tell_programs(each: bool) -> None:
    """Print how many programs the first lit picture compiles, and their text."""
    with tempfile.TemporaryDirectory() as folder:
        programs = compiled(["shot", MAP, "-o", str(Path(folder) / "p.png"), "--size", "x".join(map(str, SIZE))])
    if each:
        head("program", "macros", "bytes")
        for program in programs:
            row(program.files, program.defines, f"{program.bytes:,}")
    print(f"{len(programs)} programs, {sum(program.bytes for program in programs):,} bytes of expanded text")


def timed(command: Sequence[str], environment: dict[str, str]) -> tuple[float, float, str]:
    """Elapsed seconds, processor seconds and output of a process."""
    environment = environment | {"PYTHONDONTWRITEBYTECODE": ""}
    before, clock = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    done = subprocess.run(command, check=True, capture_output=True, text=True, env=os.environ | environment)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    cpu_s = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return time.perf_counter() - clock, cpu_s, done.stdout


def pictures(folder: Path, pyvista: str | None) -> dict[str, list[str]]:
    """Commands of first pictures by name: of ours, and of pyvista, which draws every post."""
    out = str(folder / "picture.png")
    shot = [sys.executable, "-m", "terrain_gl", "shot", MAP, "-o", out]
    commands = {"`shot alpine`": shot, "`shot alpine --style lambert`": [*shot, "--style", "lambert"]}
    if pyvista:
        heightmap, _ = open_map(MAP)
        camera = standard_view(heightmap)
        np.save(folder / "heights.npy", heightmap.heights)
        numbers = [*heightmap.spacing_m, out, *camera.eye, *camera.target, camera.fov_deg]
        commands["pyvista, every post"] = [pyvista, "-c", PYVISTA, str(folder / "heights.npy"), *map(str, numbers)]
    return commands


def tell_pictures(times: int, pyvista: str | None) -> None:
    """Print the times of first pictures."""
    seconds: dict[tuple[str, str], list[tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory() as name:
        commands = pictures(Path(name), pyvista)
        modules = {"PYTHONPYCACHEPREFIX": str(Path(name) / "modules")}
        for command in commands.values():
            timed(command, modules)
        for turn in range(times):
            for i, (what, command) in enumerate(commands.items()):
                cache = modules | {"MESA_SHADER_CACHE_DIR": str(Path(name) / f"cache{turn}-{i}")}
                for state in ("cold", "warm"):
                    seconds.setdefault((what, state), []).append(timed(command, cache)[:2])
    head("first picture", "shader cache", "s", "processor s", "processor s, relative to pyvista")
    for (what, state), taken in seconds.items():
        clock, cpu = (statistics.median(values) for values in zip(*taken, strict=True))
        theirs = [taken[1] for taken in seconds.get(("pyvista, every post", state), [])]
        ratio = f"{cpu / statistics.median(theirs):.1f}" if theirs else "—"
        row(what, state, f"{clock:.1f}", f"{cpu:.1f}", ratio)


def tell_window(times: int) -> None:
    """Print when the window has its first picture, and when it is finished."""
    start = str(Path(__file__).with_name("viewer_start.py"))
    command = ["xvfb-run", "-a", "-s", "-screen 0 1280x800x24", sys.executable, start, MAP]
    rows: dict[tuple[str, str], list[tuple[float, float]]] = {}
    with tempfile.TemporaryDirectory() as name:
        homes = {key: name for key in ("XDG_CONFIG_HOME", "XDG_CACHE_HOME")}
        homes |= {"PYTHONPYCACHEPREFIX": str(Path(name) / "modules")}
        timed(command, homes)
        for turn in range(times):
            for state in ("cold", "warm"):
                told = timed(command, homes | {"MESA_SHADER_CACHE_DIR": str(Path(name) / f"cache{turn}")})[2]
                for line in told.splitlines()[2:]:
                    what, clock, cpu = (cell.strip() for cell in line.split("|")[1:4])
                    rows.setdefault((what, state), []).append((float(clock), float(cpu)))
    head("window", "shader cache", "s from the start", "processor s")
    for (what, state), taken in rows.items():
        clock, cpu = (statistics.median(values) for values in zip(*taken, strict=True))
        row(what, state, f"{clock:.1f}", f"{cpu:.1f}")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--programs", action="store_true", help="only the programs, a line for each")
    here = sys.executable if find_spec("pyvista") else None
    parser.add_argument(
        "--pyvista", metavar="PYTHON", default=here, help="a Python that has pyvista; this one, if it has"
    )
    parser.add_argument("--times", type=int, default=5)
    args = parser.parse_args()
    tell_programs(args.programs)
    if args.programs:
        return
    if not args.pyvista:
        print("pyvista is left out: --pyvista names a Python that has it")
    tell_pictures(args.times, args.pyvista)
    if shutil.which("xvfb-run"):
        tell_window(args.times)
    else:
        print("the window is left out: apt install xvfb")


if __name__ == "__main__":
    main()
