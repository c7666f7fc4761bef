"""What the students' tree leaves out because it has the answers: the reference, and whatever uses it.

`terrain_gl.reference` states in numpy what students write. Tests and programs that use it have answers beside them,
or do not run without it. So a file loses its imports of the reference, and all its parts that need them. Programs of
`benchmarks/` are not handed out either, nor tests that import them.
"""

from __future__ import annotations

import ast
import re

from .folders import HERE

PATHS = ("terrain_gl/reference", "terrain_gl/comparison/pruned.py")
_PROGRAMS, _HELPERS = (
    {path.stem for each in files for path in HERE.parent.glob(each)}
    for files in (("benchmarks/*.py", "benchmarks/open/*.py"), ("tests/*.py",))
)
REFERENCE = tuple(path.removesuffix(".py").replace("/", ".") for path in PATHS)
MODULES = *REFERENCE, *sorted(_PROGRAMS - _HELPERS)
_LINK = re.compile(rf"\[([^\]]*)\]\([^)]*(?:{'|'.join(PATHS)})[^)]*\)")
_Import = ast.Import | ast.ImportFrom


def without_links(page: str) -> str:
    """A page whose links to files that are left out are plain text."""
    return _LINK.sub(r"\1 (not in this tree)", page)


def without_reference(text: str) -> str:
    """Python code without the imports of what is left out, and without the functions and values that need them.

    A test that asks for a fixture by the name of an argument needs it, too.
    """
    body = ast.parse(text).body
    gone = {name for part in body for name in _hidden_names(part)}
    out: dict[int, str] = {}  # the parts that change, and what they become
    for i, part in enumerate(body):
        if isinstance(part, _Import) and (hidden := _hidden_names(part)):
            part.names = [each for each in part.names if (each.asname or each.name) not in hidden]
            out[i] = f"{ast.unparse(part)}\n" if part.names else ""
    while True:
        needy = [i for i, part in enumerate(body) if i not in out and _needs(part) & gone]
        if not needy:
            break
        out |= dict.fromkeys(needy, "")
        gone |= {name for i in needy for name in _defined(body[i])}
    lines: list[str] = text.splitlines(keepends=True)
    for i in sorted(out, reverse=True):
        lines[_first_line(body[i]) - 1 : body[i].end_lineno] = [out[i]]
    return "".join(lines)


def has_tests(text: str) -> bool:
    """Whether a file has a test."""
    return re.search(r"^def test_", text, re.MULTILINE) is not None


def _hidden_names(part: ast.AST) -> set[str]:
    """The names that imports of what is left out bring, wherever they stand in a part."""
    found = set()
    for node in ast.walk(part):
        if isinstance(node, _Import) and not getattr(node, "level", 0):
            within = f"{node.module}." if isinstance(node, ast.ImportFrom) else ""
            found |= {each.asname or each.name for each in node.names if _is_hidden(within + each.name)}
    return found


def _is_hidden(name: str) -> bool:
    return any(f"{name}.".startswith(f"{module}.") for module in MODULES)


def _needs(part: ast.AST) -> set[str]:
    """The names that a part uses; arguments are names of fixtures."""
    if isinstance(part, _Import):
        return set()
    names = {node.id for node in ast.walk(part) if isinstance(node, ast.Name)}
    return names | {node.arg for node in ast.walk(part) if isinstance(node, ast.arg)}


def _defined(part: ast.AST) -> set[str]:
    if isinstance(part, ast.FunctionDef | ast.ClassDef):
        return {part.name}
    return {node.id for node in ast.walk(part) if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Store)}


def _first_line(part: ast.stmt) -> int:
    marks = part.decorator_list if isinstance(part, ast.FunctionDef | ast.ClassDef) else []
    return min([part.lineno, *(mark.lineno for mark in marks)])
