"""Names of points: they are beside the points that a picture shows; land in front of a point hides its name."""

import json

import numpy as np
import pytest
from rasters import write_raster

import terrain_gl as tg
from terrain_gl.camera.pieces import cut
from terrain_gl.cli import shot
from terrain_gl.files.furniture import name_stamps
from terrain_gl.image import read_image
from terrain_gl.renderer import names, renderer
from terrain_gl.renderer.overlay import Overlay, read_overlay

SIZE = (160, 90)
POINTS = {"front": (32, 50), "behind": (32, 14), "top": (32, 32), "beside": (52, 14), "off": (900, 3)}
FRONT = tg.Camera((320.0, -300.0, 130.0), (320.0, 320.0, 60.0), 45.0)


def hill():
    """A hill on a plain, high enough to hide what is behind it."""
    y, x = np.mgrid[0:65, 0:65]
    return tg.Heightmap((200 * np.exp(-((x - 32) ** 2 + (y - 32) ** 2) / 60)).astype("f4"), 10.0)


def named():
    return Overlay((), np.array(list(POINTS.values()), float), tuple(POINTS))


def seen(r, camera, **options):
    r.render(camera, 1.0, style="lambert", **options)
    return {label.name: (label.x, label.y) for label in r.labels()}


def test_land_hides_names_behind_it(ctx, monkeypatch):
    with tg.Renderer(hill(), SIZE, ctx=ctx) as r:
        assert r.labels() == []
        r.overlays = (named(), Overlay((), np.array([[1.0, 60.0]])))  # the other has no names
        found = seen(r, FRONT)
        assert set(found) == {"front", "top", "beside"}
        assert found["front"][0] == pytest.approx(80, abs=1) and found["top"][1] < found["front"][1] - 15
        assert set(seen(r, tg.Camera((320.0, 940.0, 130.0), (320.0, 320.0, 60.0)))) == {"behind", "top", "beside"}
        assert set(seen(r, tg.Camera((320, 320, 900), (320, 320, 0), 45.0))) == {"front", "behind", "top", "beside"}
        high = seen(r, FRONT, exaggeration=1.3)
        assert high["top"][1] != pytest.approx(found["top"][1], abs=1) and "behind" not in high
        monkeypatch.setattr(names, "_SLACK", 0.0)
        assert "behind" in seen(r, FRONT)  # without the test of depths


def test_the_property_is_chosen_and_points_without_it_have_no_name():
    parts = [({"name": " Big \n Hill", "ele": 1234}, [100.0, 20.0]), ({"ele": 7.5}, [50.0, 60.0]), (None, [1.0, 1.0])]
    features = [{"type": "Feature", "properties": p, "geometry": {"type": "Point", "coordinates": c}} for p, c in parts]
    source = {"type": "FeatureCollection", "features": features}

    class Geo:
        __geo_interface__ = source

    assert read_overlay(Geo(), hill()).names == ("Big Hill", "", "")
    assert read_overlay(Geo(), hill(), "ele").names == ("1234", "7.5", "")


def test_names_that_would_cover_each_other_are_left_out():
    stamps = name_stamps((640, 360), [("one", 100, 100, False), ("two", 104, 102, False), ("three", 300, 100, False)])
    assert len(stamps) == 2 and stamps[0].top > 100 and stamps[1].left > 300


def test_pictures_in_pieces_and_films_have_names(folder, monkeypatch, run):
    pytest.importorskip("pyproj", reason="the extra [geo] is not installed")
    write_raster("hill.tif", hill().heights, crs="EPSG:32632")
    at = [[500_005 + 10 * x, 4_999_995 - 10 * y] for x, y in POINTS.values()]
    features = [
        {"type": "Feature", "properties": {"name": name}, "geometry": {"type": "Point", "coordinates": place}}
        for name, place in zip(POINTS, at, strict=True)
    ]
    crs = {"type": "name", "properties": {"name": "EPSG:32632"}}
    (folder / "p.json").write_text(json.dumps({"type": "FeatureCollection", "crs": crs, "features": features}))
    view = ("--eye", "320,-300,130", "--target", "320,320,60", "--fov", "45", "--size", "160x90", "--style", "lambert")
    over = ("shot", "hill.tif", *view, "--overlay", "p.json", "-o")
    assert run(*over, "named.png")[0] == 0
    assert run(*over, "bare.png", "--labels", "none")[0] == 0
    whole, bare = read_image("named.png").astype(int), read_image("bare.png").astype(int)
    rows, _ = np.nonzero((whole != bare).any(-1))
    assert len(rows) > 200 and whole[rows.min() : rows.max()].max() > 250  # panels with white ink
    monkeypatch.setattr(renderer, "cut", lambda size, fine: cut(size, fine, 64))
    monkeypatch.setattr(shot, "LARGEST", 64)
    assert run(*over, "pieces.png")[0] == 0
    assert (np.abs(read_image("pieces.png").astype(int) - whole).max(-1) > 8).mean() < 0.01
