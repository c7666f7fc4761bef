"""Saved pictures, meshes, films, maps, command lines and camera paths."""

import json
import shlex
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rasters import write_raster
from viewers import (
    changed,
    drawn_at_once,
    hills,
    later,
    light_is_up_to_date,
    load,
    seen,
    set_budget,
    settle,
    slow,
    swift,
)

from terrain_gl.camera import Camera
from terrain_gl.cli.line import command_line
from terrain_gl.files.export import FORMATS
from terrain_gl.film.path import CameraPath
from terrain_gl.heightmap import Heightmap, ground_m
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.renderer.overlay import read_overlay
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.loops import turn
from terrain_gl.viewer.saver import SIZES, free_path


def saved(viewer):
    """Save a picture."""
    viewer.window.message = ""
    press(viewer, "p")
    while not viewer.window.message:
        later(viewer)
        viewer.saver.join()


def test_the_picture_is_saved_without_panels_beside_earlier_ones(viewer, folder):
    for _ in range(2):
        saved(viewer)
    assert sorted(path.name for path in folder.glob("*.png")) == ["hills-001.png", "hills-002.png"]
    assert np.array_equal(load(folder / "hills-001.png"), drawn_at_once(viewer))
    assert json.loads((folder / "hills-001.json").read_text())["triangles"] == viewer.painter.frame.stats["triangles"]
    assert (folder / "hills-001.png").read_bytes() == (folder / "hills-002.png").read_bytes()
    assert free_path("x/hills.tif").name == "hills-003.png"
    assert f"saved {folder.resolve() / 'hills-002.png'}" in viewer.window.message


def test_a_picture_that_cannot_be_saved_gives_a_message(viewer, folder):
    shutil.rmtree(folder)
    settle(viewer)
    saved(viewer)
    assert "saved" not in viewer.window.message


@pytest.mark.parametrize("suffix", [".tif", ".png", ".exr"])
def test_the_land_is_saved_and_opens_again(viewer, tmp_path, suffix):
    settle(viewer)
    viewer.exaggerate(2.0)
    settle(viewer)
    heights = viewer.scene.renderer.heightmap.heights
    path = tmp_path / f"land{suffix}"
    viewer.sculpting.save(str(path))
    viewer.sculpting.writer.join()
    settle(viewer)
    assert "saved" in viewer.window.message and "--spacing" in viewer.window.message
    words = viewer.window.message.split("open it again: ")[1].split()
    options = dict(zip(words[::2], words[1::2], strict=True))
    scales = {"z_scale": float(options.get("--z-scale", 1)), "z_offset_m": float(options.get("--z-offset", 0))}
    again = Heightmap.open(path, spacing_m=10.0, **scales)
    assert np.abs(again.heights - heights).max() <= scales["z_scale"] / 2 if suffix == ".png" else again.heights.size
    if suffix != ".png":
        assert np.array_equal(again.heights, heights)


def test_a_map_that_cannot_be_saved_gives_a_message(viewer, tmp_path):
    settle(viewer)
    for path in ("land.doc", str(tmp_path / "nowhere" / "land.tif")):
        viewer.sculpting.save(path)
        if viewer.sculpting.writer:
            viewer.sculpting.writer.join()
        later(viewer)
        assert (
            viewer.sculpting.writer is None and viewer.window.message and not viewer.window.message.startswith("saved")
        )


def fly(viewer, frames=8):
    """Record a short flight sideways; returns the first camera and the last."""
    settle(viewer)
    press(viewer, "r")
    later(viewer, 0.1)
    first = viewer.scene.controller.camera
    viewer.scene.controller.press("d")
    for _ in range(frames):
        later(viewer, 0.05)
    viewer.scene.controller.let_go_all()
    press(viewer, "r")
    return first, viewer.scene.controller.camera


def finish(viewer):
    """Go on until the film is drawn and written."""
    while viewer.saver.shot:
        later(viewer)
    viewer.saver.join()


