"""`terrain-gl fly` as a user sees it: films, pictures, the numbers of each frame, wrong use."""

import errno
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from fractions import Fraction
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from commands import refused, small_map

import terrain_gl as tg
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.cli import frames
from terrain_gl.film import parts, record
from terrain_gl.film.journal import FlightJournal
from terrain_gl.film.parts import JOURNAL
from terrain_gl.film.path import CameraPath, Keyframe
from terrain_gl.film.record import Recorder
from terrain_gl.film.tour import tour
from terrain_gl.image import read_image
from terrain_gl.store import scheduling

SMALL = ("--size", "64x36", "--fps", "5", "--seconds", "1")


@pytest.fixture(autouse=True)
def dem(folder):
    return small_map()


@pytest.fixture
def path():
    """A file with a path of two views of the map."""
    views = [tg.Camera((10, 5, 60), (50, 35, 20), 40), tg.Camera((80, 5, 50), (50, 35, 20), 50)]
    CameraPath([Keyframe(view) for view in views], seconds=1).save("path.json")
    return "path.json"


@pytest.mark.slow
def test_a_folder_of_pictures_takes_no_extra(run, path):
    status, out, err = run("fly", "dem.npy", "--path", path, "-o", "frames", *SMALL, "--json", "flight.json")
    assert (status, err) == (0, "") and out.startswith("frames: 5 frames of 64x36")
    assert sorted(os.listdir("frames")) == [JOURNAL, *(f"frame-{i:05d}.png" for i in range(1, 6))]
    about = json.loads(Path("flight.json").read_text())
    poses = list(CameraPath.open(path).poses(5))
    with tg.Renderer(tg.Heightmap.open("dem.npy"), (64, 36)) as renderer:
        for i, pose in enumerate(poses):
            frame = renderer.render(pose.camera)
            assert np.array_equal(read_image(f"frames/frame-{i + 1:05d}.png"), frame.image[..., :3])
            told = about["frames"][i]
            assert told["frame"] == i and tuple(told["eye"]) == pose.camera.eye
            for key in ("triangles", "patches", "splits", "certified_max_error_px"):
                assert told[key] == frame.stats[key]
    assert about["summary"]["triangles"]["max"] == max(frame["triangles"] for frame in about["frames"])
    times = [frame["ms"]["frame"] for frame in about["frames"]]
    assert about["summary"]["ms"]["frame"]["median"] == pytest.approx(np.median(times))
    assert np.median(times) <= about["summary"]["ms"]["frame"]["p999"] <= max(times)
    assert about["frames_outside"] == about["frames_under_ground"] == 0


def test_a_film_of_the_tour(run):
    av = pytest.importorskip("av", reason="the extra [video] is not installed")
    status, out, err = run("fly", "dem.npy", "-o", "tour.mp4", "--size", "65x37", "--fps", "10", "--seconds", "0.6")
    assert status == 0 and "6 frames" in out and "64x36" in out
    assert err == "terrain-gl: note: --size: an .mp4 has even sides: 64x36\n"
    with av.open("tour.mp4") as film:
        frames = [frame.to_ndarray(format="rgb24") for frame in film.decode(video=0)]
        assert film.streams.video[0].average_rate == 10
    heightmap = tg.Heightmap.open("dem.npy")
    with tg.Renderer(heightmap, (64, 36)) as renderer:
        for frame, pose in zip(frames, tour(heightmap).poses(6), strict=True):
            drawn = renderer.render(pose.camera).image[..., :3]
            assert np.abs(frame.astype(int) - drawn).mean() < 4


def test_measured(run):
    status, out, _ = run("fly", "dem.npy", "-o", "f/", *SMALL, "--measure", "--max-error", "2", "--json", "-")
    about = json.loads(out)
    assert status == 0 and about["summary"]["holes"] == 0 and len(about["frames"]) == 5
    for frame in about["frames"]:
        assert 0 < frame["max_error_px"] <= frame["certified_max_error_px"] <= about["requested_max_error_px"] == 2
        assert frame["posts_measured"] > 0
    assert about["summary"]["max_error_px"]["max"] == max(frame["max_error_px"] for frame in about["frames"])
    bounds = [frame["certified_max_error_px"] for frame in about["frames"]]
    assert [frame["certified_jump_px"] for frame in about["frames"][1:]] == [a + b for a, b in pairwise(bounds)]
    assert about["summary"]["certified_jump_px"]["max"] <= 2 * max(bounds)
    assert "jumps of at most" in run("fly", "dem.npy", "-o", "g/", *SMALL)[1]


