"""Method sat is a function of tables and camera: other tables give another mesh, equal tables an equal mesh."""

import numpy as np
import pytest
from maps import cameras, rough
from ring_scenes import change_shaders, clipmap_of, patches_of, surface_errors

from terrain_gl import Renderer, reference
from terrain_gl.camera import Camera
from terrain_gl.files.maps import bundled
from terrain_gl.gpu import layout
from terrain_gl.gpu.context import create_context
from terrain_gl.gpu.packing import ERROR_UNIT
from terrain_gl.heightmap import Heightmap
from terrain_gl.lod import Goal, RingsSelector, rings
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.verify.measure import Measurement

pytestmark = pytest.mark.line

SIZE = (160, 90)


def land():
    """Land that is rough down to the posts: a coarser mesh has a large error."""
    noise = np.random.default_rng(1).normal(size=(110, 90))
    return Heightmap(rough(110, 90, 11) + 6 * noise.astype("f4"), (12.0, 9.0))


@pytest.fixture
def scene(ctx):
    return clipmap_of(ctx, land(), SIZE)


def mesh_of(scene, camera, **settings):
    """The patch records, in order."""
    settings = settings or {"tolerance_px": 1.0}
    selection = scene.select(camera, **settings)
    return selection.buffers.patches.read(16 * selection.patches)


def options(**settings):
    return FrameOptions(method="sat", **settings)


