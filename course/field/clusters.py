"""A hierarchy of clusters: each cluster decides alone.

Run: python -m course.field.clusters
"""

import numpy as np

from course.field import own
from course.land import land

five = own(5)
LEVELS = range(1, 6)


def drawn(errors, tolerance):
    """How many clusters cover each cell: one is drawn if it is good enough, and the one above it is not."""
    covered = np.zeros((128, 128), int)
    for i, level in enumerate(errors):
        above = errors[i + 1] if i + 1 < len(errors) else np.full((1, 1), np.inf)
        step = len(level) // len(above)
        parent = above.repeat(step, 0).repeat(step, 1)
        chosen = (level <= tolerance) & (parent > tolerance)
        covered += chosen.repeat(128 // len(level), 0).repeat(128 // len(level), 1)
    return covered


def main():
    """Count cells that no cluster covers, or several, with errors as they are and with nested errors."""
    heights = land(np.random.default_rng(1), 129, 129) + np.random.default_rng(2).normal(0, 6, (129, 129))
    errors = [np.zeros((128, 128)), *(five.quad_errors(heights, level) for level in LEVELS)]
    for name, each in (("as they are", errors), ("nested", five.nested(errors))):
        covered = [drawn(each, tolerance) for tolerance in (5.0, 10.0, 15.0, 20.0)]
        holes, twice = (
            100 * np.mean([condition(c) for c in covered]) for condition in (lambda c: c == 0, lambda c: c > 1)
        )
        print(f"errors {name}: {holes:.1f} % of the cells have no cluster, {twice:.1f} % have several")


if __name__ == "__main__":
    main()