def test_the_path_gives_time_and_sun_unless_options_do(run):
    low, high = (tg.Camera((10, 5, z), (50, 35, 20), 40) for z in (60, 70))
    CameraPath([Keyframe(low, 0, (90, 10)), Keyframe(high, 0.4, (90, 60))]).save("sun.json")
    assert run("fly", "dem.npy", "--path", "sun.json", "-o", "a", "--size", "64x36", "--fps", "5")[0] == 0
    first, last = (read_image(f"a/{name}").astype(int) for name in sorted(pictures("a")))
    assert len(pictures("a")) == 2
    assert run("fly", "dem.npy", "--path", "sun.json", "-o", "b", *SMALL, "--sun", "90,60")[0] == 0
    names = sorted(pictures("b"))
    assert len(names) == 5 and np.array_equal(read_image(f"b/{names[-1]}"), last)
    assert not np.array_equal(read_image(f"b/{names[0]}"), first)


def test_outside_and_under_ground_are_told(run):
    views = [tg.Camera((-20, 5, 60), (50, 35, 20)), tg.Camera((50, 35, -5), (60, 35, -5))]
    CameraPath([Keyframe(view) for view in views]).save("path.json")
    status, out, err = run("fly", "dem.npy", "--path", "path.json", "-o", "f", *SMALL)
    assert (status, err) == (0, "")
    assert "note: in 2 frames the eye is outside the map" in out and "the eye is under ground" in out


@pytest.mark.parametrize(
    ("words", "status", "texts"),
    [
        (("-o", "a.avi"), 2, ("a.avi", ".mp4, .gif, .webp, .png")),
        (("-o", "f", "--seconds", "0.01"), 2, ("0 frames",)),
        (("-o", "f", "--seconds", "1e6", "--fps", "999"), 2, ("frames: take 1 to",)),
        (("-o", "f", "--fps", "0"), 2, ("--fps",)),
        (("-o", "f", "--fps", "1e5"), 2, ("frames a second",)),
        (("-o", "f", "--seconds", "nan"), 2, ("--seconds",)),
        (("-o", "none/f"), 1, ("none/f: cannot make this folder",)),
        (("-o", "f", "--path", "none.json"), 1, ("none.json: cannot be read",)),
        (("-o", "f", "--path", "dem.npy"), 1, ("dem.npy: not JSON",)),
        (("-o", "f", "--path", "broken.json"), 1, ("broken.json: keyframe 2: eye",)),
        (("-o", "f", "--json", "none/a.json"), 1, ("none",)),
        (("-o", "f", "--eye", "1,2,3"), 2, ("--eye",)),
        (("-o", "f", "--size", "0x5"), 2, ("--size",)),
        ((), 2, ("-o",)),
    ],
)
def test_wrong_use(run, words, status, texts):
    with open("broken.json", "w") as file:
        file.write('[{"eye": [1, 2, 3], "target": [0, 0, 0]}, {"eye": [1, 2], "target": [0, 0, 0]}]')
    refused(run("fly", "dem.npy", *words), status, *texts)
    assert sorted(os.listdir()) == ["broken.json", "dem.npy"]


def test_the_map_is_not_written_over(run):
    pytest.importorskip("av", reason="the extra [video] is not installed")
    tg.image.write_png("map.png", np.arange(64, dtype=np.uint8).reshape(8, 8))
    before = Path("map.png").read_bytes()
    refused(run("fly", "map.png", "-o", "map.png", *SMALL), 2, "is also an input")
    assert Path("map.png").read_bytes() == before


