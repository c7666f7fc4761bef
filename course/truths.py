"""True values of checks: computed here; stored in the students' tree, whose checks do not have the code.

A check marks the functions that compute them:

    @private            its arguments do not depend on a student's answer: students get its results, in order
    @referee("totals")  it looks at an answer: students' checks call their own function of that name
"""

from __future__ import annotations

import ast
import functools
import zlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, TypeVar

from .box import wire
from .folders import HERE

STORED = HERE / "stored"  # results, by lesson and seed; only in the students' tree
Function = TypeVar("Function", bound=Callable[..., Any])

_tape: list[bytes] = []  # results of the task that runs, if they are recorded
_results: Iterator[Any] = iter(())  # results of the task that runs, if they are read
_within: list[str] = []  # private functions that run: one that another calls has no result of its own


def private(function: Function) -> Function:
    """Declare a function whose code students do not get."""

    @functools.wraps(function)
    def value(*args: Any) -> Any:
        if STORED.is_dir():
            return next(_results)
        _within.append(function.__name__)
        try:
            found = function(*args)
        finally:
            _within.pop()
        if _within:
            return found
        _tape.append(wire.pack(found)[8:])
        return wire.unpack(_tape[-1])  # as students' checks get it

    return value  # type: ignore[return-value]


def referee(own: str) -> Callable[[Function], Function]:
    """Declare a function of a student and an answer. In the students' tree it calls the student's function `own`."""

    def declared(function: Function) -> Function:
        @functools.wraps(function)
        def value(student: Any, *args: Any) -> Any:
            if STORED.is_dir():
                return student.call(own, *args)
            _within.append(function.__name__)
            try:
                return function(student, *args)
            finally:
                _within.pop()

        return value  # type: ignore[return-value]

    return declared


def seeds(lesson: Path) -> list[int]:
    """The seeds that the students' tree has results for; empty where they are computed."""
    return sorted(int(path.name) for path in STORED.glob(f"{lesson.name}/*"))


def begin(lesson: Path, seed: int, task: int) -> None:
    """Begin a task: results are those of this task from now on."""
    global _results
    _tape.clear()
    path = STORED / lesson.name / str(seed)
    _results = iter(wire.unpack(zlib.decompress(path.read_bytes()))[task]) if path.is_file() else iter(())


def recorded() -> list[Any]:
    """The results of the task that has run."""
    return [wire.unpack(each) for each in _tape]


def write(path: Path, tasks: list[list[Any]]) -> None:
    """Store the results of a lesson's tasks."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(zlib.compress(wire.pack(tasks)[8:]))


def without_code(text: str) -> str:
    """A check without the code of its private functions and without the project's reference."""
    lines: list[str | None] = list(text.splitlines(keepends=True))
    for part in ast.parse(text).body:
        if isinstance(part, ast.ImportFrom) and (part.module or "").startswith("terrain_gl"):
            lines[part.lineno - 1 : part.end_lineno] = [None] * ((part.end_lineno or 0) - part.lineno + 1)
        if isinstance(part, ast.FunctionDef) and any(_is_mark(each) for each in part.decorator_list):
            first = part.body[1].lineno - 1 if ast.get_docstring(part) else part.body[0].lineno - 1
            lines[first : part.end_lineno] = [None] * ((part.end_lineno or 0) - first)
            if not ast.get_docstring(part):
                lines[first] = "    raise NotImplementedError\n"
    return "".join(line for line in lines if line is not None)


def _is_mark(node: ast.expr) -> bool:
    name = node.func if isinstance(node, ast.Call) else node
    return isinstance(name, ast.Name) and name.id in (private.__name__, referee.__name__)
