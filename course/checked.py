"""Check one lesson of one student in a process of its own, so that no answer can end the grading of the others.

Run: python -m course.checked NUMBER FILE SEED SECONDS FIRST. Each task from FIRST on prints a line of JSON: its
index, its verdict, and the findings without their arrays.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .box import walls
from .checking import WRONG, Finding, Lesson, Outcome, Task, check, lesson
from .folders import HERE

MEMORY = 4 << 30  # bytes of a check; the student's own process may have half of it
_PIPES: dict[str, Any] = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
ENDED = "the check ended: the answer needs more memory, time or depth than a check has"


def outcomes(found: Lesson, file: Path, seed: int, seconds: float) -> list[Outcome]:
    """The outcome of every task of a lesson. A task that ends its process is wrong, with the reason; the next go on."""
    known: list[Outcome] = []
    while len(known) < len(found.tasks):
        told = _told_from(len(known), found, file, seed, seconds)
        known += [_outcome(found.tasks[line["task"]], line) for line in told]
        if len(known) < len(found.tasks):
            each = found.tasks[len(known)]
            known.append(Outcome(each, WRONG, [Finding(each.title, WRONG, ENDED)]))
    return known


def _told_from(first: int, found: Lesson, file: Path, seed: int, seconds: float) -> list[dict[str, Any]]:
    """What a process tells of the tasks, from one task to the last or to the one that ends it."""
    numbers = found.number, file.resolve(), seed, seconds, first
    words = [sys.executable, "-m", "course.checked", *map(str, numbers)]
    most_s = 2 * seconds * (len(found.tasks) - first + 1) + 60  # the check itself works, too
    try:
        text = subprocess.run(words, cwd=HERE.parent, **_PIPES, timeout=most_s).stdout
    except subprocess.TimeoutExpired as late:
        text = late.stdout or b""
    return [json.loads(line) for line in text.decode().split("\n")[:-1]]


def _outcome(each: Task, told: dict[str, Any]) -> Outcome:
    return Outcome(each, told["verdict"], [Finding(*finding) for finding in told["findings"]], told["printed"])


def _told(index: int, outcome: Outcome) -> str:
    findings = [(finding.what, finding.verdict, finding.text) for finding in outcome.findings]
    told = {"task": index, "verdict": outcome.verdict, "findings": findings, "printed": outcome.printed}
    return json.dumps(told)


def _lines(number: int, file: Path, seed: int, seconds: float, first: int) -> Iterator[str]:
    for index, outcome in enumerate(check(lesson(number), file, seed, seconds, walled=True, first=first), first):
        yield _told(index, outcome)


if __name__ == "__main__":
    walls.limit_memory(MEMORY)
    for line in _lines(int(sys.argv[1]), Path(sys.argv[2]), int(sys.argv[3]), float(sys.argv[4]), int(sys.argv[5])):
        print(line, flush=True)
