"""The largest map that can be held in memory, and the command for larger ones."""

import os
import shlex

from .exceptions import TerrainError

MAX_POSTS = 16384 * 16384
MAX_SIDE = 16385  # posts a side that 15 levels of nodes cover


def check_size(rows: int, cols: int, name: str) -> None:
    """Raise `TerrainError` for a map with too few posts, or too many."""
    if rows < 2 or cols < 2:
        raise TerrainError(f"{name}: has {cols} x {rows} posts: a heightmap needs at least 2 x 2")
    if is_too_large(rows, cols):
        most = f"{MAX_SIDE} a side" if max(rows, cols) > MAX_SIDE else f"{MAX_POSTS} (16384 x 16384) in memory"
        raise TerrainError(
            f"{name}: has {cols} x {rows} posts, more than {most}: draw it from a store: {store_command(name)}"
        )


def is_too_large(rows: int, cols: int) -> bool:
    """Whether a map has more posts than can be held in memory, and needs a store."""
    return rows * cols > MAX_POSTS or max(rows, cols) > MAX_SIDE


def store_command(name: str) -> str:
    """The command that makes a store of a file."""
    store = os.path.splitext(os.path.basename(name))[0] + ".zarr"
    return f"terrain-gl build {shlex.quote(name)} -o {shlex.quote(store)}"
