"""Try to get out of the box. The grader runs this as if a student had written it."""

from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path


def escapes(beside: str, parent: int) -> list[str]:
    """The forbidden actions that succeed, among: write, delete, chmod, read, network, signal, fork."""

    def fork() -> None:
        subprocess.Popen([sys.executable, "-c", "pass"]).wait()

    def connect() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as s:
            s.connect(("192.0.2.1", 9))  # an address for documentation: no packet leaves for a mere connect

    tries: dict[str, Callable[[], object]] = {
        "reads files": lambda: Path(beside, "kept").read_text(),
        "writes files": lambda: Path(beside, "new").write_text("x"),
        "changes permissions": lambda: os.chmod(Path(beside, "kept"), 0o640),
        "deletes files": lambda: os.remove(Path(beside, "kept")),
        "uses the network": connect,
        "signals processes": lambda: os.kill(parent, signal.SIGCONT),
    }
    return [name for name, attempt in tries.items() if _goes_through(attempt)]


def _goes_through(attempt: Callable[[], object]) -> bool:
    try:
        attempt()
    except OSError:
        return False
    return True
