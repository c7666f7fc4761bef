"""Ways in which other programs call a renderer: each gets the right pictures, and its own things stay as they were."""

import asyncio
import gc
import multiprocessing
import os
import shutil
import signal
import subprocess
import sys
import threading
import warnings
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext, suppress

import moderngl
import numpy as np
import pytest
from maps import rough

import terrain_gl as tg
from terrain_gl.gpu.session import Session

SIZE = (96, 54)
OPTIONS = {"max_error_px": 0.5, "style": "lambert", "wires": True}
N = 6


def land():
    return tg.Heightmap(rough(65, 81, relief=30.0), 10.0, "land")


def camera(number):
    turn = 2 * np.pi * number / N
    return tg.Camera((400 + 250 * np.sin(turn), 320 + 250 * np.cos(turn), 150.0), (400.0, 320.0, 0.0))


def drawn(renderer, number):
    return renderer.render(camera(number), **OPTIONS).image


def drawn_alone(number):
    """For processes: a renderer of its own."""
    with tg.Renderer(land(), SIZE) as renderer:
        return drawn(renderer, number)


@pytest.fixture(scope="module")
def truth():
    """The picture of each camera, each by a renderer of its own."""
    return [drawn_alone(number) for number in range(N)]


@pytest.fixture
def renderer():
    with tg.Renderer(land(), SIZE) as made:
        yield made


def in_thread(work, *arguments):
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(work, *arguments).result(60)


class Own:
    """A program that draws in its own context."""

    def __init__(self):
        self.ctx = moderngl.create_context(standalone=True, backend="egl")
        self.framebuffer = self.ctx.simple_framebuffer((4, 4))
        self.program = self.ctx.program(
            "#version 330\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }",
            "#version 330\nout vec4 o; void main() { o = vec4(0.0, 1.0, 0.0, 1.0); }",
        )
        whole = self.ctx.buffer(np.array([-1, -1, 3, -1, -1, 3], "f4").tobytes())
        self.array = self.ctx.vertex_array(self.program, [(whole, "2f", "at")])
        self.framebuffer.use()

    def __enter__(self):
        return self

    def __exit__(self, failed, *_):
        if not failed:
            self.draw()
        self.ctx.release()

    def draw(self):
        """It draws on, without making its context current again."""
        self.ctx.clear(1.0, 0.0, 0.0, 1.0)
        self.array.render()
        assert self.framebuffer.read() == bytes([0, 255, 0] * 16) and self.ctx.error == "GL_NO_ERROR"

    def in_turns(self, count, *renderers):
        """Pictures of these renderers; it draws after each of them."""
        found = []
        for number in range(count):
            found.append(drawn(renderers[number % len(renderers)], number))
            self.draw()
        return found


def to_the_end(steps, found):
    """These steps, of `render_steps`; `found` then gets the picture."""
    found.append((yield from steps).image)


async def in_executor(renderer, count, pool=None):
    run = asyncio.get_running_loop().run_in_executor
    return await asyncio.gather(*(run(pool, drawn, renderer, number) for number in range(count)))


# --- The table: each way returns the pictures of cameras 0 to N - 1, or of the first of them --------------------------


def threads_share_a_renderer(renderer):
    with ThreadPoolExecutor(4) as pool:
        return list(pool.map(lambda number: drawn(renderer, number), range(N)))


def threads_that_change_often(renderer):
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        return threads_share_a_renderer(renderer)
    finally:
        sys.setswitchinterval(before)


def a_renderer_for_each_thread(_):
    with ThreadPoolExecutor(3) as pool:
        return list(pool.map(drawn_alone, range(3)))


def two_renderers_in_four_threads(renderer):
    with tg.Renderer(land(), SIZE) as other, ThreadPoolExecutor(4) as pool:
        return list(pool.map(lambda number: drawn((renderer, other)[number % 2], number), range(N)))


def a_new_thread_for_each_picture(renderer):
    return [in_thread(drawn, renderer, number) for number in range(3)]