@pytest.mark.slow
def test_a_film_is_drawn_in_full_quality_along_the_flown_path(viewer, folder, monkeypatch):
    pytest.importorskip("av", reason="the extra [video] is not installed")
    import av

    monkeypatch.setitem(SIZES, "large", (450, 260))
    viewer.saver.size = "large"
    first, last = fly(viewer)
    assert viewer.saver.shot and "film hills-001.mp4" in viewer.progress.text and viewer.progress.can_cancel
    finish(viewer)
    with av.open("hills-001.mp4") as film:
        frames = [frame.to_ndarray(format="rgb24").astype(int) for frame in film.decode(video=0)]
    path = CameraPath.open("hills-001-path.json")
    assert len(frames) == round(path.seconds * 30) >= 10 and "saved" in viewer.window.message
    assert np.allclose(path.keyframes[0].camera.eye, first.eye) and np.allclose(path.keyframes[-1].camera.eye, last.eye)
    with Renderer(viewer.scene.renderer.heightmap, (450, 260), ctx=viewer.ctx) as renderer:
        for camera, frame in ((first, frames[0]), (last, frames[-1])):
            truth = renderer.render(camera, **vars(viewer.settings.options)).image[..., :3].astype(int)
            assert np.abs(frame - truth).mean() < 4  # what H.264 makes of it
    assert changed(frames[-1], frames[0]) > 0.01


def test_a_film_is_cancelled_and_leaves_nothing_half_written(viewer, folder, monkeypatch):
    monkeypatch.setattr("terrain_gl.viewer.saver.film_suffix", lambda: "")
    fly(viewer)
    set_budget(viewer, slow())
    later(viewer)
    press(viewer, "escape")
    assert not viewer.saver.shot and viewer.window.message == "cancelled" and not viewer.window.closing
    assert [path.name for path in folder.iterdir()] == ["hills-001-path.json"]


def test_a_window_that_closes_warns_of_a_film_under_way(viewer, folder):
    settle(viewer)
    press(viewer, "r")
    for _ in range(5):
        later(viewer, 0.1)
    viewer.quit()
    assert not viewer.window.closing and viewer.saver.shot and "repeat" in viewer.window.message
    viewer.quit()
    assert viewer.window.closing


@pytest.mark.slow
def test_the_sun_of_a_film_moves_as_it_moved(viewer, folder, monkeypatch):
    monkeypatch.setattr("terrain_gl.viewer.saver.film_suffix", lambda: "")
    settle(viewer)
    viewer.settings.change_all(sun=(120.0, 60.0))
    settle(viewer)
    press(viewer, "r")
    for elevation in (60.0, 35.0, 10.0):
        viewer.settings.change_all(sun=(120.0, elevation))
        later(viewer, 0.12)
    press(viewer, "r")
    assert [frame.sun for frame in CameraPath.open("hills-001-path.json").keyframes][-1] == (120.0, 10.0)
    finish(viewer)
    pictures = sorted((folder / "hills-001").iterdir())
    with Renderer(viewer.scene.renderer.heightmap, (320, 200), ctx=viewer.ctx) as renderer:
        lit = renderer.render(viewer.scene.controller.camera, sun=(120.0, 60.0)).image[..., :3].astype(int)
    assert changed(load(pictures[0]), lit) < 0.01 < 0.3 < changed(load(pictures[-1]), lit)
    settle(viewer)
    assert np.array_equal(seen(viewer), drawn_at_once(viewer))  # the window has its own light again


def pictures_of(folder, name):
    return [load(path) for path in sorted((folder / name).iterdir())]