def fill_with(buffer, words):
    buffer.write(np.resize(words, buffer.size // 4).astype("u4").tobytes())


RANDOM = np.random.default_rng(5).integers(0, 2**32, 4099, dtype="u4")
SETTINGS = {"counters": {"tolerance_px": 1.0}, "squares": {"tolerance_px": 1.0, "metric": "rms"}}


@pytest.mark.parametrize("words", [0, 0xFFFFFFFF, RANDOM], ids=["zeros", "ones", "random"])
@pytest.mark.parametrize("table", SETTINGS)
def test_other_sums_give_another_mesh(ctx, scene, table, words):
    """Random counters say "rough" nearly everywhere; constant counters say that every box is flat."""
    camera, settings = cameras(scene.heightmap)["default"], SETTINGS[table]
    before = mesh_of(scene, camera, **settings)
    fill_with(getattr(scene.tables, table), words)
    assert mesh_of(scene, camera, **settings) != before


def test_without_counters_the_bound_breaks(ctx, scene):
    camera = cameras(scene.heightmap)["default"]
    kept = scene.select(camera, 1.0)
    assert surface_errors(scene, kept, camera).max_px <= kept.certified_px <= 1
    fill_with(scene.tables.counters, 0)
    broken = scene.select(camera, 1.0)
    assert surface_errors(scene, broken, camera).max_px > 1


def test_without_squares_the_bound_of_the_mean_breaks(ctx, scene):
    """Where a patch is partly in the picture, its maximum is bounded instead. So the whole map is in this picture."""
    east, north = scene.heightmap.extent_m
    camera = Camera((0.5 * east, -0.2 * north, north), (0.5 * east, 0.5 * north, 0.0), 70.0)
    kept = scene.select(camera, 0.1, "rms")
    assert surface_errors(scene, kept, camera).rms_px <= kept.certified_px <= 0.1
    fill_with(scene.tables.squares, 0)
    fill_with(scene.tables.counters, 0)
    broken = scene.select(camera, 0.1, "rms")
    assert surface_errors(scene, broken, camera).rms_px > 0.1


def test_a_budget_asks_the_squares(ctx, scene):
    camera = cameras(scene.heightmap)["default"]
    before = mesh_of(scene, camera, triangles=3000)
    fill_with(scene.tables.counters, RANDOM)
    assert mesh_of(scene, camera, triangles=3000) != b""
    fill_with(scene.tables.squares, RANDOM)
    assert mesh_of(scene, camera, triangles=3000) != before


def test_nodes_decide_nothing(ctx, scene):
    """The summed-area tables decide: garbage in the node records changes nothing."""
    camera, settings = cameras(scene.heightmap)["default"], [*SETTINGS.values(), {"triangles": 3000}]
    before = [mesh_of(scene, camera, **each) for each in settings]
    for table in ("nodes", "contributions"):
        fill_with(getattr(scene.tables, table), RANDOM & 0x3FFF3FFF)
    assert [mesh_of(scene, camera, **each) for each in settings] == before


def test_same_view_same_mesh_in_any_order_and_context(ctx, scene):
    views = cameras(scene.heightmap)
    settings = [{"tolerance_px": 0.5}, {"tolerance_px": 2.0, "metric": "rms"}, {"triangles": 2500}]
    asked = [(view, each) for view in ("default", "grazing", "wide") for each in settings]
    first = [mesh_of(scene, views[view], **each) for view, each in asked]
    again = [mesh_of(scene, views[view], **each) for view, each in reversed(asked)][::-1]
    assert again == first
    with create_context("egl") as other:
        fresh = clipmap_of(other, land(), SIZE)
        assert [mesh_of(fresh, views[view], **each) for view, each in asked] == first
        fresh.release()


class Counted(RingsSelector):
    """A selector that counts its dispatches."""

    dispatches = 0

    def _run(self, *args, **uniforms):
        self.dispatches += 1
        super()._run(*args, **uniforms)


class Thorough(RingsSelector):
    """A selector whose rounds all look at all leaves, not only at leaves around which something has changed."""

    def _run(self, name, *args, **uniforms):
        if name == "agree" and uniforms["agreed"]:
            self._queue_all(uniforms["agreed"])
        super()._run(name, *args, **uniforms)

    def _queue_all(self, over):
        blocks, lists = self._buffers["blocks"], self._buffers["lists"]
        work = np.frombuffer(blocks.read(), layout.RING_WORK, 1)[0].copy()
        units = np.frombuffer(self._buffers["units"].read(), "u4").reshape(2, -1)[over % 2]
        listed = np.frombuffer(lists.read(), layout.LISTED).copy()
        leaves = listed["leaf"][: work["leaves"]["count"]]
        queue = work["queue"][over % layout.RING_QUEUES]
        queued = listed["in_queue"][: queue["count"], over % 2]
        others = np.setdiff1d(leaves, queued & 0xFFFFFFF)
        everything = np.concatenate([queued, others | (units[others] >> 8 & 3) << 28]).astype("u4")
        queue["count"], queue["groups"] = len(everything), -(-len(everything) // 64)
        listed["in_queue"][: len(everything), over % 2] = everything
        lists.write(listed.tobytes())
        blocks.write(work.tobytes())


def test_rounds_look_at_all_that_may_change(ctx, scene):
    thorough, quick = Thorough(scene.tables), RingsSelector(scene.tables)
    for camera in cameras(scene.heightmap).values():
        for tolerance in (0.2, 1.0):
            meshes = []
            for selector in (thorough, quick):
                selection = selector.select(camera, SIZE, scene.near_m, Goal(tolerance))
                meshes.append(selection.buffers.patches.read(layout.PATCH.itemsize * selection.patches))
            assert meshes[0] == meshes[1]


class Counting(RingsSelector):
    """A selector that counts the blocks of its rings, and those that it looks at."""

    def _run(self, name, indirect=None, **uniforms):
        super()._run(name, indirect, **uniforms)
        if name == "cull":
            data = self._buffers["blocks"].read(layout.RING_WORK.itemsize)
            work = np.frombuffer(data, layout.RING_WORK)[0]
            self.blocks, self.seen = int(work["all"]["count"]), int(work["seen"]["groups"])


def test_rings_and_blocks_that_nobody_sees_change_nothing(ctx, scene, monkeypatch):
    all_, quick, least = Counting(scene.tables), Counting(scene.tables), np.ones(2)
    in_picture = rings.rings_in_picture
    for camera in cameras(scene.heightmap).values():
        meshes = []
        for selector, leave_out in ((all_, lambda rings, *_: rings), (quick, in_picture)):
            monkeypatch.setattr(rings, "rings_in_picture", leave_out)
            selection = selector.select(camera, SIZE, scene.near_m, Goal(0.3))
            patches = selection.buffers.patches.read(layout.PATCH.itemsize * selection.patches)
            meshes.append((selection.certified_px, selection.triangles, patches))
        assert meshes[0] == meshes[1]
        least = np.minimum(least, (quick.blocks / all_.blocks, quick.seen / quick.blocks))
    assert (least < 0.75).all()


def test_a_budget_weighs_only_blocks_in_the_picture(ctx, scene, monkeypatch):
    """The others change nothing, and would take as long."""
    camera, found = cameras(scene.heightmap)["grazing"], []
    for old in ("unchanged", "u_cull == 0 || !project_square"):
        change_shaders(monkeypatch, old, "true || !project_square")
        selector = Counting(scene.tables)
        selection = selector.select(camera, SIZE, scene.near_m, Goal(metric="rms", triangles=3000))
        patches = selection.buffers.patches.read(layout.PATCH.itemsize * selection.patches)
        found.append((selector.seen, selection.triangles, patches))
        selector.release()
    assert found[0][1:] == found[1][1:]
    assert found[0][0] < 0.6 * found[1][0]


def test_without_cut_edges_the_bound_breaks(ctx):
    """With the error of cells whose edges are whole, places beside finer patches are further off than certified.

    In the south, every sixteenth row has hills where the others have hollows. The north needs small cells. A cell
    beside the north has new vertices on the hills, and rises over the hollows.
    """
    y, x = np.mgrid[:129, :129]
    heights = np.where(y % 16 == 0, 2.0, -2.0) * np.sin(np.pi * x / 16) ** 2
    heights[:64] += 3 * rough(64, 129, 3)
    scene = clipmap_of(ctx, Heightmap(heights, 10.0), (320, 180))
    camera, nodes = cameras(scene.heightmap)["default"], scene.tables.nodes

    def achieved():
        for error in (1.34, 1.4):
            view = scene.select(camera, error)
            yield surface_errors(scene, view, camera).max_px / view.certified_px

    assert max(achieved()) <= 1
    whole = np.frombuffer(nodes.read(), layout.NODE).copy()
    for level, sizes in enumerate(scene.terrain.levels[1:], 1):
        errors_m = reference.largest_errors(scene.terrain.filled, level) * 1.001
        part = slice(sizes.first_node, sizes.first_node + sizes.nodes)
        whole["max_m"][part] = errors_m.ravel() / (scene.terrain.span_m * ERROR_UNIT)
    nodes.write(whole)
    for level in range(len(scene.terrain.levels)):
        scene.tables._update_tables(level, scene.terrain.all_posts)
    assert max(achieved()) > 1


def test_flat_land_is_coarser_than_the_cells_of_its_ring(ctx):
    """A square of eight ring cells has at most four segments a side: rings stand on the lattice of the next level."""
    scene = clipmap_of(ctx, Heightmap(np.zeros((300, 400)), 10.0), SIZE)
    patches = patches_of(scene, scene.select(cameras(scene.heightmap)["default"], 1.0))
    far = patches.step_log2 >= 1
    assert far.any() and (patches.side_log2 - patches.step_log2)[far].max() <= 2


def test_no_pass_walks_the_map(ctx):
    """The same land around the eye in larger and larger maps: as many blocks, but for the rings that are added."""
    small = rough(129, 129, 2)
    used = []
    for times in (2, 4, 8):
        grid = np.tile(np.block([[small, small[:, ::-1]], [small[::-1], small[::-1, ::-1]]])[1:, 1:], (times // 2,) * 2)
        heightmap = Heightmap(grid, 10.0)
        east, north = heightmap.extent_m
        camera = Camera((0.5 * east, 0.5 * north, 200.0), (0.5 * east + 900, 0.5 * north, 0.0), 30.0)
        selector = Counted(clipmap_of(ctx, heightmap, SIZE).tables)
        selector.select(camera, SIZE, 1.0, Goal(1.0))
        rings = selector._rings_of(camera, 8)
        summary = np.frombuffer(selector._buffers["summary"].read(layout.RING_SUMMARY.itemsize), layout.RING_SUMMARY)[0]
        roots = sum(ring.blocks[0] * ring.blocks[1] for ring in rings)
        used.append((len(rings), roots, int(summary["blocks"]) - roots, selector.dispatches))
    for (rings, _, parts, _), (more_rings, roots, more_parts, dispatches) in zip(used, used[1:], strict=False):
        assert more_rings <= rings + 2
        assert roots <= 64 * more_rings
        assert more_parts == parts
        assert dispatches == 11


@pytest.fixture(scope="module")
def alpine():
    known = bundled()["alpine-30m"]
    heightmap = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
    with Renderer(heightmap, size=(320, 180)) as renderer:
        yield renderer


def test_most_triangles_come_from_tessellated_patches(alpine):
    """At least half of the triangles are in patches of 4 × 4 segments or more."""
    frame = alpine.select(bundled()["alpine-30m"].camera, (640, 360), options(max_error_px=1.0))
    triangles = np.array(frame.selection.counts) * 2 * 4 ** np.arange(7)
    assert triangles[2:].sum() >= 0.5 * frame.selection.triangles


@pytest.mark.slow
def test_budgets_are_spent_and_never_exceeded(alpine):
    camera, errors = bundled()["alpine-30m"].camera, []
    with alpine.session:
        measurement = Measurement(alpine.terrain)
        for budget in (2000, 20_000, 200_000):
            frame = alpine.select(camera, alpine.size, options(triangles=budget))
            assert 0.95 * budget <= frame.selection.triangles <= budget
            errors.append(measurement.achieved(frame.selection, camera, alpine.size, frame.near_m).rms_px)
        measurement.release()
    assert errors[0] > errors[1] > errors[2]
    for budget in (10, 300):
        few = alpine.choose(camera, method="sat", triangles=budget)["triangles"]
        assert few <= max(budget, fewest(alpine, camera))


def fewest(renderer, camera):
    """Triangles of the coarsest mesh of the rings: a smaller budget cannot be kept."""
    return renderer.choose(camera, method="sat", triangles=2)["triangles"]


def test_an_edit_gives_the_mesh_of_a_fresh_renderer(ctx):
    heights, camera = rough(90, 75, 6), None
    edited = heights.copy()
    edited[30:40, 20:50] += 25
    meshes = []
    for start, then in ((heights, edited), (edited, None)):
        with Renderer(Heightmap(start, 10.0), size=SIZE) as renderer:
            camera = camera or Camera.default(renderer.heightmap)
            if then is not None:
                renderer.choose(camera, 1.0, method="sat")
                renderer.edit(slice(30, 40), slice(20, 50), then[30:40, 20:50])
            selection = renderer.select(camera, SIZE, options(max_error_px=1.0)).selection
            with renderer.session:
                meshes.append(selection.buffers.patches.read(16 * selection.patches))
    assert meshes[0] == meshes[1]