def asyncio_to_thread(renderer):
    async def main():
        return await asyncio.gather(*(asyncio.to_thread(drawn, renderer, number) for number in range(N)))

    return asyncio.run(main())


def asyncio_default_executor(renderer):
    return asyncio.run(in_executor(renderer, N))


def asyncio_executor_of_one_thread(renderer):
    with ThreadPoolExecutor(1) as pool:
        return asyncio.run(in_executor(renderer, 3, pool))


def asyncio_steps_between_other_tasks(renderer):
    """Two tasks take the steps of two renderers; the loop takes turns."""

    async def stepped(each, number):
        found = []
        for _ in to_the_end(each.render_steps(camera(number), **OPTIONS), found):
            await asyncio.sleep(0)
        return found[0]

    async def main():
        with tg.Renderer(land(), SIZE) as other:
            return await asyncio.gather(stepped(renderer, 0), stepped(other, 1))

    return asyncio.run(main())


def asyncio_task_that_is_cancelled(renderer):
    async def main():
        task = asyncio.create_task(asyncio.to_thread(drawn, renderer, 3))
        await asyncio.sleep(0.01)
        task.cancel()
        return [await asyncio.to_thread(drawn, renderer, 0)]

    return asyncio.run(main())


def made_in_a_thread(_):
    made = in_thread(tg.Renderer, land(), SIZE)
    found = [drawn(made, 0), in_thread(drawn, made, 1)]
    in_thread(made.release)
    return found


def a_thread_with_a_context_of_its_own(renderer):
    def work():
        with Own() as own:
            return own.in_turns(1, renderer)

    return in_thread(work)


def own_drawing_in_turns(renderer):
    with Own() as own:
        return own.in_turns(3, renderer)


def two_renderers_and_own_drawing_in_turns(renderer):
    with Own() as own, tg.Renderer(land(), SIZE) as other:
        return own.in_turns(4, renderer, other)


def two_renderers_in_a_shared_context(_):
    with Own() as own, tg.Renderer(land(), SIZE, ctx=own.ctx) as one, tg.Renderer(land(), SIZE, ctx=own.ctx) as other:
        return own.in_turns(4, one, other)


def own_drawing_in_the_middle_of_a_picture(_):
    found = []
    with Own() as own, tg.Renderer(land(), SIZE, ctx=own.ctx) as renderer:
        for _ in to_the_end(renderer.render_steps(camera(0), **OPTIONS), found):
            own.draw()
    return found


def a_scope_is_open(_):
    with Own() as own, tg.Renderer(land(), SIZE, ctx=own.ctx) as renderer:
        with own.ctx.scope(own.framebuffer, moderngl.DEPTH_TEST | moderngl.CULL_FACE):
            found = [drawn(renderer, 0)]
        own.ctx.enable_only(moderngl.NOTHING)
        own.draw()
        return found


def a_context_that_collects_its_garbage(_):
    with Own() as own:
        own.ctx.gc_mode = "auto"
        with tg.Renderer(land(), SIZE, ctx=own.ctx) as renderer:
            found = own.in_turns(2, renderer)
        own.ctx.gc_mode = None  # moderngl would delete what the program has later, in any context
    return found


def draw_into_and_render_in_turns(_):
    found, view, projection = [], np.eye(4), np.diag([0.002, 0.003, -0.0005, 1.0])
    view[:3, 3] = -400, -320, -500
    with Own() as own, tg.Renderer(land(), SIZE, ctx=own.ctx) as renderer:
        target = own.ctx.framebuffer([own.ctx.texture(SIZE, 4)], own.ctx.depth_texture(SIZE))
        for number in range(2):
            assert renderer.draw_into(target, view, projection, style="lambert")["triangles"] > 0
            found.append(drawn(renderer, number))
            own.draw()
    return found


def progress_that_draws(renderer):
    """A callback draws with another renderer, and with the program's own context."""
    among = []
    with Own() as own, tg.Renderer(land(), SIZE) as other:

        def progress(_):
            if not among:
                among.append(drawn(other, 1))
            own.draw()

        return [renderer.render(camera(0), progress=progress, **OPTIONS).image, *among]