def test_a_full_folder_is_not_mixed_with(run, path):
    words = ("fly", "dem.npy", "--path", path, "-o", "f", *SMALL)
    assert run(*words)[0] == 0
    refused(run(*words, "--sun", "90,20"), 1, "f: holds frames of another flight")
    Path(f"f/{JOURNAL}").unlink()
    refused(run(*words), 1, "f: holds frames already")


@pytest.mark.slow
@pytest.mark.parametrize("output", ["f/", "film.gif"])
def test_interrupted(output):
    """Ctrl-C in the middle: status 130, one line that says which files exist, and no incomplete file."""
    if output != "f/":
        pytest.importorskip("av", reason="the extra [video] is not installed")
    command = [sys.executable, *f"-m terrain_gl fly dem.npy -o {output} --size 64x36 --seconds 999".split()]
    listening = {"preexec_fn": lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)}  # background jobs ignore Ctrl-C
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, **listening) as process:
        try:
            deadline = time.monotonic() + 120
            while len(os.listdir()) < 2 or (output == "f/" and len(os.listdir("f")) < 3):
                assert time.monotonic() < deadline and process.poll() is None
                time.sleep(0.05)
            time.sleep(0.5)
            process.send_signal(signal.SIGINT)
            out, err = process.communicate(timeout=30)
        finally:
            process.kill()
    assert (process.returncode, out) == (130, "") and err.count("\n") == 1, err
    assert err.startswith(f"terrain-gl: {output}: stopped, ")
    if output == "film.gif":
        assert os.listdir() == ["dem.npy"] and "nothing is written" in err
    else:
        assert os.path.isfile(f"f/{JOURNAL}") and "the same command continues" in err
        names = sorted(set(os.listdir("f")) - {JOURNAL})
        assert f"stopped, {len(names)} pictures are complete" in err
        assert names == [f"frame-{i + 1:05d}.png" for i in range(len(names))]
        assert read_image(f"f/{names[-1]}").shape == (36, 64, 3)


# --- Interrupted flights, and many workers ----------------------------------------------------------------------------


def pictures(folder):
    """Names and bytes of all files in a folder, except the journal, which has times."""
    return {name: Path(folder, name).read_bytes() for name in os.listdir(folder) if name != JOURNAL}


def told(path):
    """The numbers of a flight, without times."""
    about = json.loads(Path(path).read_text())
    del about["summary"]["ms"]
    return about | {"frames": [frame | {"ms": None} for frame in about["frames"]]}


@pytest.fixture
def undisturbed(run, path):
    """The command line of a flight, and the pictures and numbers of a run that nothing disturbed."""
    words = ("fly", "dem.npy", "--path", path, *SMALL)
    assert run(*words, "-o", "whole", "--json", "whole.json")[0] == 0
    return words, pictures("whole"), told("whole.json")


def interrupt(monkeypatch, after):
    """Let the drawing of frames be interrupted after some of them; returns the views that are drawn."""
    drawn, steps = [], frames.Drawing.steps

    def counted(self, pose):
        if len(drawn) == after:
            raise KeyboardInterrupt
        drawn.append(pose)
        return steps(self, pose)

    monkeypatch.setattr(frames.Drawing, "steps", counted)
    return drawn


def break_off(run, monkeypatch, words):
    """Run a command line that is interrupted after three frames."""
    with monkeypatch.context() as patch:
        interrupt(patch, 3)
        assert run(*words)[0] == 130


def test_an_interrupted_folder_is_continued(undisturbed, run, monkeypatch):
    words, expected, numbers = undisturbed
    words = (*words, "-o", "f", "--json", "n.json")
    break_off(run, monkeypatch, words)
    left = len(pictures("f"))
    assert 1 <= left <= 3
    refused(run(*words, "--style", "normals"), 1, "f: holds frames of another flight")
    with open(f"f/{JOURNAL}", "a") as file:
        file.write('{"cut')
    drawn = interrupt(monkeypatch, 99)
    assert run(*words)[0] == 0
    assert (pictures("f"), told("n.json"), len(drawn)) == (expected, numbers, 5 - left)


def test_a_journal_that_was_cut_off_is_refused_in_one_line(undisturbed, run, monkeypatch):
    words = (*undisturbed[0], "-o", "f")
    break_off(run, monkeypatch, words)
    Path(f"f/{JOURNAL}").write_bytes(b"")
    refused(run(*words), 1, "f: holds frames of another flight")


