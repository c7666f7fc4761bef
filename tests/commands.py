"""Call the command line from a test: in this process or in a separate one, on a small map."""

import os
import subprocess
import sys

import numpy as np

from terrain_gl import cli
from terrain_gl.cli.records import told

SIZE = ("--size", "96x64")


def small_map():
    """Write a small map with a hill into the working directory; returns its name."""
    y, x = np.mgrid[0:65, 0:97]
    np.save("dem.npy", (40 * np.exp(-((x - 50) ** 2 + (y - 30) ** 2) / 300) + 0.1 * x).astype("f4"))
    return "dem.npy"


def spawn(*words, **settings):
    """Run the command line in a process of its own."""
    environment = os.environ | settings.pop("env", {})
    command = [sys.executable, "-m", "terrain_gl", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, env=environment, **settings)


def refused(result, status, *texts):
    """Assert that a run ended with `status` and one line on standard error that holds the texts."""
    code, out, err = result if isinstance(result, tuple) else (result.returncode, result.stdout, result.stderr)
    assert (code, out) == (status, ""), err
    assert err.startswith("terrain-gl") and err.count("\n") == 1, err
    assert all(text in err for text in texts), err


def parse(*words):
    """The record of a command line."""
    given = cli.parser().parse_args(cli.join_negative(words))
    return told(given.record, given)
