"""Films: frames go in one at a time; the output is an MP4, GIF, animated WebP or PNG, or a folder of PNGs.

A separate thread encodes the frames from a short queue, so that drawing need not wait. A film appears under its name
only when it is complete. A folder keeps all complete pictures, and a film in parts keeps all complete parts.
"""

from __future__ import annotations

import contextlib
import os
import queue
import threading
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from itertools import count
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.locks import lock
from ..basics.replacing import replacing
from ..image import write_png
from . import parts

WAITING = 4  # most frames in the queue
FPS = 30.0
MAX_FPS = 1000.0
GIF_FPS = 50.0  # browsers play a faster GIF at ten frames a second
Write = Callable[[np.ndarray], None]


class Codec(NamedTuple):
    """How PyAV writes a film: FFmpeg's names of container, encoder and pixel format, and options."""

    container: str
    encoder: str
    pixels: str
    encoder_options: dict[str, str] = {}
    container_options: dict[str, str] = {}


_BT709 = 1  # number of BT.709 in ITU-T H.273
_LIMITED = 1
CODECS = {
    ".mp4": Codec("mp4", "libx264", "yuv420p", {"crf": "18", "preset": "fast"}, {"movflags": "+faststart"}),
    ".gif": Codec("gif", "gif", "pal8"),
    # libwebp_anim leaves blocks of earlier frames in smooth gradients such as skies, so we do not use it
    ".webp": Codec("webp", "libwebp", "yuv420p", {"quality": "75", "compression_level": "4"}, {"loop": "0"}),
    ".png": Codec("apng", "apng", "rgb24", {}, {"plays": "0"}),
}


class Recorder:
    """Writes frames to a film or a folder.

    Parameters
    ----------
    path
        A file whose name ends in one of `CODECS` (needs the extra [video]), or a folder for numbered PNGs: a name
        without an ending, or with a slash at its end. A missing folder is created.
    fps
        Frames a second.
    kept
        Numbers of the frames that a folder, or parts of a film, already hold, counted from 0; the others are recorded
        in their order. If it is given, even empty, an MP4 is written in parts (terrain_gl/film/parts.py).

    Raises
    ------
    UsageError
        An unknown ending, or a frame rate out of range.
    TerrainError
        The file or folder cannot be written, the folder holds other frames, or PyAV is missing.

    Examples
    --------
    >>> with Recorder("flight.mp4", fps=30) as recorder:  # doctest: +SKIP
    ...     for camera in cameras:
    ...         recorder.append(renderer.render(camera).image)
    """

    def __init__(self, path: str | os.PathLike[str], fps: float = FPS, kept: Collection[int] | None = None) -> None:
        self.path = os.fspath(path)
        if not 0 < fps <= MAX_FPS:
            raise UsageError(f"frames a second must be more than 0 and at most {MAX_FPS:g}, got {fps:g}")
        self.frames = len(kept or ())
        first = None if kept is None else self.frames
        writing = _pictures(Path(path), kept or ()) if is_folder(path) else _film(Path(path), fps, first)
        self._shape: tuple[int, ...] | None = None
        self._cancelled = False
        self._error: BaseException | None = None
        self._queue: queue.Queue[np.ndarray | None] = queue.Queue(WAITING)
        self._thread = threading.Thread(target=self._run, args=(writing,), name="recorder", daemon=True)
        self._thread.start()

    def append(self, image: np.ndarray, wait: bool = True) -> bool:
        """Record a frame; False if it was dropped.

        Parameters
        ----------
        image
            (height, width, 3 or 4) uint8, first row on top; all frames have the same size.
        wait
            If the encoder is behind, wait for it, or drop the frame.

        Raises
        ------
        TerrainError
            The frame has another size, or writing has failed. Nothing more can be recorded after a failure.
        """
        self._raise_error()
        self._shape = self._shape or image.shape
        if image.shape != self._shape or image.ndim != 3 or image.dtype != np.uint8:
            raise TerrainError(f"{self.path}: expected a frame of {self._shape} uint8, got {image.shape} {image.dtype}")
        return self._put(np.ascontiguousarray(image[..., :3]), wait)

    def close(self) -> None:
        """Finish the file; `TerrainError` if it cannot be written."""
        if self._thread.is_alive():
            try:
                self._put(None, wait=True)
                self._thread.join()
            except BaseException:  # interrupted while waiting: drop the film
                self.cancel()
                raise
        self._raise_error()

    def cancel(self) -> None:
        """Stop without a film. Pictures that are already in a folder stay."""
        self._cancelled = True
        with contextlib.suppress(queue.Full):
            self._queue.put_nowait(None)
        self._thread.join()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if error is None:
            self.close()
        else:
            self.cancel()

    def _put(self, item: np.ndarray | None, wait: bool) -> bool:
        while self._thread.is_alive():
            try:
                self._queue.put(item, wait, 0.1)  # a short wait only: the thread may end before it takes the frame
                return True
            except queue.Full:
                if not wait:
                    return False
        self._raise_error()
        raise TerrainError(f"{self.path}: the recording has ended")

    def _raise_error(self) -> None:
        if self._error is not None:
            raise self._error

    def _run(self, writing: AbstractContextManager[Write]) -> None:
        try:
            with writing as write:
                while (image := self._queue.get()) is not None and not self._cancelled:
                    write(image)
                    self.frames += 1
                if self._cancelled:
                    raise _CancelledError
                if not self.frames:
                    raise TerrainError(f"{self.path}: a film needs at least one frame")
        except _CancelledError:
            pass
        except Exception as error:
            self._error = error