def test_a_journal_is_whole_while_it_is_begun_again(tmp_path, monkeypatch):
    """As if killed in the moment before the new file replaces the old one."""
    (tmp_path / "frame-00001.png").write_bytes(b"")
    journal = FlightJournal(tmp_path, "flight")
    journal.begin()
    journal.add(0, "first")
    with monkeypatch.context() as patch:
        patch.setattr("os.replace", lambda *_: (_ for _ in ()).throw(KeyboardInterrupt))
        with pytest.raises(KeyboardInterrupt):
            FlightJournal(tmp_path, "flight").begin()
    assert FlightJournal(tmp_path, "flight").done == {0: "first"}


@pytest.mark.parametrize("lost", [(), (1,), (3,), (5,), (1, 2, 4)])
def test_the_same_command_again_draws_only_what_is_missing(undisturbed, run, monkeypatch, lost):
    words, expected, numbers = undisturbed
    words = (*words, "-o", "whole", "--json", "n.json")
    for number in lost:
        Path(f"whole/frame-{number:05d}.png").unlink()
    Path("whole/.frame-00003-0a1b2c3d.png").write_bytes(b"")  # as a killed flight leaves it
    drawn = interrupt(monkeypatch, 99)
    assert run(*words)[0] == 0
    assert (pictures("whole"), told("n.json"), len(drawn)) == (expected, numbers, len(lost))


@pytest.fixture
def film(undisturbed, run, monkeypatch):
    """The command line of a film in parts of two frames, and the numbers of a run that nothing disturbed."""
    pytest.importorskip("av", reason="the extra [video] is not installed")
    monkeypatch.setattr(parts, "FRAMES", 2)
    return (*undisturbed[0], "-o", "f.mp4", "--json", "n.json"), undisturbed[2]


def assert_whole(film):
    """A film has all pictures of the undisturbed flight, in order and in time."""
    import av

    with av.open(film) as file:
        shown = [(frame.pts * frame.time_base, frame.to_ndarray(format="rgb24")) for frame in file.decode(video=0)]
    assert [time_s for time_s, _ in shown] == [Fraction(i, 5) for i in range(5)]
    for i, (_, frame) in enumerate(shown):
        assert np.abs(frame.astype(int) - read_image(f"whole/frame-{i + 1:05d}.png")).mean() < 4


@pytest.mark.parametrize("after", [0, 1, 3, 4])
def test_an_interrupted_film_is_continued(film, run, monkeypatch, after):
    words, numbers = film
    before = set(os.listdir())
    with monkeypatch.context() as patch:
        interrupt(patch, after)
        patch.setattr(Recorder, "cancel", cancel_when_written(after))
        status, _, err = run(*words)
    left = after - after % 2
    assert status == 130 and (f"stopped, {left} pictures are complete" if left else "nothing is written") in err
    assert set(os.listdir()) - before == ({"f.mp4.parts"} if left else set())
    if left:
        refused(run(*words, "--style", "normals"), 1, "f.mp4.parts: holds frames of another flight")
        Path("f.mp4.parts/.part-00002-killed.mp4").write_bytes(b"cut")
    drawn = interrupt(monkeypatch, 99)
    assert run(*words)[0] == 0
    assert (told("n.json"), len(drawn)) == (numbers, 5 - left)
    assert_whole("f.mp4")
    assert set(os.listdir()) - before == {"f.mp4", "n.json"}


def cancel_when_written(count):
    """`Recorder.cancel`, after `count` frames of the queue are written."""
    cancel = Recorder.cancel

    def later(recorder):
        deadline = time.monotonic() + 30
        while recorder.frames < count and time.monotonic() < deadline:
            time.sleep(0.01)
        cancel(recorder)

    return later


def test_a_film_keeps_its_parts_when_the_disk_is_full(film, run, monkeypatch):
    words, _ = film
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    with monkeypatch.context() as patch:
        patch.setattr(record, "_join", lambda *_: (_ for _ in ()).throw(full))
        refused(run(*words), 1, "f.mp4: cannot write: No space left on device; the first 5 pictures are complete")
    drawn = interrupt(monkeypatch, 0)
    assert run(*words)[0] == 0
    assert drawn == []
    assert_whole("f.mp4")


