"""The folders of files that come with the code: `glsl` and `heightmaps`."""

from pathlib import Path

FOLDERS = ("glsl", "heightmaps")
_PACKAGE = Path(__file__).resolve().parents[1]


def folder(name: str) -> Path:
    """Find a folder: inside the package after an installation, beside the package in a clone."""
    inside = _PACKAGE / name
    return inside if inside.is_dir() else _PACKAGE.parent / name


def holds(path: Path) -> bool:
    """Whether a file exists and comes with the code."""
    real = path.resolve()
    return real.exists() and any(folder(name) in real.parents for name in FOLDERS)