def a_callback_that_fails(renderer):
    def fail(*_):
        raise RuntimeError("in the middle")

    with Own() as own:
        for call, how in (renderer.render, {"progress": fail}), (renderer.draw, {"size": SIZE, "receive": fail}):
            with pytest.raises(RuntimeError, match="in the middle"):
                call(camera(3), **how, **OPTIONS)
            own.draw()
    return [drawn(renderer, 0)]


def an_interrupt_in_the_middle(renderer):
    """Ctrl-C, as a signal."""

    def interrupt(_):
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        renderer.render(camera(3), progress=interrupt, **OPTIONS)
    return [drawn(renderer, 0), in_thread(drawn, renderer, 1)]


def wrong_options_between(renderer):
    found = []
    for number, wrong in enumerate(({"max_error_px": -1}, {"style": "none"}, {"triangles": 0}, {"metric": "least"})):
        with suppress(tg.UsageError):
            renderer.render(camera(3), **wrong)
            raise AssertionError("was taken")
        found.append(drawn(renderer, number))
    return found


def steps_that_are_dropped(renderer):
    for taken in range(3):
        steps = renderer.render_steps(camera(3), **OPTIONS)
        for _ in range(taken):
            next(steps)
        del steps
    gc.collect()
    return [drawn(renderer, 0)]


def steps_that_another_thread_closes(renderer):
    steps = renderer.render_steps(camera(3), **OPTIONS)
    next(steps)
    in_thread(steps.close)
    return [drawn(renderer, 0)]


def steps_that_several_threads_take(renderer):
    found = []
    steps = to_the_end(renderer.render_steps(camera(0), **OPTIONS), found)
    while in_thread(next, steps, "end") != "end":
        pass
    return found


def an_edit_in_another_thread(renderer):
    found, there = [drawn(renderer, 0)], (slice(10, 20), slice(10, 20))
    heights = renderer.heightmap.heights[there] + 20
    in_thread(renderer.edit, *there, heights)
    with tg.Renderer(land(), SIZE) as other:
        other.edit(*there, heights)
        edited = [in_thread(drawn, renderer, 0), drawn(other, 0)]
    assert np.array_equal(*edited) and not np.array_equal(edited[0], found[0])
    return found


def measured_in_another_thread(renderer):
    found = [drawn(renderer, 0)]
    frame = in_thread(lambda: renderer.render(camera(1), **OPTIONS))
    assert in_thread(renderer.measure)["max_error_px"] <= 0.5
    assert frame.facts.kind.shape == SIZE[::-1]
    return [*found, frame.image]


def resized_in_another_thread(renderer):
    in_thread(renderer.resize, (32, 18))
    renderer.render(camera(0), **OPTIONS)
    in_thread(renderer.resize, SIZE)
    return [drawn(renderer, 0)]


def a_renderer_that_is_dropped_beside_it(renderer):
    with Own() as own:
        for where in (in_thread, lambda work: work()):
            other = tg.Renderer(land(), SIZE)
            drawn(other, 3)
            loop = [other]
            loop.append(loop)  # only the collector finds it
            del other, loop
            where(gc.collect)
            own.draw()
    return [drawn(renderer, 0)]


def numpy_errors_and_warnings_raise(renderer):
    with np.errstate(all="raise"), warnings.catch_warnings():
        warnings.simplefilter("error")
        return [drawn(renderer, 0)]


def the_folder_changes(renderer):
    before = os.getcwd()
    os.chdir("/")
    try:
        return [drawn(renderer, 0), drawn_alone(1)]
    finally:
        os.chdir(before)


def spawned_pool(_):
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        return pool.map(drawn_alone, range(2))


def spawned_executor(_):
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return list(pool.map(drawn_alone, range(2)))


def process_of_a_fork_server(_):
    with multiprocessing.get_context("forkserver").Pool(1) as pool:
        return pool.map(drawn_alone, range(1))


WAYS = [each for each in list(globals().values()) if getattr(each, "__module__", "") == __name__]
WAYS = WAYS[WAYS.index(threads_share_a_renderer) :]


