"""The structure of the package: imports run one way."""

import ast
import configparser
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
PACKAGE = TESTS.parent / "terrain_gl"

# Each row imports from the rows above it alone. A folder is one entry, and has an order of its own.
LAYERS = (
    ("basics", "reference"),
    ("gpu", "image"),
    ("readers", "sat"),
    ("sight",),
    ("heightmap",),
    ("terrain",),
    ("camera", "error"),
    ("light", "lod"),
    ("mesh", "pages"),
    ("shade", "store", "verify"),
    ("files", "film"),
    ("renderer",),
    ("comparison", "viewer"),
    ("cli", "pytest_plugin"),
    ("__main__",),
)


@cache
def modules():
    """Files of the package by their dotted name without the package's own."""
    found = {}
    for path in PACKAGE.rglob("*.py"):
        parts = path.relative_to(PACKAGE).with_suffix("").parts
        found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = path
    return found


@cache
def imports(name):
    """Modules of the package that a module imports, for types alone or not."""
    path, found = modules()[name], set()
    package = ["terrain_gl", *name.split(".")] if path.name == "__init__.py" else ["terrain_gl", *name.split(".")[:-1]]
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            targets = [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            start = [part for part in package if part][: len(package) - node.level + 1] if node.level else []
            base = ".".join([*start, *([node.module] if node.module else [])])
            targets = [f"{base}.{alias.name}" for alias in node.names]
        else:
            continue
        inside = (
            target.removeprefix("terrain_gl").lstrip(".") for target in targets if target.startswith("terrain_gl")
        )
        found |= {next((t for t in (target, target.rpartition(".")[0]) if t in modules()), "") for target in inside}
    return found - {name, ""}


def entry(name):
    """A module's own entry in `LAYERS`."""
    return name.split(".")[0]


def layer(name):
    row = next((i for i, row in enumerate(LAYERS) if entry(name) in row), None)
    assert row is not None, f"terrain_gl/{name}: give it a place in LAYERS, below all that it imports"
    return row


@pytest.mark.parametrize("name", sorted(set(modules()) - {""}))
def test_imports_run_one_way(name):
    for other in imports(name):
        if entry(other) != entry(name):
            assert layer(other) < layer(name), f"{name} imports {other}, which stands no lower"


def circles(graph):
    """Sets of modules that import each other in a circle (Tarjan 1972)."""
    order, low, stack, found = {}, {}, [], []

    def visit(node):
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in graph[node]:
            if other not in order:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], order[other])
        if low[node] == order[node]:
            circle = set(stack[stack.index(node) :])
            del stack[stack.index(node) :]
            if len(circle) > 1:
                found.append(circle)

    for node in graph:
        if node not in order:
            visit(node)
    return found


def test_circles_are_found():
    assert circles({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}) == [{"a", "b", "c"}]
    assert circles({"a": {"b"}, "b": {"c"}, "c": set()}) == []


def test_no_imports_go_in_a_circle():
    assert circles({name: imports(name) for name in modules()}) == []


def viewer_rows():
    """Modules of the viewer, from top to bottom, as the package's docstring lists them."""
    table = ast.get_docstring(ast.parse((PACKAGE / "viewer" / "__init__.py").read_text())).split("\n\n")[-1]
    names = {name.rpartition(".")[2] for name in modules() if name.startswith("viewer.")}
    return [[name for name in line.split("  ")[0].split(", ") if name in names] for line in table.splitlines()]


def test_the_viewer_keeps_its_own_order():
    """Each module imports from its own line or the lines below; the docstring is the one list of them."""
    row = {f"viewer.{name}": i for i, names in enumerate(viewer_rows()) for name in names}
    assert set(row) == {name for name in modules() if name.startswith("viewer.")}
    for name in row:
        for other in imports(name) & set(row):
            assert row[other] >= row[name], f"{name} imports {other}, which stands above it"


# --- Lines ------------------------------------------------------------------------------------------------------------

WIDTH = 120
SHADERS = TESTS.parent / "glsl"
ENDINGS = (".comp", ".frag", ".geom", ".glsl", ".tesc", ".tese", ".vert")


def shaders():
    """All files of shaders."""
    return sorted(path for path in SHADERS.rglob("*") if path.suffix in ENDINGS)


def wide(text):
    return [number for number, line in enumerate(text.splitlines(), 1) if len(line) > WIDTH]


