"""Mutants: the solutions with one token changed. A mutant that passes its lesson's check shows what the check misses.

Mutants change operators, comparisons, constants, bounds, axes, signs, and words such as `min` and `max`. One that
survives is either the same function, and a line of solutions/survivors.toml says why, or the check lacks a case.
"""

from __future__ import annotations

import re
import tempfile
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .checking import EXACT, NOT_RUN, Lesson, outcome_of
from .remote import Student, StudentError
from .solving import SOLUTIONS, clean, solution

EXPLAINED = SOLUTIONS / "survivors.toml"
SURVIVED, EXPLAINED_BY, REJECTED, UNTRIED = "survived", "explained", "rejected", "not run"
_REGION = re.compile(r"^[ \t]*(?:#|//) solution\n(.*?)^[ \t]*(?:#|//) end\n", re.MULTILINE | re.DOTALL)
_COMMENT = re.compile(r"\s(#|//) .*$")
# A token, and what it becomes.
_SWAPS: tuple[tuple[str, dict[str, str]], ...] = (
    (r"(?<=\s)(\+|-|\*|/|//|%)(?=\s)", {"+": "-", "-": "+", "*": "/", "/": "*", "//": "*", "%": "+"}),
    (r"(?<=\s)(<=|>=|<|>|==|!=)(?=\s)", {"<": "<=", "<=": "<", ">": ">=", ">=": ">", "==": "!=", "!=": "=="}),
    (r"(?<=\s)(<<|>>|&|\|)(?=\s)", {"<<": ">>", ">>": "<<", "&": "|", "|": "&"}),
    (r"\b(min|max|minimum|maximum|any|all|floor|ceil|and|or|True|False|cumsum|argmin|argmax)\b", {
        "min": "max", "max": "min", "minimum": "maximum", "maximum": "minimum", "any": "all", "all": "any",
        "floor": "ceil", "ceil": "floor", "and": "or", "or": "and", "True": "False", "False": "True",
        "cumsum": "cumprod", "argmin": "argmax", "argmax": "argmin"}),
    (r"(?<=[(,\[=] )(-)(?=\w)|(?<=[(,\[:])(-)(?=\w)", {"-": ""}),  # a sign
    (r"(\.T)\b", {".T": ""}),
)  # fmt: skip
_NUMBER = re.compile(r"(?<![\w.])(\d+\.\d*(?:e-?\d+)?|\d+(?:e-?\d+)?|\d+u)(?![\w.])")
_PAIR = re.compile(r"\[(\w+), (\w+)\]")  # two indices or axes


class Mutant(NamedTuple):
    """A changed solution."""

    line: str  # the line before, stripped
    changed: str  # and after
    text: str  # the whole file
    task: str  # the number of the task that is changed, such as 3.2


def mutants(folder: Path) -> list[Mutant]:
    """All mutants of a lesson's solution."""
    text = solution(folder).read_text(encoding="utf-8")
    found = []
    for region in _REGION.finditer(text):
        at = region.start(1)
        task = re.findall(r"\b\d+\.\d\b(?= [A-Z])", text[:at])[-1:]
        for line in region[1].splitlines(keepends=True):
            code = _COMMENT.sub("", line.rstrip("\n"))
            is_code = not code.lstrip().startswith(("#", "//")) and " " in code.strip()  # no row of a table
            for start, end, new in _changes(code) if is_code else ():
                changed = code[:start] + new + code[end:]
                whole = text[:at] + line.replace(code, changed) + text[at + len(line) :]
                found.append(Mutant(code.strip(), changed.strip(), clean(whole), *(task or [""])))
            at += len(line)
    return found


def _changes(code: str) -> Iterator[tuple[int, int, str]]:
    """Start, end and new text of every change of a line."""
    for pattern, new in _SWAPS:
        for match in re.finditer(pattern, code):
            yield match.start(), match.end(), new[match[0]]
    for match in _NUMBER.finditer(code):
        number, unsigned = match[0].rstrip("u"), "u" * match[0].endswith("u")
        if number.isdigit():
            yield match.start(), match.end(), f"{int(number) + 1}{unsigned}"
            if number != "0":
                yield match.start(), match.end(), f"{int(number) - 1}{unsigned}"
        else:
            yield match.start(), match.end(), repr(float(number) * 1.01 or 0.01)
    for match in _PAIR.finditer(code):
        if match[1] != match[2]:
            yield match.start(), match.end(), f"[{match[2]}, {match[1]}]"


def chosen(folder: Path, count: int, seed: int) -> list[Mutant]:
    """So many mutants of a lesson, chosen by chance; all of them if there are fewer."""
    every = mutants(folder)
    order = np.random.default_rng(seed).permutation(len(every))[:count]
    return [every[i] for i in sorted(order)]


def passes(mutant: Mutant, lesson: Lesson, seed: int, seconds: float) -> str:
    """What the lesson's check says of a mutant: survived, rejected or not run."""
    tasks = sorted(enumerate(lesson.tasks), key=lambda pair: not pair[1].title.startswith(f"{mutant.task} "))
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder, lesson.file)
        file.write_text(mutant.text, encoding="utf-8")
        with Student(file, seconds, original=lesson.original) as student:
            try:
                student.call("")
            except StudentError:
                return REJECTED
            for index, task in tasks:
                student.allow(seconds)
                outcome = outcome_of(task, student, np.random.default_rng([seed, lesson.number, index]))
                if outcome.verdict == NOT_RUN:
                    return UNTRIED
                if outcome.verdict != EXACT:
                    return REJECTED
    return SURVIVED


def explained() -> dict[tuple[int, str, str], str]:
    """Why a mutant is right all the same, by lesson, line and changed line."""
    listed = tomllib.loads(EXPLAINED.read_text(encoding="utf-8")) if EXPLAINED.is_file() else {}
    return {(int(n), each["old"], each["new"]): each["why"] for n, rows in listed.items() for each in rows}


def verdicts(
    lesson: Lesson, count: int, seed: int, jobs: int = 1, seconds: float = 10.0
) -> Iterator[tuple[Mutant, str, str]]:
    """Mutants of a lesson, what becomes of each, and the reason if one that survives is explained."""
    known = explained()

    def verdict(mutant: Mutant) -> tuple[Mutant, str, str]:
        said = passes(mutant, lesson, seed, seconds)
        why = known.get((lesson.number, mutant.line, mutant.changed), "")
        return mutant, EXPLAINED_BY if said == SURVIVED and why else said, why

    with ThreadPoolExecutor(jobs) as pool:
        yield from pool.map(verdict, chosen(lesson.folder, count, seed))
