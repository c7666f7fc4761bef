"""Grade folders of submissions: each file runs in a sandbox, with hidden seeds. Results: a table, and feedback."""

from __future__ import annotations

import csv
import importlib.util
import os
import stat
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from .checked import outcomes
from .checking import NOT_RUN, WRONG, Lesson, Outcome, points_text
from .folders import HERE
from .folders import lessons as all_lessons
from .remote import Student
from .similar import likenesses, runs_text

LARGEST = 1 << 20  # bytes of a student's file
DEPTH = 6  # levels of folders below a submission that are searched
# A table's notes repeat messages with these words.
NOTED = (
    "the time limit",
    "the process ended",
    "the check ended",
    "too deep",
    "File too large",
    "MemoryError",
    "ImportError",
    "ModuleNotFoundError",
    "PermissionError",
    "BlockingIOError",
)


def open_walls() -> list[str]:
    """The forbidden things that a student's code can do on this machine; empty if the sandbox works."""
    with tempfile.TemporaryDirectory() as beside:
        Path(beside, "kept").write_text("kept")
        with Student(HERE / "box" / "probe.py", 20.0, walled=True) as probe:
            return [str(name) for name in probe.escapes(beside, os.getpid(), _answers())]


def _answers() -> list[str]:
    """Files with the computations that students write, wherever the project is installed."""
    found = importlib.util.find_spec("terrain_gl")
    return [str(HERE / "checking.py"), *([found.origin] if found and found.origin else [])]


def submissions(folder: Path) -> list[Path]:
    """What students handed in: folders, and also files and links, which get a row with the reason."""
    return sorted(path for path in folder.iterdir() if path.is_symlink() or not path.name.startswith("."))


def handed_in(student: Path, lesson: Lesson) -> tuple[Path | None, str]:
    """A student's file for a lesson, and what to say about it; None if there is no file to grade.

    Of several files, the one with the fewest folders above it is graded, then the first by alphabet.
    """
    if student.is_symlink() or not student.is_dir():
        return None, "not a folder" + (": a link" if student.is_symlink() else "")
    found, elsewhere = [], []
    for folder, below, names in os.walk(student):
        below[:] = below if len(Path(folder).relative_to(student).parts) < DEPTH else []
        if lesson.file in names:
            path = Path(folder, lesson.file)
            if path.parent.name == lesson.folder.name:
                found.append(path)
            elif path.parent.name not in {each.name for each in all_lessons()}:
                elsewhere.append(path)
    found.sort(key=lambda path: (len(path.parts), path))
    if not found:
        lies = "".join(f"; {path.relative_to(student)} is in no lesson's folder" for path in sorted(elsewhere)[:1])
        return None, f"not handed in{lies and lies + f': put it into {lesson.folder.name}/'}"
    status = found[0].lstat()
    if not stat.S_ISREG(status.st_mode):
        return None, "not a plain file"
    if status.st_size > LARGEST:
        return None, f"more than {LARGEST:,} bytes"
    names = [str(path.relative_to(student)) for path in found]
    return found[0], f"{len(found)} files: {names[0]} is graded, {names[1]} is not" if len(found) > 1 else ""


@dataclass
class Graded:
    """One lesson of a student."""

    lesson: Lesson
    outcomes: list[Outcome]
    problem: str = ""  # why there is nothing to grade, or which of several files is graded
    alike: str = ""  # which hand-in or file of the project it is most like

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
        return ", ".join(part for part in (self.problem, *texts[:1], not_run, self.alike) if part)


def grade_lesson(student: Path, lesson: Lesson, seed: int, seconds: float) -> Graded:
    """Grade a student's file of a lesson. Whatever happens, there is a row with the reason."""
    try:
        file, said = handed_in(student, lesson)
        return Graded(lesson, outcomes(lesson, file, seed, seconds) if file else [], said)
    except Exception as error:
        return Graded(lesson, [], f"the grader stopped here: {type(error).__name__}: {error}")


def grade(
    folder: Path, lessons: list[Lesson], seed: int, seconds: float, jobs: int, told: Callable[[str], None]
) -> dict[str, list[Graded]]:
    """All lessons of all students, by name."""

    def row(student: Path) -> tuple[str, list[Graded]]:
        graded = [grade_lesson(student, lesson, seed, seconds) for lesson in lessons]
        told(student.name)
        return student.name, graded

    with ThreadPoolExecutor(jobs) as pool:
        found = dict(pool.map(row, submissions(folder)))
    for at, lesson in enumerate(lessons):
        _tell_likenesses({name: graded[at] for name, graded in found.items()}, folder, lesson)
    return found


def _tell_likenesses(found: dict[str, Graded], folder: Path, lesson: Lesson) -> None:
    """Write into the rows of a lesson which hand-ins are like another one, or like a file of the project."""
    files = {name: handed_in(folder / name, lesson)[0] for name, graded in found.items() if graded.outcomes}
    told: dict[str, list[str]] = {name: [] for name in found}
    for like in likenesses(lesson, {name: file for name, file in files.items() if file}):
        for one, other in ((like.one, like.other), (like.other, like.one)):
            if one in found:
                told[one].append(f"{like.share:.0%} like {other}")
    for name, said in told.items():
        file = files.get(name)
        runs = runs_text(file.read_text("utf-8", "replace")) if file else ""
        parts = [f"{said[0]} and {len(said) - 1} more" if len(said) > 1 else said[0]] if said else []
        parts += [f"has {runs}: it can run a hidden text, so read it"] if runs else []
        found[name].alike = ", ".join(parts)


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
            own = f"{points_text(each.points, each.not_run)} of {each.lesson.points} points"
            said = f"{own} ({each.problem})" if each.outcomes and each.problem else each.problem or own
            text.append(f"Lesson {each.lesson.number}: {each.lesson.title}. {said}")
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
