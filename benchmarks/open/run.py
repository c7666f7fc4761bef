"""The open benchmark: terrain level of detail by many methods, verified by one program. README.md tells how it works.

Run: python benchmarks/open/run.py [ENTRY ...] [--flights NAME ...] [--frames N] [--dump DIR] [--json FILE]
"""

import argparse
import importlib
import json
import os
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path[:0] = [str(HERE), str(HERE.parent)]

import verify  # noqa: E402
from table import head, row  # noqa: E402

DUMP_BYTES = ("vertices", "<f8"), ("triangles", "<i4")


def entries():
    """Names of all entries."""
    return sorted(path.stem for path in (HERE / "entries").glob("[!_]*.py"))


def flights():
    """All flights by name."""
    return {path.stem: json.loads(path.read_text()) for path in sorted((HERE / "flights").glob("*.json"))}


def heights_of(flight):
    """The map of a flight, a square of 2^n + 1 posts in metres; None if it is a real map that is not here."""
    from terrain_gl import Heightmap
    from terrain_gl.files.maps import open_map

    of_map = flight["map"]
    if "bundled" in of_map:
        heightmap = open_map(of_map["bundled"])[0]
    else:
        file = Path(os.environ.get("TERRAIN_GL_DEM", "")) / of_map["file"]
        if not file.is_file():
            return None
        heightmap = Heightmap.open(file, flight["spacing_m"], of_map.get("z_scale", 1.0))
    col, row, side = of_map["window"]
    return np.array(heightmap.heights[row : row + side, col : col + side], np.float64)


def dump(entry, flight, heights, folder):
    """Write the frames of an entry; returns the milliseconds of each frame, or None."""
    folder.mkdir(parents=True, exist_ok=True)
    np.save(folder / "map.npy", heights)
    (folder / "flight.json").write_text(json.dumps(flight))
    module = importlib.import_module(f"entries.{entry}")
    if not hasattr(module, "meshes"):
        raise SystemExit(f"{entry}: has no function meshes(heights, spacing_m, cameras, size, tolerance_px)")
    made = module.meshes(heights, flight["spacing_m"], flight["cameras"], flight["size"], flight["tolerance_px"])
    times = []
    for i, (vertices, triangles, *ms) in enumerate(made):
        arrays = {"vertices": vertices, "triangles": triangles}
        np.savez(folder / f"{i:04}.npz", **{name: np.asarray(arrays[name], kind) for name, kind in DUMP_BYTES})
        times += ms or [None]
    if len(times) != len(flight["cameras"]):
        raise SystemExit(f"{entry}: {len(times)} meshes for {len(flight['cameras'])} cameras")
    return times


def summary(entry, name, flight, frames, times):
    """The figures of one entry in one flight."""

    def all_of(key):
        return [frame[key] for frame in frames if key in frame]

    def is_whole(frame):
        return frame["uncovered_posts"] == 0

    measured = [ms for ms in times if ms is not None]
    asked = flight["tolerance_px"]
    return {
        "entry": entry,
        "flight": name,
        "triangles": float(np.mean(all_of("triangles"))),
        "max": max(all_of("max_px")) / asked,
        "max_posts": max(all_of("max_posts_px")) / asked,
        "mean": float(np.mean(all_of("mean_px"))) / asked,
        "kept": float(np.mean([is_whole(frame) and frame["max_px"] <= asked for frame in frames])),
        "kept_posts": float(np.mean([is_whole(frame) and frame["max_posts_px"] <= asked for frame in frames])),
        "max_jump": max(all_of("max_jump_px"), default=0.0) / asked,
        "mean_jump": float(np.mean(all_of("mean_jump_px") or [0.0])) / asked,
        "uncovered": sum(all_of("uncovered_posts")),
        "crack_m": max(all_of("largest_crack_m")),
        "ms": float(np.mean(measured)) if measured else None,
    }


HEAD = {
    "entry": None,
    "flights": None,
    "triangles": lambda rows: f"{np.mean(rows['triangles']):,.0f}",
    "max": lambda rows: f"{max(rows['max']):.2f}",
    "kept": lambda rows: f"{100 * np.mean(rows['kept']):.0f} %",
    "max at posts": lambda rows: f"{max(rows['max_posts']):.2f}",
    "kept at posts": lambda rows: f"{100 * np.mean(rows['kept_posts']):.0f} %",
    "mean": lambda rows: f"{np.mean(rows['mean']):.3f}",
    "max jump": lambda rows: f"{max(rows['max_jump']):.2f}",
    "mean jump": lambda rows: f"{np.mean(rows['mean_jump']):.4f}",
    "uncovered": lambda rows: f"{sum(rows['uncovered']):,}",
    "crack": lambda rows: f"{max(rows['crack_m']):.2g} m",
    "ms": lambda rows: f"{np.mean(times):.1f}" if (times := [ms for ms in rows["ms"] if ms is not None]) else "-",
}
BETTER = {"max": "largest error", "mean": "mean error", "max_jump": "largest jump"}


