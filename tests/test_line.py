"""The command line of a view draws exactly the same picture."""

import shlex
import shutil

import numpy as np
import pytest
from commands import parse
from hypothesis import given, settings
from hypothesis import strategies as st

from terrain_gl import cli
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera
from terrain_gl.cli import options
from terrain_gl.cli.line import command_line
from terrain_gl.cli.scene import open_scene
from terrain_gl.comparison.clipmap import Rings
from terrain_gl.comparison.tessellated import Edges
from terrain_gl.files.maps import bundled, open_map
from terrain_gl.files.views import standard_view
from terrain_gl.film.path import CameraPath, Keyframe
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions

SIZE = (96, 64)


@pytest.fixture(autouse=True)
def folder(folder):
    y, x = np.mgrid[0:65, 0:97]
    heights = 40 * np.exp(-((x - 50) ** 2 + (y - 30) ** 2) / 300) + 0.1 * x
    heights[3:6, 80:90] = -9
    np.save("a hill's map.npy", heights.astype("f4"))
    return folder


def parsed(line):
    program, *words = shlex.split(line)
    assert program == "terrain-gl"
    return parse(*words)


def draws_the_same(heightmap, camera, drawing=None, size=SIZE):
    """Assert that the command line draws what the renderer draws; returns the command line."""
    drawing = drawing or FrameOptions()
    line = command_line(heightmap, camera, size, drawing)
    assert cli.main(shlex.split(line)[1:]) == 0
    with Renderer(heightmap, size) as renderer:
        assert np.array_equal(read_image("picture.png"), renderer.render(camera, **vars(drawing)).image)
    return line


@pytest.mark.parametrize(
    ("drawing", "said"),
    [
        (FrameOptions(method="clipmap", parameters=Rings(31), style="depth"), "--ring 31"),
        (FrameOptions(method="tessellated", parameters=Edges(12.5), style="depth"), "--edge 12.5"),
    ],
)
def test_parameters_of_rivals(drawing, said):
    heightmap = Heightmap.open("a hill's map.npy")
    assert said in draws_the_same(heightmap, standard_view(heightmap), drawing)


def test_parameters_without_an_option_are_refused():
    heightmap = Heightmap.open("a hill's map.npy")
    drawing = FrameOptions(method="clipmap", parameters=Rings(31, finest=2))
    with pytest.raises(UsageError, match="no options for all of Rings"):
        command_line(heightmap, standard_view(heightmap), SIZE, drawing)


def test_only_what_is_unusual_is_said():
    known = bundled()["canyon-15m"]
    heightmap, _ = open_map("canyon-15m")
    assert (
        command_line(heightmap, known.camera, (1280, 720), FrameOptions(sun=known.sun))
        == "terrain-gl shot canyon-15m -o picture.png"
    )
    line = command_line(
        heightmap, Camera(known.eye, (1, -2.5, 3e-7), known.fov_deg), SIZE, FrameOptions(2, sun=known.sun), "a b.png"
    )
    assert line == "terrain-gl shot canyon-15m -o 'a b.png' --target 1,-2.5,3e-07 --size 96x64 --max-error 2"


def test_bundled_map_in_its_view():
    known = bundled()["canyon-15m"]
    draws_the_same(open_map("canyon-15m")[0], known.camera, FrameOptions(sun=known.sun, style="normals"))


def test_bundled_map_in_another_shape():
    heightmap, _ = open_map("canyon-15m", spacing_m=(10.0, 20.0))
    line = draws_the_same(heightmap, standard_view(heightmap, "high"), FrameOptions(style="normals"))
    assert "--spacing 10,20" in line
    bare = Heightmap.open(bundled()["canyon-15m"].path)
    line = draws_the_same(bare, standard_view(bare), FrameOptions(style="normals"))
    assert "--spacing 1,1 --z-scale 0.0006 --z-offset 0" in line