@pytest.mark.slow
def test_one_flies_on_while_a_film_is_drawn_and_it_stays_the_same(viewer, folder, monkeypatch):
    """The film waits while the camera moves, then draws its picture afresh; with another light in the window, too."""
    monkeypatch.setattr("terrain_gl.viewer.saver.film_suffix", lambda: "")
    monkeypatch.setattr("terrain_gl.viewer.loops.TURN_S", 0.3)
    settle(viewer)
    press(viewer, "ctrl+r")
    finish(viewer)
    home = viewer.scene.controller.pose
    press(viewer, "ctrl+r")
    set_budget(viewer, slow())
    for step in range(4):
        while viewer.saver.shot.share < 0.2 * (step + 1) or not viewer.saver.is_drawing:
            later(viewer)
        before = viewer.saver.shot.share
        viewer.scene.controller.pose = replace(home, azimuth_deg=home.azimuth_deg + 20 + step)
        if step == 1:
            viewer.settings.change_all(sun=(90.0, 20.0))
        elif step == 2:
            viewer.mouse.press("left", 160, 150)
            viewer.mouse.release("left", 160, 150)
        later(viewer, 0.02)
        assert not viewer.saver.is_drawing and viewer.saver.shot.share == before
    finish(viewer)
    first, second = pictures_of(folder, "hills-001"), pictures_of(folder, "hills-002")
    assert len(first) == 9 and all(np.array_equal(a, b) for a, b in zip(first, second, strict=True))
    set_budget(viewer, swift())
    settle(viewer)
    assert viewer.explainer.explanation
    viewer.explainer.explanation = None
    settle(viewer)
    assert np.array_equal(seen(viewer), drawn_at_once(viewer))  # with the window's own light


def test_a_turn_ends_where_it_began_around_the_middle(viewer, folder, monkeypatch):
    monkeypatch.setattr("terrain_gl.viewer.saver.film_suffix", lambda: "")
    monkeypatch.setattr("terrain_gl.viewer.loops.TURN_S", 0.2)
    settle(viewer)
    controller = viewer.scene.controller
    middle = controller.ground_at(0.0, 0.0)
    press(viewer, "ctrl+r")
    assert "waits while the camera moves" in viewer.progress.text or viewer.saver.shot.share == 0
    finish(viewer)
    path = CameraPath.open("hills-001-path.json")
    assert path.closed and np.allclose(path.keyframes[0].camera.eye, controller.camera.eye)
    for keyframe in path.keyframes:
        camera = keyframe.camera
        assert np.allclose(camera.target, middle) and np.isclose(
            np.linalg.norm(np.subtract(camera.eye, middle)[:2]), np.linalg.norm((controller.eye - middle)[:2])
        )
    pictures = pictures_of(folder, "hills-001")
    assert changed(pictures[0], drawn_at_once(viewer)) == 0 and changed(pictures[3], pictures[0]) > 0.1
    controller.look(0.0, -900.0)  # to the sky
    press(viewer, "ctrl+r")
    assert not viewer.saver.shot and "only sky" in viewer.window.message


def test_a_turn_stays_above_the_land(viewer):
    settle(viewer)
    controller = viewer.scene.controller
    controller.change_mode("walk")
    controller.change_mode("fly")
    controller.elevation_deg = -10.0
    path = turn(viewer.scene)
    eyes = np.array([keyframe.camera.eye for keyframe in path.keyframes])
    ground = ground_m(viewer.scene.heightmap, eyes[:, :2])
    assert (eyes[:, 2] > np.nan_to_num(ground, nan=-1e9)).all()
    assert (controller.eye[2] < np.nanmax(ground)) == (eyes[0, 2] > controller.eye[2] + 1e-6)


@pytest.mark.slow
def test_a_day_is_filmed_from_sunrise_to_sunset(viewer, folder, monkeypatch):
    monkeypatch.setattr("terrain_gl.viewer.saver.film_suffix", lambda: "")
    monkeypatch.setattr("terrain_gl.viewer.loops.DAY_S", 0.2)
    settle(viewer)
    press(viewer, "ctrl+d")
    finish(viewer)
    suns = np.array([keyframe.sun for keyframe in CameraPath.open("hills-001-path.json").keyframes])
    assert (suns[:, 1] > 0).all() and suns[0, 0] < 90 < 270 < suns[-1, 0] and suns[:, 1].max() > 55
    pictures = pictures_of(folder, "hills-001")
    assert changed(pictures[0], pictures[3]) > 0.2
    settle(viewer)
    assert np.array_equal(seen(viewer), drawn_at_once(viewer))


