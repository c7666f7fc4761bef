"""my_terrain.py: one renderer that grows with the lessons, made of the student's functions and a frame.

    frame       the camera, a mesh of all posts, a flat light, and OpenGL that draws triangles
    lesson k    the student's functions that its stage uses, and the stage: it takes the place of a part of the frame

A later definition takes the place of an earlier one, as always in Python.
"""

from __future__ import annotations

import ast
import shutil
import subprocess
import sys
import tempfile
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .checking import Lesson, lesson
from .folders import HERE

PARTS = HERE / "growing"
SOLVED = HERE / "solved"  # solutions that a lecturer has added to the students' tree
_AFTER_6 = {13: 6.1, 14: 6.2}  # pages to read after lesson 6
ORDER = tuple(sorted((int(path.stem[-2:]) for path in PARTS.glob("stage_*.py")), key=lambda n: _AFTER_6.get(n, n)))
MAP = HERE.parent / "heightmaps" / "alpine-30m.png"


_lesson = cache(lesson)  # cached, because loading a check takes long


class GrowError(Exception):
    """The file cannot grow; the message has one line."""


def grown(last: int, fill: bool) -> str:
    """The text of my_terrain.py up to a lesson: what main() uses, with the last definition of each name.

    `fill` takes the course's functions where the student has none. No other picture uses lesson 14.
    """
    frame, end = _part("frame"), _part("end").replace("LESSON", f"{last:02d}")
    head, pieces = frame[: frame.index("\n\n\n")], _pieces(frame, "frame")  # imports and constants come first
    before = [number for number in ORDER[: ORDER.index(last)] if number != 14]
    stages = {number: _part(f"stage_{number:02d}") for number in (*before, last)}
    lacking: dict[str, int] = {}
    for number, stage in stages.items():
        found = _lesson(number)
        title = f"Lesson {number}: {found.title}"
        own, blank = _functions(found, "\n".join(stages.values()), fill)
        new = {**_pieces("\n".join(own), title), **_pieces(stage, title)}
        pieces = {**pieces, **new}
        lacking = {name: n for name, n in lacking.items() if name not in new} | dict.fromkeys(blank, number)
    main = _pieces(end, "end")
    subjects = {f"{kind}_{last:02d}" for kind in ("paint", "show", "report", "film")}
    used, todo = set(), _names(main["main"].part) | subjects
    while todo:
        name = todo.pop()
        if name in pieces and name not in used:
            used.add(name)
            todo |= _names(pieces[name].part)
    if lacks := sorted((number, name) for name, number in lacking.items() if name in used):
        told = "; ".join(f"lesson {n}: {', '.join(name for k, name in lacks if k == n)}" for n in dict(lacks))
        can = "your copy has no solution: ask your lecturer" if fill else "--fill takes the course's, if you have it"
        raise GrowError(f"not written yet: {told}; {can}")
    text, title = [head], "frame"
    for name, piece in pieces.items():
        if name not in used or piece.text in head:
            continue
        if piece.title != title:
            title = piece.title
            text.append(f"# --- {title} {'-' * (100 - len(title))}")
        text.append(piece.text)
    return "\n\n\n".join([*text, end]) + "\n"


class Piece(NamedTuple):
    """A function or a constant."""

    title: str
    part: ast.stmt
    text: str


def _pieces(text: str, title: str) -> dict[str, Piece]:
    """Functions and constants of a text by name."""
    return {name: Piece(title, part, ast.get_source_segment(text, part) or "") for name, part in _top(text).items()}


def picture(last: int, fill: bool, out: Path, file: Path, beside: bool = True) -> str:
    """Write my_terrain.py, run it, and put a right solution's picture beside its picture; returns what it prints."""
    try:
        from matplotlib import pyplot as plt
    except ImportError:
        raise GrowError("a picture needs matplotlib: pip install -e '.[compare]'") from None
    file.write_text(grown(last, fill), encoding="utf-8")
    done = subprocess.run([sys.executable, str(file), str(MAP), str(out)], capture_output=True, text=True)
    if done.returncode:
        raise GrowError(f"{file}: {(done.stderr.strip() or 'it has failed').splitlines()[-1]}")
    expected = lesson(last).folder / "picture.png"
    if beside and expected.is_file():
        own, right = (plt.imread(path)[..., :3] for path in (out, expected))
        plt.imsave(out, np.concatenate([own, np.ones((len(own), 8, 3)), right], 1))
    return done.stdout.strip()