def test_a_copy_of_a_bundled_map(folder):
    shutil.copy(bundled()["canyon-15m"].path, "other.png")
    heightmap, known = open_map("other.png")
    assert "shot canyon-15m" in command_line(heightmap, known.camera, SIZE, FrameOptions(sun=known.sun))


@pytest.mark.parametrize(
    "drawing",
    [
        FrameOptions(),
        FrameOptions(0.1 + 0.2, metric="rms"),
        FrameOptions(method="full", style="normals", near_m=1 / 3),
        FrameOptions(style="wireframe", sun=(-10.5, 60)),
        FrameOptions(triangles=500),
    ],
    ids=str,
)
def test_a_file_with_everything(drawing):
    heightmap = Heightmap.open("a hill's map.npy", (2.5, 1 / 3), 1.7, -3, nodata=-9)
    camera = Camera((-20 / 3, 5, 90), (1e2 / 7, 11.1, 2), 33.3, (0.1, 0.2, 1))
    line = draws_the_same(heightmap, camera, drawing)
    scene = open_scene(parsed(line))
    assert (scene.camera, scene.frame) == (camera, drawing)
    assert np.array_equal(scene.heightmap.heights, heightmap.heights, equal_nan=True)


def test_from_another_folder(folder, monkeypatch):
    heightmap = Heightmap.open("a hill's map.npy")
    line = command_line(heightmap, standard_view(heightmap), SIZE, FrameOptions())
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    assert np.array_equal(open_scene(parsed(line)).heightmap.heights, heightmap.heights)


def test_a_view_from_a_path():
    heightmap = Heightmap.open("a hill's map.npy")
    views = [Keyframe(standard_view(heightmap)), Keyframe(Camera((50, 30, 200), (50, 30, 0)))]
    draws_the_same(heightmap, CameraPath(views).at(0.7).camera)


numbers = st.floats(-1e8, 1e8).filter(lambda v: v == 0 or abs(v) > 1e-100)


@settings(max_examples=50)
@given(st.tuples(numbers, numbers, numbers), st.floats(0.1, 170), st.floats(1e-6, 1e5), st.floats(-90, 90))
def test_every_digit_counts(eye, fov, max_error, elevation):
    camera = Camera(eye, tuple(np.add(eye, (3e3, 1e3, -2e3))), fov)
    heightmap = open_map("canyon-15m")[0]
    asked = parsed(command_line(heightmap, camera, SIZE, FrameOptions(max_error, sun=(12.3, elevation))))
    start = bundled()["canyon-15m"].camera
    said = {"eye": start.eye, "fov_deg": start.fov_deg} | asked.camera.given
    assert Camera(**said) == camera and asked.frame.max_error_px == max_error
    assert asked.light.sun == asked.frame.sun == (12.3, elevation)


def test_what_no_option_says_is_not_passed_over(monkeypatch):
    heightmap = Heightmap.open("a hill's map.npy")
    monkeypatch.setattr(options, "add_rendering", lambda command: None)
    with pytest.raises(UsageError, match="no option for style"):
        command_line(heightmap, standard_view(heightmap), (1280, 720), FrameOptions(style="lod"))


def test_maps_that_no_file_holds():
    for heightmap in (Heightmap([[0, 1], [2, 3]]), Heightmap.open("a hill's map.npy").copy()):
        heightmap.write(0, 0, [[7]])
        with pytest.raises(UsageError, match="save it"):
            command_line(heightmap, standard_view(heightmap), SIZE, FrameOptions())


def test_edits_in_the_renderer_are_noticed():
    heightmap = Heightmap.open("a hill's map.npy")
    with Renderer(heightmap, SIZE) as renderer:
        assert command_line(renderer.heightmap, standard_view(heightmap), SIZE, FrameOptions())
        renderer.edit(np.s_[2:4], np.s_[5:9], 55.0)
        with pytest.raises(UsageError, match="save it"):
            command_line(renderer.heightmap, standard_view(heightmap), SIZE, FrameOptions())
