"""Requests to end (Ctrl-C, kill, a closed terminal): handled once, and only when that is safe.

A signal raises an exception in the Python code that runs. That is unsafe in three cases. Some C code calls Python and
does not check for exceptions (moderngl, for every uniform of a shader): then the process dies. During an import, the
exception may end the process or get lost. While an object is deleted, Python prints the exception and goes on. So
a signal waits until none of these cases holds, usually for milliseconds. All signals after the first are ignored,
because they would interrupt the removal of half-written files.
"""

import signal
from types import FrameType

_CALLED_FROM_C = ("_moderngl", "terrain_gl.gpu.loaders")  # modules that moderngl's C code calls
_AGAIN_S = 0.001
_REQUESTS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP", "SIGQUIT") if hasattr(signal, name))
_ending: list[int] = []  # the signal that ends the process


def listen() -> None:
    """Let Ctrl-C raise KeyboardInterrupt, and other requests raise SystemExit. So half-written files are removed."""
    for number in _REQUESTS:
        if signal.getsignal(number) != signal.SIG_IGN:  # nohup ignores SIGHUP on purpose
            signal.signal(number, _heard)
    if signal.getsignal(signal.SIGINT) in (signal.default_int_handler, signal.SIG_DFL):  # else it is ignored on purpose
        signal.signal(signal.SIGINT, _heard)


def rest() -> None:
    """Drop a signal that still waits, because the work is done."""
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
    """Whether an exception would pass through code that does not expect it."""
    while frame:
        module = frame.f_globals.get("__name__") or ""
        if module in _CALLED_FROM_C or module.startswith("importlib") or frame.f_code.co_name == "__del__":
            return True
        frame = frame.f_back
    return False