def surroundings():
    """What a guest leaves as it was: state of numpy, of Python and of the process."""
    chance = np.random.get_state()
    return (
        *(chance[0], chance[1].tobytes(), *chance[2:], np.geterr(), os.getcwd(), dict(os.environ)),
        *([signal.getsignal(each) for each in (signal.SIGINT, signal.SIGTERM)], sys.getswitchinterval()),
        *(sorted(each.name for each in threading.enumerate() if not each.daemon), len(warnings.filters)),
    )


@pytest.mark.parametrize("way", WAYS, ids=lambda way: way.__name__)
def test_every_way_gives_the_right_pictures(way, truth, renderer, capfd):
    before = surroundings()
    found = way(renderer)
    assert surroundings() == before
    assert 1 <= len(found) <= N
    for number, image in enumerate(found):
        assert np.array_equal(image, truth[number]), number
    assert capfd.readouterr() == ("", "")


def test_there_are_thirty_ways():
    assert len(WAYS) >= 30


@pytest.mark.parametrize("has_turns", [True, False])
def test_without_turns_a_thread_draws_into_the_picture_of_another(renderer, truth, monkeypatch, has_turns):
    """While one thread is between two steps of `render`, another asks for a picture."""
    if not has_turns:
        monkeypatch.setattr(Session, "turn", lambda self: nullcontext())
    others = []

    def progress(share):
        if not others and share > 0:
            thread = threading.Thread(target=lambda: others.append(drawn(renderer, 3)))
            thread.start()
            thread.join(1.0)  # it waits for its turn
            others.append(thread)

    image = renderer.render(camera(0), progress=progress, **OPTIONS).image
    next(each for each in others if isinstance(each, threading.Thread)).join(60)
    assert np.array_equal(image, truth[0]) == has_turns


# --- Programs of their own --------------------------------------------------------------------------------------------

HEAD = """
import os, sys, threading, time
import numpy as np
import terrain_gl as tg
land = tg.Heightmap(np.outer(*[np.hanning(65)] * 2).astype("f4") * 50, 10.0)
camera = tg.Camera.default(land)
def draw(renderer=None):
    return (renderer or tg.Renderer(land, (64, 48))).render(camera, 2.0, style="lambert").image.mean()
"""

PROGRAMS = {
    "ends without release": """
renderer = tg.Renderer(land, (64, 48))
print(draw(renderer) > 0)
""",
    "ends while a thread draws": """
renderer = tg.Renderer(land, (64, 48))
print(draw(renderer) > 0, flush=True)
threading.Thread(target=lambda: [draw(renderer) for _ in range(10**6)], daemon=True).start()
time.sleep(0.2)
""",
    "draws while it ends": """
import atexit
renderer = tg.Renderer(land, (64, 48))
atexit.register(lambda: print(draw(renderer) > 0))
""",
    "forks before its first picture": """
child = os.fork()
if not child:
    print(draw() > 0, flush=True)
    os._exit(0)
os.waitpid(child, 0)
assert draw() > 0
""",
    "forks after its first picture": """
renderer, told = tg.Renderer(land, (64, 48)), []
draw(renderer)
child = os.fork()
if not child:
    for use in (lambda: draw(renderer), renderer.release, draw):
        try:
            use()
        except tg.TerrainError as error:
            told.append("fork" in str(error) and "spawn" in str(error))
    print(all(told) and len(told) == 3, flush=True)
    os._exit(0)
os.waitpid(child, 0)
assert draw(renderer) > 0
""",
    "forks a pool after its first picture": """
import multiprocessing
renderer = tg.Renderer(land, (64, 48))
draw(renderer)
with multiprocessing.get_context("fork").Pool(1) as pool:
    try:
        pool.apply_async(draw).get(60)
    except tg.TerrainError as error:
        print("fork" in str(error) and "spawn" in str(error))
assert draw(renderer) > 0
""",
    "forks while another thread draws": """
renderer = tg.Renderer(land, (64, 48))
draw(renderer)
thread = threading.Thread(target=lambda: [draw(renderer) for _ in range(20)])
thread.start()
time.sleep(0.05)
child = os.fork()
if not child:
    try:
        draw(renderer)
    except tg.TerrainError as error:
        print("fork" in str(error), flush=True)
    os._exit(0)
os.waitpid(child, 0)
thread.join()
assert draw(renderer) > 0
""",
}