def test_a_flight_over_another_map_is_not_mixed_with(undisturbed, run, monkeypatch):
    words = (*undisturbed[0], "-o", "f")
    break_off(run, monkeypatch, words)
    np.save("dem.npy", 2 * np.load("dem.npy"))
    refused(run(*words), 1, "f: holds frames of another flight")
    for name in pictures("f"):
        os.remove(f"f/{name}")
    assert run(*words)[0] == 0


def test_an_interrupted_flight_without_pictures_leaves_nothing(run, path, monkeypatch):
    interrupt(monkeypatch, 0)
    assert run("fly", "dem.npy", "--path", path, "-o", "f", *SMALL)[0] == 130
    assert not os.path.exists("f")


def kill_after(monkeypatch, frames, victim):
    """Kill a worker after some frames."""
    append, count = Recorder.append, 0

    def counted(*args, **settings):
        nonlocal count
        count += 1
        if count == frames:
            os.kill(victim(), signal.SIGKILL)
        return append(*args, **settings)

    monkeypatch.setattr(Recorder, "append", counted)


@pytest.mark.slow
def test_two_processes_draw_the_same_though_one_dies(undisturbed, run, monkeypatch):
    words, expected, numbers = undisturbed
    kill_after(monkeypatch, 2, lambda: multiprocessing.active_children()[0].pid)
    assert run(*words, "-o", "f", "--workers", "2", "--json", "n.json")[0] == 0
    assert (pictures("f"), told("n.json")) == (expected, numbers)
    assert multiprocessing.active_children() == []


@pytest.mark.slow
def test_a_cluster_draws_the_same_though_a_worker_dies(undisturbed, run, monkeypatch):
    distributed = pytest.importorskip("distributed")
    words, expected, numbers = undisturbed
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        kill_after(monkeypatch, 2, lambda: cluster.workers[0].pid)
        assert run(*words, "-o", "f", "--scheduler", cluster.scheduler_address, "--json", "n.json")[0] == 0
    assert (pictures("f"), told("n.json")) == (expected, numbers)


@pytest.mark.slow
def test_an_error_of_a_worker_is_one_line(run, path):
    words = ("--workers", "2", "--material", "none.png")
    refused(run("fly", "dem.npy", "--path", path, "-o", "f", *SMALL, *words), 1, "none.png")
    assert sorted(os.listdir()) == ["dem.npy", "path.json"]


class Promised:
    """A stand-in for a future; the first `deaths` times it fails, as if its worker had died."""

    def __init__(self, task, deaths):
        self.task, self.deaths = task, deaths

    def result(self):
        if self.exception():
            raise self.exception()
        return 10 * self.task

    def done(self):
        return True

    def exception(self):
        return ChildProcessError() if self.deaths else None

    def cancel(self):
        pass


@pytest.mark.parametrize("workers", [1, 3])
def test_results_come_in_order_and_few_are_begun_ahead(workers):
    begun, taken = [], 0

    def begin(task):
        begun.append(task)
        return Promised(task, deaths=task == 4 and begun.count(4) < scheduling.TRIES)

    for number, result in enumerate(scheduling._in_order(range(20), begin, lambda: workers, ChildProcessError)):
        assert result == 10 * number
        taken += 1
        assert max(begun) < taken + scheduling.AHEAD * workers
    assert taken == 20 and begun.count(4) == scheduling.TRIES and begun.count(5) == 1


def test_workers_may_leave():
    workers = iter([3, 1, *[1] * 20])
    results = scheduling._in_order(range(9), lambda task: Promised(task, 0), lambda: next(workers), OSError)
    assert list(results) == [10 * task for task in range(9)]


def test_a_task_that_ends_every_worker_ends_the_flight():
    with pytest.raises(TerrainError, match="again to go on"):
        list(scheduling._in_order(range(3), lambda task: Promised(task, 1), lambda: 2, ChildProcessError))
