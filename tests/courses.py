"""Helpers for the tests of the course: run trusted answers in this process."""

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))  # the course is not installed as a package

from course import checking, folders, solving  # noqa: E402
from course.box import wire  # noqa: E402
from course.remote import BlankError, StudentError  # noqa: E402

NUMBERS = [int(folder.name[:2]) for folder in folders.lessons()]


class Local:
    """An answer that runs here, with the same messages as in a process of its own."""

    printed = ""

    def __init__(self, text, original=""):
        self.source, self.original = text, original
        self._names = {"__name__": "student"}
        exec(compile(text, "answer", "exec"), self._names)

    def __getattr__(self, name):
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *args, **kwargs: self.call(name, *args, **kwargs)

    def call(self, name, *args, **kwargs):
        return self.call_with({}, name, *args, **kwargs)

    def call_with(self, replaced, name, *args, **kwargs):
        args, kwargs = wire.unpack(wire.pack((args, kwargs))[8:])
        kept = {other: self._names.get(other) for other in replaced}
        try:
            self._names.update({other: eval(text, {}) for other, text in replaced.items()})
            value = self._names[name](*args, **kwargs)
        except NotImplementedError as error:
            raise BlankError(str(error)) from error
        except Exception as error:
            raise StudentError(f"{type(error).__name__}: {error}") from error
        finally:
            self._names.update(kept)
        return wire.unpack(wire.pack(value)[8:])


def answer(text, lesson):
    """An answer to a lesson."""
    return Local(text, lesson.original)


def outcomes(number, text, seed=1, until=(), first=""):
    """Outcomes of an answer's tasks, up to the first with one of the verdicts; the task `first` comes first."""
    lesson = checking.lesson(number)
    found = []
    for index, task in sorted(enumerate(lesson.tasks), key=lambda pair: not pair[1].title.startswith(f"{first} ")):
        rng = np.random.default_rng([seed, number, index])
        found.append(checking.outcome_of(task, answer(text, lesson), rng))
        if found[-1].verdict in until:
            break
    return found


def told(found):
    """The messages of all findings that are not exact."""
    return [(f.what, f.text) for outcome in found for f in outcome.findings if f.verdict != checking.EXACT]


def solved(number):
    """The solution of a lesson."""
    return solving.clean(solving.solution(checking.lesson(number).folder).read_text(encoding="utf-8"))
