"""Records films of what is seen. A film is finished in a thread."""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..exceptions import TerrainError
from ..film.record import Recorder


class Filming:
    """Records at most one film at a time.

    Parameters
    ----------
    say
        Shows a message.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._recorder: Recorder | None = None
        self._begun_s = 0.0
        self._finishing: list[threading.Thread] = []

    @property
    def running(self) -> bool:
        """Whether a film is being recorded."""
        return self._recorder is not None

    def begin(self, path: Path, now_s: float) -> None:
        """Begin a film, or say why it cannot begin."""
        try:
            self._recorder, self._begun_s = Recorder(path), now_s
        except TerrainError as error:
            self._say(str(error))
        else:
            self._say(f"recording {path}: R stops")

    def add(self, image: np.ndarray, now_s: float) -> None:
        """Add a frame, (height, width, 3) uint8; if that fails, the film ends."""
        assert self._recorder
        try:
            self._recorder.append(image, now_s - self._begun_s, wait=False)
        except TerrainError as error:
            self._recorder.cancel()
            self._recorder = None
            self._say(f"recording ended: {error}")

    def stop(self) -> None:
        """Finish the film in a thread, because encoders take their time."""
        if self._recorder is None:
            return
        recorder, self._recorder = self._recorder, None
        thread = threading.Thread(target=self._finish, args=(recorder,), name=f"finishing {recorder.path}")
        self._finishing = [t for t in self._finishing if t.is_alive()] + [thread]
        thread.start()

    def join(self) -> None:
        """Wait until all films are finished."""
        for thread in self._finishing:
            thread.join()

    def _finish(self, recorder: Recorder) -> None:
        try:
            recorder.close()
        except (TerrainError, OSError) as error:
            self._say(f"recording failed: {error}")
        else:
            path = Path(recorder.path).absolute()
            film = "" if path.suffix else ", a folder of pictures (pip install 'terrain-gl[video]' for films)"
            self._say(f"recorded {path}{film}: {recorder.frames} frames")


def film_suffix() -> str:
    """Ending of the name of a film; "" without the extra [video], which makes it a folder of pictures."""
    return ".mp4" if importlib.util.find_spec("av") else ""
