"""An X server without a screen for tests of the real window: reads pixels; sends keys and mouse by xdotool."""

import contextlib
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

_DRIVER = re.compile(r"(libEGL|libGL|MESA|Mesa|ZINK)\b")


def own_lines(stderr):
    """The lines of a program's standard error, except those of the graphics driver.

    Mesa 24 and 25 write "libEGL warning: DRI3 error: Could not get DRI3 device" under Xvfb, although all is well.
    """
    return [line for line in stderr.splitlines() if not _DRIVER.match(line)]


class Screen:
    """An X server whose pixels lie in a file of a folder."""

    def __init__(self, folder):
        self.folder = folder
        read, write = os.pipe()
        options = ["-displayfd", str(write), "-screen", "0", "1280x800x24", "-fbdir", str(folder), "-nolisten", "tcp"]
        self.server = subprocess.Popen(["Xvfb", *options], pass_fds=[write], stderr=subprocess.DEVNULL)
        os.close(write)
        with os.fdopen(read) as pipe:
            self.environment = os.environ | {"DISPLAY": f":{pipe.readline().strip()}", "XDG_STATE_HOME": str(folder)}

    def pixels(self):
        """(height, width, 3) of the screen, from its XWD file."""
        data = (self.folder / "Xvfb_screen0").read_bytes()
        header = np.frombuffer(data, ">u4", 25)
        width, height, stride, first = header[4], header[5], header[12], header[0] + 12 * header[19]
        rows = np.frombuffer(data, np.uint8, height * stride, first).reshape(height, stride)
        return rows[:, : 4 * width].reshape(height, width, 4)[..., 2::-1].astype(int)

    def do(self, *words):
        """Run xdotool."""
        words = ["xdotool", *map(str, words)]
        subprocess.run(words, env=self.environment, check=True, stdout=subprocess.DEVNULL, timeout=120)

    def is_at_rest(self, process):
        """Whether nothing changes for a second, and the process has done nothing: on a busy machine work takes long."""
        before, worked_s = self.pixels(), _work_s(process)
        time.sleep(1.0)
        return _work_s(process) - worked_s < 0.03 and np.array_equal(self.pixels(), before)

    @contextlib.contextmanager
    def running(self, *arguments, cwd):
        """A Python process with these arguments on this screen; it is killed if it is still alive at the end."""
        process = subprocess.Popen(
            [sys.executable, *map(str, arguments)],
            cwd=cwd,
            env=self.environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )
        try:
            yield process
        finally:
            if process.poll() is None:
                process.kill()
                process.communicate()

    def wait(self, condition, what, seconds=120):  # slow machines need long
        """Wait until a condition holds."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if condition():
                return
            time.sleep(0.05)
        raise AssertionError(f"waited {seconds} s for {what}")


def _work_s(process):
    """Seconds of processor time that a process has taken."""
    fields = Path(f"/proc/{process.pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def end_of(process):
    """Exit status, standard output and our own lines of standard error, when a process has ended."""
    output, errors = process.communicate(timeout=120)
    return process.returncode, output.strip(), own_lines(errors)
