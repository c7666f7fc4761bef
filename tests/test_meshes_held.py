"""A chosen mesh is a value: it stays as it was while its holder has it, whatever is chosen after it."""

import numpy as np
import pytest
from maps import rough

import terrain_gl as tg
from terrain_gl.gpu.buffer_pool import BufferPool, OwnedBuffer
from terrain_gl.mesh import captured_triangles
from terrain_gl.renderer.options import FrameOptions

SIZE = (96, 64)
WAYS = (
    {"max_error_px": 1.0},
    {"triangles": 900},
    {"triangles": 900, "metric": "rms"},
    {"max_error_px": 2.0, "metric": "rms"},
    {"method": "full"},
    {"method": "clipmap", "triangles": 900},
    {"method": "tessellated", "triangles": 900},
)


@pytest.fixture(scope="module")
def renderer():
    with tg.Renderer(tg.Heightmap(rough(90, 120, relief=60), 10.0), SIZE) as renderer:
        yield renderer


@pytest.fixture(scope="module")
def cameras(renderer):
    x, y = renderer.heightmap.extent_m
    return [tg.Camera((at * x, -0.3 * y, 300.0), (0.5 * x, 0.5 * y, 60.0)) for at in (0.1, 0.5, 0.9)]


def held(renderer, cameras):
    """Meshes by all ways and cameras in turns, and what each was when it was made."""
    frames, triangles = [], []
    for camera in cameras:
        for way in WAYS:
            with renderer.session:
                frames.append(renderer.select(camera, SIZE, FrameOptions(**way)))
                triangles.append(captured_triangles(frames[-1].selection))
    return frames, triangles


def are_as_they_were(renderer, frames, triangles):
    with renderer.session:
        try:
            now = [captured_triangles(frame.selection) for frame in frames]
        except tg.TerrainError:  # there are more triangles than the mesh had
            return False
    return all(
        np.array_equal(a, b) for one, two in zip(now, triangles, strict=True) for a, b in zip(one, two, strict=True)
    )


def test_later_choices_change_no_mesh_that_is_held(renderer, cameras):
    frames, triangles = held(renderer, cameras)
    assert are_as_they_were(renderer, frames, triangles)


def test_with_one_buffer_for_all_meshes_they_would_change(renderer, cameras, monkeypatch):
    own = BufferPool.own

    def the_same(pool, needed=0):
        pool.shared = own(pool, needed) if needed > getattr(pool, "shared_bytes", -1) else pool.shared
        pool.shared_bytes = pool.shared.buffer.size
        return OwnedBuffer(pool.shared.buffer, [])

    monkeypatch.setattr(BufferPool, "own", the_same)
    with tg.Renderer(renderer.heightmap, SIZE) as other:
        assert not are_as_they_were(other, *held(other, cameras))


def test_buffers_are_used_again_when_nobody_holds_their_mesh(renderer, cameras):
    for _ in range(2):
        held(renderer, cameras)
    before = renderer.selectors.bytes
    for _ in range(3):
        for way in WAYS:
            renderer.choose(cameras[0], **way)
    assert renderer.selectors.bytes == before


def test_a_frame_is_explained_and_measured_after_another_one(renderer, cameras):
    """Its hidden land, its tolerance and its camera are its own."""
    renderer.choose(cameras[0], 0.5)
    first = renderer.inspector.frame
    place = renderer.heightmap.extent_m[0] / 2, renderer.heightmap.extent_m[1] / 2
    told = renderer.inspector.explain(*place)
    measured = renderer.inspector.measure_steps()
    renderer.choose(cameras[2], 8.0)
    assert renderer.inspector.explain(*place, first) == told != renderer.inspector.explain(*place)
    with pytest.raises(StopIteration) as end:
        while True:
            next(measured)
    assert 0 < end.value.value.max_px <= first.selection.certified_px <= 0.5


def test_a_picture_answers_after_another_mesh_was_chosen(renderer, cameras):
    """The view of the picture is set again for each question."""
    renderer.labels()
    frame = renderer.render(cameras[0], 0.5)
    seen = renderer.place_at(48, 10)
    frame = renderer.render(cameras[0], 0.5)
    with renderer.session:
        renderer.select(cameras[2], SIZE, FrameOptions(8.0, near_m=40.0))
    assert renderer.place_at(48, 10) == seen
    assert frame.depth[10, 48] == renderer.render(cameras[0], 0.5).depth[10, 48]


def test_an_edit_ends_the_use_of_an_earlier_mesh(renderer, cameras):
    options = FrameOptions(1.0)
    heights = np.zeros((20, 20))
    with tg.Renderer(renderer.heightmap, SIZE) as other, other.session:
        first = other.select(cameras[0], SIZE, options)
        assert other.select(cameras[0], SIZE, options, first).selection is first.selection
        assert other.select(cameras[1], SIZE, options, first).selection is not first.selection
        assert other.select(cameras[0], SIZE, FrameOptions(2.0), first).selection is not first.selection
        other.edit(slice(20, 40), slice(20, 40), heights)
        assert other.select(cameras[0], SIZE, options, first).selection is not first.selection
