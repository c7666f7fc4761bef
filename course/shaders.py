"""Findings about students' shaders. They run in a separate process; without OpenGL they do not run."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import Any

import numpy as np

from .checking import BLANK, NOT_RUN, SECONDS, WRONG, Finding, compare
from .folders import HERE
from .remote import Student, StudentError

RUNNER = HERE / "box" / "shaders.py"
_AT = re.compile(r"\b\d+:(\d+)\(\d+\)|\b\d+\((\d+)\)|\b\d+:(\d+)(?=:)")  # line numbers of Mesa, NVIDIA and AMD


def missing(version: int) -> str:
    """Why there is no OpenGL of a version here, such as 430; empty if there is."""
    try:
        _renderer(version)
    except StudentError as error:
        return f"this machine has no OpenGL {version // 100}.{version // 10 % 10}: {error}"
    return ""


@cache  # exceptions are not cached: if the machine was too busy to answer, the next call asks again
def _renderer(version: int) -> str:
    """Name of the driver."""
    with Student(RUNNER, SECONDS, ours=True) as runner:
        return str(runner.renderer(version))


def ready(student: Student, texts: Any, names: set[str], version: int) -> Finding | None:
    """Why shaders cannot run: they are blank, or there is no OpenGL here; None if they can."""
    if not isinstance(texts, dict) or not names <= set(texts) or not all(isinstance(texts[n], str) for n in names):
        return Finding("shaders", WRONG, f"expected a dict of the texts of {', '.join(sorted(names))}")
    original = _texts(student.original)
    given = {name for name in names if "// write this" in original[name]}
    unwritten = sorted(name for name in given if _bare(texts[name]) == _bare(original[name]))
    if unwritten:
        return Finding("shaders", BLANK, f"not written yet: {', '.join(unwritten)}")
    why = missing(version)
    return Finding("shaders", NOT_RUN, why) if why else None


@cache
def _texts(original: str) -> dict[str, str]:
    """The shaders of a file as it was handed out."""
    names: dict[str, Any] = {}
    exec(original, names)
    return dict(names["shaders"]())


def _bare(text: str) -> str:
    """A shader without comments and spaces."""
    return re.sub(r"//[^\n]*|/\*.*?\*/|\s", "", text, flags=re.DOTALL)


@contextmanager
def runner(student: Student, texts: dict[str, str]) -> Iterator[Student]:
    """The process that runs a student's shaders. A compiler's message gets the line of the student's file."""
    with Student(RUNNER, SECONDS, ours=True) as found:
        try:
            yield found
        except StudentError as error:
            raise StudentError(_placed(str(error), texts, student.source)) from None


def _placed(message: str, texts: dict[str, str], source: str) -> str:
    """A message "name: what the compiler says" with lines of the file in place of lines of the shader."""
    name = message.partition(":")[0]
    if name not in texts:
        return message
    lines, file = texts[name].strip().splitlines(), source.splitlines()

    def place(found: re.Match[str]) -> str:
        at = int(next(filter(None, found.groups()))) - 1
        line = _line_in(lines, at, file)
        return f"line {line}" if line else found[0]

    return f"the shader {_AT.sub(place, message)}"


def _line_in(lines: list[str], at: int, file: list[str]) -> int:
    """The line of the file that a shader's line is: the equal line with the most equal lines around it; 0 if none."""

    def run(i: int, step: int) -> int:
        count = 0
        while 0 <= at + count * step < len(lines) and 0 <= i + count * step < len(file):
            if lines[at + count * step] != file[i + count * step]:
                break
            count += 1
        return count

    places = [i for i, line in enumerate(file) if 0 <= at < len(lines) and line == lines[at]]
    return max(places, key=lambda i: run(i, 1) + run(i, -1)) + 1 if places else 0


def prefix_sums(student: Student, texts: Any, maps: list[tuple[np.ndarray, np.ndarray]]) -> Iterator[Finding]:
    """Compare the tables that reduce, scan and propagate compute from maps of uint32 with the true ones beside them."""
    hindrance = ready(student, texts, {"reduce", "scan", "propagate"}, 430)
    if hindrance is not None:
        yield hindrance
        return
    with runner(student, texts) as found:
        for values, want in maps:
            got = found.prefix_table(texts, values)
            yield compare(f"a map of {values.shape[1]} x {values.shape[0]}", got, want, axes=("row", "column"))
