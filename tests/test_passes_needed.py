"""All that real pictures give to their passes is needed: without it there is an error, with another the bytes change.

Scenes draw every style, lines, edits, stores and so on. Each pass that they make is asked to run without each of its
resources and uniforms, one at a time: it must refuse. Then it runs with something else in the place of each, and what
it writes must change. What it writes is copied before and brought back after, so the scene goes on as usual.
"""

import ctypes
import inspect
import json
import re
import struct
from collections import Counter

import moderngl
import numpy as np
import pytest
from maps import rough
from test_draw_into import look_at, perspective

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.basics.steps import drain
from terrain_gl.gpu import gl, passes, shaders
from terrain_gl.gpu.passes import declarations
from terrain_gl.gpu.selftest import faults
from terrain_gl.gpu.shaders import ShaderError
from terrain_gl.gpu.textures import depth_texture
from terrain_gl.image import write_image
from terrain_gl.pages.crop import release_context
from terrain_gl.renderer.methods import METHODS
from terrain_gl.renderer.overlay import Overlay
from terrain_gl.sat import SummedAreaTables, Table
from terrain_gl.shade.picture import STYLES
from terrain_gl.store import StoredMap, build

SIZE = (96, 64)
LAND = rough(257, 300, relief=300.0)
CAMERA = tg.Camera((1500.0, 300.0, float(LAND.max()) + 20.0), (1450.0, 2600.0, 0.0), 60.0)
GROUND = float(LAND[150, 150])  # metres, under the eye of CLOSE
CLOSE = tg.Camera((1500.0, 1060.0, GROUND + 4.0), (1530.0, 1300.0, GROUND - 10.0), 60.0)


def with_voids():
    heights = LAND.copy()
    heights[130:150, 140:170] = np.nan
    return tg.Heightmap(heights, 10.0)


def of_style(style):
    """Bytes of a picture with everything that it may show, of its measures, and of another after an edit."""

    def scene(ctx, folder):
        with tg.Renderer(with_voids(), SIZE, ctx=ctx) as renderer:
            low = {"sun": (60.0, 9.0), "style": style}
            one = renderer.render(CAMERA, 0.7, water_m=-5.0, contour_m=10.0, voids="hole", **low)
            found = [one.image, json.dumps(measured(renderer)), renderer.triangles(), renderer.inspector.error_map()]
            renderer.edit(slice(200, 210), slice(140, 155), 12.0)
            found.append(renderer.render(CLOSE, 2.0, metric="rms", **low).image)
        return found

    return scene


def measured(renderer):
    """The stats of a measured picture, without times."""
    return {name: each for name, each in renderer.measure().items() if "ms" not in name and "seconds" not in name}


def of_options(ctx, folder):
    """Wires, budgets, means, exaggeration, a worn map, lines, numbers of a picture, an explanation."""
    low = {"sun": (60.0, 9.0)}
    write_image(str(folder / "worn.png"), (np.indices((300, 257, 3)).sum(0) % 251).astype(np.uint8))
    with tg.Renderer(tg.Heightmap(LAND, 10.0), SIZE, ctx=ctx) as renderer:
        renderer.draw(CLOSE, 0.05, style="depth")
        line = np.array([[100.0, 220.0], [200.0, 190.0], [150.0, 130.0]])
        renderer.overlays = (Overlay((line,), np.array([[150.0, 190.0]])),)
        frames = [
            renderer.render(CAMERA, 1.0, style="lambert", wires=True, material=str(folder / "worn.png")),
            renderer.render(CAMERA, 1.0, metric="rms", haze=3.0, sun=(100.0, 8.0)),
            renderer.render(CAMERA, triangles=300, exaggeration=2.0, **low),
            renderer.render(
                CAMERA, triangles=300, metric="max", look="viridis", contour_m=0, surroundings="none", **low
            ),
            renderer.render(CAMERA, 0.5, curvature="on", refraction=0.13, size=(96, 64), fine=2),
            renderer.render(CAMERA, 1.0, exact=True),
        ]
        last = renderer.render(CAMERA, 1.0)
        found = [each.image for each in (*frames, last)]
        found += [last.depth, last.places, last.normals, last.kind]
        found.append(repr(renderer.inspector.explain(1500.0, 700.0)))
        found += renderer.inspector.triangulate(2.0)[:1]
        found += [drawn_into(renderer)]
    return found