class _CancelledError(Exception):
    """Ends a film without writing its file."""


def is_folder(path: str | os.PathLike[str]) -> bool:
    """Whether a name means a folder of pictures, not a film."""
    name = os.fspath(path)
    return name.endswith(("/", os.sep)) or os.path.isdir(name) or not os.path.splitext(name)[1]


def picture_name(number: int) -> str:
    """File name of a picture; `number` counts from 0."""
    return f"frame-{number + 1:05d}.png"


def _pictures(folder: Path, kept: Collection[int]) -> AbstractContextManager[Write]:
    made = not folder.is_dir()
    held = _locked(folder)
    if not kept and any(folder.glob("frame-*.png")):
        os.close(held)
        raise TerrainError(f"{folder}: holds frames already: name another folder, or empty it")
    for left in folder.glob(".frame-*"):  # of a flight that was killed
        left.unlink()
    return _numbered(folder, made, held, kept)


def _locked(folder: Path) -> int:
    """Make a folder, and lock it against other recordings; returns the descriptor, which the system closes at exit."""
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise TerrainError(f"{folder}: cannot make this folder: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise TerrainError(f"{folder}: no permission to write there: choose another folder")
    try:
        return lock(folder, waits=False)
    except BlockingIOError:
        raise TerrainError(f"{folder}: another recording is being written there: name another folder") from None


@contextmanager
def _numbered(folder: Path, made: bool, held: int, kept: Collection[int]) -> Iterator[Write]:
    """Write the numbered files that a folder lacks; a new folder that stays empty is removed."""
    done = len(kept)
    missing = (number for number in count() if number not in kept)

    def write(image: np.ndarray) -> None:
        nonlocal done
        try:
            write_png(folder / picture_name(next(missing)), image)
        except TerrainError as error:
            raise TerrainError(f"{error}; {done} other pictures are complete") from None
        done += 1

    try:
        yield write
    finally:
        os.close(held)
        if made and not done:
            parts.remove_empty(folder)


def _film(path: Path, fps: float, first: int | None) -> AbstractContextManager[Write]:
    codec = CODECS.get(path.suffix.lower())
    if codec is None:
        raise UsageError(f"{path}: a film's name must end in one of {', '.join(CODECS)}, or name a folder, FRAMES/")
    if codec.encoder == "gif" and fps > GIF_FPS:
        raise UsageError(f"{path}: a GIF has at most {GIF_FPS:g} frames a second, got {fps:g}")
    try:
        import av
    except ImportError:
        raise TerrainError(
            f"{path}: films need the extra [video]: pip install 'terrain-gl[video]'; a folder, FRAMES/, needs no extra"
        ) from None
    if not path.parent.is_dir():
        raise TerrainError(f"{path}: there is no folder {path.parent}: make it first")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise TerrainError(f"{path}: no permission to write in {path.parent}: choose another folder")
    rate = Fraction(fps).limit_denominator(1001)
    if first is None:
        return _encoded(av, path, codec, rate)
    return _in_parts(av, path, codec, rate, first, _locked(parts.folder_of(path)))


@contextmanager
def _in_parts(av: Any, film: Path, codec: Codec, rate: Fraction, first: int, held: int) -> Iterator[Write]:
    """Write the parts of a film from frame `first` on; at the end, join all parts, and remove them.

    `held` is the descriptor that locks their folder.
    """
    done = complete = first
    try:
        with contextlib.ExitStack() as part:
            put: Write

            def write(image: np.ndarray) -> None:
                nonlocal done, complete, put
                if done % parts.FRAMES == 0:
                    put = part.enter_context(_encoded(av, parts.part_of(film, done), codec, rate))
                put(image)
                done += 1
                if done % parts.FRAMES == 0:
                    part.close()
                    complete = done

            yield write
            part.close()
            complete = done
        with replacing(film) as beside, _reasons(av, film):
            _join(av, [parts.part_of(film, frame) for frame in range(0, done, parts.FRAMES)], beside, rate, codec)
        for file in parts.folder_of(film).glob("*part-*.mp4"):
            file.unlink()
    except TerrainError as error:
        if not complete:
            raise
        raise TerrainError(f"{error}; the first {complete} pictures are complete") from None
    finally:
        parts.remove_empty(parts.folder_of(film))
        os.close(held)


def _join(av: Any, files: Sequence[Path], to: Path, rate: Fraction, codec: Codec) -> None:
    """Join the parts of a film as they are: nothing is encoded twice."""
    with av.open(os.fspath(to), "w", format=codec.container, container_options=codec.container_options) as joined:
        stream = None
        for number, file in enumerate(files):
            with av.open(os.fspath(file)) as part:
                stream = stream or joined.add_stream_from_template(part.streams.video[0])
                for packet in part.demux(video=0):
                    if packet.dts is not None:  # the last packet is empty
                        ticks = round(number * parts.FRAMES / rate / packet.time_base)
                        packet.pts = packet.pts + ticks
                        packet.dts = packet.dts + ticks
                        packet.stream = stream
                        joined.mux(packet)


@contextmanager
def _encoded(av: Any, path: Path, codec: Codec, rate: Fraction) -> Iterator[Write]:
    """Write a film to a temporary file, which gets its name at the end. The first frame sets the size."""
    is_h264 = codec.encoder == "libx264"
    numbers = count()
    stream: Any = None
    convert: Callable[[Any], Any] = _h264_pixels if is_h264 else lambda frame: frame.reformat(format=codec.pixels)
    options = codec.container_options
    with (
        replacing(path) as part,
        _reasons(av, path),
        av.open(os.fspath(part), "w", format=codec.container, container_options=options) as film,
    ):

        def write(image: np.ndarray) -> None:
            nonlocal stream, convert
            if is_h264:
                image = _even(image)
            if stream is None:
                height, width = image.shape[:2]
                stream = _stream(film, codec, rate, width, height)
                if codec.encoder == "gif":
                    convert = _palette_pixels(av, width, height, 1 / rate)
            frame = av.VideoFrame.from_ndarray(np.ascontiguousarray(image), "rgb24")
            frame.pts = next(numbers)
            frame.time_base = 1 / rate
            film.mux(stream.encode(convert(frame)))

        yield write
        if stream is not None:
            film.mux(stream.encode(None))  # what the encoder still holds


def _stream(film: Any, codec: Codec, rate: Fraction, width: int, height: int) -> Any:
    stream = film.add_stream(codec.encoder, rate, options=dict(codec.encoder_options))
    stream.width = width
    stream.height = height
    stream.pix_fmt = codec.pixels
    context = stream.codec_context
    context.time_base = 1 / rate
    if codec.encoder == "libx264":
        context.colorspace = context.color_primaries = context.color_trc = _BT709
        context.color_range = _LIMITED
    return stream


def _h264_pixels(frame: Any) -> Any:
    """Pixels as players expect them in H.264: the matrix of BT.709, limited range 16 to 235."""
    return frame.reformat(format="yuv420p", dst_colorspace="ITU709", dst_color_range="MPEG")


def _palette_pixels(av: Any, width: int, height: int, time_base: Fraction) -> Callable[[Any], Any]:
    """A conversion to the best 256 colours for each frame, with FFmpeg's filters palettegen and paletteuse."""
    graph = av.filter.Graph()
    frames = graph.add_buffer(width=width, height=height, format="rgb24", time_base=time_base)
    twice = graph.add("split")
    palette = graph.add("palettegen", "stats_mode=single")
    dithered = graph.add("paletteuse", "new=1:dither=bayer:bayer_scale=4")
    out = graph.add("buffersink")
    for one, other, port in ((frames, twice, 0), (twice, palette, 0), (palette, dithered, 1), (dithered, out, 0)):
        one.link_to(other, 0, port)
    twice.link_to(dithered, 1, 0)
    graph.configure()

    def convert(frame: Any) -> Any:
        graph.push(frame)
        return graph.pull()

    return convert


@contextmanager
def _reasons(av: Any, path: Path) -> Iterator[None]:
    """Report FFmpeg's errors in one line."""
    try:
        yield
    except av.FFmpegError as error:
        raise TerrainError(f"{path}: cannot write: {error.strerror or error}") from None


def _even(image: np.ndarray) -> np.ndarray:
    """Crop to even sides: H.264 stores colours for every other pixel."""
    height, width = image.shape[0] & ~1, image.shape[1] & ~1
    if min(height, width) < 2:
        raise TerrainError(f"an MP4 takes pictures of at least 2x2 pixels, got {image.shape[1]}x{image.shape[0]}")
    return image[:height, :width]
