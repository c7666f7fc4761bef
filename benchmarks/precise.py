"""What `precise` costs: processor time with it and without, side by side in one run, for docs/precision.md.

`precise` forbids a compiler to reorder or fuse operations. The script removes the word from the shaders' text and
compares: the error tables, and a frame without light. Times are processor milliseconds of
all threads of a software renderer, medians of runs that alternate. (`generate` needs `precise` for the same bytes on
every driver, whatever it costs.)

Run: python benchmarks/precise.py [RUNS]; by default 30.
"""

import statistics
import sys
import time

from table import head, row

import terrain_gl as tg
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.gpu import shaders
from terrain_gl.gpu.context import create_context

SIZE = (640, 360)
source = shaders.source
WORDS = {"precise": source, "without": lambda *given: source(*given).replace("precise ", "")}


def works(name, ctx):
    """A renderer with the shaders of `WORDS[name]`, already compiled; and the functions to time, by name."""
    shaders.source = WORDS[name]
    renderer = tg.Renderer(open_map("alpine")[0], SIZE, ctx=ctx)
    known = bundled()["alpine"]

    def frame():
        renderer.draw(known.camera, 1.0, style="normals", sun=known.sun)

    found = {"error tables": renderer.tables.build, "frame": frame}
    for work in found.values():
        work()
    return renderer, found


def processor_ms(renderer, work):
    """Processor time of a run, up to the end of what the GPU does."""
    renderer.ctx.finish()
    started = time.process_time()
    work()
    renderer.ctx.finish()
    return 1e3 * (time.process_time() - started)


def measure(ctx, runs):
    """Print a line for each part."""
    made = {name: works(name, ctx) for name in WORDS}
    head("what", "ms with `precise`", "ms without", "ratio of medians", "median of ratios")
    for part in made["precise"][1]:
        ms = {name: [] for name in made}
        for _ in range(runs):
            for name, (renderer, found) in made.items():
                ms[name].append(processor_ms(renderer, found[part]))
        medians = {name: statistics.median(times) for name, times in ms.items()}
        ratios = [a / b for a, b in zip(*ms.values(), strict=True)]
        shares = medians["precise"] / medians["without"], statistics.median(ratios)
        row(part, *(f"{ms:.2f}" for ms in medians.values()), *(f"{share:.3f}" for share in shares))


if __name__ == "__main__":
    with create_context() as context:
        measure(context, int(sys.argv[1]) if len(sys.argv) > 1 else 30)
