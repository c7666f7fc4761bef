"""Solutions, the students' blanks that are made from them, and the wrong answers that every check rejects.

A solution is between two comments; the blank has one line instead:

    # solution            →    raise NotImplementedError("write this")
    ...
    # end
"""

from __future__ import annotations

import re
import shutil
import tomllib
from pathlib import Path
from typing import NamedTuple

from .checking import HERE, LESSONS, lessons

SOLUTIONS = HERE / "solutions"
APART = ("solutions", "lecturer", "__pycache__", "grading.py", "solving.py")  # not in the students' tree
_PYTHON = re.compile(r"^([ \t]*)# solution\n.*?^[ \t]*# end\n", re.MULTILINE | re.DOTALL)
_SHADER = re.compile(r"^([ \t]*)// solution\n.*?^[ \t]*// end\n", re.MULTILINE | re.DOTALL)


class Wrong(NamedTuple):
    """A wrong answer: the solution with one thing changed."""

    name: str
    why: str
    text: str


def solution(folder: Path) -> Path:
    """The solution of a lesson, given by its folder in lessons/."""
    found = [path for path in (SOLUTIONS / folder.name).iterdir() if path.stem == "solution"]
    return found[0]


def clean(text: str) -> str:
    """A solution without the comments that mark it."""
    return re.sub(r"^[ \t]*(#|//) (solution|end)\n", "", text, flags=re.MULTILINE)


def blank(text: str) -> str:
    """What the student gets: a solution with each marked part left out."""
    text = _PYTHON.sub(r'\1raise NotImplementedError("write this")\n', text)
    return _SHADER.sub(r"\1// write this\n", text)


def wrong_answers(folder: Path) -> list[Wrong]:
    """The wrong answers in a lesson's file; each replaces a text that occurs once in the solution."""
    text = clean(solution(folder).read_text(encoding="utf-8"))
    listed = tomllib.loads((SOLUTIONS / folder.name / "wrong.toml").read_text(encoding="utf-8"))
    found = []
    for name, entry in listed.items():
        old, new = entry["old"].strip("\n"), entry["new"].strip("\n")
        if text.count(old) != 1:
            raise ValueError(
                f"{folder.name}/wrong.toml: [{name}]: its old text occurs {text.count(old)} times, not once"
            )
        found.append(Wrong(name, entry["why"], text.replace(old, new)))
    return found


def write_blanks() -> list[Path]:
    """Write the student's file of every lesson again; return those that changed."""
    changed = []
    for folder in lessons():
        source = solution(folder)
        path, text = folder / f"student{source.suffix}", blank(source.read_text(encoding="utf-8"))
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            changed.append(path)
    return changed


def students_tree(out: Path) -> None:
    """Copy the course without the solutions, with fresh blanks, to a new folder."""
    shutil.copytree(HERE, out / HERE.name, ignore=shutil.ignore_patterns(*APART))
    for folder in lessons():
        source = solution(folder)
        target = out / HERE.name / LESSONS.name / folder.name / f"student{source.suffix}"
        target.write_text(blank(source.read_text(encoding="utf-8")), encoding="utf-8")
