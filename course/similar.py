"""How much of a hand-in stands in another one, or in the project: names, spaces and comments do not matter.

A text becomes a sequence of tokens. Every name but Python's own, and the names of the blank's code, is the same token.
Two texts share the runs of `RUN` tokens that both have. Runs of the blank do not count. The bodies of functions are
also compared with the reference, one by one, without the names of the blank.

A copy in a text that the code unpacks and runs is not seen, so a hand-in that can run texts is told.
"""

from __future__ import annotations

import ast
import io
import keyword
import re
import tokenize
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

from .checking import Lesson
from .folders import HERE
from .solving import clean, solution

RUN = 12  # tokens: about a line
FEWEST = 40  # runs: shorter answers are alike by chance
ALIKE = 0.8  # the share of the shorter text's runs
ALIKE_BODY = 0.9  # the share of one function's runs: short functions have fewer ways to be written
_RUNS_TEXT = re.compile(r"\b(exec|eval|compile|__import__|importlib|runpy|marshal|pickle|ctypes|FunctionType)\b")
_SHADER = re.compile(r'"""\n#version.*?"""', re.DOTALL)
_TOKEN = re.compile(r"[^\W\d]\w*|[\d.]+|[^\w\s]")


class Likeness(NamedTuple):
    """Two texts of a lesson, and the share of the first one's runs that the second one has."""

    lesson: int
    one: str
    other: str
    share: float


def runs(text: str, kept: frozenset[str]) -> set[tuple[str, ...]]:
    """All runs of a text. `kept` are the names that stay what they are."""
    tokens = [token if token in kept or not token.isidentifier() else "name" for token in _TOKEN.findall(_code(text))]
    return {tuple(tokens[i : i + RUN]) for i in range(len(tokens) - RUN + 1)}


def _code(text: str) -> str:
    """A text without comments, and without the texts that stand alone."""
    try:
        found = list(tokenize.generate_tokens(io.StringIO(text).readline))
    except (tokenize.TokenError, SyntaxError):
        return text
    kept = [_SHADER.sub(_without_comments, token.string) for token in found if token.type != tokenize.COMMENT]
    return re.sub(r'"""(?!\n#version).*?"""', "", " ".join(kept), flags=re.DOTALL)


def _without_comments(shader: re.Match[str]) -> str:
    return re.sub("//.*", "", shader[0])


def runs_text(text: str) -> str:
    """The first name of a hand-in that could run a hidden text; empty if it has none."""
    found = _RUNS_TEXT.search(_code(text))
    return found[0] if found else ""


def _bodies(text: str) -> dict[str, str]:
    """The functions of a text without their first lines, by name, in one form of brackets and lines."""
    try:
        parts = [part for part in ast.parse(text).body if isinstance(part, ast.FunctionDef)]
    except (SyntaxError, ValueError, RecursionError):
        return {}
    return {part.name: "\n".join(map(ast.unparse, part.body)) for part in parts}


def likenesses(lesson: Lesson, files: dict[str, Path]) -> list[Likeness]:
    """Pairs of hand-ins of a lesson that are alike, and hand-ins and functions that are like the project's files."""
    names = frozenset(re.findall(r"[^\W\d]\w*", _code(lesson.original))) | frozenset(keyword.kwlist)
    blank = runs(lesson.original, names)
    texts = {name: path.read_text("utf-8", "replace") for name, path in files.items()}
    mine = _counted({name: runs(text, names) - blank for name, text in texts.items()})
    sources = {path.name: path.read_text("utf-8") for path in _sources(lesson)}
    pairs = [
        Likeness(lesson.number, one, other, len(mine[one] & mine[other]) / min(len(mine[one]), len(mine[other])))
        for one, other in combinations(sorted(mine), 2)
    ]
    sources["the solution"] = clean(solution(lesson.folder).read_text("utf-8"))
    pairs += [
        Likeness(lesson.number, name, source, len(own & theirs) / len(own))
        for source, theirs in ((source, runs(text, names)) for source, text in sources.items())
        for name, own in mine.items()
    ]
    del sources["the solution"]  # a right function of a few lines is much like another one
    words = frozenset(keyword.kwlist)
    theirs = set().union(*(runs(body, words) for text in sources.values() for body in _bodies(text).values()))
    bodies = [
        Likeness(lesson.number, name, f"the reference in {function}()", len(own & theirs) / len(own))
        for name, text in texts.items()
        for function, own in _counted({f: runs(body, words) for f, body in _bodies(text).items()}).items()
    ]
    found = [each for each in pairs if each.share >= ALIKE] + [each for each in bodies if each.share >= ALIKE_BODY]
    return sorted(found, key=lambda each: -each.share)


def _counted(texts: dict[str, set[tuple[str, ...]]]) -> dict[str, set[tuple[str, ...]]]:
    return {name: found for name, found in texts.items() if len(found) >= FEWEST}


def _sources(lesson: Lesson) -> list[Path]:
    """The project's files that have the same computations."""
    return [*sorted((HERE.parent / "terrain_gl" / "reference").glob("*.py")), lesson.folder / "check.py"]
