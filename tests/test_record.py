"""Films: they contain the recorded frames, are complete or do not exist, and recording need not wait."""

import os
import signal
import sys
import time
from contextlib import contextmanager

import numpy as np
import pytest

from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.film import parts, record
from terrain_gl.film.record import CODECS, Recorder
from terrain_gl.image import read_image

COUNT = 12
OUTPUTS = (*(f"film{ending}" for ending in CODECS), "frames/")


pytestmark = pytest.mark.usefixtures("folder")


@pytest.fixture(params=OUTPUTS)
def output(request):
    if not request.param.endswith("/"):
        pytest.importorskip("av", reason="the extra [video] is not installed")
    return request.param


def picture(i, size=(64, 48)):
    """A smooth slope that drifts, with a red mark in the top left corner."""
    y, x = np.mgrid[: size[1], : size[0]]
    pixels = np.stack([2 * x, 3 * y, np.full_like(x, 10 * i), np.full_like(x, 255)], -1).astype(np.uint8)
    if min(size) > 16:
        pixels[:16, :16] = (200, 30, 30, 255)
    return pixels


def frames_of(output):
    """(n, height, width, 3) pictures of a film, and when each begins, in seconds."""
    if output.endswith("/"):
        names = sorted(os.listdir(output))
        assert names == [f"frame-{i + 1:05d}.png" for i in range(len(names))]
        return np.array([read_image(output + name) for name in names]), None
    if output.endswith(".webp"):  # FFmpeg writes them but does not read them
        image = pytest.importorskip("PIL.Image").open(output)
        frames, times = [], [0.0]
        for i in range(image.n_frames):
            image.seek(i)
            frames.append(np.asarray(image.convert("RGB")))
            times.append(times[-1] + image.info["duration"] / 1000)
        return np.array(frames), times[:-1]
    import av

    with av.open(output) as file:
        decoded = list(file.decode(video=0))
    return np.array([f.to_ndarray(format="rgb24") for f in decoded]), [float(f.pts * f.time_base) for f in decoded]


@contextmanager
def disk_of(limit):
    """Imitate a full disk: no file may grow beyond `limit` bytes."""
    resource = pytest.importorskip("resource")
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (limit, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))
        signal.signal(signal.SIGXFSZ, handler)


def test_round_trip(output):
    with Recorder(output, fps=20) as recorder:
        for i in range(COUNT):
            assert recorder.append(picture(i))
    assert recorder.frames == COUNT and os.listdir() == [output.rstrip("/")]
    frames, times = frames_of(output)
    assert len(frames) == COUNT
    for i, frame in enumerate(frames):
        assert np.abs(frame.astype(int) - picture(i)[..., :3]).mean() < 6
        assert np.abs(frame[8, 8].astype(int) - (200, 30, 30)).max() <= 8  # the right way up, the right red
    if times:
        assert times == pytest.approx([i / 20 for i in range(COUNT)], abs=0.0051)


def test_lossless_where_it_can_be():
    pytest.importorskip("av", reason="the extra [video] is not installed")
    for output in ("film.png", "frames/"):
        with Recorder(output) as recorder:
            for i in range(3):
                recorder.append(picture(i))
        assert np.array_equal(frames_of(output)[0], [picture(i)[..., :3] for i in range(3)])


@pytest.mark.parametrize("size", [(65, 49), (2, 3), (64, 49)])
def test_odd_sizes(output, size):
    with Recorder(output) as recorder:
        for i in range(3):
            recorder.append(picture(i, size))
    width, height = (side & ~1 for side in size) if output.endswith(".mp4") else size
    assert frames_of(output)[0].shape == (3, height, width, 3)


def test_slow_changes_are_shown(output):
    """A sky becomes brighter, one step a frame: no frame repeats parts of the one before it."""
    sky = np.add.outer(np.linspace(80, 130, 48), np.linspace(0, 20, 64))[..., None] + [0, 20, 40]
    with Recorder(output) as recorder:
        for i in range(12):
            recorder.append((sky + i).astype(np.uint8))
    frames, _ = frames_of(output)
    assert len(frames) == 12
    brighter = frames.astype(float).mean((1, 2)) - frames[0].mean((0, 1))
    assert np.abs(brighter - np.arange(12)[:, None]).max() < 255 / 219  # one of the 219 steps of video's luma


def test_no_film_of_one_pixel():
    pytest.importorskip("av", reason="the extra [video] is not installed")
    with pytest.raises(TerrainError, match="2x2"), Recorder("film.mp4") as recorder:
        recorder.append(picture(0, (1, 1)))
    assert not os.listdir()


def test_the_encoder_is_not_waited_for(monkeypatch):
    """With a slow disk frames are dropped without waiting, and the film goes on."""
    monkeypatch.setattr(record, "write_png", lambda *_: time.sleep(0.2))
    started = time.monotonic()
    recorder = Recorder("frames/")
    taken = [recorder.append(picture(i), wait=False) for i in range(30)]
    assert time.monotonic() - started < 0.15 and record.WAITING <= sum(taken) < 10
    recorder.close()
    assert recorder.frames == sum(taken)


def test_later_changes_of_an_image_are_not_recorded():
    image = picture(0)
    with Recorder("frames/") as recorder:
        for i in range(6):
            image[...] = picture(i)
            recorder.append(image)
    assert np.array_equal(frames_of("frames/")[0], [picture(i)[..., :3] for i in range(6)])


