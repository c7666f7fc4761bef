"""A driver that computes wrongly is refused at the start, in one line that says what to do."""

import os
import subprocess
import sys

import numpy as np
import pytest
from drivers import environment

from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu import pattern, selftest, shaders

WRONG = {  # what a wrong driver might do, as a change of the kernel's text; words of the refusal
    "an old loop bound": ("u_strip, u_length)", "u_strip, min(u_length, 16u))", "loops whose bounds change"),
    "floats cut off": (
        "sum = o.x + o.y",
        "sum = uintBitsToFloat(floatBitsToUint(o.x + o.y) & ~1u)",
        "round to the nearest float",
    ),
    "a fused sum": (
        "both = o.x * o.y + o.z",
        "both = float(double(o.x) * double(o.y) + double(o.z))",
        "declared precise",
    ),
    "a rest that is simplified": ("(o.x - (sum - of_y)) + (o.y - of_y)", "0.0", "reorders sums"),
    "a coarse quotient": ("o.x / o.w", "o.x * 1.00001 / o.w", "computes quotients"),
    "a reciprocal off by one": ("o.x / o.w", "o.x / o.w * (1.0 + exp2(-23.0))", "powers of two that are not exact"),
    "a coarse power": ("exp2(-o.w)", "exp2(-o.w) * 1.00001", "computes powers of two"),
    "no root": ("sqrt(o.w)", "0.0 / (o.w - o.w)", "computes square roots"),
    "fewer segments": ("exp2(float(own_log2))", "max(2.0, 0.5 * exp2(float(own_log2)))", "another number of triangles"),
    "uneven segments": ("gl_TessCoord.xy", "gl_TessCoord.xy * gl_TessCoord.xy", "other vertices on its edges"),
    "mirrored patches": ("equal_spacing, cw", "equal_spacing, ccw", "do not cover it once"),
}


@pytest.fixture
def poisoned(monkeypatch):
    """Give a function that changes the kernel as a wrong driver would; no driver counts as tried."""
    monkeypatch.setattr(selftest, "_passed", set())

    def poison(old, new):
        changed = []

        body = shaders._body

        def changed_body(path, of):
            changed.extend([old] if old in body(path, of) else [])
            return body(path, of).replace(old, new)

        monkeypatch.setattr(shaders, "_body", changed_body)
        return changed

    return poison


def test_this_driver_passes(ctx, poisoned):
    assert not list(selftest.faults(ctx))
    selftest.check_driver(ctx)


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_driver_is_refused(ctx, poisoned, wrong):
    old, new, said = WRONG[wrong]
    changed = poisoned(old, new)
    with pytest.raises(TerrainError) as refused:
        selftest.check_driver(ctx)
    assert changed
    line = str(refused.value)
    assert said in line and "\n" not in line and line.startswith(ctx.info["GL_RENDERER"])
    assert "LIBGL_ALWAYS_SOFTWARE=1" in line


@pytest.mark.parametrize("inside", pattern.COUNTS)
def test_every_number_of_segments_is_tried(ctx, poisoned, inside):
    """A driver that is wrong for one number alone."""
    text = "exp2(float(own_log2))"
    halved = "max(2.0, 0.5 * exp2(float(own_log2)))" if inside > 2 else "4.0"
    changed = poisoned(text, f"(own_log2 == {inside.bit_length() - 1} ? {halved} : {text})")
    faults = list(pattern.wrong_pattern(ctx))
    assert changed and len(faults) == 1 and f"a patch of {inside} segments" in faults[0]


def test_every_number_on_every_edge_is_tried():
    """The proof needs every number inside from 2 to 64, each with every number on an edge that is not less."""
    tried = {(inside, edge, count) for *edges, inside in pattern.strips() for edge, count in enumerate(edges)}
    powers = [2**k for k in range(1, 7)]
    assert tried == {(i, edge, n) for i in powers for n in powers if n >= i for edge in range(4)}


CENTRE = (32, 32)
FLIPPED = {  # levels, the ends of an edge between two triangles, and what is wrong with the other diagonal of both
    "leave a cell": ((2, 2, 2, 2, 2), (CENTRE, (32, 0))),
    "between two cut edges": ((4, 4, 2, 2, 2), (CENTRE, (0, 0))),
    "do not reach the centre": ((1, 1, 1, 1, 2), (CENTRE, (0, 0))),
}


@pytest.mark.parametrize("said", FLIPPED)
def test_triangles_that_the_bounds_do_not_cover_are_found(ctx, said):
    levels, edge = FLIPPED[said]
    *edges, inside = levels
    triangles = pattern._captured(ctx, (levels,))[..., :2]
    assert not list(pattern.faults_of(triangles, edges, inside))
    on_edge = (triangles[:, :, None] == edge).all(-1)  # triangle, corner, end
    first, second = np.flatnonzero(on_edge.any(1).all(1))
    corners = {i: triangles[i][~on_edge[i].any(1)][0] for i in (first, second)}
    for i, other, end in ((first, second, 0), (second, first, 1)):
        triangles[i][on_edge[i][:, end]] = corners[other]
    assert any(said in fault for fault in pattern.faults_of(triangles, edges, inside))


def test_a_driver_is_tried_once(ctx, poisoned, monkeypatch):
    selftest.check_driver(ctx)
    monkeypatch.setattr(selftest, "faults", lambda ctx: pytest.fail("tried again"))
    selftest.check_driver(ctx)


@pytest.mark.parametrize("command", ["shot", "generate"])
def test_commands_end_with_one_line(poisoned, run, folder, command):
    poisoned(*WRONG["an old loop bound"][:2])
    np.save("hill.npy", np.outer(*[np.hanning(9)] * 2).astype("f4"))
    words = ["shot", "hill.npy", "-o", "p.png"] if command == "shot" else ["generate", "land.png", "--size", "33"]
    status, out, error = run(*words)
    assert status == 1 and not out
    assert error.count("\n") == 1 and "loops whose bounds change" in error
    assert {path.name for path in folder.iterdir()} == {"hill.npy"}


@pytest.mark.parametrize("cure", ["0", "1"])
def test_zink_is_refused_without_its_cure(tmp_path, cure):
    """Mesa 22.3: a kernel with inlined uniforms keeps the loop bound of an earlier run, in some processes."""
    try:
        variables = environment("zink") | {"ZINK_INLINE_UNIFORMS": cure}
    except LookupError as error:
        pytest.skip(str(error))
    command = [sys.executable, "-m", "terrain_gl", "generate", "land.png", "--size", "33"]
    done = subprocess.run(command, env=os.environ | variables, cwd=tmp_path, capture_output=True, text=True)
    if cure == "0":
        assert done.returncode == 0, done.stderr
        return
    lines = [line for line in done.stderr.splitlines() if "XDG_RUNTIME_DIR" not in line]  # that one is zink's
    assert done.returncode == 1 and len(lines) == 1 and "set ZINK_INLINE_UNIFORMS=0" in lines[0], done.stderr
