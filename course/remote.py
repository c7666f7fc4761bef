"""A student's file in a separate process: its functions are called there, and only values come back."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import TracebackType
from typing import Any

from .box import walls, wire

WORKER = Path(__file__).parent / "box" / "worker.py"
ORIGINAL = "handed_out.py"  # as in worker.py
PRINTED = 4000  # characters of a student's own prints that are shown


class StudentError(Exception):
    """A student's function raised, took too long, or returned what cannot be sent."""


class BlankError(StudentError):
    """A student's function is not written yet."""


class Student:
    """The functions of one file. Call them as methods: student.shift_px(points).

    Parameters
    ----------
    file
        The student's file. A copy of it runs.
    seconds
        Time for all calls together.
    walled
        Deny the code files, network and other processes, as far as the system can.
    original
        The file as it was handed out: a function that is still the same is blank.
    ours
        The file is the course's own: its errors have no line.
    """

    def __init__(
        self, file: Path, seconds: float = 60.0, walled: bool = False, original: str = "", ours: bool = False
    ) -> None:
        self._left, self._over, self._broken, self._told, self._ours = seconds, False, False, 0, ours
        self.original, self.source = original, "" if ours else file.read_text("utf-8", "replace")
        self._folder = Path(tempfile.mkdtemp(prefix="course-"))
        copy = self._folder / file.name
        shutil.copyfile(file, copy)
        (self._folder / ORIGINAL).write_text(original, encoding="utf-8")
        kind = "ours" if ours else "walled" if walled else "open"
        words = [sys.executable, "-I", "-B", "-u", str(WORKER), str(copy), kind]
        self._process = subprocess.Popen(
            walls.command(words, self._folder) if walled else words,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            cwd=self._folder,
            start_new_session=True,
        )

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """A function of the student's."""
        if name.startswith("_"):
            raise AttributeError(name)
        return lambda *args, **kwargs: self.call(name, *args, **kwargs)

    def call(self, name: str, *args: Any, **kwargs: Any) -> Any:
        """Call a function and return its value; StudentError says why there is none."""
        return self.call_with({}, name, *args, **kwargs)

    def call_with(self, replaced: dict[str, str], name: str, *args: Any, **kwargs: Any) -> Any:
        """Call a function while other functions of the file are replaced by expressions; "" only loads the file."""
        who = "the shaders" if self._ours else f"{name}()" if name else "the file"
        start, alarm = time.monotonic(), threading.Timer(max(self._left, 0.0), self._end)
        alarm.start()
        try:
            answer = self._ask(wire.pack((name, args, kwargs, replaced)))
        except (OSError, EOFError):
            self._broken = True
            why = "the time limit is over" if self._over else "the process ended (memory, processor time or exit)"
            raise StudentError(f"{who}: {why}") from None
        except (ValueError, KeyError, TypeError) as error:
            self._broken = True  # later bytes in the pipe cannot be matched with a request
            raise StudentError(f"{who}: the answer cannot be read: {error}") from None
        finally:
            alarm.cancel()
            self._left -= time.monotonic() - start
        if "error" in answer:
            raise (BlankError if answer.get("blank") is True else StudentError)(str(answer["error"]))
        return answer["value"]

    def _ask(self, request: bytes) -> dict[str, Any]:
        stdin, stdout = self._process.stdin, self._process.stdout
        assert stdin is not None and stdout is not None
        stdin.write(request)
        stdin.flush()
        answer = wire.read(stdout)
        if not isinstance(answer, dict) or not {"value", "error"} & set(answer):
            raise ValueError("it has neither a value nor an error")
        return answer

    def _end(self) -> None:
        """Kill the process and all processes that it has started."""
        self._over = True
        if self._process.poll() is None:
            os.killpg(self._process.pid, signal.SIGKILL) if hasattr(os, "killpg") else self._process.kill()

    @property
    def printed(self) -> str:
        """The text that the code has printed since the last call, cut to `PRINTED` characters."""
        try:
            with open(self._folder / "printed", "rb") as file:
                file.seek(self._told)
                text = file.read(PRINTED).decode("utf-8", "replace")
                self._told = file.seek(0, os.SEEK_END)
                return text
        except OSError:
            return ""

    @property
    def ended(self) -> bool:
        """Whether the process has ended."""
        return self._broken or self._process.poll() is not None

    def allow(self, seconds: float) -> None:
        """Set the time for all further calls together."""
        self._left = seconds

    def close(self) -> None:
        """End the process and remove its folder."""
        self._end()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            with contextlib.suppress(OSError):
                stream.close()  # type: ignore[union-attr]
        shutil.rmtree(self._folder, ignore_errors=True)

    def __enter__(self) -> Student:
        """Use as `with Student(file) as student`."""
        return self

    def __exit__(self, kind: type | None, error: BaseException | None, trace: TracebackType | None) -> None:
        """End the process."""
        self.close()