def drawn_into(renderer):
    """Colours of a framebuffer of ours, with the land in it."""
    with renderer.session:
        target = renderer.ctx.framebuffer([renderer.ctx.texture(SIZE, 4)], depth_texture(renderer.ctx, SIZE, 0))
        target.clear()
    renderer.draw_into(target, look_at(CAMERA.eye, CAMERA.target), perspective(60.0, SIZE, 1.0, 5000.0), 1.0)
    with renderer.session:
        found = target.read(components=4)
        target.release()
    return found


def of_cuts(ctx, folder):
    """Points so high that cells are cut: leaves beside them are split, because an edge has at most 64 segments."""
    heights = np.zeros((200, 200), np.float32)
    heights[104:108, 140:148] = 1e3 * (np.indices((4, 8)).sum(0) % 2)
    holed = heights.copy()
    holed[100:103, 142:145] = np.nan
    build(holed, folder / "cuts", tile=16, shard=64)
    camera, found = tg.Camera((16.0, 95.0, 20.0), (150.0, 95.0, 0.0), 20.0), []
    for land in (tg.Heightmap(heights, 1.0), tg.Heightmap(holed, 1.0), StoredMap(folder / "cuts")):
        with tg.Renderer(land, (64, 64), ctx=ctx) as renderer:
            found += [renderer.render(camera, 0.3, metric=metric).image for metric in ("max", "rms")]
    return found


def of_driver(ctx, folder):
    """The driver's test, which renderers run once in a process: here also after others."""
    with ctx:
        return [list(faults(ctx))]


def of_store(ctx, folder):
    """A store with voids: light, an edit, a rebuild."""
    if not (folder / "s").exists():
        build(with_voids().heights, folder / "s", tile=16, shard=64, spacing_m=10.0)
    with tg.Renderer(StoredMap(folder / "s"), SIZE, ctx=ctx) as renderer:
        found = [renderer.render(CAMERA, 0.7, voids="hole").image, json.dumps(measured(renderer))]
        renderer.edit(slice(200, 210), slice(140, 155), 12.0)
        drain(renderer.editor.rebuild_steps())
        found += [renderer.render(CAMERA, 2.0, metric=metric, style="normals").image for metric in ("max", "rms")]
    return found


def of_methods(ctx, folder):
    """The other methods."""
    with tg.Renderer(tg.Heightmap(LAND, 10.0), SIZE, ctx=ctx) as renderer:
        return [renderer.render(CAMERA, style="lod", method=name).image for name in METHODS]


def of_strips(ctx, folder):
    """A table of sums as GPUs make it: a thread for each strip of a line. Processors sum whole lines."""
    values = np.random.default_rng(1).integers(0, 2**30, (2, 40, 50)).astype("u4")
    with ctx:
        sums, buffer = SummedAreaTables(ctx, 32, 8), ctx.buffer(values.tobytes())
        sums.build(buffer, Table(50, 40, 2))
        found = buffer.read()
        sums.release()
        buffer.release()
    return [found]


SCENES = of_driver, of_strips, of_options, *map(of_style, STYLES), of_store, of_methods, of_cuts


# --- In the place of what is given ------------------------------------------------------------------------------------

READ_SAMPLES = """
#version 430
layout(local_size_x = 1) in;
layout(binding = 0) uniform KIND u_from;
layout(std430, binding = 0) writeonly buffer Out { uint out_[]; };
void main() {
    ivec2 at = ivec2(gl_WorkGroupID.xy), size = textureSize(u_from);
    for (int i = 0; i < SAMPLES; i++) {
        uvec4 texel = BITS(texelFetch(u_from, at, i));
        for (int k = 0; k < 4; k++) {
            out_[4 * (SAMPLES * (at.y * size.x + at.x) + i) + k] = texel[k];
        }
    }
}
"""


def twin(ctx, given):
    """An object of the same kind and size, full of zeros or of nothing."""
    if isinstance(given, moderngl.Buffer):
        return ctx.buffer(bytes(given.size))
    if isinstance(given, gl.WordTexture):
        return gl.WordTexture(ctx).of(twin(ctx, given._buffer))
    if isinstance(given, moderngl.TextureArray):
        made = ctx.texture_array(given.size, given.components, dtype=given.dtype)
    elif given.depth:
        made = depth_texture(ctx, given.size, given.samples)
    else:
        made = ctx.texture(given.size, given.components, samples=given.samples, dtype=given.dtype)
    if not getattr(given, "samples", 0):
        made.filter, made.repeat_x, made.repeat_y = given.filter, given.repeat_x, given.repeat_y
    return made