def test_cancelled(output):
    recorder = Recorder(output)
    for i in range(COUNT):
        recorder.append(picture(i))
    while output == "frames/" and recorder.frames < 2:
        time.sleep(0.01)
    recorder.cancel()
    if output == "frames/":
        assert len(frames_of(output)[0]) == recorder.frames >= 2
    else:
        assert not os.listdir()
    with pytest.raises(TerrainError, match="has ended"):
        recorder.append(picture(0))


def test_cancelled_before_the_first_frame(output):
    Recorder(output).cancel()
    assert not os.listdir()


def test_an_error_around_it_leaves_nothing(output):
    with open("film.mp4", "w") as old:
        old.write("old")
    with pytest.raises(ZeroDivisionError), Recorder(output) as recorder:
        recorder.append(picture(0))
        raise ZeroDivisionError
    assert set(os.listdir()) - {"frames"} == {"film.mp4"}
    with open("film.mp4") as old:
        assert old.read() == "old"


@pytest.mark.parametrize("limit", [1, 1000, 20_000, 1_000_000])
def test_full_disk(output, limit):
    """At whatever byte the disk is full: an error in one line and no film, or the whole film."""
    noise = np.random.default_rng(0).integers(0, 256, (COUNT, 48, 64, 3), dtype=np.uint8)
    whole = False
    with disk_of(limit):
        try:
            with Recorder(output) as recorder:
                for frame in noise:
                    recorder.append(frame)
            whole = True
        except TerrainError as error:
            assert "cannot write" in str(error) and "\n" not in str(error)
    if whole:
        assert len(frames_of(output)[0]) == COUNT
    else:
        assert not os.listdir()
    assert whole == (limit == 1_000_000) or limit == 20_000


def test_a_folder_keeps_what_was_complete_when_the_disk_was_full():
    recorder = Recorder("frames/")
    recorder.append(picture(0))
    while not os.path.exists("frames/frame-00001.png"):
        time.sleep(0.01)
    with disk_of(1), pytest.raises(TerrainError, match="1 other pictures are complete"), recorder:
        for i in range(1000):
            recorder.append(picture(i))
    assert len(frames_of("frames/")[0]) == 1
    with pytest.raises(TerrainError, match="holds frames already"):
        Recorder("frames/")


def test_a_film_keeps_its_complete_parts_when_the_disk_was_full(monkeypatch):
    pytest.importorskip("av", reason="the extra [video] is not installed")
    monkeypatch.setattr(parts, "FRAMES", 2)
    recorder = Recorder("film.mp4", kept=())
    for i in range(2):
        recorder.append(picture(i))
    while not os.path.exists("film.mp4.parts/part-00001.mp4"):
        time.sleep(0.01)
    with disk_of(1), pytest.raises(TerrainError, match="the first 2 pictures are complete"), recorder:
        for i in range(1000):
            recorder.append(picture(i))
    assert (os.listdir(), os.listdir("film.mp4.parts")) == (["film.mp4.parts"], ["part-00001.mp4"])


def test_a_folder_that_was_there_stays_when_nothing_is_recorded():
    os.mkdir("mine")
    for folder in ("mine", "made"):
        with pytest.raises(TerrainError, match="at least one frame"), Recorder(f"{folder}/"):
            pass
    assert os.listdir() == ["mine"]


def test_the_end_of_the_recorder_is_told_to_who_appends():
    recorder = Recorder("frames/")
    recorder.append(picture(0))
    while not os.path.exists("frames/frame-00001.png"):
        time.sleep(0.01)
    with disk_of(1), pytest.raises(TerrainError, match="cannot write"):
        for i in range(1000):
            recorder.append(picture(i))
    with pytest.raises(TerrainError, match="cannot write"):
        recorder.close()


@pytest.mark.parametrize(
    ("output", "fps", "error", "reason"),
    [
        ("film.avi", 30, UsageError, "must end in one of .mp4, .gif, .webp, .png"),
        ("film.mp4", 0, UsageError, "frames a second"),
        ("film.mp4", 1e9, UsageError, "frames a second"),
        ("film.mp4", float("nan"), UsageError, "frames a second"),
        ("film.gif", 60, UsageError, "at most 50"),
        ("none/film.mp4", 30, TerrainError, "there is no folder none"),
        ("none/frames/", 30, TerrainError, "cannot make this folder"),
        ("/proc/film.mp4", 30, TerrainError, "/proc/film.mp4: "),
        ("/proc/frames/", 30, TerrainError, "/proc/frames: cannot make"),
    ],
)
def test_bad_requests(output, fps, error, reason):
    if error is TerrainError and not output.endswith("/"):
        pytest.importorskip("av", reason="the extra [video] is not installed")
    with pytest.raises(error) as caught, Recorder(output, fps) as recorder:
        recorder.append(picture(0))
    assert reason in str(caught.value) and "\n" not in str(caught.value)
    assert not os.listdir()


def test_frames_of_one_size():
    with pytest.raises(TerrainError, match="expected a frame of"), Recorder("frames/") as recorder:
        recorder.append(picture(0))
        recorder.append(picture(0, (32, 32)))


def test_no_frames_no_film(output):
    with pytest.raises(TerrainError, match="at least one frame"), Recorder(output):
        pass
    assert not os.listdir()


def test_without_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "av", None)
    with pytest.raises(TerrainError, match=r"pip install 'terrain-gl\[video\]'"):
        Recorder("film.mp4")
    with Recorder("frames/") as recorder:
        recorder.append(picture(0))
    assert os.listdir("frames") == ["frame-00001.png"]
