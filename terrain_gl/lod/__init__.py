"""Level of detail: a pure function from tables and camera to patches.

rings        a clipmap around the eye: summed-area tables decide how finely each patch is tessellated (method "sat")
every_post   the full resolution (methods "full" and "truth")

patches      shared by both: one record for each patch, and the shaders that draw it
surface      the interface between a method and the code that draws, measures or exports its mesh
"""

from ..camera.view import ViewBlock
from .every_post import EveryPost
from .goal import METRES, METRICS, Goal
from .rings import RingsSelector
from .selection import Selection

__all__ = ["METRES", "METRICS", "EveryPost", "Goal", "RingsSelector", "Selection", "ViewBlock"]
