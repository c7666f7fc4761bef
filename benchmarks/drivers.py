"""Tests on every driver: a table of test files and drivers, for CONTRIBUTING.md.

    python benchmarks/drivers.py                                    the files of FILES, on all drivers
    python benchmarks/drivers.py tests/test_sat.py --drivers zink   some of them
    python benchmarks/drivers.py --table                            print what has been run, run nothing

Every cell is one run of `pytest --driver` (tests/drivers.py), without tests marked slow. Its result is kept in
build/drivers.json at once, and a later start goes on from there: delete the file after a change. A run stops after
`--limit` seconds; the cell then counts the tests up to there. The exit status is 1 if a test failed.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from table import head, row

from terrain_gl.basics.replacing import replacing

ROOT = Path(__file__).parents[1]
RESULTS = ROOT / "build/drivers.json"
sys.path.insert(0, str(ROOT / "tests"))
from drivers import DRIVERS, environment  # noqa: E402  the tests' own

# Tests that compute on the GPU and compare with the CPU, most important first. Left out: the course, the window, the
# site, files and the command line, and stores, whose pages come from the same shaders (tests/test_pages.py is here).
STAGES = "selftest sat error bound few_cells rings_sat rings_tables rings_twins mesh between precision measure"
OTHERS = "cutting edge every_post hidden twins generate the_method lobes layout gl context terrain shaders passes guest"
PICTURES = "pixels shade golden renderer looks exaggeration curvature light_truth horizon underside voids overlaid"
REST = "exact pieces budgets pages light timing stability baselines contours project"
FILES = [f"tests/test_{name}.py" for part in (STAGES, OTHERS, PICTURES, REST) for name in part.split()]
SECONDS_TO_END = 30  # after Ctrl+C, for pytest to write its report


def run(driver: str, file: str, limit_s: float) -> dict[str, Any]:
    """One run of pytest: the number of tests by outcome, whether it was cut off, seconds, and reasons."""
    started = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "-m", "not slow", "--driver", driver]
        command += [file, f"--junitxml={report}", f"--basetemp={folder}/tmp"]
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            process.wait(limit_s)
            cut = False
        except subprocess.TimeoutExpired:
            cut = True
            process.send_signal(signal.SIGINT)
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(SECONDS_TO_END)
        finally:
            process.kill()
            process.wait()
        cases = list(ElementTree.parse(report).iter("testcase")) if report.exists() else []
    counts: Counter[str] = Counter()
    reasons = []
    for case in cases[: len(cases) - 1 if cut else None]:  # Ctrl+C may have failed the last one
        outcome = next((part for part in case if part.tag in ("failure", "error", "skipped")), None)
        kind = "passed" if outcome is None else "skipped" if outcome.tag == "skipped" else "failed"
        counts[kind] += 1
        if outcome is not None:
            reason = (outcome.get("message") or "").split("\n")[0][:150]
            reasons.append(f"{kind}: {case.get('name')}: {reason}")
    seconds = round(time.perf_counter() - started)
    return {"counts": counts, "cut": cut, "status": process.returncode, "seconds": seconds, "reasons": reasons}


def cell(result: dict[str, Any] | None) -> str:
    """The numbers of one file on one driver."""
    if result is None:
        return ""
    counts = result["counts"]
    words = [str(counts.get("passed", 0))]
    words += [f"{counts[kind]} {kind}" for kind in ("skipped", "failed") if counts.get(kind)]
    if result["cut"]:
        words.append("cut off")
    elif result["status"] not in (0, 1):  # pytest: passed, some failed
        words.append(f"exit status {result['status']}")
    return ", ".join(words)


def write_table(results: dict[str, dict[str, Any]], drivers: list[str]) -> None:
    """Print the table, then why tests were skipped or failed: one line a reason, with all drivers that gave it."""
    head("file", *drivers)
    for file, found in results.items():
        row(Path(file).stem.removeprefix("test_"), *(cell(found.get(driver)) for driver in drivers))
    of = {driver: [found[driver] for found in results.values() if driver in found] for driver in drivers}
    for word, kind in (("passed", "passed"), ("failed", "failed")):
        row(word, *(sum(r["counts"].get(kind, 0) for r in of[driver]) for driver in drivers))
    row("seconds", *(sum(r["seconds"] for r in of[driver]) for driver in drivers))
    print()
    reasons: dict[str, list[str]] = {}
    for file, found in results.items():
        for driver in drivers:
            for reason in found.get(driver, {}).get("reasons", []):
                reasons.setdefault(f"{Path(file).stem}, {reason}", []).append(driver)
    for reason, given_by in reasons.items():
        print(f"{', '.join(given_by)}: {reason}")


def main() -> int:
    """Run the tests that have not been run, and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("files", nargs="*", default=FILES)
    parser.add_argument("--drivers", nargs="+", choices=DRIVERS, default=list(DRIVERS))
    parser.add_argument("--limit", type=float, default=90, metavar="S", help="seconds of one run")
    parser.add_argument("--table", action="store_true", help="print what has been run, run nothing")
    args = parser.parse_args()
    results = json.loads(RESULTS.read_text()) if RESULTS.exists() else {}
    drivers = []
    for driver in args.drivers:
        try:
            environment(driver)
            drivers.append(driver)
        except LookupError as error:
            print(f"{driver} is left out: {error}", file=sys.stderr)
    for file in [] if args.table else args.files:
        for driver in drivers:
            found = results.setdefault(file, {})
            if driver in found:
                continue
            found[driver] = run(driver, file, args.limit)
            print(f"{file}, {driver}: {cell(found[driver])}, {found[driver]['seconds']} s", file=sys.stderr, flush=True)
            RESULTS.parent.mkdir(exist_ok=True)
            with replacing(RESULTS) as beside:
                beside.write_text(json.dumps(results, indent=1))
    write_table(results, drivers)
    every = [result for found in results.values() for result in found.values()]
    return int(any(result["counts"].get("failed") for result in every))


if __name__ == "__main__":
    raise SystemExit(main())
