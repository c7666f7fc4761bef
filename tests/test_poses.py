"""The camera of a picture in JSON: with K, R and t, a place is where the picture shows it."""

import json

import numpy as np
import pytest
from commands import small_map

import terrain_gl as tg
from terrain_gl.camera.lens import Lens
from terrain_gl.cli.scene import CommandScene
from terrain_gl.renderer.options import FrameOptions

SIZE = (160, 90)
POSE = {"eye", "target", "fov_deg", "projection", "K", "R", "t", "sun"}


def projected(pose, points):
    """OpenCV's formula."""
    seen = np.array(pose["K"]) @ (np.array(pose["R"]) @ np.transpose(points) + np.array(pose["t"])[:, None])
    return (seen[:2] / seen[2]).T


def cameras():
    rng = np.random.default_rng(5)
    for i in range(40):
        eye = rng.uniform(-100, 100, 3)
        target = eye + rng.normal(size=3) * 50
        low, high = -rng.uniform(0.1, 1, 2), rng.uniform(0.1, 1, 2)
        lens = Lens(tuple(low), tuple(high)) if i % 2 else None
        yield tg.Camera(tuple(eye), tuple(target), rng.uniform(5, 120), lens=lens)


def test_to_opencv_is_the_inverse_of_from_opencv():
    rng = np.random.default_rng(6)
    for camera in cameras():
        k, r, t = camera.to_opencv(SIZE)
        points = np.array(camera.eye) + 20 * camera.forward + rng.normal(size=(9, 3))
        pose = {"K": k, "R": r, "t": t}
        assert np.allclose(projected(pose, points), camera.pixels(points, SIZE), rtol=0, atol=1e-6)
        again = tg.Camera.from_opencv(k, r, t, SIZE)
        assert np.allclose(again.pixels(points, SIZE), camera.pixels(points, SIZE), rtol=0, atol=1e-6)
    with pytest.raises(tg.UsageError, match="orthographic"):
        tg.Camera.orthographic((0, 0, 9), (0, 1, 0), 5.0).to_opencv(SIZE)


def told(path):
    with open(path, encoding="utf-8") as file:
        return json.load(file)


@pytest.mark.parametrize("factor", ["1", "2.5"])
def test_every_command_tells_its_camera(run, folder, factor):
    words = (small_map(), "--size", "160x90", "--style", "lambert", "--exaggeration", factor)
    assert run("shot", *words, "-o", "a.png", "--json", "a.json")[0] == 0
    assert run("measure", *words, "--json", "m.json")[0] == 0
    assert run("fly", *words, "--seconds", "1", "--fps", "2", "-o", "film/", "--json", "f.json")[0] == 0
    shot, frames = told("a.json"), told("f.json")["frames"]
    assert {name: told("m.json")[name] for name in POSE} == {name: shot[name] for name in POSE}
    assert [frame["time_s"] for frame in frames] == [0.0, 0.5]
    assert frames[0]["target"] != frames[1]["target"]
    for pose in (shot, *frames):
        assert pose.keys() >= POSE
        middle = np.array(pose["target"]) * [1, 1, float(factor)]  # the picture's middle shows the target
        assert np.allclose(projected(pose, [middle]), [[79.5, 44.5]], rtol=0, atol=1e-6)


def test_a_path_moves_the_sun(run, folder):
    keys = [{"eye": [0, -90, 60], "target": [50, 30, 0], "sun": [100 + 40 * i, 30]} for i in range(2)]
    with open("path.json", "w", encoding="utf-8") as file:
        json.dump({"keyframes": keys}, file)
    words = ("fly", small_map(), "--path", "path.json", "--size", "32x18", "--style", "lambert", "--seconds", "1")
    assert run(*words, "--fps", "2", "-o", "film/", "--json", "f.json")[0] == 0
    first, last = (frame["sun"][0] for frame in told("f.json")["frames"])
    assert first == 100 and last > first


@pytest.mark.parametrize("factor", [1.0, 2.5])
def test_the_pose_of_an_orthographic_camera(factor):
    """A place is at K (x, y, 1), with its height as drawn."""
    heightmap = tg.Heightmap(np.zeros((9, 9)), 10.0)
    for aspect in (None, 2.5):
        camera = tg.Camera.orthographic((40, -20, 60), (45, 50, 0), 90.0, aspect=aspect)
        pose = CommandScene(heightmap, heightmap, camera, FrameOptions(exaggeration=factor)).pose(SIZE)
        points = np.random.default_rng(8).uniform(0, 80, (20, 3))
        drawn = camera.over_exaggerated(factor).pixels(points * [1 / factor, 1 / factor, 1], SIZE)
        at = np.array(pose["R"]) @ (points * [1, 1, factor]).T + np.array(pose["t"])[:, None]
        at[2] = 1
        assert pose["projection"] == "orthographic"
        np.testing.assert_allclose((np.array(pose["K"]) @ at)[:2].T, drawn, atol=1e-9)
