"""Pictures, meshes, films, maps, command lines and camera paths that are saved."""

import json
import shlex
import shutil
from dataclasses import replace

import numpy as np
import pytest
from viewers import changed, drawn_at_once, later, load, seen, set_budget, settle, slow, swift

from terrain_gl.cli.line import command_line
from terrain_gl.files.export import FORMATS
from terrain_gl.film.path import CameraPath
from terrain_gl.heightmap import Heightmap
from terrain_gl.options import RenderOptions
from terrain_gl.renderer import Renderer
from terrain_gl.viewer.commands import press
from terrain_gl.viewer.saver import SIZES, free_path


def test_the_picture_is_saved_without_panels_beside_earlier_ones(viewer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        viewer.window.message = ""
        press(viewer, "p")
        while not viewer.window.message:
            later(viewer)
            viewer.saver.join()
    assert sorted(path.name for path in tmp_path.glob("*.png")) == ["hills-001.png", "hills-002.png"]
    assert np.array_equal(load(tmp_path / "hills-001.png"), drawn_at_once(viewer))
    assert json.loads((tmp_path / "hills-001.json").read_text())["triangles"] == viewer.painter.frame.stats["triangles"]
    assert (tmp_path / "hills-001.png").read_bytes() == (tmp_path / "hills-002.png").read_bytes()
    assert free_path("x/hills.tif").name == "hills-003.png"
    assert f"saved {tmp_path.resolve() / 'hills-002.png'}" in viewer.window.message


def test_a_picture_that_cannot_be_saved_gives_a_message(viewer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    shutil.rmtree(tmp_path)
    settle(viewer)
    press(viewer, "p")
    while not viewer.window.message:
        later(viewer)
        viewer.saver.join()
    assert "saved" not in viewer.window.message


@pytest.mark.parametrize("suffix", [".tif", ".png", ".exr"])
def test_the_land_is_saved_and_opens_again(viewer, tmp_path, suffix):
    settle(viewer)
    viewer.exaggerate(2.0)
    settle(viewer)
    heights = viewer.scene.renderer.heightmap.heights / 2
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


def test_a_film_is_recorded(viewer, tmp_path, monkeypatch):
    pytest.importorskip("av", reason="the extra [video] is not installed")
    monkeypatch.chdir(tmp_path)
    settle(viewer)
    press(viewer, "r")
    viewer.scene.controller.press("d")
    for _ in range(12):
        later(viewer, 0.1)
    viewer.scene.controller.let_go_all()
    press(viewer, "r")
    viewer.saver.filming.join()
    import av

    with av.open(str(tmp_path / "hills-001.mp4")) as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
    assert len(frames) > 5 and frames[0].shape == (200, 320, 3)
    assert changed(frames[-1].astype(int), frames[0].astype(int)) > 0.01


def test_a_film_that_cannot_be_written_gives_a_message(viewer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    settle(viewer)
    monkeypatch.setattr("terrain_gl.viewer.saver.free_path", lambda *_: tmp_path / "nowhere" / "film.mp4")
    press(viewer, "r")
    for _ in range(5):
        later(viewer)
    assert not viewer.saver.filming.running and viewer.window.message
    monkeypatch.setattr("terrain_gl.viewer.saver.free_path", lambda *_: tmp_path / "pictures")
    press(viewer, "r")
    later(viewer)
    viewer.window.resize((300, 180))  # a film has one size
    for _ in range(5):
        later(viewer)
    assert not viewer.saver.filming.running and "ended" in viewer.window.message


def test_the_view_is_copied_as_a_command_line(viewer):
    settle(viewer)
    told = []
    viewer.saver.line_of = lambda *view: told.append(view) or "terrain-gl shot hills"
    viewer.saver.on_copy = told.append
    press(viewer, "y")
    heightmap, camera, size, drawing = told[0]
    assert (camera, size, drawing) == (viewer.scene.controller.camera, (320, 200), viewer.settings.options)
    assert told[1] == "terrain-gl shot hills" and "shot hills" in viewer.window.message


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
    assert words[words.index("--z-scale") + 1] == "1.3"
    again = Heightmap.open(words[2], z_scale=1.3)
    assert np.array_equal(again.heights, viewer.scene.renderer.heightmap.heights) and again.heights.max() > 1000


def test_a_picture_of_any_size_is_what_the_renderer_draws(viewer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
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
    assert not viewer.saver.shot and "map has changed" in viewer.window.message and not list(tmp_path.iterdir())
    press(viewer, "ctrl+z")
    press(viewer, "b")
    settle(viewer)  # unused headroom is given back
    for split in (False, True):
        if split:
            press(viewer, "t")
            viewer.settings.sides[1] = RenderOptions(style="normals")
            viewer.settings.divider = 0.4
        press(viewer, "p")
        while viewer.saver.shot:
            later(viewer)
        viewer.saver.join()
    whole, parts = (load(tmp_path / f"hills-00{i}.png") for i in (1, 2))
    with Renderer(viewer.scene.renderer.heightmap, (450, 260), ctx=viewer.ctx) as renderer:
        shaded, normals = (
            renderer.render(viewer.scene.controller.camera, style=style).image[..., :3]
            for style in ("shaded", "normals")
        )
    assert np.array_equal(whole, shaded)
    assert np.array_equal(parts, np.concatenate([shaded[:, :180], normals[:, 180:]], 1))
    numbers = json.loads((tmp_path / "hills-002.json").read_text())
    assert [side["width"] for side in numbers] == [450, 450] and numbers[0]["triangles"] > 100
    press(viewer, "t")
    set_budget(viewer, swift())
    viewer.window.message = ""
    settle(viewer)
    assert changed(seen(viewer)[:, 250:], seen_before[:, 250:]) == 0


@pytest.mark.parametrize("ending", FORMATS)
def test_the_mesh_is_saved_as_it_is_drawn(viewer, tmp_path, monkeypatch, ending):
    monkeypatch.chdir(tmp_path)
    settle(viewer)
    set_budget(viewer, slow())
    viewer.scene.controller.look(40, 0)
    later(viewer)  # what is seen is coarse
    viewer.saver.mesh_format = ending
    press(viewer, "o")
    viewer.saver.join()
    told = int(viewer.window.message.split(": ")[1].split()[0].replace(",", ""))
    content = (tmp_path / f"hills-001{ending}").read_bytes()
    settle(viewer)
    assert told == viewer.painter.frame.stats["triangles"]
    if ending == ".ply":
        assert f"element face {told}\n".encode() in content
    elif ending == ".obj":
        assert content.count(b"\nf ") == told
    viewer.scene.controller.look(0, -10000)  # the sky
    press(viewer, "o")
    assert "no triangles" in viewer.window.message


def test_bookmarks_become_a_path(viewer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    press(viewer, "k")
    assert "bookmarks" in viewer.window.message and not list(tmp_path.iterdir())
    press(viewer, "ctrl+2")
    viewer.scene.controller.look(200, 0)
    press(viewer, "ctrl+1")
    press(viewer, "k")
    path = CameraPath.open("hills-001-path.json")
    assert [frame.camera.eye for frame in path.keyframes] == [viewer.scene.controller.bookmarks[n].eye for n in (1, 2)]
    assert "fly MAP --path hills-001-path.json" in viewer.window.message  # these hills have no file
    viewer.scene.opened = replace(viewer.scene.opened, key="alpine")
    press(viewer, "k")
    assert "fly alpine --path hills-002-path.json" in viewer.window.message
