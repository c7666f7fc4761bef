"""The pages that a mesh uses, and the pages that would make it better: numpy over the patches of the GPU."""

from typing import Any

import numpy as np

from ..camera import Camera
from ..lod import Goal, Selection
from .map import Boxes
from .terrain import PagedTerrain

MOST_LEVELS = 3  # most levels that a patch skips at once
MOST_PAGES = 32  # most pages that a patch requests at once
FLAT = 0.05  # least sine of the angle between a sight line and level ground in `areas`: hills face the eye even then


class DrawnPatches:
    """The patches of a selection, hidden ones included: `boxes` of posts, and certified errors `bound_px`."""

    def __init__(self, terrain: PagedTerrain, selection: Selection, camera: Camera) -> None:
        self.terrain = terrain
        surface: Any = selection.surface
        patches = surface.chosen(selection)  # with hidden ones: drawn patches share their edges
        last = np.array([terrain.heightmap.cols - 1, terrain.heightmap.rows - 1])
        self.boxes = Boxes(np.maximum(patches.corner, 0), np.minimum(patches.corner + patches.size, last))
        self.bound_px = patches.bound_px
        self._side_log2 = patches.side_log2
        self._step_log2 = patches.step_log2
        self._camera = camera
        self._is_drawn = np.arange(len(self.bound_px)) < selection.patches

    def use(self) -> None:
        """Tell the pool which pages the patches use, each patch at its spacing."""
        terrain = self.terrain
        terrain.use(self.boxes, np.clip(self._step_log2, 0, terrain.top_level))
        if terrain.shows_errors:
            drawn = self.boxes.some(self._is_drawn)
            terrain.use(drawn, np.zeros(len(drawn.low), np.int64))

    def areas(self) -> np.ndarray:
        """Approximate size of the patches in the picture, up to a factor: projected area over distance squared.

        For an orthographic camera: over 1 m².
        """
        terrain = self.terrain
        heightmap = terrain.heightmap
        east, north = heightmap.spacing_m
        eye = np.asarray(self._camera.eye)
        low, end = self.boxes
        col, row = ((low + end) // 2).T
        x, y = col * east, (heightmap.rows - 1 - row) * north
        posts_m2 = np.prod(end - low, 1) * east * north
        if self._camera.is_orthographic:
            return posts_m2 * max(abs(float(self._camera.axes[2][2])), FLAT)
        up = np.abs(terrain.filled[row, col] - self._camera.drop_m(x, y) - eye[2])
        flat = np.hypot(x - eye[0], y - eye[1])
        distance = np.maximum(np.hypot(flat, up), 0.5 * min(east, north))
        return posts_m2 * np.maximum(up, FLAT * distance) / distance**3

    def open_to(self, goal: Goal) -> tuple[np.ndarray, np.ndarray]:
        """Which patches may become better with finer pages, and the finest level that is loaded under each patch.

        With a tolerance: patches over tolerance. If a price decides: patches whose spacing is as fine as their pages
        allow; the pages of other patches would have allowed a finer spacing. Under a patch with all posts loaded, there
        are no finer pages.
        """
        finest = self.terrain.resident_level(self.boxes, np.clip(self._side_log2 - 6, 0, self.terrain.top_level))
        priced = (self._step_log2 <= finest) & (self.bound_px > 0)
        return (priced if goal.is_priced else self.bound_px > goal.tolerance_px) & (finest > 0), finest

    def on_rims(self, finest: np.ndarray) -> np.ndarray:
        """Which patches have a rim of a void that finer pages would draw more sharply.

        A node of a coarse page is drawn as a hole only if all its cells are holes. So a page that has a node with both
        holes and land is too coarse if that node is wider than a pixel.
        """
        terrain = self.terrain
        found = np.zeros(len(finest), bool)
        if not terrain.rim_focal_px or not len(finest):
            return found
        box, numbers = terrain.numbering.over(self.boxes, finest)
        found[box[terrain.is_mixed(numbers)]] = True
        nodes = np.prod(self.boxes.end - self.boxes.low, 1) / 4.0**finest
        width_px = terrain.rim_focal_px * np.sqrt(self.areas() / np.maximum(nodes, 1e-9))
        return found & (finest > 0) & (width_px > 1)

    def within(self, goal: Goal) -> float:
        """Approximate share of the picture whose patches are within the tolerance; it includes hidden patches.

        If a price decides: the share whose patches need no finer pages.
        """
        areas = self.areas()
        good = ~self.open_to(goal)[0] if goal.is_priced else self.bound_px <= goal.tolerance_px
        return float(areas[good].sum() / max(areas.sum(), 1e-300)) if len(areas) else 1.0

    def wanted(self, goal: Goal) -> tuple[np.ndarray, np.ndarray]:
        """Numbers of the pages that would make patches better (`open_to`, `on_rims`), and their worth; largest first.

        If all patches are good, and the picture shows errors: the pages of level 0.

        The worth of a page is certified pixels times area in the picture, summed over all patches that want it.
        """
        terrain = self.terrain
        numbering = self.terrain.numbering
        open_, finest = self.open_to(goal)
        open_ = open_ | self.on_rims(finest)
        shows_errors = terrain.shows_errors and not open_.any()  # the pages that the mesh needs come first
        if shows_errors:
            open_ = self._is_drawn & (terrain.resident_level(self.boxes, np.zeros_like(finest)) > 0)
        boxes = self.boxes.some(open_)
        bound_px = np.clip(self.bound_px[open_], 1e-6, 1e12)
        finest = finest[open_]
        level = np.zeros_like(finest) if shows_errors else finest - self._steps(boxes, bound_px, finest, goal)
        box, numbers = numbering.over(boxes, level)
        gain = (bound_px * self.areas()[open_])[box]
        numbers, which = np.unique(numbers, return_inverse=True)
        new = ~terrain.is_there(numbers)
        worth = np.bincount(which, gain, minlength=len(numbers))[new]
        numbers = numbers[new]
        order = np.argsort(-worth, kind="stable")
        return numbers[order], worth[order]

    def _steps(self, boxes: Boxes, bound_px: np.ndarray, finest: np.ndarray, goal: Goal) -> np.ndarray:
        """How many levels finer the next pages of patches are: more where the bound is far over the tolerance."""
        over = np.log2(bound_px / goal.tolerance_px) if goal.tolerance_px else np.zeros(len(bound_px))
        steps = np.minimum(np.clip(np.ceil(over).astype(np.int64), 1, MOST_LEVELS), finest)
        for _ in range(MOST_LEVELS - 1):
            steps -= (self.terrain.numbering.count(boxes, finest - steps) > MOST_PAGES) & (steps > 1)
        return steps
