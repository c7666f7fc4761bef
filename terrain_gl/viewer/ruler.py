"""The ruler: a line of clicks on the land, its length on the map and along the ground, and its profile."""

from typing import NamedTuple

import numpy as np

from ..heightmap import Heightmap, ground_m
from ..renderer.lines import leg

MOST = 2000  # rough limit of places in a profile


class Profile(NamedTuple):
    """Heights along a line."""

    places: np.ndarray  # (n, 2) metres east and north
    along_m: np.ndarray  # (n,) distance along the line on the map
    height_m: np.ndarray  # (n,) NaN where there is no land
    length_m: float  # of the whole line on the map
    ground_m: float  # of the whole line along the ground
    climb_m: float  # the sum of all rises
    descent_m: float  # the sum of all falls


def profile(heightmap: Heightmap, corners: np.ndarray) -> Profile:
    """The profile along straight legs between `corners` (m, 2), in metres east and north, at least two.

    The profile has a place wherever a leg crosses a row or a column of posts. On long lines, about `MOST` places have
    equal distances.
    """
    most = MOST // (len(corners) - 1) + 1
    legs = zip(corners, corners[1:], strict=False)
    places = np.concatenate([*(leg(a, b, heightmap.spacing_m, most) for a, b in legs), corners[-1:]])
    along_m = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    height_m = ground_m(heightmap, places)
    known = np.isfinite(height_m)  # over a gap, the length is that of a straight line
    rises = np.diff(height_m[known])
    runs = np.diff(along_m[known])
    outside_m = along_m[-1] - runs.sum()
    ground = float(np.hypot(rises, runs).sum() + outside_m)
    climb = float(rises[rises > 0].sum())
    descent = float(-rises[rises < 0].sum())
    return Profile(places, along_m, height_m, float(along_m[-1]), ground, climb, descent)


class Ruler:
    """The line that the user measures."""

    def __init__(self) -> None:
        self.taken = False  # whether clicks set its corners
        self.clear()

    def toggle(self) -> bool:
        """Take the ruler, or put it away with its line; returns whether it is taken."""
        self.taken = not self.taken
        self.clear()
        return self.taken

    def clear(self) -> None:
        self.corners: list[tuple[float, float]] = []  # metres east and north
        self._ended = False

    def add(self, east_m: float, north_m: float) -> None:
        """Set the next corner; after `end`, the first corner of a new line."""
        if self._ended:
            self.clear()
        if (east_m, north_m) not in self.corners[-1:]:
            self.corners.append((east_m, north_m))

    def end(self) -> None:
        """End the line; the next corner begins another line."""
        self._ended = len(self.corners) > 1

    def profile(self, heightmap: Heightmap) -> Profile | None:
        """The profile along the line; None before it has two corners."""
        return profile(heightmap, np.array(self.corners)) if len(self.corners) > 1 else None
