"""Objects of another program meet the land, in random views; and what `Renderer.draw_into` costs beside `render`.

Each view has eight random triangles, drawn once before and once after the land, in each of four depth conventions in
turn. An independent ray caster (tests/test_draw_into.py) says which pixels the triangles own. Pixels through which an
edge may pass, and those where both surfaces are within 1 % of the depth, do not count.

Run: python benchmarks/own_objects.py [VIEWS [SEED]]; by default 500 views and seed 1. `cost` as the first word measures
the cost: the median of 15 frames, with both calls in turns.
"""

import statistics
import sys
import time
from pathlib import Path

import numpy as np

import terrain_gl as tg
from terrain_gl.files.maps import bundled, open_map

sys.path.insert(0, str(Path(__file__).parents[1] / "tests"))
import test_draw_into as own  # noqa: E402  the tests' own program and ray caster

FRAMES = 15


def scene(rng):
    """An eye over the land, above its highest post, and any direction in which there is land."""
    eye = rng.uniform([100, 100, 110], [860, 860, 350])
    target = rng.uniform([200, 200, 40], [760, 760, 80])
    return own.look_at(eye, target) if np.linalg.norm((target - eye)[:2]) > 50 else scene(rng)


def check(views, seed):
    """Count pixels, and those that differ from the ray caster."""
    rng, heightmap = np.random.default_rng(seed), own.hills()
    pixels = mixed = wrong = worst = 0
    ctx = tg.create_context("auto")
    programs = [(own.Program(ctx, depth, zero_to_one=zo), rev) for depth, rev, zo in own.CONVENTIONS.values()]
    with tg.Renderer(heightmap, own.SIZE, ctx=ctx) as renderer:
        for number in range(views):
            program, is_reversed = programs[number % len(programs)]
            view = scene(rng)
            projection = own.perspective(rng.uniform(25, 90), own.SIZE, 5, 20000, is_reversed, program.zero_to_one)
            middle = rng.uniform([100, 100, 20], [860, 860, 150], (8, 1, 3))
            triangles = middle + rng.normal(0, rng.uniform(20, 150), (8, 3, 3))
            eye, along = own.rays(view, projection)
            objects, land = own.triangle_depths(triangles, eye, along), own.land_depths(heightmap, eye, along)
            expected = objects < land
            with np.errstate(invalid="ignore"):
                near = np.abs(objects - land) < 0.01 * land
            near |= (objects < 6) | (land < 6)  # at the near plane of 5 m
            sure = ~(own.at_edges(objects, land, np.where(expected, 1.0, 2.0)) | near)
            for is_before in (True, False):
                program.clear()
                if is_before:
                    program.draw(triangles, projection @ view)
                stats = renderer.draw_into(
                    program.framebuffer,
                    view,
                    projection,
                    0.5,
                    depth=program.depth,
                    zero_to_one=program.zero_to_one,
                    style="lambert",
                )
                if not is_before:
                    program.draw(triangles, projection @ view)
                assert stats["certified_max_error_px"] <= 0.5
                differ = int(((program.red()[0] != expected) & sure).sum())
                pixels, mixed, wrong = pixels + int(sure.sum()), mixed + int(expected[sure].sum()), wrong + differ
                worst = max(worst, differ)
    print(f"{views:,} views, seed {seed}: {pixels:,} pixels, {mixed:,} of them of triangles; {wrong:,} differ")
    print(f"at most {worst} in a picture")
    return wrong


def cost():
    """Compare `render` with `draw_into`, and with `draw`, which reads no pixels."""
    heightmap, camera = open_map("alpine-30m")[0], bundled()["alpine-30m"].camera
    size = 1280, 720
    turn = camera.axes * [[1.0], [1.0], [-1.0]]
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = turn, -turn @ np.asarray(camera.eye)
    projection = own.perspective(camera.fov_deg, size, 10, 1e6)
    ctx = tg.create_context("auto")
    target = ctx.framebuffer([ctx.texture(size, 4)], ctx.depth_texture(size))
    with tg.Renderer(heightmap, size, ctx=ctx) as renderer:
        for style in ("shaded", "lambert"):
            calls = {
                "render": lambda style=style: renderer.render(camera, 1.0, style=style, curvature="off", sky="none"),
                "draw_into": lambda style=style: renderer.draw_into(target, view, projection, 1.0, style=style),
            }
            ms = {name: [] for name in calls}
            for number in range(FRAMES + 1):
                for name, call in calls.items():
                    started = time.perf_counter()
                    call()
                    with renderer.session:
                        ctx.finish()
                    if number:  # the first compiles
                        ms[name].append(1e3 * (time.perf_counter() - started))
            render, into = (statistics.median(ms[name]) for name in calls)
            print(f"{style:8} render {render:6.0f} ms, draw_into {into:6.0f} ms: {into / render:.2f} times")


if __name__ == "__main__":
    words = sys.argv[1:]
    if words[:1] == ["cost"]:
        cost()
    else:
        sys.exit(check(*(int(word) for word in [*words, *("500", "1")[len(words) :]])) > 0)
