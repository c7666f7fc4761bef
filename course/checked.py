"""Check one lesson of one student in a process of its own, so that no answer can end the grading of the others.

Run: python -m course.checked NUMBER FILE SEED SECONDS. Each task prints a line of JSON: its index, its verdict, and the
findings without their arrays.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .box import walls
from .checking import WRONG, Finding, Lesson, Outcome, check, lesson
from .folders import HERE

MEMORY = 4 << 30  # bytes of a check; the student's own process may have half of it
_PIPES: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
ENDED = "the check ended: the answer needs more memory, time or depth than a check has"


def outcomes(found: Lesson, file: Path, seed: int, seconds: float) -> list[Outcome]:
    """The outcome of every task of a lesson. A task that the process did not reach is wrong, with the reason."""
    words = [sys.executable, "-m", "course.checked", str(found.number), str(file.resolve()), str(seed), str(seconds)]
    most_s = 2 * seconds * (len(found.tasks) + 1) + 60  # the check itself works, too
    try:
        said = subprocess.run(words, cwd=HERE.parent, **_PIPES, timeout=most_s)
        text = said.stdout
    except subprocess.TimeoutExpired as late:
        text = late.stdout or b""
    done = {line["task"]: line for line in map(json.loads, text.decode().split("\n")[:-1])}
    return [_outcome(found, index, done) for index in range(len(found.tasks))]


def _outcome(found: Lesson, index: int, done: dict[int, dict[str, Any]]) -> Outcome:
    each = found.tasks[index]
    if index not in done:
        return Outcome(each, WRONG, [Finding(each.title, WRONG, ENDED)])
    told = done[index]
    return Outcome(each, told["verdict"], [Finding(*finding) for finding in told["findings"]], told["printed"])


def _told(index: int, outcome: Outcome) -> str:
    findings = [(finding.what, finding.verdict, finding.text) for finding in outcome.findings]
    told = {"task": index, "verdict": outcome.verdict, "findings": findings, "printed": outcome.printed}
    return json.dumps(told)


def _lines(number: int, file: Path, seed: int, seconds: float) -> Iterator[str]:
    for index, outcome in enumerate(check(lesson(number), file, seed, seconds, walled=True)):
        yield _told(index, outcome)


if __name__ == "__main__":
    walls.limit_memory(MEMORY)
    for line in _lines(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4])):
        print(line, flush=True)
