"""How much of a hand-in stands in another one, or in the project: names, spaces and comments do not matter.

A text becomes a sequence of tokens. Every name but Python's own, and every name of the blank, is the same token. Two
texts share the runs of `RUN` tokens that both have. Runs of the blank do not count.
"""

from __future__ import annotations

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
    kept = [token.string for token in found if token.type != tokenize.COMMENT]
    return re.sub(r'"""(?!\n#version).*?"""', "", " ".join(kept), flags=re.DOTALL)


def likenesses(lesson: Lesson, files: dict[str, Path]) -> list[Likeness]:
    """Pairs of hand-ins of a lesson that are alike, and hand-ins that are like the project's files."""
    names = frozenset(re.findall(r"[^\W\d]\w*", lesson.original)) | frozenset(keyword.kwlist)
    blank = runs(lesson.original, names)
    mine = {name: runs(path.read_text("utf-8", "replace"), names) - blank for name, path in files.items()}
    mine = {name: found for name, found in mine.items() if len(found) >= FEWEST}
    sources = {path.name: runs(path.read_text("utf-8"), names) for path in _sources(lesson)}
    sources["the solution"] = runs(clean(solution(lesson.folder).read_text("utf-8")), names)
    pairs = [(one, other, mine[one], mine[other]) for one, other in combinations(sorted(mine), 2)]
    pairs += [(name, source, own, theirs) for name, own in mine.items() for source, theirs in sources.items()]
    found = [
        Likeness(lesson.number, one, other, len(a & b) / (len(a) if other in sources else min(len(a), len(b))))
        for one, other, a, b in pairs
    ]
    return sorted((each for each in found if each.share >= ALIKE), key=lambda each: -each.share)


def _sources(lesson: Lesson) -> list[Path]:
    """The project's files that have the same computations."""
    return [*sorted((HERE.parent / "terrain_gl" / "reference").glob("*.py")), lesson.folder / "check.py"]
