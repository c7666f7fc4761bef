"""Files that are dropped on the window: layers in the picture, in saved pictures, in another order and colour."""

import json
import shlex

import numpy as np
import pytest
from rasters import write_raster
from viewers import hills, load, seen, settle, texts

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.camera import Camera
from terrain_gl.cli.line import command_line
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import write_image
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.photos import photo_in
from terrain_gl.viewer.loading import Opened
from terrain_gl.viewer.memory import Memory
from terrain_gl.viewer.state import checked

GREEN = (0, 255, 0, 255)


@pytest.fixture
def drop(app, tmp_path, monkeypatch):
    """Drop a line across the map, from west to east, in metres from its corner."""
    monkeypatch.chdir(tmp_path)

    def dropped(name, north_m, **properties):
        line = {"type": "LineString", "coordinates": [[100, north_m], [1200, north_m]]}
        feature = {"type": "Feature", "geometry": line, "properties": properties}
        (tmp_path / name).write_text(json.dumps({"type": "FeatureCollection", "crs": None, "features": [feature]}))
        app.drop(str(tmp_path / name), 600, 300)
        app.frame(app.viewer.window.now_s + 1)  # it begins to read
        app.viewer.layers.join()
        settle(app)
        return app.viewer.layers.layers[-1]

    return dropped


def share(picture, colour):
    """Share of the pixels that have about a colour."""
    return (np.abs(picture - np.array(colour[:3])).max(-1) < 60).mean()


def test_a_dropped_file_is_a_layer_that_can_be_switched_coloured_and_removed(app, drop):
    plain = seen(app)
    layer = drop("way.geojson", 600)
    assert app.viewer.scene.opened.key == "hills" and "--trust" not in texts(app)  # the map stays
    assert share(seen(app), layer.colour) > share(plain, layer.colour) + 2e-4
    app.viewer.layers.toggle(layer)
    settle(app)
    assert share(seen(app), layer.colour) == pytest.approx(share(plain, layer.colour), abs=1e-5)
    app.viewer.layers.toggle(layer)
    app.viewer.layers.paint(layer, GREEN)
    settle(app)
    assert share(seen(app), GREEN) > share(plain, GREEN) + 2e-4
    app.panels.opened["Layers"] = True
    assert "way.geojson" in texts(app)
    app.viewer.layers.remove(layer)
    settle(app)
    assert "way.geojson" not in texts(app) and not app.viewer.scene.renderer.overlays


def test_the_last_layer_is_on_top_until_it_is_lowered(app, drop):
    first, second = drop("a.geojson", 600), drop("b.geojson", 600)
    assert first.colour != second.colour
    over = share(seen(app), second.colour)
    app.viewer.layers.lower(second)
    settle(app)
    assert app.viewer.layers.layers == [second, first]
    assert share(seen(app), second.colour) < 0.5 * over


def test_a_layer_is_in_the_saved_picture(app, drop, tmp_path):
    layer = drop("way.geojson", 600, stroke="#00ff00")
    assert share(seen(app), GREEN) > 2e-4  # the file's own colour
    app.viewer.layers.toggle(layer)
    app.press("p")
    settle(app)
    app.viewer.layers.toggle(layer)
    settle(app)
    app.press("p")
    settle(app)
    without, with_it = (load(tmp_path / f"hills-00{i}.png") for i in (1, 2))
    assert share(with_it, GREEN) > share(without, GREEN) + 2e-4


