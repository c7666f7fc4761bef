"""Pictures without land, overlays without a pixel and options without effect: one line reports each."""

import json
from pathlib import Path

import numpy as np
import pytest
from commands import parse
from rasters import spaced, write_raster

import terrain_gl as tg
from terrain_gl.cli import effects
from terrain_gl.cli.scene import open_scene

SHOT = ("shot", "dem.tif", "--size", "64x36", "--style", "lambert", "-o", "a.png")
WEST, NORTH, STEP = 500_000.0, 5_000_000.0, 10.0


@pytest.fixture(autouse=True)
def dem(folder):
    """A hill of 20 to 80 m on 41 × 61 posts of 10 m, in a zone of UTM."""
    y, x = np.mgrid[0:61, 0:41]
    heights = 20 + 60 * np.exp(-((x - 20.0) ** 2 + (y - 30.0) ** 2) / 90)
    write_raster("dem.tif", heights.astype("f4"), spaced(STEP, WEST - STEP / 2, NORTH + STEP / 2), "EPSG:32632")
    return folder


def notes(result):
    code, _, told = result
    assert code == 0, told
    return [line.removeprefix("terrain-gl: note: ") for line in told.splitlines()]


def test_a_picture_of_the_map_needs_no_note(run):
    assert notes(run(*SHOT)) == []


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--style", "normals", "--look", "arid"), "--look: without effect in the style normals"),
        (("--water", "5"), "--water: without effect in the style lambert"),
        (("--contours", "500"), "--contours: no line, because no multiple of 500 m lies between 20"),
        (("--voids", "hole"), "--voids hole: without effect, because the map has no voids"),
        (("--refraction", "0.13"), "--refraction: without effect, because the map is drawn flat"),
        (("--time", "2026-01-01T12:00", "--longitude", "8"), "--longitude: without effect"),
        (("--style", "cracks"), "--style cracks: patches do not agree on edges; nothing is certified"),
        (("--sun", "90,-20"), "no note"),
    ],
)
def test_an_option_without_effect_is_told(run, words, told):
    found = notes(run(*SHOT, *words))
    assert len(found) == (told != "no note") and all(told in note for note in found)


def test_water_below_the_land_and_night_are_told():
    asked = parse(*SHOT, "--style", "shaded", "--water", "5", "--sun", "90,-20")
    found = list(effects._without_effect(asked, open_scene(asked)))
    assert "--water 5: without effect" in found[0] and "20 degrees under the horizon" in found[1] and len(found) == 2


def test_contour_lines_that_exist_need_no_note(run):
    assert notes(run(*SHOT, "--contours", "50")) == [] and notes(run(*SHOT, "--contours", "auto")) == []


def test_a_picture_without_land_says_so_and_how_to_name_map_coordinates(run):
    (note,) = notes(run(*SHOT, "--eye", "500200,4999000,400", "--target", "500200,4999600,0"))
    assert "no land is in the picture: the eye is" in note and "km from the map" in note
    assert "add --coordinates map" in note
    (note,) = notes(run(*SHOT, "--eye", "900200,4999000,400", "--target", "900200,4999600,0"))
    assert "add --coordinates map" not in note and "metres from its south-west post" in note
    (note,) = notes(run(*SHOT, "--eye", "200,300,300", "--target", "200,300,900"))
    assert "looks away" in note and "400,600" in note


def test_map_coordinates_are_the_same_view(run):
    assert notes(run(*SHOT, "--eye", "200,-400,400", "--target", "200,200,0")) == []
    first = Path("a.png").read_bytes()
    in_map = ("--eye", "500200,4999000,400", "--target", "500200,4999600,0", "--coordinates", "map")
    assert notes(run(*SHOT, *in_map)) == []
    assert Path("a.png").read_bytes() == first
    code, _, told = run("shot", "alpine", "--size", "64x36", "-o", "b.png", *in_map)
    assert code == 2 and "does not say where it lies" in told


def overlay(name, *lonlats):
    kind = {"type": "LineString", "coordinates": lonlats}
    with open(name, "w", encoding="utf-8") as file:
        json.dump(kind, file)
    return "--overlay", name


def test_overlays_that_are_not_seen_say_so(run):
    to_degrees = tg.Heightmap.open("dem.tif").place.to_lonlat
    here = [to_degrees(x, y) for x, y in ((100.0, 200.0), (300.0, 400.0))]
    seen = overlay("seen.json", *here)
    behind = overlay("behind.json", *[to_degrees(x, y) for x, y in ((10.0, 10.0), (390.0, 10.0))])
    away = overlay("away.json", (20, 50), (21, 50))
    none = overlay("none.json")
    camera = ("--eye", "200,100,200", "--target", "200,400,40")
    found = notes(run(*SHOT, *camera, *seen, *behind, *away, *none, "--json", "a.json"))
    assert found == [
        "away.json: lies off the map (GeoJSON has longitudes before latitudes), so nothing of it is drawn",
        "none.json: has no lines and no points, so nothing of it is drawn",
        "behind.json: nothing of it is in the picture: turn the camera to it",
    ]
    with open("a.json", encoding="utf-8") as file:
        samples = json.load(file)["overlay_samples"]
    assert samples[0] > 0 and samples[1:] == [0, 0, 0]
    assert "are not in a picture of floats" in notes(run(*SHOT[:-1], "a.exr", *camera, *seen))[0]


def test_a_film_counts_frames_without_land(run):
    eyes = [{"eye": [200, -100, 200], "target": target} for target in ([200, 300, 20], [200, -900, 500])]
    with open("path.json", "w", encoding="utf-8") as file:
        json.dump({"keyframes": eyes}, file)
    away = overlay("away.json", (20, 50), (21, 50))
    words = "fly", "dem.tif", "--path", "path.json", "--seconds", "1", "--fps", "2", "--size", "64x36"
    code, out, told = run(*words, "--style", "lambert", *away, "-o", "film/")
    assert code == 0 and "1 frames show no land" in out, (out, told)
    assert told.count("away.json: lies off the map") == 1
