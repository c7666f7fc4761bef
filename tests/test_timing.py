"""GPU times without waiting."""

import time

import moderngl
import numpy as np
import pytest
from maps import rough

import terrain_gl as tg
from terrain_gl.comparison.bench import bench
from terrain_gl.gpu.timing import Stopwatch

SIZE = (160, 90)


def waited_ms(ctx, work, turns):
    """Milliseconds by the clock until the GPU is done."""
    ctx.finish()
    started = time.perf_counter()
    work(turns)
    ctx.finish()
    return 1e3 * (time.perf_counter() - started)


@pytest.fixture
def work(ctx):
    """A function that keeps the GPU busy; a larger argument takes longer. `long` is one that takes over 20 ms."""
    shader = """#version 430
        layout(local_size_x = 64) in;
        layout(std430, binding = 0) buffer Out { float out_[]; };
        uniform int u_turns;
        void main() {
            float x = float(gl_GlobalInvocationID.x);
            for (int i = 0; i < u_turns; i++) x = sin(x) + 1.0;
            out_[gl_GlobalInvocationID.x] = x;
        }"""
    kernel, out = ctx.compute_shader(shader), ctx.buffer(reserve=4 * 64 * 64)

    def run(turns):
        out.bind_to_storage_buffer(0)
        kernel["u_turns"] = turns
        kernel.run(64)

    run.long = next(turns for turns in (3000 << k for k in range(16)) if waited_ms(ctx, run, turns) > 20)
    yield run
    kernel.release()
    out.release()


def draw_a_triangle(ctx):
    corners = "const vec2 AT[3] = vec2[](vec2(-1), vec2(3, -1), vec2(-1, 3));"
    vertex = f"#version 430\n{corners} void main() {{ gl_Position = vec4(AT[gl_VertexID], 0.0, 1.0); }}"
    program = ctx.program(vertex, fragment_shader="#version 430\nout vec4 o; void main() { o = vec4(1.0); }")
    ctx.simple_framebuffer(SIZE).use()
    ctx.vertex_array(program, []).render(moderngl.TRIANGLES, 3)


@pytest.mark.parametrize("after_a_triangle", [False, True])
def test_times_are_those_that_waiting_finds(ctx, work, after_a_triangle):
    if after_a_triangle:
        draw_a_triangle(ctx)
    watch = Stopwatch(ctx)
    ratios = []
    for _ in range(5):
        ctx.finish()
        started = time.perf_counter()
        with watch.stage("work"):
            work(work.long)
        ctx.finish()
        waited = 1e3 * (time.perf_counter() - started)
        ratios.append(watch.frame()["work"] / waited)
    assert 0.5 < np.median(ratios) <= 1.05
    watch.release()


def test_stages_are_told_apart_and_those_of_one_name_added_up(ctx, work):
    watch = Stopwatch(ctx)
    for stage, turns in (("short", 100), ("long", 4000), ("short", 100)):
        with watch.stage(stage):
            work(turns)
    ctx.finish()
    times = watch.frame()
    assert set(times) == {"short", "long"} and 0 <= times["short"] < times["long"]
    assert watch.frame() == {}  # a frame without stages
    watch.release()


def test_a_gpu_far_behind_is_not_waited_for(ctx, work, monkeypatch):
    watch = Stopwatch(ctx, depth=2)
    monkeypatch.setattr(watch, "_finished", lambda stages: False)
    for _ in range(5):
        with watch.stage("work"):
            work(10)
        assert watch.frame() is None
    made = len(watch._spare) + 2 * sum(map(len, watch._frames))
    for _ in range(50):
        with watch.stage("work"):
            work(10)
        watch.frame()
    assert len(watch._spare) + 2 * sum(map(len, watch._frames)) == made  # queries are used again
    monkeypatch.undo()
    ctx.finish()
    assert watch.frame()["work"] > 0
    watch.release()


def test_a_renderer_that_does_not_wait_draws_and_knows_the_same(monkeypatch):
    heightmap = tg.Heightmap(rough(90, 120), 10.0)
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as renderer:
        waited = renderer.render(camera)
        renderer.timer.waits = False
        finished = []
        monkeypatch.setattr(renderer.timer, "ctx", Noting(renderer.ctx, finished))
        for _ in range(8):
            frame = renderer.render(camera)  # reading the picture waits for the GPU, so its times arrive
        assert not finished
        assert (frame.image == waited.image).all()
        assert frame.stats["triangles"] == waited.stats["triangles"]
        assert all(frame.stats["ms"][stage] > 0 for stage in ("lod", "draw", "shade"))
        renderer.edit(slice(3, 9), slice(4, 8), 5.0)
        for _ in range(3):
            frame = renderer.render(camera)
        assert frame.stats["ms"]["edit"] > 0


def test_the_gpus_clock_times_the_very_frame_that_was_waited_for():
    heightmap = tg.Heightmap(rough(90, 120), 10.0)
    camera = tg.Camera.default(heightmap)
    with tg.Renderer(heightmap, SIZE) as renderer:
        assert renderer.draw(camera)["ms_clock"] == "cpu"
        renderer.timer.ms = {}
        renderer.timer.queries = Stopwatch.works(renderer.ctx)
        if not renderer.timer.queries:
            pytest.skip("this driver has no timer queries")
        renderer.choose(camera)
        stats = renderer.draw(camera)
        assert stats["ms_clock"] == "gpu"
        ms = stats["ms"]
        assert all(ms[stage] > 0 for stage in ("lod", "draw", "shade"))
        assert ms["lod"] + ms["draw"] + ms["shade"] <= ms["frame"]
        for _ in renderer.draw_steps(camera):
            pass
        assert renderer.timer.ms["shade"] > 0
        given_up = renderer.draw_steps(camera)
        next(given_up)
        next(given_up)
        given_up.close()
        assert not renderer.timer.stopwatch._stages  # they do not belong to the next frame


class Noting:
    """A context that records who waits for it."""

    def __init__(self, ctx, finished):
        self._ctx, self._finished = ctx, finished

    def finish(self):
        self._finished.append("finish")

    def __getattr__(self, name):
        return getattr(self._ctx, name)

    def __enter__(self):
        return self._ctx.__enter__()


@pytest.mark.slow
def test_the_time_in_python_counts_python_and_not_opengl(ctx, work, monkeypatch):
    """20 ms of Python in each frame count as Python; the same time of GPU work does not."""
    with tg.Renderer(tg.Heightmap(rough(65, 65, 1, 100.0), 30.0), SIZE, ctx=ctx) as renderer:
        camera, select = tg.Camera.default(renderer.heightmap), renderer.select
        plain_ms = bench(renderer, 3, dense=False, camera=camera)["ms"]["python"]

        def slow(*arguments):
            until = time.thread_time() + 0.02
            while time.thread_time() < until:
                pass
            return select(*arguments)

        def heavy(*arguments):
            work(2 * work.long)
            return select(*arguments)

        monkeypatch.setattr(renderer, "select", slow)
        assert bench(renderer, 3, dense=False, camera=camera)["ms"]["python"] > plain_ms + 15
        monkeypatch.setattr(renderer, "select", heavy)
        heavy_ms = bench(renderer, 3, dense=False, camera=camera)["ms"]
        assert heavy_ms["frame"] > 15 and heavy_ms["python"] < plain_ms + 5