def test_a_film_that_cannot_be_written_gives_a_message(viewer, folder, monkeypatch):
    settle(viewer)
    press(viewer, "r")
    later(viewer, 0.05)
    press(viewer, "r")
    assert not viewer.saver.filming.running and "too short" in viewer.window.message
    monkeypatch.setattr("terrain_gl.viewer.saver.free_path", lambda *_: folder / "nowhere" / "film.mp4")
    fly(viewer)
    assert not viewer.saver.filming.running and not viewer.saver.shot and "nowhere" in viewer.window.message


def test_another_exaggeration_ends_a_picture(viewer, folder):
    settle(viewer)
    set_budget(viewer, slow())
    press(viewer, "p")
    later(viewer)
    viewer.exaggerate(2.0)
    assert not viewer.saver.shot and "exaggeration" in viewer.window.message
    settle(viewer)
    assert list(folder.iterdir()) == [] and light_is_up_to_date(viewer)


def test_another_map_ends_a_recording(viewer, folder):
    settle(viewer)
    press(viewer, "r")
    later(viewer, 0.1)
    viewer.rescale(spacing_m=(20.0, 20.0))
    settle(viewer)
    assert not viewer.saver.filming.running and not list(folder.iterdir())


def test_the_view_is_copied_as_a_command_line(viewer):
    settle(viewer)
    told = []
    viewer.saver.line_of = lambda *view, laid: told.append((*view, laid)) or "terrain-gl shot hills"
    viewer.saver.on_copy = told.append
    press(viewer, "y")
    heightmap, camera, size, drawing, laid = told[0]
    assert (camera, size, drawing) == (viewer.scene.controller.camera, (320, 200), viewer.settings.options)
    assert laid == ()
    assert told[1] == "terrain-gl shot hills" and "shot hills" in viewer.window.message


@pytest.mark.slow
def test_an_exaggerated_map_is_copied_as_a_command_line(viewer, tmp_path):
    heights = np.random.default_rng(3).integers(0, 900, (40, 30)).astype("u2")
    np.save(tmp_path / "land.npy", heights)
    viewer.open(str(tmp_path / "land.npy"))
    settle(viewer)
    viewer.exaggerate(2.7)
    settle(viewer)
    viewer.exaggerate(1.3)
    settle(viewer)
    told = []
    viewer.saver.line_of, viewer.saver.on_copy = command_line, told.append
    press(viewer, "y")
    words = shlex.split(told[0])
    assert words[words.index("--exaggeration") + 1] == "1.3"
    assert float(words[words.index("--eye") + 1].split(",")[2]) == pytest.approx(
        viewer.scene.controller.eye[2] / 1.3, rel=1e-3
    )
    assert np.array_equal(Heightmap.open(words[2]).heights, viewer.scene.heightmap.heights)


def feature(at, **properties):
    kind = "Point" if np.ndim(at) == 1 else "LineString"
    return {"type": "Feature", "properties": properties, "geometry": {"type": kind, "coordinates": at}}


@pytest.fixture
def laid(empty, folder, monkeypatch):
    """A window that shows a map of a file, with lines, a point with a name, contours in feet, and higher relief."""
    write_raster("hills.tif", hills().heights.astype("f4"))
    lon, lat = 15.0081, 45.1475  # the middle of the map
    way = feature([[lon - 0.006, lat], [lon + 0.006, lat + 0.001]], stroke="#ff0000")
    content = {"type": "FeatureCollection", "features": [way, feature([lon, lat - 0.002], peak="Summit")]}
    Path("way.geojson").write_text(json.dumps(content))
    heightmap = Heightmap.open("hills.tif")
    overlay = read_overlay("way.geojson", heightmap, "peak")
    opened = Opened(heightmap, Camera.default(heightmap), key="hills", camera_given=True, overlays=(overlay,))
    empty.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), opened)
    empty.settings.change_all(contour_m=20 * 0.3048, units="ft")
    empty.exaggerate(1.5)
    empty.saver.size = "large"
    monkeypatch.setitem(SIZES, "large", (480, 300))
    settle(empty)
    return empty