def copy(ctx, source, target):
    """Copy a buffer or a texture into its twin."""
    if isinstance(source, moderngl.Buffer):
        ctx.copy_buffer(target, source)
        return
    kind = TARGETS["array" if isinstance(source, moderngl.TextureArray) else "samples" if source.samples else "plain"]
    box = (*source.size, 1)[:3]
    arguments = (source.glo, kind, 0, 0, 0, 0, target.glo, kind, 0, 0, 0, 0, *box)
    gl.function(ctx, "glCopyImageSubData", None, *[ctypes.c_uint] * len(arguments))(*arguments)


TARGETS = {"plain": 0x0DE1, "samples": 0x9100, "array": 0x8C1A}


class Reader:
    """Reads the bytes of buffers and textures, also those with several samples a pixel."""

    def __init__(self, ctx):
        self.ctx, self.programs = ctx, {}

    def read(self, given):
        if not getattr(given, "samples", 0):
            return given.read()
        kind = "usampler2DMS" if given.dtype.startswith("u") else "sampler2DMS"
        if (kind, given.samples) not in self.programs:
            text = READ_SAMPLES.replace("KIND", kind).replace("SAMPLES", str(given.samples))
            text = text.replace("BITS", "" if kind.startswith("u") else "floatBitsToUint")
            self.programs[kind, given.samples] = self.ctx.compute_shader(text)
        program = self.programs[kind, given.samples]
        out = self.ctx.buffer(reserve=16 * given.samples * given.width * given.height)
        given.use(0)
        out.bind_to_storage_buffer(0)
        program.run(*given.size)
        self.ctx.memory_barrier()
        found = out.read()
        out.release()
        return found


def others(ctx, given):
    """Other objects of a kind: zeros, and the same words, but each at the place of the next; or other numbers."""
    if isinstance(given, gl.WordTexture):
        for buffer in others(ctx, given._buffer):
            yield gl.WordTexture(ctx).of(buffer)
    elif isinstance(given, (moderngl.Buffer, moderngl.Texture, moderngl.TextureArray)):
        yield twin(ctx, given)
        if not getattr(given, "samples", 0):
            moved = twin(ctx, given)
            moved.write(np.roll(np.frombuffer(given.read(), "u1"), 4).tobytes())
            yield moved
    else:
        for change in (lambda v: v + 1, lambda v: 0 * v, lambda v: 2 * v + 3, lambda v: -v):
            yield changed(given, change)


def changed(value, change):
    if isinstance(value, (tuple, list)):
        return (list if isinstance(value, list) else tuple)(changed(each, change) for each in value)
    return change(value)


