"""Films of what is seen: fed with frames at their own pace, finished in a thread of their own."""

from __future__ import annotations

import importlib.util
import threading
from collections.abc import Callable
from pathlib import Path

import numpy as np

from ..exceptions import TerrainError
from ..film.record import Recorder


class Filming:
    """At most one film at a time.

    Parameters
    ----------
    say
        Told in a line how it goes.
    """

    def __init__(self, say: Callable[[str], None]) -> None:
        self._say = say
        self._recorder: Recorder | None = None
        self._begun_s = 0.0
        self._finishing: list[threading.Thread] = []

    @property
    def running(self) -> bool:
        """Whether frames are wanted."""
        return self._recorder is not None

    def begin(self, path: Path, now_s: float) -> None:
        """Begin a film; what stands in the way is told."""
        try:
            self._recorder, self._begun_s = Recorder(path), now_s
        except TerrainError as error:
            self._say(str(error))
        else:
            self._say(f"recording {path}: R stops")

    def add(self, image: np.ndarray, now_s: float) -> None:
        """Add what is seen now; where that fails the film ends."""
        assert self._recorder
        try:
            self._recorder.append(image, now_s - self._begun_s, wait=False)
        except TerrainError as error:
            self._recorder.cancel()
            self._recorder = None
            self._say(f"recording ended: {error}")

    def stop(self) -> None:
        """Finish the film; encoders take their time, so in a thread."""
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
    """Ending of a film's name: without the extra [video] it is a folder of pictures."""
    return ".mp4" if importlib.util.find_spec("av") else ""
