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
from collections.abc import Callable
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

    `fill` takes the course's functions where the student has none. A part of an earlier lesson that lacks a function
    is left out if a still earlier one, or the frame, has the same part. No other picture uses lesson 14.
    """
    return _text(last, _grow(last, fill, _student)[0])


def needs(last: int) -> tuple[list[int], list[int]]:
    """The lessons that the picture of a lesson needs, and those that it uses if they are written."""
    needed: list[int] = []
    try:
        _grow(last, False, lambda found: found.original)
    except _MissingError as error:
        needed = sorted(error.absent)
    used = {piece.lesson for piece in _grow(last, False, _solved)[0] if piece.is_task}
    return needed, sorted(used - set(needed))


def _text(last: int, pieces: list[Piece]) -> str:
    """The text of my_terrain.py."""
    text, title = [_head(_part("frame"))], "frame"
    for piece in pieces:
        if piece.title != title:
            title = piece.title
            text.append(f"# --- {title} {'-' * (100 - len(title))}")
        text.append(piece.text)
    return "\n\n\n".join([*text, _end(last)]) + "\n"


def _head(frame: str) -> str:
    """The frame's imports and constants, which come first."""
    return frame[: frame.index("\n\n\n")]


def _end(last: int) -> str:
    return _part("end").replace("LESSON", f"{last:02d}")


def _grow(last: int, fill: bool, source: Callable[[Lesson], str]) -> tuple[list[Piece], str]:
    """What main() uses, in order; and what is left out, as a line."""
    frame = _part("frame")
    parts = {name: [piece] for name, piece in _pieces(frame, 0, "frame").items()}  # definitions, the last one counts
    before = [number for number in ORDER[: ORDER.index(last)] if number != 14]
    stages = {number: _part(f"stage_{number:02d}") for number in (*before, last)}
    for number, stage in stages.items():
        found = _lesson(number)
        title = f"Lesson {number}: {found.title}"
        for name, piece in _functions(found, source(found), title, "\n".join(stages.values()), fill).items():
            parts[name] = [piece]
        for name, piece in _pieces(stage, number, title).items():
            parts[name] = [*parts.get(name, []), piece]
    removed = _leave_out(parts, last)
    subjects = {f"{kind}_{last:02d}" for kind in ("paint", "show", "report", "film")}
    used = _reached(parts, _pieces(_end(last), 0, "end")["main"].names | subjects)
    if absent := _unwritten(parts, used):
        raise _MissingError(absent, fill)
    absent = _unwritten(parts, {name for each in removed if each.name in used for name in _reached(parts, each.names)})
    left_out = f"left out, because it is not written yet: {_told(absent)}" if absent else ""
    return [piece for name, (*_, piece) in parts.items() if name in used and piece.text not in _head(frame)], left_out


def _leave_out(parts: dict[str, list[Piece]], last: int) -> list[Piece]:
    """Remove definitions that lack a function, where there is an earlier one; the lesson's own stay."""
    lacking, removed, more = {name for name, defined in parts.items() if defined[-1].is_blank}, [], True
    while more:
        more = False
        for name, defined in parts.items():
            if name in lacking or not defined[-1].names & lacking:
                continue
            more = True
            if len(defined) > 1 and defined[-1].lesson != last:
                removed.append(defined.pop())
            else:
                lacking.add(name)
    return removed


def _reached(parts: dict[str, list[Piece]], names: set[str]) -> set[str]:
    """Names, and all that their definitions use."""
    used: set[str] = set()
    todo = set(names)
    while todo:
        name = todo.pop()
        if name in parts and name not in used:
            used.add(name)
            todo |= parts[name][-1].names
    return used


def _unwritten(parts: dict[str, list[Piece]], names: set[str]) -> dict[int, list[str]]:
    """Functions that are not written yet, by lesson."""
    found: dict[int, list[str]] = {}
    for number, name in sorted((parts[name][-1].lesson, name) for name in names if parts[name][-1].is_blank):
        found.setdefault(number, []).append(name)
    return found


def _told(absent: dict[int, list[str]]) -> str:
    return "; ".join(f"lesson {number}: {', '.join(names)}" for number, names in absent.items())


class _MissingError(GrowError):
    """Functions that the picture needs are not written yet."""

    def __init__(self, absent: dict[int, list[str]], fill: bool) -> None:
        self.absent = absent
        can = "your copy has no solution: ask your lecturer" if fill else "--fill takes the course's, if you have it"
        super().__init__(f"not written yet: {_told(absent)}; {can}")


class Piece(NamedTuple):
    """A function or a constant."""

    name: str
    lesson: int  # 0: the frame
    title: str
    text: str
    names: set[str]  # that it uses
    is_task: bool = False  # the student writes it
    is_blank: bool = False  # and has not yet


def _pieces(text: str, number: int, title: str) -> dict[str, Piece]:
    """Functions and constants of a text by name."""
    return {
        name: Piece(name, number, title, ast.get_source_segment(text, part) or "", _names(part))
        for name, part in _top(text).items()
    }


def picture(last: int, fill: bool, out: Path, file: Path, beside: bool = True) -> str:
    """Write my_terrain.py, run it, and put a right solution's picture beside its picture; returns what it prints."""
    try:
        from matplotlib import pyplot as plt
    except ImportError:
        raise GrowError("a picture needs matplotlib: pip install -e '.[compare]'") from None
    pieces, left_out = _grow(last, fill, _student)
    file.write_text(_text(last, pieces), encoding="utf-8")
    done = subprocess.run([sys.executable, str(file), str(MAP), str(out)], capture_output=True, text=True)
    if done.returncode:
        raise GrowError(f"{file}: {(done.stderr.strip() or 'it has failed').splitlines()[-1]}")
    expected = lesson(last).folder / "picture.png"
    if beside and expected.is_file():
        own, right = (plt.imread(path)[..., :3] for path in (out, expected))
        plt.imsave(out, np.concatenate([own, np.ones((len(own), 8, 3)), right], 1))
    return "\n".join(filter(None, [done.stdout.strip(), left_out]))


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


def _functions(found: Lesson, source: str, title: str, stages: str, fill: bool) -> dict[str, Piece]:
    """The student's functions that stages use, and those that they use; docstrings keep their first line."""
    own, original = _top(source), _top(found.original)
    tasks = {name for name, part in original.items() if _is_blank(part)}
    blanks = {name for name in tasks & set(own) if ast.dump(own[name]) == ast.dump(original[name])}
    texts = {name: _short(source, part) for name, part in own.items()}
    if fill and blanks:
        given = _solved(found)
        for name, part in _top(given).items():
            if name in blanks or name not in own:
                own[name], texts[name] = part, _short(given, part)
                blanks.discard(name)
    needed, todo = set(), {name for piece in _top(stages).values() for name in _names(piece)} & set(own)
    while todo:
        name = todo.pop()
        needed.add(name)
        todo |= (_names(own[name]) & set(own)) - needed
    return {
        name: Piece(name, found.number, title, texts[name], _names(part) - {name}, name in tasks, name in blanks)
        for name, part in own.items()
        if name in needed
    }


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