@pytest.mark.slow
def test_the_saved_picture_and_that_of_the_copied_command_are_what_is_seen(laid, run):
    assert {"Summit"} < {label.name for label in laid.painter.labels}
    saved(laid)
    told = []
    laid.saver.line_of, laid.saver.on_copy = command_line, told.append
    press(laid, "y")
    assert told, laid.window.message
    words = shlex.split(told[0])
    assert words[words.index("--overlay") + 1] == str(Path("way.geojson").resolve())
    assert words[words.index("--labels") + 1] == "peak"
    assert run(*words[1:])[0] == 0
    picture = load("hills-001.png")
    assert np.array_equal(picture, load("picture.png"))
    laid.scene.renderer.overlays = ()
    laid.painter.forget()
    saved(laid)
    bare = load("hills-002.png")
    label = next(each for each in laid.painter.labels if each.name.endswith(" ft"))
    row, col = round(label.y * 300 / 200), round(label.x * 480 / 320)
    assert np.array_equal(picture[row - 3 : row + 3, col - 5 : col + 5], bare[row - 3 : row + 3, col - 5 : col + 5])
    off = np.abs(picture.astype(int) - bare).max(-1) > 30
    red = np.abs(picture.astype(int) - [255, 0, 0]).max(-1) < 60
    assert red.sum() > 100 and (off & ~red).sum() > 100, "the line, and the name with its ring"


@pytest.mark.slow
def test_a_film_shows_overlays_and_names(laid, monkeypatch):
    monkeypatch.setattr("terrain_gl.viewer.saver.film_suffix", lambda: "")  # pictures
    saved(laid)
    press(laid, "r")
    for _ in range(5):
        later(laid, 0.1)
    press(laid, "r")
    finish(laid)
    frames = [load(path) for path in sorted(Path("hills-001").iterdir())]
    assert len(frames) > 2 and all(np.array_equal(frame, load("hills-001.png")) for frame in frames)


def test_an_overlay_without_a_file_is_told(laid):
    laid.scene.renderer.overlays = tuple(each._replace(path="") for each in laid.scene.opened.overlays)
    laid.saver.line_of = command_line
    press(laid, "y")
    assert "an overlay is in no file" in laid.window.message


@pytest.mark.slow
def test_a_picture_of_any_size_is_what_the_renderer_draws(viewer, folder, monkeypatch):
    monkeypatch.setitem(SIZES, "large", (450, 260))
    viewer.saver.size = "large"
    settle(viewer)
    seen_before = seen(viewer)
    set_budget(viewer, slow())
    press(viewer, "p")
    later(viewer)
    assert viewer.progress == ("drawing hills-001.png", viewer.saver.shot.share, True)
    press(viewer, "escape")
    assert not viewer.saver.shot and not viewer.window.closing and viewer.window.message == "cancelled"
    press(viewer, "b")
    settle(viewer)
    press(viewer, "p")
    later(viewer)
    viewer.mouse.press("left", 160, 150)
    viewer.mouse.release("left", 160, 150)
    assert not viewer.saver.shot and "map has changed" in viewer.window.message and not list(folder.iterdir())
    press(viewer, "ctrl+z")
    press(viewer, "b")
    settle(viewer)
    for split in (False, True):
        if split:
            press(viewer, "t")
            viewer.settings.sides = [FrameOptions(), FrameOptions(style="normals")]
            viewer.settings.divider = 0.4
        press(viewer, "p")
        while viewer.saver.shot:
            later(viewer)
        viewer.saver.join()
    whole, parts = (load(folder / f"hills-00{i}.png") for i in (1, 2))
    with Renderer(viewer.scene.renderer.heightmap, (450, 260), ctx=viewer.ctx) as renderer:
        shaded, normals = (
            renderer.render(viewer.scene.controller.camera, style=style).image[..., :3]
            for style in ("shaded", "normals")
        )
    assert np.array_equal(whole, shaded)
    assert np.array_equal(parts, np.concatenate([shaded[:, :180], normals[:, 180:]], 1))
    numbers = json.loads((folder / "hills-002.json").read_text())
    assert [side["width"] for side in numbers] == [450, 450] and numbers[0]["triangles"] > 100
    press(viewer, "t")
    set_budget(viewer, swift())
    viewer.window.message = ""
    settle(viewer)
    assert changed(seen(viewer)[:, 250:], seen_before[:, 250:]) == 0


