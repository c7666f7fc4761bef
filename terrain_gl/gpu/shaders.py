"""GLSL loader: files of the `glsl/` folder with nested includes, defines, and errors that name file and line.

`#include "sat/box.glsl"` takes a path from the root of `glsl/`; each file is included once. The loader writes
`#version 430 core`, the sizes that shaders share with Python (`layout.DEFINES`) and the defines of the call; the files
contain none of them. Comments are blanked first: an include in a comment is not followed, and drivers see plain ASCII.
An include between #ifdef and #endif is expanded as any other; the driver then leaves it out.
"""

import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import moderngl

from ..basics.exceptions import TerrainError
from ..basics.resources import folder
from .layout import DEFINES

VERSION = "#version 430 core"
Defines = Mapping[str, object]
NO_DEFINES: Defines = MappingProxyType({})

_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"\s*$')
# "0:12(5): error" Mesa, "0(12) : error" NVIDIA, "ERROR: 0:12: ..." AMD, Intel
_LOG_LINE = re.compile(r"^(?:(?:ERROR|WARNING): )?0(?::(\d+)(?:\(\d+\))?|\((\d+)\))\s*:\s*(.*)$")


class ShaderError(TerrainError, RuntimeError):
    """A shader does not load, compile or link; the message says `file:line`."""


class Line(NamedTuple):
    """One line of expanded text and where it came from."""

    text: str
    path: str
    number: int


def source(path: str, defines: Defines = NO_DEFINES) -> str:
    """Text of the shader `path`: version, defines, expanded includes."""
    return "\n".join(_head(defines)) + "\n" + _body(path, root())


def compute(ctx: moderngl.Context, path: str, defines: Defines = NO_DEFINES) -> moderngl.ComputeShader:
    """Compile the compute shader `path`; raises `ShaderError` with file and line."""
    try:
        return ctx.compute_shader(source(path, defines))
    except moderngl.Error as error:
        raise ShaderError(_explain(str(error), {"compute_shader": _load(path, defines)})) from None


def program(
    ctx: moderngl.Context,
    *,
    vertex: str,
    fragment: str | None = None,
    tess_control: str | None = None,
    tess_evaluation: str | None = None,
    geometry: str | None = None,
    defines: Defines = NO_DEFINES,
    varyings: Sequence[str] = (),
) -> moderngl.Program:
    """Compile and link a program from one file per stage; all of them see the same defines.

    Raises `ShaderError` with file and line.
    """
    paths = {
        "vertex_shader": vertex,
        "tess_control_shader": tess_control,
        "tess_evaluation_shader": tess_evaluation,
        "geometry_shader": geometry,
        "fragment_shader": fragment,
    }
    stages = {stage: path for stage, path in paths.items() if path}
    texts: dict[str, Any] = {stage: source(path, defines) for stage, path in stages.items()}
    try:
        return ctx.program(**texts, varyings=tuple(varyings))
    except moderngl.Error as error:
        lines = {stage: _load(path, defines) for stage, path in stages.items()}
        raise ShaderError(_explain(str(error), lines)) from None


def _load(path: str, defines: Defines) -> list[Line]:
    return [Line(text, "(loader)", i + 1) for i, text in enumerate(_head(defines))] + _lines(path, root())


def _head(defines: Defines) -> list[str]:
    return [VERSION] + [f"#define {name} {_literal(value)}" for name, value in {**DEFINES, **defines}.items()]


@cache  # programs differ by their defines
def _body(path: str, of: Path) -> str:
    return "".join(line.text + "\n" for line in _lines(path, of))


@cache  # every renderer loads its own shaders
def _lines(path: str, _root: Path) -> list[Line]:
    """Lines of `path` with its includes in place."""
    return _expand(path, set(), "(loader)")


def _expand(path: str, seen: set[str], included_from: str) -> list[Line]:
    """Lines of `path` with its includes in place, skipping files already seen."""
    seen.add(path)
    lines: list[Line] = []
    for line, included in _own_lines(path, _read(path, included_from)):
        if included is None:
            lines.append(line)
        elif included not in seen:
            lines += _expand(included, seen, f"{path}:{line.number}")
    return lines


@cache  # many shaders include the same files
def _own_lines(path: str, text: str) -> list[tuple[Line, str | None]]:
    """Lines of one file, each with the file that it includes."""
    matches = [(_INCLUDE.match(line), line) for line in text.split("\n")]
    return [(Line(line, path, n), match[1] if match else None) for n, (match, line) in enumerate(matches, 1)]


def _read(path: str, included_from: str) -> str:
    try:
        text = root().joinpath(*path.split("/")).read_text(encoding="utf-8")
    except OSError:
        raise ShaderError(f"{included_from}: there is no shader file glsl/{path}") from None
    return _without_comments(text)


@cache
def _without_comments(text: str) -> str:
    """The text, each line where it was, without the spaces around it, which would be most of the text."""
    without = _COMMENT.sub(lambda comment: " " + "\n" * comment[0].count("\n"), text)
    return "\n".join(line.strip() for line in without.split("\n"))


def root() -> Path:
    """Return the folder that holds the GLSL files."""
    return folder("glsl")


def _literal(value: object) -> str:
    return str(int(value)) if isinstance(value, bool) else str(value)


def _explain(log: str, stages: Mapping[str, Sequence[Line]]) -> str:
    """Rewrite a driver's log: the stage's heading selects the file, numbers become `file:line`."""
    lines = next(iter(stages.values()))
    told = []
    for text in log.split("\n"):
        lines = stages.get(text.strip(), lines)
        if match := _LOG_LINE.match(text):
            at = lines[min(int(match[1] or match[2]), len(lines)) - 1]
            told.append(f"{at.path}:{at.number}: {match[3]}")
        elif text.startswith(("error", "ERROR")):
            told.append(f"{' + '.join(lines[-1].path for lines in stages.values())}: {text}")
    return "\n".join(told) or log
