"""Measurements that need a GPU, in about ten minutes; they are written to docs/gpu.md.

They are: both certified methods at 1080p and 4k (`lod`, `draw`, `shade`), the same arithmetic in a compute and in a
fragment shader, summed-area and error tables of 4096² posts, a dab of the brush, the difference of the golden pictures
from those of this machine, and the checks of the drivers: the self-test, certificates of random views, and tests of the
stages. The script also runs with software OpenGL: `--small` takes pictures of 320 × 180, a map of 513² posts, and few
checks; that is 105 s on two busy cores.

Run: python benchmarks/gpu.py [--small] [-o docs/gpu.md]
"""

from __future__ import annotations

import argparse
import datetime
import platform
import statistics
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import moderngl
import numpy as np

import terrain_gl as tg
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.gpu.context import create_context
from terrain_gl.gpu.selftest import faults
from terrain_gl.image import read_image
from terrain_gl.renderer.brush import Brush, Sculptor

FRAMES = 9
CHECK_SECONDS = 200  # for each of two checks, so that the whole takes ten minutes
ROOT = Path(__file__).parents[1]
GOLDEN = ROOT / "tests" / "golden"
STAGES = ["selftest", "sat", "few_cells", "mesh", "precision", "rings_tables", "rings_twins"]


def milliseconds(work: Callable[[], object], ctx: moderngl.Context, runs: int = FRAMES) -> float:
    """Median time of several runs; each waits for the GPU."""
    times = []
    for _ in range(runs):
        ctx.finish()
        started = time.perf_counter()
        work()
        ctx.finish()
        times.append(1e3 * (time.perf_counter() - started))
    return statistics.median(times)


