"""Where the parts of the course lie."""

from __future__ import annotations

from pathlib import Path

HERE = Path(__file__).parent
LESSONS = HERE / "lessons"
SEED = HERE / "seed"  # the number that chooses the maps of this copy's checks; without the file, 1
BLANKS = HERE / "blanks"  # the students' files as they were handed out; only in the students' tree


def lessons() -> list[Path]:
    """Folders of all lessons, in their order."""
    return sorted(path.parent for path in LESSONS.glob("*/check.py"))
