"""Level of detail: a pure function from tables and camera to patches.

clipmap    rings around the eye; the summed-area tables decide how finely each patch is tessellated (method "sat")
quadtree   the fewest triangles; the error records of single nodes decide (method "quadtree")
"""

from ..view import View
from .clipmap import ClipmapSelector
from .quadtree import QuadtreeSelector
from .selection import METRES, METRICS, Goal, Selection

__all__ = ["METRES", "METRICS", "ClipmapSelector", "Goal", "QuadtreeSelector", "Selection", "View"]
