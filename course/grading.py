"""Grade folders of submissions: each file runs in a sandbox, with hidden seeds; the result is a table of points."""

from __future__ import annotations

import csv
import os
import stat
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

from .checking import HERE, WRONG, Lesson, check
from .remote import Student

LARGEST = 1 << 20  # bytes of a student's file
DEPTH = 6  # folders below a submission that are searched
# A table's notes repeat messages with these words.
NOTED = ("the time limit", "the process ended", "File too large", "MemoryError", "BlockingIOError")


def open_walls() -> list[str]:
    """The forbidden things that a student's code can do on this machine; empty if the sandbox works."""
    with tempfile.TemporaryDirectory() as beside:
        Path(beside, "kept").write_text("kept")
        with Student(HERE / "box" / "probe.py", 20.0, walled=True) as probe:
            return [str(name) for name in probe.escapes(beside, os.getpid())]


def submissions(folder: Path) -> list[Path]:
    """Folders of the students; links are not followed."""
    return sorted(path for path in folder.iterdir() if path.is_dir() and not path.is_symlink())


def handed_in(student: Path, lesson: Lesson) -> Path | str:
    """A student's file for a lesson, or why there is none."""
    for folder, below, names in os.walk(student):
        below[:] = sorted(below) if len(Path(folder).relative_to(student).parts) < DEPTH else []
        if Path(folder).name == lesson.folder.name and lesson.file in names:
            path = Path(folder) / lesson.file
            status = path.lstat()
            if not stat.S_ISREG(status.st_mode):
                return "not a plain file"
            return path if status.st_size <= LARGEST else f"more than {LARGEST:,} bytes"
    return "not handed in"


def grade_lesson(student: Path, lesson: Lesson, seed: int, seconds: float) -> tuple[float, str]:
    """Points of a student in a lesson, and a note on problems other than a wrong answer."""
    file = handed_in(student, lesson)
    if isinstance(file, str):
        return 0.0, file
    points, notes = 0.0, []
    for outcome in check(lesson, file, seed, seconds, walled=True):
        points += outcome.points
        if outcome.verdict == WRONG:
            notes += [f.text for f in outcome.findings if any(reason in f.text for reason in NOTED)]
    return points, notes[0] if notes else ""


def grade(
    folder: Path, lessons: list[Lesson], seed: int, seconds: float, jobs: int, told: Callable[[str], None]
) -> list[dict[str, str]]:
    """One row for each student: points of each lesson, their sum, and notes."""

    def row(student: Path) -> dict[str, str]:
        graded = [grade_lesson(student, lesson, seed, seconds) for lesson in lessons]
        told(student.name)
        points = {f"lesson {lesson.number}": f"{got:g}" for lesson, (got, _) in zip(lessons, graded, strict=True)}
        notes = "; ".join(f"{lesson.number}: {note}" for lesson, (_, note) in zip(lessons, graded, strict=True) if note)
        return {"student": student.name, **points, "sum": f"{sum(got for got, _ in graded):g}", "notes": notes}

    with ThreadPoolExecutor(jobs) as pool:
        return list(pool.map(row, submissions(folder)))


def write_table(rows: list[dict[str, str]], lessons: list[Lesson], seed: int, path: Path) -> None:
    """Write the table as CSV, complete or not at all. Its first row has the most points, and the seed."""
    most = {f"lesson {lesson.number}": str(lesson.points) for lesson in lessons}
    first = {"student": "(most)", **most, "sum": str(sum(lesson.points for lesson in lessons)), "notes": f"seed {seed}"}
    beside = path.with_name(f".{path.name}.part")
    with open(beside, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(first))
        table.writeheader()
        table.writerows([first, *({key: _harmless(value) for key, value in row.items()} for row in rows)])
    beside.replace(path)


def _harmless(text: str) -> str:
    """The text of a cell, changed so that no spreadsheet reads it as a formula."""
    return (
        f"'{text}"
        if text.startswith(("=", "+", "-", "@", "\t", "\r")) and not text.lstrip("-").replace(".", "").isdigit()
        else text
    )
