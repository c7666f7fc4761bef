"""The GLSL loader; and every shader compiles with the driver, and with the reference compiler."""

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from terrain_gl.gpu import shaders


@pytest.fixture
def glsl(tmp_path, monkeypatch):
    """Give a function that writes one shader file into an otherwise empty GLSL folder."""
    monkeypatch.setattr(shaders, "root", lambda: tmp_path)

    def write(path, text):
        (tmp_path / path).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / path).write_text(text, encoding="utf-8")

    return write


def test_version_comes_first_then_defines(glsl):
    glsl("a.comp", "void main() {}\n")
    text = shaders.source("a.comp", {"SIZE": 8, "EXACT": True})
    lines = text.split("\n")
    assert lines[:2] == ["#version 430 core", "#define MAX_LEVELS 15"]
    assert lines[-5:-2] == ["#define SIZE 8", "#define EXACT 1", "void main() {}"]


def test_includes_nest_and_enter_once(glsl):
    glsl("a.comp", '#include "x/b.glsl"\n#include "x/c.glsl"\nA\n')
    glsl("x/b.glsl", '#include "x/c.glsl"\nB\n')
    glsl("x/c.glsl", '#include "x/b.glsl"\nC\n')
    assert shaders.source("a.comp").split()[-3:] == ["C", "B", "A"]


def test_comments_are_blanked_and_their_includes_not_followed(glsl):
    glsl("a.comp", '// Σ as #include "x.glsl"\n/* two\n#include "y.glsl"\n*/ int a; // S(x, y)\n')
    text = shaders.source("a.comp")
    assert text.isascii() and "include" not in text
    assert text.split("\n")[-3].strip() == "int a;"


def test_missing_file_is_named_with_the_line_that_wants_it(glsl):
    glsl("a.comp", 'int a;\n#include "none.glsl"\n')
    with pytest.raises(shaders.ShaderError, match=r"^a\.comp:2: there is no shader file glsl/none\.glsl$"):
        shaders.source("a.comp")


def test_compute_error_names_the_included_file_and_line(ctx, glsl):
    glsl("a.comp", '#include "b.glsl"\nlayout(local_size_x = 1) in;\nvoid main() { f(); }\n')
    glsl("b.glsl", "// one\nvoid f() {\n    nonsense();\n}\n")
    with pytest.raises(shaders.ShaderError, match=r"^b\.glsl:3: .*nonsense"):
        shaders.compute(ctx, "a.comp", {"N": 1})


def test_program_error_names_the_stage_at_fault(ctx, glsl):
    glsl("a.vert", "void main() { gl_Position = vec4(0); }\n")
    glsl("a.frag", "out vec4 out_color;\n\nvoid main() { out_color = missing; }\n")
    with pytest.raises(shaders.ShaderError, match=r"^a\.frag:3: .*missing"):
        shaders.program(ctx, vertex="a.vert", fragment="a.frag")


def test_link_error_names_the_files(ctx, glsl):
    glsl("a.vert", "void main() { gl_Position = vec4(0); }\n")
    glsl("a.frag", "vec4 nowhere();\nout vec4 out_color;\nvoid main() { out_color = nowhere(); }\n")
    with pytest.raises(shaders.ShaderError, match=r"^a\.vert \+ a\.frag: .*nowhere"):
        shaders.program(ctx, vertex="a.vert", fragment="a.frag")


@pytest.mark.parametrize(
    "log",
    [
        "compute_shader\n==\n0:3(5): error: bad",  # Mesa
        "compute_shader\n==\n0(3) : error: bad",  # NVIDIA
        "compute_shader\n==\nERROR: 0:3: error: bad",  # AMD, Intel
    ],
)
def test_logs_of_all_drivers_are_understood(log):
    lines = [shaders.Line("", "(loader)", 1), shaders.Line("", "a.comp", 1), shaders.Line("", "a.comp", 2)]
    assert shaders._explain(log, {"compute_shader": lines}) == "a.comp:2: error: bad"


ROOT = Path(str(shaders.root()))
COMPUTE = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*.comp"))


