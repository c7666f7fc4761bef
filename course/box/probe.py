"""Try to get out of the box. The grader runs this as if a student had written it."""

from __future__ import annotations

import os
import signal
import socket
from collections.abc import Callable
from pathlib import Path


def escapes(beside: str, parent: int, answers: list[str]) -> list[str]:
    """The forbidden actions that succeed: of write, delete, chmod, read, network, signal, fork.

    `answers` are files with the computations that students write.
    """

    def fork() -> None:
        if os.fork() == 0:
            os._exit(0)

    def connect() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
            s.connect(("192.0.2.1", 9))  # a reserved address; connect() alone sends no packet

    def stop_and_go() -> None:
        if parent == os.getpid():  # both ids are 1 if they belong to two namespaces, as in a container
            raise ProcessLookupError
        os.kill(parent, signal.SIGCONT)

    tries: dict[str, Callable[[], object]] = {
        "reads files": lambda: Path(beside, "kept").read_text(),
        "writes files": lambda: Path(beside, "new").write_text("x"),
        "changes permissions": lambda: os.chmod(Path(beside, "kept"), 0o640),
        "deletes files": lambda: os.remove(Path(beside, "kept")),
        "uses the network": connect,
        "signals processes": stop_and_go,
        "starts processes": fork,
    }
    tries |= {f"reads {path}": Path(path).read_bytes for path in answers}
    return [name for name, attempt in tries.items() if _goes_through(attempt)]


def _goes_through(attempt: Callable[[], object]) -> bool:
    try:
        attempt()
    except OSError:
        return False
    return True
