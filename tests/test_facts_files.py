"""What pixels show, as files beside pictures of `shot` and `fly`: the same as `Frame.facts`."""

import json
import os
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from commands import refused, small_map

import terrain_gl as tg
from terrain_gl.camera import pieces
from terrain_gl.cli import frames, shot
from terrain_gl.renderer import renderer
from terrain_gl.renderer.facts import KINDS

VIEW = ("--size", "96x64", "--eye=40,-60,60", "--target=50,40,10", "--fov", "60", "--water", "2", "--spacing", "1")
NAMES = {"depth", "places", "normals", "kind"}


@pytest.fixture
def truth(folder):
    """The facts of the view, from the API."""
    heightmap = tg.Heightmap.open(small_map(), 1.0)
    with tg.Renderer(heightmap, (96, 64)) as renderer:
        camera = tg.Camera((40, -60, 60), (50, 40, 10), 60)
        facts = renderer.render(camera, 1.0, water_m=2.0).facts
    assert {KINDS[kind] for kind in np.unique(facts.kind)} >= {"sky", "land", "water", "surroundings"}
    return facts


def read(path):
    """The arrays of a file, by their names in `Facts`."""
    if str(path).endswith(".npz"):
        with np.load(path) as file:
            return dict(file)
    file = oiio.ImageInput.open(str(path))
    assert file, oiio.geterror()
    names = file.spec().channelnames
    found = dict(zip(names, np.moveaxis(file.read_image("float"), -1, 0), strict=True))
    places, normals = (np.stack([found[f"{letter}.{axis}"] for axis in "XYZ"], -1) for letter in "PN")
    return {"depth": found["Z"], "places": places, "normals": normals, "kind": found["kind"]}


@pytest.mark.parametrize("ending", ["npz", "exr"])
def test_a_shot_has_the_facts_of_its_frame_beside_it(run, truth, ending):
    assert run("shot", "dem.npy", *VIEW, "-o", "a.png", "--facts", ending)[0] == 0
    assert sorted(os.listdir()) == sorted(["a.png", f"a.{ending}", "dem.npy"])
    found = read(f"a.{ending}")
    assert found.keys() == NAMES
    for name in NAMES:
        expected = getattr(truth, name)
        if ending == "npz":
            assert found[name].dtype == expected.dtype
        np.testing.assert_array_equal(found[name], expected.astype(found[name].dtype), name)


def test_a_picture_in_pieces_has_its_facts_in_one_file(run, truth, monkeypatch):
    monkeypatch.setattr(renderer, "cut", lambda size, fine: pieces.cut(size, fine, 40))
    monkeypatch.setattr(shot, "LARGEST", 40)
    assert run("shot", "dem.npy", *VIEW, "-o", "a.png", "--facts", "npz")[0] == 0
    found = read("a.npz")
    same = found["kind"] == truth.kind
    assert same.mean() > 0.995  # samples on a boundary may fall to the other side
    both = same & np.isfinite(truth.depth)
    np.testing.assert_allclose(found["depth"][both], truth.depth[both], rtol=0.02)
    assert np.median(np.abs(found["depth"][both] - truth.depth[both])) < 1e-3


@pytest.mark.slow
@pytest.mark.parametrize("workers", [(), ("--workers", "2")])
def test_a_flight_has_facts_for_each_picture_and_continues(run, folder, workers):
    words = ("fly", small_map(), "--size", "64x48", "--fps", "3", "--seconds", "1", "-o", "film/", "--facts", "npz")
    assert run(*words, *workers, "--json", "f.json")[0] == 0
    first = {path.name: path.read_bytes() for path in Path("film").glob("frame-*")}
    assert sorted(first) == sorted(f"frame-{i:05d}.{ending}" for i in (1, 2, 3) for ending in ("npz", "png"))
    for number, pose in enumerate(json.loads(Path("f.json").read_text())["frames"], 1):
        found = read(f"film/frame-{number:05d}.npz")
        row, col = np.argwhere(found["kind"] == KINDS.index("land"))[50]
        at = np.array(pose["K"]) @ (np.array(pose["R"]) @ found["places"][row, col] + pose["t"])
        assert np.abs(at[:2] / at[2] - (col, row)).max() < 1.0  # the sample is within its pixel
        assert at[2] == pytest.approx(found["depth"][row, col], rel=1e-4)
    os.remove("film/frame-00002.npz")  # the frame is no longer complete
    assert run(*words, *workers)[0] == 0
    assert {path.name for path in Path("film").glob("frame-*")} == first.keys()
    assert read("film/frame-00002.npz")["kind"].any()


def test_facts_are_taken_before_the_measurement(run, folder):
    """`measure` draws over the picture."""
    words = ("fly", small_map(), "--size", "64x48", "--fps", "1", "--seconds", "1", "--facts", "npz")
    assert run(*words, "-o", "a/")[0] == run(*words, "-o", "b/", "--measure")[0] == 0
    for name, values in read("a/frame-00001.npz").items():
        np.testing.assert_array_equal(values, read("b/frame-00001.npz")[name])


@pytest.mark.parametrize(
    "words, texts",
    [
        (("shot", "dem.npy", "-o", "a.exr", "--facts", "exr"), ("a.exr is the picture",)),
        (("shot", "dem.npy", "-o", "a.png", "--facts", "png"), ("--facts", "npz")),
        (("shot", "dem.npy", "-o", "a.png", "--facts", "npz", "--size", "9000x9000"), ("67,108,864 pixels",)),
        (("shot", "dem.npy", "-o", "a.png", "--facts", "npz", "--json", "a.npz"), ("two outputs",)),
        (("fly", "dem.npy", "-o", "a.mp4", "--facts", "npz"), ("FRAMES/",)),
    ],
)
def test_wrong_use_is_one_line(run, folder, words, texts):
    small_map()
    refused(run(*words), 2, *texts)
    assert os.listdir() == ["dem.npy"]


def test_a_name_that_is_no_format(truth):
    with pytest.raises(tg.UsageError, match=r"\.npz, \.exr"):
        truth.write("a.png")
    assert frames.OutputOptions(path="a.b/c.png", facts="npz").facts_beside("a.b/c.png") == "a.b/c.npz"