RUNS = (
    (passes.ComputePass, "run"),
    (passes.ComputePass, "run_indirect"),
    (passes.DrawPass, "draw"),
    (passes.DrawPass, "draw_indirect"),
    (passes.DrawPass, "capture"),
)
MOST_TRIES = 8  # runs of a pass in a scene in which names are tried
MAIN = ".comp", ".vert", ".tesc", ".tese", ".geom", ".frag"
UNIFORM_BLOCK = re.compile(r"layout\(std140, binding = \d+\) uniform (\w+) \{([^}]*)\};")
# What has been given something else without an effect in any of the runs, by the reason and by shader. Blocks that a
# program declares and does not read are found by the compiler: see Trial._unread.
UNSEEN = {
    "included code names it, the pass does not call that code, and the compiler leaves the block in": {
        "lod/every_post.comp": "Counters",
        "lod/rings/cull.comp": "Counters",
        "lod/rings/explain.comp": "Blocks Rings",
        "lod/rings/horizon.comp": "Blocks Counters Rings",
        "lod/rings/spend.comp": "Counters",
        "lod/rings/weigh.comp": "Units",
    },
    "it only asks whether a sample sees land, and the depth alone tells that": {
        "shade/cracks.frag": "Terrain View",
        "shade/wires.frag": "Terrain View",
    },
    "a leaf that is split here is within the tolerance, so its parts are, at the same spacing": {
        "lod/rings/agree.comp": "Counters Ranges View u_heights u_marks",
    },
    "few runs of stores are tried, and which tiles are loaded by then depends on time": {
        "lod/rings/agree.comp": "priced u_pages",
        "lod/rings/count.comp": "tan_off u_horizon",
        "lod/rings/decide.comp": "u_marks",
        "lod/rings/spend.comp": "Terrain View u_pages",
    },
    "two planes of leaves take turns, and are equal where the last round has changed nothing": {
        "lod/rings/count.comp": "agreed",
        "lod/rings/emit.comp": "agreed",
    },
    "no patch is hidden in these pictures: tests/test_hidden.py has others": {
        "lod/rings/count.comp": "sectors shells",
    },
    "only places beside a void read marks, and few pixels or squares are there": {
        "lod/every_post.comp": "u_marks",
        "lod/rings/explain.comp": "u_marks",
        "shade/error.frag": "u_marks",
        "shade/shaded.frag": "u_marks",
        "shade/voids.frag": "u_marks",
    },
    "only squares of two posts read heights, others read the tables": {
        "lod/rings/decide.comp": "u_heights",
        "lod/rings/explain.comp": "u_heights",
    },
    "only lit pixels where the sun's disc is half hidden, or the land turns from the sun, ask for it": {
        "shade/direct.frag": "sun_towards u_shares u_sun_horizon",
        "shade/shaded.frag": "sun_elevation sun_radius sun_towards u_packed u_sun_horizon",
        "shade/visibility.frag": "sun_towards u_heights u_sun_horizon",
    },
    "only the walls and the land around the map, or grounds by height, ask for it": {
        "shade/shaded.frag": "Terrain base_m climate edge_m exaggeration u_height_sums u_heights u_pages",
    },
    "an option that these pictures do not use, or a limit that they do not reach": {
        "error/coarse.comp": "posts",  # which posts have changed: edits come later, tests/test_error.py compares them
        "light/record.comp": "HeightSums u_albedo",
        "lod/rings/spend.comp": "Ranges",
        "mesh/error.frag": "View",  # the measured pictures have no curvature
        "shade/cracks.frag": "u_depth u_drawn",  # no pixel of the list looks through a crack
        "shade/detail.frag": "Pyramid",
        "shade/error.frag": "bar error_scale_px u_drawn",  # pixels of the list away from the bar
        "shade/into.frag": "far",  # there is a sky
        "shade/normals.frag": "u_height_sums",
        "comparison/tessellated/levels.comp": "u_heights",
    },
}
KNOWN = {(path, name) for known in UNSEEN.values() for path in known for name in known[path].split()}
NO_SCENE = (  # a generator, a kernel of tests, and the window
    "generate/heights.comp sat/query.comp shade/enlarge.frag shade/show.frag view/canvas.frag view/gui.frag"
    " view/gui.vert view/sat.frag"
)