def frames(sizes: dict[str, tuple[int, int]]) -> list[str]:
    """Times of the stages of a frame."""
    lines = [
        "| map | picture | triangles | patches | lod | draw | shade |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, known in bundled().items():
        with tg.Renderer(open_map(name)[0], next(iter(sizes.values()))) as renderer:
            for label, size in sizes.items():
                renderer.resize(size)
                seen = [renderer.draw(known.camera, 1.0, sun=known.sun) for _ in range(FRAMES)]
                ms = [f"{statistics.median(s['ms'][stage] for s in seen):.2f}" for stage in ("lod", "draw", "shade")]
                counts = f"{seen[-1]['triangles']:,} | {seen[-1]['patches']:,}"
                lines.append(f"| {name} | {label} | {counts} | {' | '.join(ms)} |")
    return lines


def arithmetic(size: tuple[int, int]) -> list[str]:
    """Times of the same arithmetic, once a pixel, in a compute and in a fragment shader.

    `lod` and tables are compute shaders, `draw` and `shade` mostly others. GPUs for data centres run only compute
    shaders on all of their units.
    """
    work = "float turn(float x) { for (int i = 0; i < 200; i++) x = fract(x * 1.7 + 0.3); return x; }"
    with create_context() as ctx:
        texture = ctx.texture(size, 1, dtype="f4")
        target = ctx.framebuffer([texture])
        corner = "vec2[](vec2(-1), vec2(3, -1), vec2(-1, 3))[gl_VertexID]"
        program = ctx.program(
            f"#version 430\nvoid main() {{ gl_Position = vec4({corner}, 0.0, 1.0); }}",
            f"#version 430\n{work}\nout float y; void main() {{ y = turn(gl_FragCoord.x + gl_FragCoord.y); }}",
        )
        kernel = ctx.compute_shader(
            "#version 430\nlayout(local_size_x = 8, local_size_y = 8) in;\n"
            f"layout(r32f, binding = 0) uniform image2D y;\n{work}\n"
            "void main() { ivec2 at = ivec2(gl_GlobalInvocationID.xy);"
            " imageStore(y, at, vec4(turn(float(at.x + at.y)))); }"
        )
        vao = ctx.vertex_array(program, [])
        target.use()
        texture.bind_to_image(0, read=False)
        ways: dict[str, Callable[[], object]] = {
            "compute shader": lambda: kernel.run(-(-size[0] // 8), -(-size[1] // 8)),
            "fragment shader": lambda: vao.render(vertices=3),
        }
        times = {name: milliseconds(way, ctx) for name, way in ways.items()}
    return ["| where | ms |", "|---|---|", *(f"| {name} | {ms:.2f} |" for name, ms in times.items())]


def tables(posts: int) -> list[str]:
    """Times of the tables, which are built once for a map, and of a dab of the brush."""
    rng = np.random.default_rng(1)
    steps = rng.normal(size=(posts, posts)).cumsum(0).cumsum(1).astype("f4")
    heightmap = tg.Heightmap(steps / np.abs(steps).max() * 2000, 30.0)
    with tg.Renderer(heightmap, (640, 360)) as renderer:
        build = milliseconds(renderer.tables.build, renderer.ctx, 3)
        brush, sculptor = Brush(radius_m=64 * 30.0), Sculptor(renderer)
        x_m, y_m = (0.5 * extent for extent in heightmap.extent_m)
        dab = milliseconds(lambda: sculptor.dab(brush, x_m, y_m), renderer.ctx)
    return [
        "| what | ms |",
        "|---|---|",
        f"| error tables of {posts}² posts, with their summed-area tables | {build:.1f} |",
        f"| a dab of 64 posts' radius in the middle of the map | {dab:.1f} |",
    ]


def golden() -> list[str]:
    """Differences between the golden pictures, which Mesa's software renderer drew, and this machine's."""
    lines = ["| picture | mean | most |", "|---|---|---|"]
    for path in sorted(GOLDEN.glob("*.png")):
        name, style = path.stem.split("_", 1)
        known, kept = bundled()[name], read_image(path)[..., :3].astype(int)
        with tg.Renderer(open_map(name)[0], kept.shape[1::-1]) as renderer:
            tolerance_px = 1.0 if style == "shaded" else 2.0
            image = renderer.render(known.camera, tolerance_px, style=style, sun=known.sun).image[..., :3]
        off = np.abs(image.astype(int) - kept)
        lines.append(f"| {path.stem} | {off.mean():.3f} | {off.max()} |")
    return lines


def checks(small: bool) -> list[str]:
    """Check this driver: the self-test, random views, and tests of the stages (see benchmarks/drivers.py)."""
    with create_context() as ctx:
        times = []
        for _ in range(3):
            started = time.perf_counter()
            wrong = list(faults(ctx))
            times.append(1e3 * (time.perf_counter() - started))
    lines = [f"- self-test: {', '.join(wrong) or 'passed'}, {times[0]:.0f} ms at first, then {times[-1]:.1f} ms"]
    views = ["benchmarks/certificate.py", "--random", "10" if small else "300"]
    files = [f"tests/test_{name}.py" for name in (["selftest"] if small else STAGES)]
    for command in (views, ["-m", "pytest", "-q", "-p", "no:cacheprovider", *files]):
        try:
            done = subprocess.run(
                [sys.executable, *command], cwd=ROOT, capture_output=True, text=True, timeout=CHECK_SECONDS
            )
            said = (done.stdout.strip() or done.stderr.strip()).splitlines()[-1]
        except subprocess.TimeoutExpired:
            said = f"not ended after {CHECK_SECONDS} s"
        lines.append(f"- `python {' '.join(command)}`: {said}")
    return lines


def main() -> None:
    """Measure, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--small", action="store_true", help="small pictures and maps, to try the script")
    parser.add_argument("-o", "--output", default="docs/gpu.md")
    args = parser.parse_args()
    sizes = {"320 x 180": (320, 180)} if args.small else {"1080p": (1920, 1080), "4k": (3840, 2160)}
    with tg.Renderer(open_map("canyon-15m")[0], (16, 16)) as renderer:
        machine = renderer.ctx.info["GL_RENDERER"]
    about = f"`python benchmarks/gpu.py`, {datetime.date.today()}: {machine}, Python {platform.python_version()}."
    page = ["# On a GPU", "", about]
    parts: dict[str, Callable[[], list[str]]] = {
        "Frames at 1 px, milliseconds": lambda: frames(sizes),
        "200 turns of a loop in each pixel": lambda: arithmetic(next(iter(sizes.values()))),
        "Once a map, and an edit": lambda: tables(513 if args.small else 4096),
        "Golden pictures, levels of 255": golden,
        "Checks": lambda: checks(args.small),
    }
    for title, lines in parts.items():
        started = time.perf_counter()
        page += ["", f"## {title}", "", *lines()]
        Path(args.output).write_text("\n".join([*page, ""]), encoding="utf-8")  # at once: the run may be ended early
        print(f"{title}: {time.perf_counter() - started:.0f} s", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