def print_figures(rows):
    """Print a row for each entry: means over the flights; largest errors, jumps and cracks of all of them."""
    head(*HEAD)
    for entry in dict.fromkeys(each["entry"] for each in rows):
        own = [each for each in rows if each["entry"] == entry]
        columns = {key: [each[key] for each in own] for key in own[0]}
        row(entry, len(own), *(text(columns) for text in HEAD.values() if text))


LOST = {  # a column: what is compared, of which flights of the other entry
    "fewer triangles, and all kept": ("triangles", lambda other: other["kept"] == 1),
    "fewer triangles, kept at posts alone": ("triangles", lambda other: other["kept"] < 1 == other["kept_posts"]),
    "smaller mean error": ("mean", lambda other: True),
    "smaller largest jump": ("max_jump", lambda other: True),
}


def print_losses(rows, ours="sat"):
    """Print in how many flights an entry is better than ours, and its least and largest share of our number there."""
    own = {each["flight"]: each for each in rows if each["entry"] == ours}
    head("entry", *LOST)
    for entry in dict.fromkeys(each["entry"] for each in rows if each["entry"] != ours):
        others = [each for each in rows if each["entry"] == entry and each["flight"] in own]
        cells = []
        for key, counts in LOST.values():
            pairs = [(each[key], own[each["flight"]][key]) for each in others if counts(each)]
            shares = sorted({f"{other / our:.2f}" for other, our in pairs if other < our})
            lost = sum(other < our for other, our in pairs)
            cells.append(f"{lost}: {' to '.join(dict.fromkeys((shares[0], shares[-1])))}" if lost else 0)
        row(entry, *cells)


def losses(rows, ours="sat"):
    """Where other entries are better than ours. Triangles are compared with those that keep what was asked, too."""
    lines = []
    for own in (each for each in rows if each["entry"] == ours):
        for other in (each for each in rows if each["flight"] == own["flight"] and each["entry"] != ours):
            better = {name: other[key] / own[key] for key, name in BETTER.items() if other[key] < own[key]}
            where = "" if other["kept"] == 1 else " (asked error kept at posts only)"
            if other["triangles"] < own["triangles"] and other["kept_posts"] == 1:
                better["triangles" + where] = other["triangles"] / own["triangles"]
            told = ", ".join(f"{share:.2f} of its {name}" for name, share in better.items())
            lines += [f"- {own['flight']}: {other['entry']} has {told}"] if told else []
    return lines


def main():
    """Run, verify, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("entries", nargs="*", help=f"default: all of {', '.join(entries())}")
    parser.add_argument("--flights", nargs="+", choices=list(flights()), default=list(flights()))
    parser.add_argument("--frames", type=int, help="only the first N frames of each flight")
    parser.add_argument("--dump", type=Path, help="keep the meshes in this folder")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    args = parser.parse_args()
    for unknown in set(args.entries) - set(entries()):
        parser.error(f"{unknown}: there is no such entry: expected {', '.join(entries())}")
    rows = []
    for name in args.flights:
        flight = flights()[name]
        flight["cameras"] = flight["cameras"][: args.frames]
        heights = heights_of(flight)
        if heights is None:
            print(f"{name}: left out: {flight['map']['file']} is not in TERRAIN_GL_DEM", file=sys.stderr)
            continue
        for entry in args.entries or entries():
            started = time.perf_counter()
            with tempfile.TemporaryDirectory() as temporary:
                folder = (args.dump or Path(temporary)) / entry / name
                try:
                    times = dump(entry, flight, heights, folder)
                except ImportError as error:
                    print(f"{entry}: left out: {error}", file=sys.stderr)
                    continue
                rows.append(summary(entry, name, flight, verify.verify(folder), times))
            print(f"{name}: {entry}, {time.perf_counter() - started:.1f} s", file=sys.stderr, flush=True)
    print_figures(rows)
    whole = [each for each in rows if not each["uncovered"]]  # whoever leaves land out is not better
    print_losses(whole)
    if lost := losses(whole):
        print("\n".join(["", "Where sat loses:", *lost]))
    if args.json:
        args.json.write_text(json.dumps(rows, indent=1))


if __name__ == "__main__":
    main()