def draw_right(last: int) -> str:
    """Draw the picture of a right solution, and its film, for the lesson's page."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "picture.png"
        said = picture(last, True, out, Path(folder) / "my_terrain.py", beside=False)
        for path in (out, out.with_suffix(".webp")):  # a film, where the lesson has one
            if path.is_file():
                shutil.copyfile(path, lesson(last).folder / path.name)
    return said


def _part(name: str) -> str:
    return (PARTS / f"{name}.py").read_text(encoding="utf-8").strip()


def _functions(found: Lesson, stages: str, fill: bool) -> tuple[list[str], set[str]]:
    """The student's functions that stages use, and the functions that these use; and the names of those not written.

    Docstrings keep their first line.
    """
    source = _student(found)
    own, blank = _top(source), _top(found.original)
    given = _solved(found) if fill else ""
    solved, blanks = _top(given), set[str]()
    texts = {name: _short(source, part) for name, part in own.items()}
    needed, todo = set(), {name for piece in _top(stages).values() for name in _names(piece)} & set(own)
    while todo:
        name = todo.pop()
        if _is_blank(own[name]) and ast.dump(own[name]) == ast.dump(blank.get(name, ast.Pass())):
            if name in solved:
                own[name] = solved[name]
                texts[name] = _short(given, own[name])
            else:
                blanks.add(name)
        needed.add(name)
        todo |= (_names(own[name]) & set(own)) - needed
    return [text for name, text in texts.items() if name in needed], blanks


def _student(found: Lesson) -> str:
    path = found.folder / found.file
    if not path.is_file():
        raise GrowError(f"{path}: no such file")
    return path.read_text(encoding="utf-8")


def _solved(found: Lesson) -> str:
    if (SOLVED / found.folder.name).is_file():
        return (SOLVED / found.folder.name).read_text(encoding="utf-8")
    try:
        from .solving import clean, solution
    except ImportError:
        return ""
    return clean(solution(found.folder).read_text(encoding="utf-8"))


def _top(text: str) -> dict[str, ast.stmt]:
    """Functions, constants and imports of a module."""
    try:
        body = ast.parse(text).body
    except SyntaxError as error:
        raise GrowError(f"line {error.lineno}: {error.msg}") from None
    functions = {part.name: part for part in body if isinstance(part, ast.FunctionDef)}
    values = {
        target.id: part
        for part in body
        if isinstance(part, ast.Assign)
        for each in part.targets
        for target in ast.walk(each)
        if isinstance(target, ast.Name)
    }
    imports = {
        each.asname or each.name.partition(".")[0]: part
        for part in body
        if isinstance(part, ast.Import | ast.ImportFrom)
        for each in part.names
    }
    return {**imports, **values, **functions}


def _names(part: ast.AST) -> set[str]:
    """Names that a part uses and does not bind itself."""
    names = [each for each in ast.walk(part) if isinstance(each, ast.Name)]
    bound = {each.id for each in names if isinstance(each.ctx, ast.Store)}
    return {each.id for each in names} - bound - {each.arg for each in ast.walk(part) if isinstance(each, ast.arg)}


def _is_blank(part: ast.stmt) -> bool:
    text = ast.unparse(part)
    return "raise NotImplementedError" in text or "// write this" in text


def _short(source: str, part: ast.stmt) -> str:
    """The text of a function with only the first line of its docstring; the text of any other part unchanged."""
    lines = source.splitlines()[part.lineno - 1 : part.end_lineno]
    told = ast.get_docstring(part) if isinstance(part, ast.FunctionDef) else None
    if told and isinstance(part, ast.FunctionDef):
        first, last = part.body[0].lineno - part.lineno, (part.body[0].end_lineno or 0) - part.lineno
        lines[first : last + 1] = [f'    """{told.splitlines()[0]}"""']
    return "\n".join(lines)