@pytest.mark.parametrize("path", COMPUTE)
def test_compute_shader_compiles_with_its_own_defaults(ctx, path):
    shaders.compute(ctx, path).release()


# --- The reference compiler of the Khronos group ----------------------------------------------------------------------

STAGES = {".comp": "comp", ".vert": "vert", ".tesc": "tesc", ".tese": "tese", ".geom": "geom", ".frag": "frag"}
ENTRIES = sorted(path.relative_to(ROOT).as_posix() for path in ROOT.rglob("*") if path.suffix in STAGES)
VARIANTS = [  # macros that choose between parts of a file
    *({"NO_VOIDS": 1, "TO": to} for to in ("PICTURE", "ABOVE", "CAPTURE")),
    {"SAMPLES": 1, "WATER": 0},
    {"BITS": 64},
    {"WHOLE_LINES": 1, "BITS": 64},
]
STRIPS = ("sat/reduce.comp", "sat/scan.comp")  # kernels that whole lines do not need


@pytest.fixture(scope="module")
def compiled(tmp_path_factory):
    """What the reference compiler says of each shader and its variants: one process reads all files, which is quick."""
    compiler, folder = shutil.which("glslangValidator"), tmp_path_factory.mktemp("glsl")
    if compiler is None:
        pytest.skip("glslangValidator is not installed (Debian: glslang-tools)")
    of = {}
    for path in ENTRIES:
        plain = shaders.source(path)
        variants = [defines for defines in VARIANTS if any(re.search(rf"\b{name}\b", plain) for name in defines)]
        variants = [defines for defines in variants if "WHOLE_LINES" not in defines or path not in STRIPS]
        for text in (plain, *(shaders.source(path, defines) for defines in variants)):
            name = f"{len(of)}{Path(path).suffix}"
            (folder / name).write_text(text)
            of[name] = path
    done = subprocess.run([compiler, *of], cwd=folder, capture_output=True, text=True)
    assert [line for line in done.stdout.splitlines() if line in of] == list(of), "each file is named once"
    said, about = {path: [] for path in ENTRIES}, None
    for line in done.stdout.splitlines():
        about = of.get(line, about)
        said[about] += [] if line in of or not line.strip() else [line]
    return said


@pytest.mark.parametrize("path", ENTRIES)
def test_reference_compiler_accepts_the_shader(compiled, path):
    assert compiled[path] == []


def test_reference_compiler_refuses_what_is_wrong():
    compiler = shutil.which("glslangValidator")
    if compiler is None:
        pytest.skip("glslangValidator is not installed (Debian: glslang-tools)")
    text = shaders.source("sat/query.comp").replace("uint", "unit")
    assert subprocess.run([compiler, "--stdin", "-S", "comp"], input=text, capture_output=True, text=True).returncode


def test_kernels_are_told_how_long_a_buffer_is():
    """Zink 22.3 answers length() with another block's length where a kernel declares a block that it does not use."""
    of_blocks = re.compile(r"buffer \w+ \{[^}]*?(\w+)\[\];")
    asking = [
        path
        for path in ENTRIES
        for name in of_blocks.findall(shaders.source(path))
        if f"{name}.length()" in shaders.source(path)
    ]
    assert not asking


def test_no_shader_has_a_double():
    """Compilers of some cards emulate doubles, by tens of thousands of instructions."""
    double = re.compile(r"\b(?:double|d(?:vec|mat)\d\w*)\b|\d\.?[lL][fF]\b")
    assert [path for path in ENTRIES if double.search(shaders.source(path))] == []
    assert all(map(double.search, ("double a;", "dvec2(a)", "a = 0.5LF;")))


def test_a_stage_has_no_more_storage_blocks_than_every_driver_has():
    """OpenGL 4.3 guarantees 8 blocks in a compute shader, and 8 places."""
    block, most = re.compile(r"layout\(std430, binding = (\d+)\)[^{;]*\bbuffer\s+(\w+)"), 0
    for path in COMPUTE:
        declared = block.findall(shaders.source(path))
        assert len({name for _, name in declared}) <= 8 and all(int(place) < 8 for place, _ in declared), path
        most = max(most, len(declared))
    assert most == 8  # so blocks are found at all
