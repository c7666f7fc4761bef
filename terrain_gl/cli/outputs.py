"""Checks of output files, before any work is done."""

import os
from collections.abc import Iterable
from pathlib import Path

from ..basics import resources
from ..basics.exceptions import TerrainError, UsageError


def check_outputs(outputs: Iterable[str | None], inputs: Iterable[str]) -> None:
    """Refuse outputs that cannot be written, and those that are also inputs."""
    written = tuple(outputs)
    check_writable(*written)
    refuse_inputs(written, inputs)


def refuse_inputs(outputs: Iterable[str | None], inputs: Iterable[str]) -> None:
    """Refuse outputs that are also inputs."""
    written = {os.path.realpath(path) for path in outputs if path}
    for read in inputs:
        if os.path.realpath(read) in written:
            raise UsageError(f"{read}: is also an input: name another file for the output")


def check_writable(*paths: str | None) -> None:
    """Refuse outputs that cannot be written, and two outputs with one name, before any work is done."""
    files = [path for path in paths if path and path != "-"]
    for path in files:
        folder = os.path.dirname(path) or "."
        if not os.path.isdir(folder):
            raise TerrainError(f"{path}: there is no folder {folder}: make it first")
        if os.path.exists(path) and not os.path.isfile(path):
            raise TerrainError(f"{path}: is a folder or a device: name a file")
        if not os.access(folder, os.W_OK | os.X_OK):
            raise TerrainError(f"{path}: no permission to write in {folder}: choose another folder")
        if resources.holds(Path(path)):
            raise UsageError(f"{path}: comes with terrain-gl: name another file for the output")
    if len({os.path.realpath(path) for path in files}) < len(files):
        raise UsageError(f"{files[0]}: is the name of two outputs: name two files")
