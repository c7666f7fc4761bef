# Lesson 5: errors of nodes. The whole map gets one level: the coarsest level with an error of at most 400 metres.


def mesh(heights):
    """Posts and triangles of one level."""
    level = max((j for j in range(1, 6) if quad_errors(heights, j).max() <= 400), default=0)
    return grid(0, 0, heights.shape[1] - 1, heights.shape[0] - 1, 1 << level)