class Trial:
    """Tries each name that passes use, in their first runs: left out, and with others in its place."""

    def __init__(self, ctx, monkeypatch):
        self.reader = Reader(ctx)
        self.pending, self.tries = {}, Counter()
        self.monkeypatch = monkeypatch
        begin = passes._Pass.__init__

        def begun(each, ctx, make, where, texts):
            begin(each, ctx, make, where, texts)
            each.text, each.make = "".join(texts), make

        release_context()  # its passes were made before
        monkeypatch.setattr(passes._Pass, "__init__", begun)
        for kind, name in RUNS:
            monkeypatch.setattr(kind, name, self._trying(getattr(kind, name)))

    def _trying(self, run):
        signature = inspect.signature(run)

        def tried(each, *given, **more):
            bound = signature.bind(each, *given, **more)
            bound.apply_defaults()
            arguments = bound.arguments
            used = each._binders.keys() | each._uniforms
            key = each._where, frozenset(used)
            if key not in self.pending:
                self.pending[key] = set(used) - self._unread(each.make)
                self._all_are_asked_for(lambda **other: run(**{**arguments, **other}), arguments, used, each._where)
            if self.pending[key] and self.tries[key] < MOST_TRIES:
                self.tries[key] += 1
                self._replace(each, key, lambda **other: run(**{**arguments, **other}), arguments)
            return run(**arguments)

        return tried

    def _unread(self, make):
        """Blocks that a program declares and does not read.

        Compilers keep all blocks of a standard layout. They leave out plain uniforms that are not read, and most packed
        blocks. So the program is compiled once more, with these in the place of its blocks.
        """
        members, source = {}, shaders.source

        def plain(block):
            lines = [each.strip() for each in block[2].split(";") if each.strip()]
            members[block[1]] = {name for each in lines for name in re.findall(r"(\w+)(?:\[\w+\])?(?=,|$)", each)}
            return " ".join(f"uniform {each};" for each in lines)

        def loose(*given):
            return UNIFORM_BLOCK.sub(plain, source(*given)).replace("std430", "packed")

        with self.monkeypatch.context() as patch:
            declared = self._names(make)
            patch.setattr(shaders, "source", loose)
            read = self._names(make)
        return {name for name in declared - read if not members.get(name, set()) & read}

    @staticmethod
    def _names(make):
        program = make()
        names = set(program)
        program.release()
        return names

    @staticmethod
    def _all_are_asked_for(run, arguments, used, where):
        for name in used:
            for of in ("resources", "uniforms"):
                if name in arguments[of]:
                    with pytest.raises(ShaderError, match=rf"^{re.escape(where)} also reads the {of} {name}$"):
                        run(**{of: {each: value for each, value in arguments[of].items() if each != name}})

    def _replace(self, each, key, run, arguments):
        ctx, read = each.ctx, self.reader.read
        ctx.memory_barrier()
        outputs = self._outputs(each, arguments)
        before = [twin(ctx, output) for output in outputs]
        for pair in zip(outputs, before, strict=True):
            copy(ctx, *pair)

        def result(**other):
            for pair in zip(before, outputs, strict=True):
                copy(ctx, *pair)
            count = run(**other)
            ctx.memory_barrier()
            return [count, *map(read, outputs)]

        expected, tidy = result(), list
        if result() != expected:  # threads append to lists in any order
            tidy = in_order
        if tidy(result()) == tidy(expected):
            for name in sorted(self.pending[key]):
                of = "uniforms" if name in arguments["uniforms"] else "resources"
                for instead in others(ctx, arguments[of][name]):
                    try:
                        is_other = tidy(result(**{of: {**arguments[of], name: instead}})) != tidy(expected)
                    except struct.error:  # a number below 0, where it is unsigned
                        continue
                    except TerrainError:
                        is_other = True
                    if is_other:
                        self.pending[key].discard(name)
                        break
        for pair in zip(before, outputs, strict=True):
            copy(ctx, *pair)

    @staticmethod
    def _outputs(each, arguments):
        """All that a run may write."""
        names = declarations(each.text)
        found = {name: arguments["resources"][name] for name in each._binders if names[name].write}
        found = [given for name, given in found.items() if names[name].kind in ("storage block", "image")]
        target = getattr(arguments.get("state"), "framebuffer", None)
        if target:
            found += [*target.color_attachments, target.depth_attachment]
        found.append(arguments.get("out"))
        kinds = moderngl.Buffer, moderngl.Texture, moderngl.TextureArray
        return list({id(each): each for each in found if isinstance(each, kinds)}.values())


def in_order(found):
    """Results without the order of words, or of bytes in planes of bytes: threads append to lists in any order."""

    def kind(each):
        return "u1" if len(each) % 4 else "u4"

    return [np.sort(np.frombuffer(each, kind(each))).tobytes() if isinstance(each, bytes) else each for each in found]


@pytest.mark.slow
@pytest.mark.longest
def test_whatever_passes_use_is_asked_for_and_changes_what_they_write(ctx, tmp_path, monkeypatch, pytestconfig):
    if pytestconfig.getoption("--driver") not in (None, "llvmpipe"):
        pytest.skip("other drivers leave out other names")
    trial = Trial(ctx, monkeypatch)
    for scene in SCENES:
        trial.tries.clear()
        scene(ctx, tmp_path)
    unseen = set()
    for (where, _), names in trial.pending.items():
        unseen |= {(where.rpartition("glsl/")[2], name) for name in names}
    assert unseen - KNOWN == set()
    tried = sum(len(names) for _, names in trial.pending)
    assert sum(map(len, trial.pending.values())) < tried / 10
    drawn = {path for where, _ in trial.pending for path in where.replace("glsl/", "").split(" + ")}
    root = shaders.root()
    files = {path.relative_to(root).as_posix() for path in root.rglob("*") if path.suffix in MAIN}
    assert files - drawn == set(NO_SCENE.split())