def test_a_file_that_is_no_layer_is_told_in_a_line_and_layers_follow_the_scale(app, drop, tmp_path):
    layer = drop("way.geojson", 600)
    (tmp_path / "bad.gpx").write_text("no track")
    app.viewer.open(str(tmp_path / "bad.gpx"))
    app.frame(app.viewer.window.now_s + 1)
    app.viewer.layers.join()
    app.frame(app.viewer.window.now_s + 1)
    assert "bad.gpx" in app.viewer.window.message and app.viewer.layers.layers == [layer]
    heights = app.viewer.scene.heightmap.heights
    wider = Heightmap(heights, 20.0, "hills")
    before = layer.overlay.lines[0]
    opened = Opened(wider, app.viewer.scene.opened.camera, key="hills")
    app.viewer.show(Renderer(wider, (320, 200), ctx=app.viewer.ctx), opened)
    app.frame(app.viewer.window.now_s + 1)
    app.viewer.layers.join()
    settle(app)
    assert np.ptp(layer.overlay.lines[0][:, 0]) == pytest.approx(0.5 * np.ptp(before[:, 0]))
    app.viewer.show(Renderer(wider, (320, 200), ctx=app.viewer.ctx), Opened(wider, opened.camera, key="another"))
    assert not app.viewer.layers.layers


def test_a_photo_is_a_layer_of_the_ground_and_a_file_that_is_none_is_not(app, tmp_path):
    write_image(tmp_path / "photo.jpg", np.full((32, 32, 3), (200, 30, 30), np.uint8))
    (tmp_path / "bad.jpg").write_text("no picture")

    def laid(name):
        app.drop(str(tmp_path / name), 600, 300)
        app.viewer.images.join()
        settle(app)
        return [layer.name for layer in app.viewer.layers.layers]

    app.viewer.settings.change(style="shaded")
    settle(app)
    plain = seen(app)
    assert laid("photo.jpg") == ["photo.jpg"] and "no place (GPS)" in " ".join(app.viewer.window.said)
    red = seen(app)
    assert (red[..., 0] - red[..., 1]).mean() > (plain[..., 0] - plain[..., 1]).mean() + 10
    app.viewer.layers.toggle(app.viewer.layers.layers[0])
    app.viewer.images.join()
    settle(app)
    assert np.abs(seen(app) - plain).mean() < 1
    assert laid("bad.jpg") == [] and "bad.jpg" in app.viewer.window.message


def picture(app):
    """The picture without panels."""
    app.viewer.draw()
    return seen(app)


def arranged(app, drop):
    """Three layers over hills: the second one painted and lowered, the third one hidden."""
    first, second, third = drop("a.geojson", 600), drop("b.geojson", 604, stroke="#00ff00"), drop("c.geojson", 900)
    app.viewer.layers.paint(second, (255, 0, 255, 255))
    app.viewer.layers.lower(second)
    app.viewer.layers.toggle(third)
    settle(app)
    return first, second, third


def test_a_bookmark_brings_the_layers_back(app, drop, tmp_path):
    first, second, third = arranged(app, drop)
    was = picture(app)
    app.press("ctrl+4")
    kept = app.viewer.scene.bookmarks[4]
    memory = Memory(tmp_path / "view.json")
    memory.note_map("hills", app.viewer.scene.controller.pose, {4: kept}, "auto")
    memory.save()
    again = Memory(tmp_path / "view.json").bookmarks("hills")[4]
    layers = app.viewer.layers
    layers.remove(second)
    layers.paint(first, (0, 255, 255, 255))
    layers.toggle(third)
    drop("d.geojson", 300)
    assert np.abs(picture(app) - was).max() > 60
    app.viewer.scene.bookmarks[4] = again
    app.press("4")
    app.frame(app.viewer.window.now_s + 1)  # it begins to read
    layers.join()
    settle(app)
    named = [(each.name, each.is_shown) for each in layers.layers]
    assert named == [("b.geojson", True), ("a.geojson", True), ("c.geojson", False), ("d.geojson", False)]
    assert np.array_equal(picture(app), was)


def test_a_wrong_layer_in_a_state_is_told():
    for layer, words in (({"path": "a", "colour": "greenish"}, "greenish"), ({"path": 3, "colour": "#ffffff"}, "path")):
        with pytest.raises(UsageError, match=words):
            checked({"layers": [layer]}, "here")