def test_no_line_of_a_shader_is_too_wide():
    assert wide("a" * WIDTH + "\n" + "b" * (WIDTH + 1)) == [2]
    found = {path.relative_to(SHADERS).as_posix(): wide(path.read_text(encoding="utf-8")) for path in shaders()}
    assert {path: lines for path, lines in found.items() if lines} == {}


# --- What is installed ------------------------------------------------------------------------------------------------


def installed_folders():
    """Folders that setup.cfg installs, by package."""
    config = configparser.ConfigParser()
    config.read(TESTS.parent / "setup.cfg")
    packages = config["options"]["packages"].split()
    moved = dict(line.split(" = ") for line in config["options"]["package_dir"].strip().splitlines())
    return {name: TESTS.parent / moved.get(name, name.replace(".", "/")) for name in packages}


def test_every_package_is_installed():
    here = {
        path.parent
        for folder in ("terrain_gl", "glsl", "heightmaps")
        for path in (TESTS.parent / folder).rglob("__init__.py")
    }
    assert set(installed_folders().values()) == here


def test_types_and_shaders_are_installed_with_the_code(tmp_path):
    pytest.importorskip("setuptools")
    command = [sys.executable, "-c", "from setuptools import setup; setup()", "-q"]
    command += ["egg_info", "--egg-base", str(tmp_path), "build_py", "--build-lib", str(tmp_path / "lib")]
    subprocess.run(command, cwd=TESTS.parent, check=True, capture_output=True)
    built = {path.relative_to(tmp_path / "lib").as_posix() for path in (tmp_path / "lib").rglob("*") if path.is_file()}
    assert "terrain_gl/py.typed" in built
    for name, folder in installed_folders().items():
        files = {path.name for path in folder.iterdir() if path.is_file() and path.suffix != ".pyc"}
        assert {f"{name.replace('.', '/')}/{file}" for file in files} <= built


# --- How much a reader opens for one decision -------------------------------------------------------------------------


def read_for(path):
    """A shader and all files that it includes, those for maps in memory and those for stores, with their lines."""
    found, waiting = {}, [path]
    while waiting:
        text = (SHADERS / waiting[-1]).read_text(encoding="utf-8")
        found[waiting.pop()] = text.count("\n")
        waiting += [each for each in re.findall(r'#include\s+"([^"]+)"', text) if each not in found]
    return found


def test_the_level_of_a_patch_is_decided_in_few_files():
    found = read_for("lod/rings/decide.comp")
    assert "error/bound.glsl" in found and "pages/bound.glsl" in found, "the tables decide, of maps and of stores"
    assert len(found) <= 11 and sum(found.values()) <= 1019, found


# --- One meaning a word -----------------------------------------------------------------------------------------------


def repeated(classes):
    """Names that two classes have; `classes` are pairs of module and name."""
    owners = {}
    for module, name in classes:
        owners.setdefault(name, []).append(module)
    return {name: modules for name, modules in owners.items() if len(modules) > 1}


def test_each_class_has_a_name_of_its_own():
    assert repeated([("lod", "Ring"), ("sat", "Table"), ("comparison", "Ring")]) == {"Ring": ["lod", "comparison"]}
    trees = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in modules().items()}
    found = [
        (name, node.name) for name, tree in trees.items() for node in ast.walk(tree) if isinstance(node, ast.ClassDef)
    ]
    assert repeated(found) == {}


def is_defined(name):
    """Whether the package has a module, or a class or value in one, of a name such as `layout.Level`."""
    *owner, last = name.split(".")
    path = ".".join(owner)
    for module, file in modules().items():
        if module == name or module.endswith(f".{name}"):
            return True
        text = file.read_text(encoding="utf-8")
        inside = module == path or module.endswith(f".{path}") or re.search(rf"class {path or last}\b", text)
        if inside and re.search(rf"\b{last}\b", text):
            return True
    return False


def test_what_the_glossary_names_is_there():
    assert is_defined("layout.Level") and not is_defined("layout.Nonsense") and not is_defined("nonsense")
    rows = (TESTS.parent / "docs" / "glossary.md").read_text(encoding="utf-8").splitlines()
    named = {name for row in rows if row.startswith("| ") for name in re.findall(r"`([^`]+)`", row.split(" | ")[-1])}
    missing = {name for name in named if not (is_defined(name) or (TESTS.parent / name).exists())}
    assert missing == set() and len(named) > 30
