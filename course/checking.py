"""Checks: a student's results are compared with the truth.

A check is a list of tasks. A task is a generator: it calls the student's functions and yields findings.

    exact    equal but for the rounding of float64
    close    within the task's tolerance: half of the points
    wrong    anything else, an exception too
    blank    not written yet
    not run  this machine lacks what the task needs, OpenGL
"""

from __future__ import annotations

import importlib.util
import sys
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from . import truths
from .folders import BLANKS, lessons
from .remote import BlankError, Student, StudentError

EXACT, CLOSE, NOT_RUN, WRONG, BLANK = ORDER = ("exact", "close", "not run", "wrong", "blank")
SECONDS = 20.0  # for a task
SAID = 6  # most lines of text for a task
ROUNDING = 1e-9  # relative to the largest expected value: room for a few million roundings of float64


@dataclass
class Finding:
    """One comparison of a task."""

    what: str
    verdict: str
    text: str = ""  # the largest difference and its place; or the mistake
    got: np.ndarray | None = None
    want: np.ndarray | None = None


@dataclass
class Task:
    """A task of a lesson: its points, and the generator that checks it."""

    title: str
    points: int
    run: Callable[[Student, np.random.Generator], Iterator[Finding]]


@dataclass
class Outcome:
    """The result of a task."""

    task: Task
    verdict: str
    findings: list[Finding] = field(default_factory=list)
    printed: str = ""

    @property
    def points(self) -> float:
        """All points for exact, half of them for close."""
        return self.task.points * {EXACT: 1.0, CLOSE: 0.5}.get(self.verdict, 0.0)

    @property
    def not_run(self) -> float:
        """Points of a task that this machine could not run; they do not count."""
        return self.task.points if self.verdict == NOT_RUN else 0.0

    @property
    def lines(self) -> list[str]:
        """The lines to print: each text once, with the cases that it is about."""
        said: dict[str, list[str]] = {}
        for finding in self.findings:
            if finding.text and finding.verdict != EXACT:  # rounding differences are no mistakes
                said.setdefault(finding.text, []).append(finding.what)
        found = [f"{_joined(names, self.task.title)}{text}" for text, names in said.items()]
        return found if len(found) <= SAID else [*found[: SAID - 1], f"and {len(found) - SAID + 1} more"]


@dataclass
class Lesson:
    """One folder of lessons/: its number, title, tasks and the file that the student writes."""

    number: int
    folder: Path
    title: str
    tasks: list[Task]
    file: str

    @property
    def points(self) -> int:
        """Points of all tasks."""
        return sum(task.points for task in self.tasks)

    @property
    def original(self) -> str:
        """The student's file as it was handed out."""
        if (BLANKS / self.folder.name).is_file():
            return (BLANKS / self.folder.name).read_text(encoding="utf-8")
        from .solving import blank, solution

        return blank(solution(self.folder).read_text(encoding="utf-8"))


def points_text(points: float, not_run: float) -> str:
    """Points, and the points of tasks that could not run, as text."""
    return f"{points:g}" if not not_run else f"{points:g} + {not_run:g} not run" if points else f"{not_run:g} not run"


def _joined(names: list[str], title: str) -> str:
    """The names of the cases that have one message; "" if the message is for the whole task."""
    if names[0] == title:
        return ""
    return f"{names[0]}, and {len(names) - 1} more: " if len(names) > 1 else f"{names[0]}: "


def task(title: str, points: int = 1) -> Callable[[Callable[..., Iterator[Finding]]], Task]:
    """Declare a task of a check."""
    return lambda run: Task(title, points, run)


def lesson(number: int) -> Lesson:
    """One lesson with its check; KeyError if there is none."""
    folder = next((path for path in lessons() if path.name.startswith(f"{number:02d}_")), None)
    if folder is None:
        raise KeyError(number)
    check = load(folder / "check.py")
    tasks = [value for value in vars(check).values() if isinstance(value, Task)]
    return Lesson(number, folder, check.TITLE, tasks, getattr(check, "FILE", "student.py"))


