"""Grade folders of submissions: each file runs in a sandbox, with hidden seeds. Results: a table, and feedback."""

from __future__ import annotations

import csv
import os
import stat
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from .checking import NOT_RUN, WRONG, Lesson, Outcome, check, points_text
from .folders import HERE
from .remote import Student

LARGEST = 1 << 20  # bytes of a student's file
DEPTH = 6  # levels of folders below a submission that are searched
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


@dataclass
class Graded:
    """One lesson of a student."""

    lesson: Lesson
    outcomes: list[Outcome]
    problem: str = ""  # why there is nothing to grade

    @property
    def points(self) -> float:
        """Points of the tasks that are right."""
        return sum(outcome.points for outcome in self.outcomes)

    @property
    def not_run(self) -> float:
        """Points of the tasks that this machine could not run."""
        return sum(outcome.not_run for outcome in self.outcomes)

    @property
    def why_not_run(self) -> list[str]:
        """What this machine lacks."""
        return [f.text for outcome in self.outcomes for f in outcome.findings if f.verdict == NOT_RUN]

    @property
    def note(self) -> str:
        """A problem other than a wrong answer."""
        wrong = [outcome for outcome in self.outcomes if outcome.verdict == WRONG]
        texts = [f.text for each in wrong for f in each.findings if any(reason in f.text for reason in NOTED)]
        tasks = [outcome.task.title.split()[0] for outcome in self.outcomes if outcome.not_run]
        not_run = f"{', '.join(tasks)} not run" if tasks else ""
        return ", ".join(part for part in (self.problem, *texts[:1], not_run) if part)


def grade_lesson(student: Path, lesson: Lesson, seed: int, seconds: float) -> Graded:
    """Grade a student's file of a lesson."""
    file = handed_in(student, lesson)
    if isinstance(file, str):
        return Graded(lesson, [], file)
    return Graded(lesson, list(check(lesson, file, seed, seconds, walled=True)))


def grade(
    folder: Path, lessons: list[Lesson], seed: int, seconds: float, jobs: int, told: Callable[[str], None]
) -> dict[str, list[Graded]]:
    """All lessons of all students, by name."""

    def row(student: Path) -> tuple[str, list[Graded]]:
        graded = [grade_lesson(student, lesson, seed, seconds) for lesson in lessons]
        for outcome in (outcome for each in graded for outcome in each.outcomes):
            for finding in outcome.findings:
                finding.got = finding.want = None  # the arrays of all students would fill the memory
        told(student.name)
        return student.name, graded

    with ThreadPoolExecutor(jobs) as pool:
        return dict(pool.map(row, submissions(folder)))


def write_table(students: dict[str, list[Graded]], lessons: list[Lesson], seed: int, path: Path) -> None:
    """Write the table as CSV, complete or not at all. Its first row has the most points, and the seed."""
    most = {f"lesson {lesson.number}": str(lesson.points) for lesson in lessons}
    total = str(sum(lesson.points for lesson in lessons))
    first = {"student": "(most)", **most, "sum": total, "not run": "", "notes": f"seed {seed}"}
    rows = [
        {
            "student": name,
            **{f"lesson {each.lesson.number}": points_text(each.points, each.not_run) for each in graded},
            "sum": f"{sum(each.points for each in graded):g}",
            "not run": f"{sum(each.not_run for each in graded):g}",
            "notes": "; ".join(f"{each.lesson.number}: {each.note}" for each in graded if each.note),
        }
        for name, graded in students.items()
    ]
    beside = path.with_name(f".{path.name}.part")
    with open(beside, "w", newline="", encoding="utf-8") as file:
        table = csv.DictWriter(file, list(first))
        table.writeheader()
        table.writerows([first, *({key: _harmless(value) for key, value in row.items()} for row in rows)])
    beside.replace(path)


def write_feedback(students: dict[str, list[Graded]], folder: Path) -> None:
    """Write one text for each student: every task with its verdict, its points, and what is wrong."""
    folder.mkdir()
    for name, graded in students.items():
        points, not_run = (sum(values) for values in zip(*((g.points, g.not_run) for g in graded), strict=True))
        text = [name, f"{points_text(points, not_run)} of {sum(g.lesson.points for g in graded)} points", ""]
        for each in graded:
            own = each.problem or f"{points_text(each.points, each.not_run)} of {each.lesson.points} points"
            text.append(f"Lesson {each.lesson.number}: {each.lesson.title}. {own}")
            for outcome in each.outcomes:
                got = points_text(outcome.points, outcome.not_run)
                text.append(f"  {outcome.verdict:7}  {outcome.task.title}: {got} of {outcome.task.points}")
                text += [f"           {line}" for line in outcome.lines]
            text.append("")
        (folder / f"{name}.txt").write_text("\n".join(text), encoding="utf-8")


def _harmless(text: str) -> str:
    """The text of a cell, changed so that no spreadsheet reads it as a formula."""
    return (
        f"'{text}"
        if text.startswith(("=", "+", "-", "@", "\t", "\r")) and not text.lstrip("-").replace(".", "").isdigit()
        else text
    )