@pytest.mark.parametrize("ending", FORMATS)
def test_the_mesh_is_saved_as_it_is_drawn(viewer, folder, ending):
    settle(viewer)
    set_budget(viewer, slow())
    viewer.scene.controller.look(40, 0)
    later(viewer)  # what is seen is coarse
    viewer.saver.mesh_format = ending
    press(viewer, "o")
    viewer.saver.join()
    told = int(viewer.window.message.split(": ")[1].split()[0].replace(",", ""))
    content = (folder / f"hills-001{ending}").read_bytes()
    settle(viewer)
    assert told == viewer.painter.frame.stats["triangles"]
    if ending == ".ply":
        assert f"element face {told}\n".encode() in content
    elif ending == ".obj":
        assert content.count(b"\nf ") == told
    viewer.scene.controller.look(0, -10000)  # the sky
    press(viewer, "o")
    assert "no triangles" in viewer.window.message


def test_a_saved_mesh_has_no_triangle_over_a_void_that_is_drawn_as_a_hole(empty, folder):
    heights = np.add.outer(np.sin(np.arange(60) / 9.0), np.cos(np.arange(80) / 7.0)) * 20
    heights[20:30, 20:50] = np.nan
    heightmap = Heightmap(heights, 5.0, "gap")
    empty.show(Renderer(heightmap, (320, 200), ctx=empty.ctx), Opened(heightmap, Camera.default(heightmap)))
    empty.settings.change_all(style="lambert", max_error_px=0.01)
    empty.saver.mesh_format = ".obj"
    covered = []
    for voids in ("fill", "hole"):
        empty.settings.change_all(voids=voids)
        press(empty, "o")
        empty.saver.join()
        lines = [line.split() for line in sorted(folder.glob("*.obj"))[-1].read_text().splitlines()]
        at = np.array([line[1:3] for line in lines if line[0] == "v"], float)
        corners = at[np.array([[c.split("/")[0] for c in line[1:]] for line in lines if line[0] == "f"], int) - 1]
        middle = corners.mean(1) / 5
        covered.append(((middle > (20, 30)) & (middle < (49, 39))).all(1).sum())
    assert covered[0] > 0 == covered[1]


def test_bookmarks_become_a_path(viewer, folder):
    press(viewer, "k")
    assert "bookmarks" in viewer.window.message and not list(folder.iterdir())
    press(viewer, "ctrl+2")
    viewer.scene.controller.look(200, 0)
    press(viewer, "ctrl+1")
    press(viewer, "k")
    path = CameraPath.open("hills-001-path.json")
    assert [frame.camera.eye for frame in path.keyframes] == [viewer.scene.bookmarks[n]["view"]["eye"] for n in (1, 2)]
    assert "fly MAP --path hills-001-path.json" in viewer.window.message  # these hills have no file
    viewer.scene.opened = replace(viewer.scene.opened, key="alpine")
    press(viewer, "k")
    assert "fly alpine --path hills-002-path.json -o" in viewer.window.message
    viewer.exaggerate(2.5)
    press(viewer, "k")
    assert "--path hills-003-path.json --exaggeration 2.5 -o" in viewer.window.message
    eyes = [frame.camera.eye for frame in CameraPath.open("hills-003-path.json").keyframes]
    assert np.array(eyes) == pytest.approx(np.array([frame.camera.eye for frame in path.keyframes]))  # true heights


def test_a_saved_picture_of_errors_has_its_bar_of_colours(viewer, folder):
    """In the window, the panel's legend takes its place."""
    viewer.settings.change(style="error")
    settle(viewer)
    viewer.window.message = ""
    press(viewer, "p")
    while not viewer.window.message:
        later(viewer)
        viewer.saver.join()
    shown = drawn_at_once(viewer)
    with Renderer(viewer.scene.heightmap, viewer.window.size) as renderer:
        own = renderer.render(viewer.scene.controller.camera, **vars(viewer.settings.options)).image[..., :3]
    assert np.array_equal(load(folder / "hills-001.png"), own)
    assert not np.array_equal(shown, own)
