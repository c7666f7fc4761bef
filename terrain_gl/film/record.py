"""Films: frames go in one at a time; the output is an MP4, GIF, animated WebP or PNG, or a folder of PNGs.

A separate thread encodes the frames from a short queue, so that drawing need not wait. A film appears under its name
only when it is complete. A folder keeps all complete pictures, and a film in parts keeps all complete parts.
"""

from __future__ import annotations

import contextlib
import fcntl
import os
import queue
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from fractions import Fraction
from functools import partial
from pathlib import Path
from types import TracebackType
from typing import Any, NamedTuple

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..basics.replacing import replacing
from ..image import write_png
from . import parts

WAITING = 4  # most frames in the queue
MAX_FPS = 1000.0
GIF_FPS = 50.0  # browsers play a faster GIF at ten frames a second
Write = parts.Write


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
    first
        Number of frames that a folder, or parts of a film, already hold; new frames follow them. With a number, also
        0, an MP4 is written in parts (terrain_gl/film/parts.py).

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

    def __init__(self, path: str | os.PathLike[str], fps: float = 30.0, first: int | None = None) -> None:
        self.path = os.fspath(path)
        if not 0 < fps <= MAX_FPS:
            raise UsageError(f"frames a second must be more than 0 and at most {MAX_FPS:g}, got {fps:g}")
        writing = _pictures(Path(path), first or 0) if is_folder(path) else _film(Path(path), fps, first)
        self.frames = first or 0
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
            Whether to wait if the encoder is behind; else the frame is dropped.

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


# --- Pictures ---------------------------------------------------------------------------------------------------------


def picture_name(number: int) -> str:
    """File name of a picture; `number` counts from 0."""
    return f"frame-{number + 1:05d}.png"


def _pictures(folder: Path, first: int) -> AbstractContextManager[Write]:
    made = not folder.is_dir()
    lock = _locked(folder)
    if not first and any(folder.glob("frame-*.png")):
        os.close(lock)
        raise TerrainError(f"{folder}: holds frames already: name another folder, or empty it")
    return _numbered(folder, made, lock, first)


def _locked(folder: Path) -> int:
    """Lock a folder against other recordings; returns the descriptor to close (the system closes it at exit).

    A missing folder is made.
    """
    try:
        folder.mkdir(exist_ok=True)
    except OSError as error:
        raise TerrainError(f"{folder}: cannot make this folder: {error.strerror}") from None
    if not os.access(folder, os.W_OK | os.X_OK):
        raise TerrainError(f"{folder}: no permission to write there: choose another folder")
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(descriptor)
        raise TerrainError(f"{folder}: another recording is being written there: name another folder") from None
    except OSError:  # a file system without locks
        pass
    return descriptor


@contextmanager
def _numbered(folder: Path, made: bool, lock: int, first: int) -> Iterator[Write]:
    """Write numbered files to a folder; a new folder that stays empty is removed."""
    done = first

    def write(image: np.ndarray) -> None:
        nonlocal done
        try:
            write_png(folder / picture_name(done), image)
        except TerrainError as error:
            raise TerrainError(f"{error}; the {done} pictures before it are complete") from None
        done += 1

    try:
        yield write
    finally:
        os.close(lock)
        if made and not done:
            parts.remove_empty(folder)


# --- Films ------------------------------------------------------------------------------------------------------------


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
            f"{path}: films need the extra [video]: pip install 'terrain-gl[video]'; a folder, FRAMES/, does not"
        ) from None
    if not path.parent.is_dir():
        raise TerrainError(f"{path}: there is no folder {path.parent}: make it first")
    if not os.access(path.parent, os.W_OK | os.X_OK):
        raise TerrainError(f"{path}: no permission to write in {path.parent}: choose another folder")
    rate = Fraction(fps).limit_denominator(1001)
    encode = partial(_encoded, av, codec=codec, rate=rate)
    if first is None:
        return encode(path)

    def join(files: Sequence[Path]) -> None:
        with replacing(path) as beside, _reasons(av, path):
            parts.join(av, files, beside, rate, codec.container_options)

    return parts.writing(path, first, _locked(parts.folder_of(path)), encode, join)


@contextmanager
def _encoded(av: Any, path: Path, codec: Codec, rate: Fraction) -> Iterator[Write]:
    """Write a film to a temporary file, which gets its name at the end."""
    with replacing(path) as part, _reasons(av, path):
        film = _Film(av, part, codec, rate)
        try:
            yield film.write
            film.finish()
        finally:
            film.close()


class _Film:
    """A film that PyAV writes; the first frame sets its size."""

    def __init__(self, av: Any, part: Path, codec: Codec, rate: Fraction) -> None:
        self._av = av
        self._codec = codec
        self._rate = rate
        self._frames = 0
        self._file = av.open(os.fspath(part), "w", format=codec.container, container_options=codec.container_options)
        self._stream: Any = None
        self._convert: Callable[[Any], Any] = _h264_pixels if codec.encoder == "libx264" else self._plain_pixels

    def write(self, image: np.ndarray) -> None:
        """Encode a frame."""
        if self._codec.encoder == "libx264":
            image = _even(image)
        if self._stream is None:
            self._open(image.shape[1], image.shape[0])
        frame = self._av.VideoFrame.from_ndarray(np.ascontiguousarray(image), "rgb24")
        frame.pts = self._frames
        frame.time_base = 1 / self._rate
        self._frames += 1
        self._file.mux(self._stream.encode(self._convert(frame)))

    def finish(self) -> None:
        """Flush the encoder."""
        if self._stream is not None:
            self._file.mux(self._stream.encode(None))

    def close(self) -> None:
        """Close the file."""
        self._file.close()

    def _open(self, width: int, height: int) -> None:
        codec = self._codec
        self._stream = self._file.add_stream(codec.encoder, self._rate, options=dict(codec.encoder_options))
        self._stream.width = width
        self._stream.height = height
        self._stream.pix_fmt = codec.pixels
        context = self._stream.codec_context
        context.time_base = 1 / self._rate
        if codec.encoder == "libx264":
            context.colorspace = context.color_primaries = context.color_trc = _BT709
            context.color_range = _LIMITED
        elif codec.encoder == "gif":
            self._convert = _palette_pixels(self._av, width, height, 1 / self._rate)

    def _plain_pixels(self, frame: Any) -> Any:
        return frame.reformat(format=self._codec.pixels)


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
