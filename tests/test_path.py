"""Camera paths: through every keyframe, at constant speed, smooth; and files with any content."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from maps import MAPS, REAL, SMALL_REAL

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.camera import Camera
from terrain_gl.files.maps import bundled
from terrain_gl.film import spline
from terrain_gl.film.path import CameraPath, Keyframe
from terrain_gl.film.tour import above_surface_m, clearance_m, tour
from terrain_gl.heightmap import Heightmap, ground_m

metres = st.integers(-10_000, 10_000).map(lambda decimetres: decimetres / 10)
places = st.tuples(metres, metres, metres)
angles = st.integers(0, 359)


@st.composite
def keyframes(draw, least=2):
    """Keyframes a metre or more apart that look anywhere, straight up and down included."""
    eyes = draw(st.lists(places, min_size=least, max_size=6))
    assume(all(math.dist(a, b) >= 1 for a, b in zip(eyes, eyes[1:] + eyes[:1], strict=True)))
    return [Keyframe(looking(eye, draw(angles), draw(st.integers(-90, 90)), draw(st.integers(20, 90)))) for eye in eyes]


def looking(eye, azimuth, elevation=0, fov=50):
    a, e = math.radians(azimuth), math.radians(elevation)
    forward = (math.sin(a) * math.cos(e), math.cos(a) * math.cos(e), math.sin(e))
    return Camera(eye, tuple(np.add(eye, forward)), fov)


def turn_rad(one, other):
    """Angle between two orientations."""
    return math.acos(np.clip((np.trace(one.axes @ other.axes.T) - 1) / 2, -1, 1))


def fly(path, count):
    return [pose.camera for pose in path.poses(count)]


# --- The curve --------------------------------------------------------------------------------------------------------


@given(keyframes(), st.booleans())
def test_passes_through_its_keyframes(keyframes, closed):
    path = CameraPath(keyframes, closed)
    for keyframe, part in zip(keyframes, path.parts, strict=True):
        camera = path.at(part).camera
        assert np.allclose(camera.eye, keyframe.camera.eye, atol=1e-6)
        assert turn_rad(camera, keyframe.camera) < 1e-3
        assert camera.fov_deg == pytest.approx(keyframe.camera.fov_deg, rel=1e-6)


@pytest.mark.slow
@settings(max_examples=40)
@given(keyframes(least=3), st.booleans())
def test_speed_is_constant(keyframes, closed):
    path = CameraPath(keyframes, closed)
    parts = np.linspace(0.001, 0.999, 99)
    step = 1e-4  # so short that, except at sharp bends, a straight step is as long as the way along the path
    ahead = np.array([path.at(part + step).camera.eye for part in parts])
    speeds = np.linalg.norm(ahead - [path.at(part).camera.eye for part in parts], axis=1) / step
    assert np.all(speeds <= path.length_m * 1.0001)
    assert np.mean(np.abs(speeds / path.length_m - 1) < 0.01) > 0.98  # the others cut across a keyframe's sharp bend
    assert np.median(speeds) == pytest.approx(path.length_m, rel=1e-3)


def test_speed_is_constant_on_the_tour():
    heightmap = MAPS["odd"]()
    path = tour(heightmap)
    eyes = np.array([camera.eye for camera in fly(path, 2000)])
    speeds = np.linalg.norm(np.diff(eyes, axis=0), axis=1) / (path.length_m / 2000)
    assert np.all(np.abs(speeds - 1) < 0.01)


@settings(max_examples=40)
@given(keyframes(least=3), st.booleans())
def test_no_jumps(keyframes, closed):
    """With four thousand frames, each frame moves the eye by its part of the way and turns it a little."""
    path = CameraPath(keyframes, closed)
    for part in (*path.parts, *np.linspace(0, 1, 50)):
        a, b = (path.at(min(max(part + step, 0), 1)).camera for step in (-1e-6, 1e-6))
        assert math.dist(a.eye, b.eye) <= 2.1e-6 * path.length_m + 1e-9
        assert turn_rad(a, b) < 0.02


def test_a_closed_path_has_no_seam():
    path = CameraPath(
        [Keyframe(looking((math.cos(t), math.sin(t), 1), 90 * i)) for i, t in enumerate((0, 1, 2, 4))], True
    )
    assert np.allclose(path.at(0).camera.eye, path.at(1).camera.eye)
    assert turn_rad(path.at(0).camera, path.at(1).camera) < 1e-3
    before = np.subtract(path.at(0).camera.eye, path.at(0.9999).camera.eye)
    after = np.subtract(path.at(0.0001).camera.eye, path.at(0).camera.eye)
    assert np.linalg.norm(before - after) < 0.02 * np.linalg.norm(after)  # two pieces of a bend
    assert len({camera.eye for camera in fly(path, 24)}) == 24  # the last frame is not the first again


def test_an_open_path_ends_at_its_last_keyframe():
    path = CameraPath(
        [Keyframe(looking((0, 0, 0), 0)), Keyframe(looking((8, 0, 0), 0)), Keyframe(looking((8, 8, 2), 40))]
    )
    cameras = fly(path, 10)
    assert np.allclose(cameras[0].eye, (0, 0, 0)) and np.allclose(cameras[-1].eye, (8, 8, 2))
    assert np.allclose(fly(path, 1)[0].eye, (0, 0, 0))


def test_a_straight_path_is_straight():
    path = CameraPath([Keyframe(looking((x, 2 * x, 5), 10)) for x in (0, 1, 10, 11)])
    eyes = np.array([camera.eye for camera in fly(path, 50)])
    assert np.allclose(eyes[:, 1], 2 * eyes[:, 0]) and np.allclose(eyes[:, 2], 5)
    assert np.allclose(np.diff(eyes[:, 0]), 11 / 49)


@pytest.mark.parametrize("first", [10, 350])
def test_turns_the_short_way(first):
    path = CameraPath([Keyframe(looking((0, 0, 0), first)), Keyframe(looking((1, 0, 0), 360 - first))])
    for camera in fly(path, 20):
        assert abs(math.degrees(math.atan2(camera.forward[0], camera.forward[1]))) < 10.001


@settings(max_examples=40)
@given(st.lists(st.tuples(places, angles, st.integers(-60, 60)), min_size=3, max_size=5, unique_by=lambda k: k[0]))
def test_the_horizon_stays_level(views):
    assume(all(math.dist(a[0], b[0]) >= 1 for a, b in zip(views, views[1:], strict=False)))
    for camera in fly(CameraPath([Keyframe(looking(*view)) for view in views]), 40):
        if math.hypot(*camera.forward[:2]) > math.cos(math.radians(70)):
            assert abs(camera.axes[0][2]) < 1e-6


def test_a_bank_that_is_asked_for_is_flown():
    bank = Camera((0, 0, 0), (0, 1, 0), up=(1, 0, 1))
    camera = CameraPath([Keyframe(bank), Keyframe(Camera((5, 0, 0), (5, 1, 0), up=(1, 0, 1)))]).at(0.5).camera
    assert np.allclose(camera.axes, bank.axes, atol=1e-9)


def test_turning_on_the_spot_takes_time():
    path = CameraPath(
        [Keyframe(looking((0, 0, 0), 0)), Keyframe(looking((0, 0, 0), 90)), Keyframe(looking((6, 0, 0), 90))]
    )
    assert np.allclose(path.parts, [0, 0.5, 1])
    assert turn_rad(path.at(0.25).camera, looking((0, 0, 0), 45)) < 0.2
    alone = CameraPath([Keyframe(looking((1, 2, 3), 0)), Keyframe(looking((1, 2, 3), 80))])
    assert alone.length_m == 0 and alone.at(0.5).camera.eye == (1, 2, 3)


def test_times_are_kept():
    times = [0, 1, 5, 6]
    keyframes = [Keyframe(looking((x, 0, 0), 0), second) for x, second in zip((0, 10, 12, 40), times, strict=True)]
    path = CameraPath(keyframes)
    assert path.seconds == 6 and np.allclose(path.parts * 6, times)
    x = np.array([path.at(part).camera.eye[0] for part in np.linspace(0, 1, 200)])
    assert np.all(np.diff(x) > 0)
    for keyframe, part in zip(keyframes, path.parts, strict=True):
        assert np.allclose(path.at(part).camera.eye, keyframe.camera.eye)
    assert CameraPath(keyframes, True, 8).parts[-1] == 6 / 8


def test_the_sun_follows():
    suns = [(350, 10), (20, 30), (60, 20)]
    path = CameraPath([Keyframe(looking((x, 0, 0), 0), None, sun) for x, sun in enumerate(suns)])
    assert [path.at(part).sun for part in path.parts] == [pytest.approx(sun) for sun in suns]
    for pose in path.poses(30):
        azimuth, elevation = pose.sun
        assert (azimuth + 20) % 360 < 90 and 5 < elevation < 35
    assert CameraPath([Keyframe(looking((x, 0, 0), 0)) for x in (0, 1)]).at(0.5).sun is None


@given(st.lists(st.floats(-1, 1, width=32), min_size=4, max_size=4).filter(lambda q: np.linalg.norm(q) > 0.1))
def test_quaternions_are_axes(q):
    q = np.array(q) / np.linalg.norm(q)
    axes = spline.axes_from_quaternion(q)
    assert np.allclose(axes @ axes.T, np.eye(3), atol=1e-12)
    assert np.allclose(np.cross(axes[1], axes[2]), -axes[0], atol=1e-12)
    back = spline.quaternion_from_axes(axes)
    assert min(np.abs(back - q).max(), np.abs(back + q).max()) < 1e-9


def test_slerp_goes_at_constant_pace():
    a, b = np.array([1.0, 0, 0, 0]), np.array([0, 0, 1.0, 0])
    angles = np.linspace(-1, 2, 13)
    turned = spline.slerp(a, b, angles)
    assert np.allclose(turned[:, 0], np.cos(angles * math.pi / 2))
    assert np.allclose(turned[:, 2], np.sin(angles * math.pi / 2))
    assert np.allclose(spline.slerp(a, a, np.array(0.3)), a)


# --- Files ------------------------------------------------------------------------------------------------------------

GOOD = {
    "closed": True,
    "seconds": 12,
    "keyframes": [
        {"eye": [0, 0, 5], "target": [10, 0, 0], "fov": 40, "sun": [100, 20], "seconds": 0},
        {"eye": [20, 0, 5], "direction": [0, 1, 0], "fov": 50, "sun": [150, 30], "seconds": 4},
        {"eye": [20, 20, 5], "direction": [-1, 0, 0], "up": [0, 0, 1], "sun": [160, 35], "seconds": 9.5},
    ],
}


def written(tmp_path, content):
    file = tmp_path / "path.json"
    file.write_text(content if isinstance(content, str) else json.dumps(content))
    return file


def test_file_round_trip(tmp_path):
    path = CameraPath.open(written(tmp_path, GOOD), fov_deg=33)
    assert [k.camera.fov_deg for k in path.keyframes] == [40, 50, 33]
    assert path.closed and path.seconds == 12 and path.keyframes[1].camera.target == (20, 1, 5)
    path.save(tmp_path / "again.json")
    again = CameraPath.open(tmp_path / "again.json")
    assert (again.keyframes, again.closed, again.seconds) == (path.keyframes, True, 12)


def test_a_bare_list_is_enough(tmp_path):
    path = CameraPath.open(
        written(tmp_path, [{"eye": [0, 0, 1], "target": [1, 0, 1]}, {"eye": [5, 0, 1], "target": [9, 9, 9]}])
    )
    assert len(path.keyframes) == 2 and not path.closed and path.seconds is None


def without(key, **more):
    entry = {"eye": [0, 0, 1], "target": [1, 0, 1]} | more
    entry.pop(key, None)
    return {"keyframes": [{"eye": [9, 9, 9], "target": [0, 0, 0]}, entry]}


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ("", "not JSON: line 1, column 1"),
        ('{"keyframes": [\n{"eye": [0, 0 1]}]}', "not JSON: line 2, column 15"),
        ("[" * 100_000, "not JSON"),
        ("{}", "keyframes"),
        ("7", "keyframes"),
        ('{"keyframes": []}', "2 to 10000 keyframes, got 0"),
        ({"keyframes": [{"eye": [0, 0, 1], "target": [1, 0, 1]}]}, "got 1"),
        ({"keyframes": [], "loop": True}, 'the path: does not know "loop"'),
        ({"keyframes": [1, 2]}, "keyframe 1: expected"),
        (without("eye"), "keyframe 2: expected an eye"),
        (without("target"), "keyframe 2: expected an eye, and either a target or a direction"),
        (without("", direction=[1, 0, 0]), "either a target or a direction"),
        (without("", eye="123"), "keyframe 2: eye: expected a list of 3 numbers"),
        (without("", eye=[1, 2]), "keyframe 2: eye: expected a list of 3 numbers"),
        (without("", eye=[1, 2, None]), "keyframe 2: eye"),
        (without("", eye=[1, 2, True]), "keyframe 2: eye"),
        ('[{"eye": [1, 2, NaN], "target": [0, 0, 0]}]', "keyframe 1: eye"),
        ('[{"eye": [1, 2, 1' + "0" * 400 + '], "target": [0, 0, 0]}]', "keyframe 1: eye"),
        (without("", eye=[1, 0, 1]), "keyframe 2: eye and target are the same"),
        (without("", fov=500), "keyframe 2: field of view"),
        (without("", fov=0), "keyframe 2: field of view"),
        (without("", fov=[50]), "keyframe 2: fov: expected a number"),
        (without("", up=[1, 0, 0]), "keyframe 2: up"),
        (without("", sun=[1, 100]), "keyframe 2: sun"),
        (without("", sun=[1, 10]), "keyframe 1: no sun"),
        (without("", zoom=2), 'keyframe 2: does not know "zoom"'),
        (GOOD | {"closed": 1}, "closed: expected true or false"),
        (GOOD | {"seconds": 9}, "seconds"),
        (GOOD | {"seconds": -1}, "seconds"),
        (GOOD | {"keyframes": GOOD["keyframes"][::-1]}, "keyframe 1: the flight starts at second 0"),
        (GOOD | {"keyframes": [*GOOD["keyframes"], GOOD["keyframes"][1]]}, "keyframe 4: second 4"),
    ],
)
def test_bad_files_name_the_entry(tmp_path, content, reason):
    with pytest.raises(TerrainError) as error:
        CameraPath.open(written(tmp_path, content))
    assert str(error.value).startswith(f"{tmp_path}/path.json: ") and reason in str(error.value)
    assert "\n" not in str(error.value) and len(str(error.value)) < 300


def test_unreadable_files(tmp_path):
    (tmp_path / "bytes.json").write_bytes(b"\xff\xfe\x00{")
    for name in ("none.json", ".", "bytes.json"):
        with pytest.raises(TerrainError, match="path|read|JSON"):
            CameraPath.open(tmp_path / name)


def test_too_few_in_memory():
    with pytest.raises(UsageError, match="got 1"):
        CameraPath([Keyframe(looking((0, 0, 0), 0))])


def test_the_path_of_the_documentation():
    """It can be opened, is closed, and stays 90 m above the land that it was made for."""
    path = CameraPath.open(Path(__file__).parent.parent / "docs" / "alpine-flight.json")
    assert path.closed and path.seconds == 14
    known = bundled()["alpine"]
    heightmap = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
    assert above_surface_m(heightmap, path.eyes).min() > 90


# --- The tour ---------------------------------------------------------------------------------------------------------


def check_tour(heightmap):
    path = tour(heightmap)
    assert path.closed and path.length_m > 0
    eyes = np.array([camera.eye for camera in fly(path, 997)])
    heights = eyes[:, 2] - ground_m(heightmap, eyes[:, :2])
    assert np.nanmin(heights, initial=np.inf) >= clearance_m(heightmap)
    east, north = heightmap.extent_m
    assert np.all((eyes[:, 0] > 0) & (eyes[:, 0] < east) & (eyes[:, 1] > 0) & (eyes[:, 1] < north))


@pytest.mark.parametrize("name", MAPS)
def test_tour_keeps_above_any_map(name):
    check_tour(MAPS[name]())


@pytest.mark.parametrize("name", bundled())
def test_tour_keeps_above_bundled_maps(name):
    known = bundled()[name]
    check_tour(Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m))


@pytest.mark.parametrize("name", SMALL_REAL)
def test_tour_keeps_above_real_maps(dem, name):
    check_tour(Heightmap.open(dem / name, **REAL[name]))


def test_a_single_needle_under_the_way_is_seen():
    """One post of 30,000, in the middle of a leg: the eye would pass below its top."""
    heights = np.zeros((201, 201), "f4")
    way = tour(Heightmap(heights, 10.0)).eyes
    x, y, z = way[300]
    heights[200 - round(y / 10), round(x / 10)] = 2 * z
    heightmap = Heightmap(heights, 10.0)
    assert above_surface_m(heightmap, way).min() < 0
    check_tour(heightmap)


@given(st.integers(0, 2**31), st.integers(2, 40), st.integers(2, 40))
def test_above_surface_is_a_lower_bound(seed, rows, cols):
    rng = np.random.default_rng(seed)
    heightmap = Heightmap(rng.uniform(0, 9, (rows, cols)), (3.0, 2.0))
    way = rng.uniform(-5, 100, (6, 3))
    least = above_surface_m(heightmap, way)
    for i in range(5):
        between = way[i] + np.linspace(0, 1, 200)[:, None] * (way[i + 1] - way[i])
        above = between[:, 2] - ground_m(heightmap, between[:, :2])
        assert np.nanmin(above, initial=np.inf) >= least[i] - 1e-9
