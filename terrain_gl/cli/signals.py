"""Ctrl-C and a request to end, heard where they do no harm.

A signal becomes an exception in whatever Python code runs. Where that was called from C which does not look whether an
exception came of it, as moderngl does for every uniform of a shader, the process dies of it; where modules are imported
it may end the process or get lost. So a signal waits until neither is at work: milliseconds, mostly.
"""

from __future__ import annotations

import signal
from types import FrameType

_CALLED_FROM_C = ("_moderngl", "terrain_gl.loaders")  # by moderngl's
_AGAIN_S = 0.001


def listen() -> None:
    """Have Ctrl-C raise KeyboardInterrupt, and a request to end SystemExit, so that half-written files go."""
    signal.signal(signal.SIGTERM, _heard)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # else we are not to hear it
        signal.signal(signal.SIGINT, _heard)


def rest() -> None:
    """Let go of a signal that still waits: there is nothing left to end."""
    if hasattr(signal, "setitimer"):
        signal.setitimer(signal.ITIMER_REAL, 0)


def _heard(number: int, frame: FrameType | None) -> None:
    if _harms(frame) and hasattr(signal, "setitimer"):
        signal.signal(signal.SIGALRM, lambda _, later: _heard(number, later))
        signal.setitimer(signal.ITIMER_REAL, _AGAIN_S)
        return
    if number == signal.SIGINT:
        raise KeyboardInterrupt
    raise SystemExit(128 + number)


def _harms(frame: FrameType | None) -> bool:
    """Whether an exception would pass through what does not expect it."""
    while frame:
        module = frame.f_globals.get("__name__") or ""
        if module in _CALLED_FROM_C or module.startswith("importlib"):
            return True
        frame = frame.f_back
    return False
