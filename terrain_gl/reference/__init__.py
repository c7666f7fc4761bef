"""The specification: every stage of the line in float64 numpy, a few lines each, its equation above it.

    heightmap   the truth: posts, and the surface between them
    sat         summed-area tables, and the sum over a box
    error       the error of each node (`nodes`), also `between` posts, of any box (`bound`), after an edit (`widening`)
    project     from metres to pixels; `curvature`: the Earth is round
    hidden      the horizon around the eye, and the land below it
    rings       the selection of method sat
    tree        a restricted quadtree: for comparison, and for the course
    mesh        the triangles of a patch
    shade       mean height and mean slope under a pixel
    light       lobes of light; `horizon`: what each place sees of sun and sky
    generate    land from a seed

The tests compare the shaders with these functions. Besides Python's standard library, they import numpy alone.
"""

from . import rings
from .between import *
from .bound import *
from .curvature import *
from .error import *
from .generate import *
from .heightmap import *
from .hidden import *
from .horizon import *
from .light import *
from .mesh import *
from .nodes import *
from .project import *
from .sat import *
from .shade import *
from .tree import *
from .widening import *
