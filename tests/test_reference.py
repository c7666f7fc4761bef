"""The reference: it imports numpy alone, and the twins that shaders name exist and are used in tests."""

import ast
import functools
import importlib
import re
import sys
from pathlib import Path

import pytest

from terrain_gl import reference
from terrain_gl.gpu import shaders

ROOT = Path(str(shaders.root()))
SHADERS = sorted(
    path for path in ROOT.rglob("*") if path.suffix in {".glsl", ".comp", ".vert", ".tesc", ".tese", ".frag", ".geom"}
)
STAGES = {"sat", "error", "lod", "mesh", "generate", "horizon", "light"}  # folders of the line: each file has a twin
WITHOUT = {  # no equation: bookkeeping, declarations, or passes that use the functions of another file
    "light/air.glsl",
    "light/around.glsl",
    "light/lit.glsl",
    "light/shown.glsl",
    "light/water.glsl",
    "lod/place.glsl",
    "lod/rings/count.comp",
    "lod/rings/emit.comp",
    "lod/rings/explain.comp",
    "lod/rings/rings.glsl",
    "lod/rings/place.comp",
    "lod/rings/agree.comp",
    "lod/rings/spawn.comp",
    "lod/rings/weigh.comp",
    "mesh/error.frag",
    "mesh/pair.glsl",  # exact arithmetic: fractions are its twin (test_proofs.py)
    "mesh/patch.glsl",
    "mesh/patch.vert",
    "mesh/to.glsl",
    "mesh/triangle.geom",
    "mesh/vertex.glsl",
}


def twins_of(path):
    """Dotted names after "Python twin" in a shader's text."""
    told = re.findall(r"Python twins?[^:\n]*:([^\n]*)", path.read_text(encoding="utf-8"))
    return [name for line in told for name in re.findall(r"[a-z_]+(?:\.\w+)+", line)]


NAMED = sorted({(path.relative_to(ROOT).as_posix(), name) for path in SHADERS for name in twins_of(path)})


def resolve(name):
    """Object of a dotted name in the package."""
    module, parts = importlib.import_module("terrain_gl"), name.split(".")
    for i, part in enumerate(parts):
        if not hasattr(module, part):
            importlib.import_module(f"terrain_gl.{'.'.join(parts[: i + 1])}")
        module = getattr(module, part)
    return module


@functools.cache
def words_of_tests():
    """Every name that the tests use, except this file."""
    files = (path for path in Path(__file__).parent.glob("*.py") if path.name != Path(__file__).name)
    return set(re.findall(r"\w+", " ".join(path.read_text(encoding="utf-8") for path in files)))


@pytest.mark.parametrize("shader, name", NAMED)
def test_twin_is_there_and_a_test_uses_it(shader, name):
    assert resolve(name) is not None
    assert name.rpartition(".")[2] in words_of_tests(), f"no test compares {shader} with {name}"


def test_every_shader_of_a_stage_names_its_twin():
    found = {path.relative_to(ROOT).as_posix() for path in SHADERS if not twins_of(path)}
    assert {path for path in found if path.split("/")[0] in STAGES} <= WITHOUT


def test_reference_imports_numpy_alone():
    for path in Path(reference.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                modules = [alias.name for alias in node.names]
            elif isinstance(node, ast.ImportFrom):
                assert node.level <= 1, f"{path.name} imports from outside the reference"
                modules = [] if node.level else [node.module]
            else:
                continue
            for module in modules:
                top = module.split(".")[0]
                assert top == "numpy" or top in sys.stdlib_module_names, f"{path.name} imports {module}"


def test_stages_are_functions_of_the_package():
    assert reference.sat is not sys.modules["terrain_gl.reference.sat"]
    assert callable(reference.sat) and callable(reference.land)