def ended(*command):
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


@pytest.mark.parametrize("name", PROGRAMS)
def test_a_program_that(name):
    done = ended(sys.executable, "-W", "ignore::DeprecationWarning", "-c", HEAD + PROGRAMS[name])
    assert (done.returncode, done.stdout, done.stderr) == (0, "True\n", "")


DROPPED = """
import gc
from terrain_gl.gpu.context import create_context
def resident():
    with open("/proc/self/statm") as f:
        return int(f.read().split()[1]) * os.sysconf("SC_PAGE_SIZE") >> 20
shared, sizes = CONTEXT, {}
for i in range(1, 46):
    draw(tg.Renderer(land, (64, 48), ctx=shared))
    gc.collect()
    sizes[i] = resident()
print(sizes[15], sizes[45], len(os.listdir("/proc/self/fd")))
"""


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
@pytest.mark.parametrize("context", ["None", "create_context()"])
def test_renderers_are_dropped_and_memory_is_flat(context):
    done = ended(sys.executable, "-c", HEAD + DROPPED.replace("CONTEXT", context))
    early, late, files = map(int, done.stdout.split())
    assert late - early < 30, "MiB of 30 renderers"  # about 28 MiB each where they are kept
    assert files < 100


WINDOW = """
import moderngl, moderngl_window
class Program(moderngl_window.WindowConfig):
    gl_version, window_size, vsync, title = (4, 3), (320, 240), False, "a program"
    def __init__(self, **settings):
        super().__init__(**settings)
        self.own = tg.Renderer(land, (64, 48))
        self.shared = tg.Renderer(land, (64, 48), ctx=self.ctx)
        self.target = self.ctx.framebuffer([self.ctx.texture((64, 48), 4)], self.ctx.depth_texture((64, 48)))
        self.program = self.ctx.program(
            "#version 330\\nin vec2 at; void main() { gl_Position = vec4(at, 0.0, 1.0); }",
            "#version 330\\nout vec4 o; void main() { o = vec4(0.0, 1.0, 0.0, 1.0); }")
        whole = self.ctx.buffer(np.array([-1, -1, 3, -1, -1, 3], "f4").tobytes())
        self.array = self.ctx.vertex_array(self.program, [(whole, "2f", "at")])
        self.frames = 0
    def on_render(self, time, frame_time):
        self.ctx.clear(1.0, 0.0, 0.0)
        images = [each.render(camera, 2.0, style="lambert").image for each in (self.own, self.shared)]
        differ = (images[0] != images[1]).any(-1).sum()
        assert not differ and images[0].std() > 5, (differ, images[0].std())
        view, projection = np.eye(4), np.diag([0.003, 0.003, -0.001, 1.0])
        view[:3, 3] = -320, -320, -500
        assert self.shared.draw_into(self.target, view, projection)["triangles"] > 0
        self.array.render()
        error = self.ctx.error
        assert error == "GL_NO_ERROR", error
        assert set(self.ctx.screen.read((0, 0, 320, 240))) == {0, 255}
        self.ctx.error  # moderngl leaves an error after it has read a window
        self.frames += 1
        if self.frames == 5:
            print(True)
            self.wnd.close()
    render = on_render  # the name in version 2
Program.run()
"""


@pytest.mark.skipif(not shutil.which("xvfb-run"), reason="needs xvfb-run")
def test_a_program_of_moderngl_window():
    pytest.importorskip("moderngl_window", reason="pip install moderngl-window")
    done = ended("xvfb-run", "-a", sys.executable, "-c", "import sys; sys.argv[1:] = []" + HEAD + WINDOW)
    assert done.returncode == 0 and done.stdout == "True\n", done.stderr