def load(path: Path) -> ModuleType:
    """A Python file as a module."""
    name = f"course_{path.parent.name}_{path.stem}"
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module


def check(
    found: Lesson, file: Path, seed: int, seconds: float = SECONDS, walled: bool = False, first: int = 0
) -> Iterator[Outcome]:
    """Check a student's file task by task, from the task `first` on. The maps, sizes and voids follow from the seed.

    Each task has `seconds` of its own, so an endless task takes no time from the others. If the file cannot be loaded,
    it is tried only once, and all tasks are wrong.
    """
    student = Student(file, seconds, walled, found.original)
    try:
        hindrance = ""
        try:
            student.call("")
        except StudentError as error:
            hindrance = str(error)
        for index, each in list(enumerate(found.tasks))[first:]:
            if hindrance:
                yield Outcome(each, WRONG, [Finding(each.title, WRONG, hindrance)], student.printed)
                continue
            if student.ended:
                student.close()
                student = Student(file, seconds, walled, found.original)
            student.allow(seconds)
            truths.begin(found.folder, seed, index)
            yield outcome_of(each, student, np.random.default_rng([seed, found.number, index]))
    finally:
        student.close()


def outcome_of(each: Task, student: Student, rng: np.random.Generator) -> Outcome:
    """Run one task."""
    findings: list[Finding] = []
    try:
        for finding in each.run(student, rng):
            findings.append(finding)
    except BlankError as error:
        findings.append(Finding(each.title, BLANK, str(error)))
    except StudentError as error:
        findings.append(Finding(each.title, WRONG, str(error)))
    except MemoryError:
        findings.append(Finding(each.title, WRONG, "the check cannot use what was returned: MemoryError"))
    except Exception as error:  # whatever an answer does to a check, the other tasks are checked
        findings.append(Finding(each.title, WRONG, f"the check cannot use what was returned: {str(error)[:300]}"))
    verdict = max((finding.verdict for finding in findings), key=ORDER.index)
    return Outcome(each, verdict, findings, student.printed)


# --- Findings ---------------------------------------------------------------------------------------------------------


def compare(
    what: str, got: Any, want: Any, close: float = 0.0, axes: tuple[str, ...] = (), rounding: float = ROUNDING
) -> Finding:
    """Compare numbers.

    Parameters
    ----------
    close
        Largest difference that counts as close; 0: only exact counts.
    axes
        Names of the indices, to say where the largest difference is.
    rounding
        Difference that still counts as exact, relative to the largest expected value; 0 where nothing is rounded.
    """
    want = np.asarray(want)
    found, problem = _numbers(got, want.shape)
    if found is None:
        return Finding(what, WRONG, problem, want=want)
    unlike = np.isnan(found) != np.isnan(want) if want.dtype.kind == "f" else ~np.isfinite(found)
    with np.errstate(invalid="ignore"):
        difference = np.abs(found.astype(float) - want.astype(float))
    difference = np.where((found == want) | (np.isnan(found) & np.isnan(want.astype(float))), 0.0, difference)
    difference = np.where(unlike | np.isnan(difference), np.inf, difference)
    if difference.size == 0 or not difference.any():
        return Finding(what, EXACT, "", found, want)
    at = np.unravel_index(int(np.argmax(difference)), difference.shape)
    largest, size = float(difference[at]), float(np.nanmax(np.abs(want[np.isfinite(want)]), initial=0.0))
    whole = want.dtype.kind in "biu"
    verdict = EXACT if not whole and largest <= rounding * size else CLOSE if largest <= close else WRONG
    where = ", ".join(f"{name} {i}" for name, i in zip(axes or ["index"] * len(at), at, strict=False))
    text = f"largest difference {largest:.3g}" + (f" at {where}" if where else "")
    if verdict != EXACT:
        text += ": yours {}, expected {}".format(*_unlike(found[at], want[at]))
    return Finding(what, verdict, text, found, want)


