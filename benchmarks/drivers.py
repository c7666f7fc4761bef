"""Tests on every driver: a table of test files and drivers, for CONTRIBUTING.md.

    python benchmarks/drivers.py                                    all files of the stages that compute on the GPU
    python benchmarks/drivers.py tests/test_sat.py --drivers zink   some of them

Each driver takes one run of `pytest --driver` (tests/drivers.py). A cell has the number of tests that passed, and of
those that were skipped or failed. The reasons follow. The exit status is 1 if a test failed.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import tempfile
import time
from collections import Counter, defaultdict
from pathlib import Path
from xml.etree import ElementTree

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests"))
from drivers import DRIVERS, environment  # noqa: E402  the tests' own

STAGES = "sat error bound few_cells quadtree selection rings_sat rings_tables rings_twins mesh between precision shade"
FILES = [f"tests/test_{name}.py" for name in f"selftest {STAGES} golden measure renderer".split()]


def results(driver: str, files: list[str]) -> tuple[dict[str, Counter[str]], list[str]]:
    """Tests by file and outcome, and the reasons of those that did not pass."""
    found: dict[str, Counter[str]] = defaultdict(Counter)
    reasons = []
    with tempfile.TemporaryDirectory() as folder:
        report = Path(folder) / "report.xml"
        command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--driver", driver, *files]
        subprocess.run([*command, f"--junitxml={report}"], cwd=ROOT, stdout=subprocess.DEVNULL, check=False)
        for case in ElementTree.parse(report).iter("testcase"):
            file = case.get("classname", "").replace("tests.", "").split(".")[0]
            outcome = next((part for part in case if part.tag in ("failure", "error", "skipped")), None)
            kind = "passed" if outcome is None else "skipped" if outcome.tag == "skipped" else "failed"
            found[file][kind] += 1
            if outcome is not None:
                reason = (outcome.get("message") or "").split("\n")[0][:150]
                reasons.append(f"{driver}, {file}, {kind}: {case.get('name')}: {reason}")
    return found, reasons


def cell(counts: Counter[str]) -> str:
    """The numbers of one file on one driver."""
    words = [str(counts["passed"])] + [f"{counts[kind]} {kind}" for kind in ("skipped", "failed") if counts[kind]]
    return ", ".join(words)


def main() -> int:
    """Run the tests and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("files", nargs="*", default=FILES)
    parser.add_argument("--drivers", nargs="+", choices=DRIVERS, default=list(DRIVERS))
    args = parser.parse_args()
    table: dict[str, dict[str, Counter[str]]] = {}
    reasons, seconds = [], {}
    for driver in args.drivers:
        try:
            environment(driver)
        except LookupError as error:
            print(f"{driver} is left out: {error}", file=sys.stderr)
            continue
        started = time.perf_counter()
        table[driver], why = results(driver, args.files)
        seconds[driver] = time.perf_counter() - started
        reasons += why
        print(f"{driver}: {seconds[driver]:.0f} s", file=sys.stderr, flush=True)
    print(f"| file | {' | '.join(table)} |\n|---|{'---|' * len(table)}")
    for file in sorted({file for found in table.values() for file in found}):
        print(f"| {file} | {' | '.join(cell(found[file]) for found in table.values())} |")
    print(f"| seconds | {' | '.join(f'{seconds[driver]:.0f}' for driver in table)} |\n")
    print("\n".join(reasons))
    return int(any(counts["failed"] for found in table.values() for counts in found.values()))


if __name__ == "__main__":
    raise SystemExit(main())
