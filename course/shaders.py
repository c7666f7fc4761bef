"""Findings about students' shaders. They run in a separate process; without OpenGL they do not run."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np

from .checking import BLANK, HERE, NOT_RUN, WRONG, Finding, compare
from .remote import Student, StudentError

RUNNER = HERE / "box" / "shaders.py"
SECONDS = 20.0


def missing() -> str:
    """Why there is no OpenGL 4.3 here; empty if there is."""
    try:
        _renderer()
    except StudentError as error:
        return f"this machine has no OpenGL 4.3: {error}"
    return ""


@cache  # a failure is no answer, and is tried again: a busy machine may be late once
def _renderer() -> str:
    """Name of the driver."""
    with Student(RUNNER, SECONDS) as runner:
        return str(runner.renderer())


def ready(texts: Any, names: set[str]) -> Finding | None:
    """Why shaders cannot run: they are blank, or there is no OpenGL here; None if they can."""
    if not isinstance(texts, dict) or set(texts) != names or not all(isinstance(text, str) for text in texts.values()):
        return Finding("shaders", WRONG, f"expected a dict of the texts of {', '.join(sorted(names))}")
    if any("write this" in text for text in texts.values()):
        return Finding("shaders", BLANK, "not written yet")
    why = missing()
    return Finding("shaders", NOT_RUN, why) if why else None


def prefix_sums(texts: Any, maps: list[np.ndarray]) -> Iterator[Finding]:
    """Compare the tables that reduce, scan and propagate compute from maps of uint32."""
    hindrance = ready(texts, {"reduce", "scan", "propagate"})
    if hindrance is not None:
        yield hindrance
        return
    with Student(RUNNER, SECONDS) as runner:
        for values in maps:
            want = values.cumsum(0, dtype=np.uint32).cumsum(1, dtype=np.uint32)
            got = runner.prefix_table(texts, values)
            yield compare(f"a map of {values.shape[1]} x {values.shape[0]}", got, want, axes=("row", "column"))