def at_least(what: str, got: Any, floor: Any, axes: tuple[str, ...] = (), rounding: float = ROUNDING) -> Finding:
    """Check that numbers are not below others: a bound and the errors that it bounds.

    `rounding` is as in `compare`. It is 0 if a bound is only selected, not computed.
    """
    floor = np.asarray(floor, float)
    found, problem = _numbers(got, floor.shape)
    if found is None:
        return Finding(what, WRONG, problem, want=floor)
    slack = rounding * np.max(np.abs(floor[np.isfinite(floor)]), initial=0.0)
    short = np.where(np.isnan(found), np.inf, floor - found)
    if short.size == 0 or not (short > slack).any():
        return Finding(what, EXACT, "", found, floor)
    at = np.unravel_index(int(np.argmax(short)), short.shape)
    where = ", ".join(f"{name} {i}" for name, i in zip(axes or ["index"] * len(at), at, strict=False))
    share = float((short > slack).mean())
    text = f"{share:.0%} are too small, the worst" + (f" at {where}" if where else "")
    text += ": yours {}, at least {}".format(*_unlike(found[at], floor[at]))
    return Finding(what, WRONG, text, found, floor)


def at_most(what: str, got: Any, ceiling: Any, axes: tuple[str, ...] = ()) -> Finding:
    """Check that numbers are not above others, except for rounding."""
    turned = at_least(what, -np.asarray(got, float), -np.asarray(ceiling, float), axes)
    if turned.verdict == EXACT or turned.got is None:
        return turned
    got, ceiling = -turned.got, -np.asarray(ceiling, float)
    at = np.unravel_index(int(np.nanargmax(got + ceiling)), got.shape)
    where = ", ".join(f"{name} {i}" for name, i in zip(axes or ["index"] * len(at), at, strict=False))
    text = "too large" + (f" at {where}" if where else "")
    yours, most = _unlike(got[at], -ceiling[at])
    return Finding(what, WRONG, f"{text}: yours {yours}, at most {most}", got, -ceiling)


def areas(triangles: np.ndarray) -> np.ndarray:
    """The signed area of each triangle, (n, 3, 2): positive if x runs to y in the direction of its corners."""
    (ax, ay), (bx, by) = (triangles[:, k].T - triangles[:, 0].T for k in (1, 2))
    return np.asarray((ax * by - ay * bx) / 2)


def holds(what: str, condition: bool, text: str) -> Finding:
    """Check a condition; `text` describes the mistake if it is false."""
    return Finding(what, EXACT if condition else WRONG, "" if condition else text)


def grows_with_the_box(sums: Callable[[np.ndarray], object], small: np.ndarray, large: np.ndarray) -> bool:
    """Whether large boxes take twice as long as small boxes, in three tests out of three: the machine may be busy."""

    def seconds(asked: np.ndarray) -> float:
        start = time.monotonic()
        sums(asked)
        return time.monotonic() - start

    return all(seconds(large) > 2 * seconds(small) + 0.1 for _ in range(3))


def _numbers(got: Any, shape: tuple[int, ...]) -> tuple[np.ndarray | None, str]:
    try:
        found = np.asarray(got)
    except ValueError:
        return None, "the parts of the answer have unlike shapes"
    if found.dtype.kind not in "biuf":
        return None, f"expected numbers, got {type(got).__name__}"
    if found.shape != shape:
        return None, f"expected the shape {shape}, got {found.shape}"
    return found, ""


def _short(value: Any, digits: int = 6) -> str:
    return str(int(value)) if np.asarray(value).dtype.kind in "biu" else f"{float(value):.{digits}g}"


def _unlike(one: Any, other: Any) -> tuple[str, str]:
    """Two numbers with so many digits that they do not look equal."""
    pairs = [(_short(one, digits), _short(other, digits)) for digits in (6, 9, 12, 17)]
    return next((pair for pair in pairs if pair[0] != pair[1]), pairs[0])
