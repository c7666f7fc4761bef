"""Requests to end (Ctrl-C, kill, a closed terminal), heard where they do no harm, and once.

A signal becomes an exception in whatever Python code runs. Where that was called from C which does not look whether an
exception came of it, as moderngl does for every uniform of a shader, the process dies of it; where modules are imported
it may end the process or get lost. So a signal waits until neither is at work: milliseconds, mostly.
After the first, all others are ignored: they would interrupt the removal of half-written files.
"""

from __future__ import annotations

import signal
from types import FrameType

_CALLED_FROM_C = ("_moderngl", "terrain_gl.gpu.loaders")  # by moderngl's
_AGAIN_S = 0.001
_REQUESTS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name))
_ending: list[int] = []  # the signal that ends the process


def listen() -> None:
    """Have Ctrl-C raise KeyboardInterrupt, and a request to end SystemExit, so that half-written files go."""
    for number in _REQUESTS:
        if signal.getsignal(number) != signal.SIG_IGN:  # nohup has a command live on
            signal.signal(number, _heard)
    if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_DFL):  # else we are not to hear it
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
    if _ending:
        return
    _ending.append(number)
    rest()
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