@pytest.mark.slow
def test_the_copied_command_draws_the_layers(app, drop, run, tmp_path):
    np.save("hills.npy", hills().heights.astype("f4"))
    heightmap = Heightmap.open("hills.npy", spacing_m=10.0)
    opened = Opened(heightmap, Camera.default(heightmap), key="hills.npy", camera_given=True)
    app.viewer.show(Renderer(heightmap, (320, 200), ctx=app.viewer.ctx), opened)
    arranged(app, drop)
    told = []
    app.viewer.saver.line_of, app.viewer.saver.on_copy = command_line, told.append
    app.press("p")
    settle(app)
    app.press("y")
    words = shlex.split(told[0])
    assert run(*words[1:])[0] == 0
    saved = load(tmp_path / "hills-001.png")
    assert share(saved, (255, 0, 255)) > 1e-4  # the painted layer
    assert np.array_equal(saved, load(tmp_path / "picture.png"))
    plain = [word for i, word in enumerate(words) if "--overlay-colour" not in (word, words[i - 1])]
    assert run(*plain[1:])[0] == 0
    assert not np.array_equal(saved, load(tmp_path / "picture.png"))


def write_photo(path, lon, lat, **tags):
    """A JPEG file with GPS tags."""
    oiio = pytest.importorskip("OpenImageIO")
    spec = oiio.ImageSpec(16, 12, 3, "uint8")
    for axis, angle, sides in (("Longitude", lon, "EW"), ("Latitude", lat, "NS")):
        minutes = 60 * (abs(angle) % 1)
        spec.attribute(f"GPS:{axis}Ref", sides[angle < 0])
        parts = int(abs(angle)), int(minutes), 60 * (minutes % 1)
        spec.attribute(f"GPS:{axis}", oiio.TypeDesc("float[3]"), parts)
    for name, value in tags.items():
        spec.attribute(f"GPS:{name}", oiio.TypeDesc("float"), value)
    file = oiio.ImageOutput.create(str(path))
    file.open(str(path), spec)
    file.write_image(np.zeros((12, 16, 3), np.uint8))
    file.close()


@pytest.mark.slow
def test_a_photo_with_a_place_is_a_marker_with_its_name_and_direction(app, run, tmp_path, monkeypatch):
    pytest.importorskip("rasterio")
    monkeypatch.chdir(tmp_path)
    write_raster("hills.tif", hills().heights.astype("f4"))
    lon, lat = 15.0081, 45.1475  # the middle of the map
    write_photo("summit.jpg", lon, lat, ImgDirection=90.0)
    heightmap = Heightmap.open("hills.tif")
    opened = Opened(heightmap, Camera.default(heightmap), key="hills.tif", camera_given=True)
    app.viewer.show(Renderer(heightmap, (320, 200), ctx=app.viewer.ctx), opened)
    settle(app)
    plain = picture(app)
    app.drop("summit.jpg", 600, 300)
    app.frame(app.viewer.window.now_s + 1)  # it begins to read
    app.viewer.layers.join()
    settle(app)
    (layer,) = app.viewer.layers.layers
    assert not layer.is_image and not app.viewer.settings.options.material
    (col, row), line = layer.overlay.points[0], layer.overlay.lines[0]
    assert line[0] == pytest.approx((col, row)) and line[-1][0] > col + 5  # to the east
    assert "summit.jpg" in {label.name for label in app.viewer.painter.labels}
    assert share(picture(app), layer.colour) > share(plain, layer.colour)
    told = []
    app.viewer.saver.line_of, app.viewer.saver.on_copy = command_line, told.append
    app.press("p")
    settle(app)
    app.press("y")
    assert run(*shlex.split(told[0])[1:])[0] == 0
    assert np.array_equal(load("hills-001.png"), load("picture.png"))
    write_photo("south.jpg", -lon, -lat)
    (place,) = [each for each in photo_in("south.jpg")["features"]]
    assert place["geometry"]["coordinates"] == pytest.approx([-lon, -lat], abs=1e-4)
