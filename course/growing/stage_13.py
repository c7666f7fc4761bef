# Lesson 13: rings around the eye; tables say how coarse each square may be. Squares of unlike spacing leave cracks.

TILE_LIMITS = class_limits(8192.0, 64, 5)


def level_tables(heights):
    """For each spacing of 2, 4, ... 32 posts: tables that count cells above each limit."""
    found = {}
    for j in range(1, 6):
        n = 1 << j
        shape = tuple((size - 1) >> j for size in heights.shape)
        errors = np.array(
            [cut_error(heights[y * n : y * n + n + 1, x * n : x * n + n + 1]) for y, x in np.ndindex(shape)]
        )
        found[j] = class_tables(errors.reshape(shape), TILE_LIMITS).astype(np.uint8)
    return found


def squares_of(heights):
    """Squares (n, 4): column, row, log2 of the side and of the spacing."""
    last, tables, allowed_m, found = len(heights) - 1, level_tables(heights), tolerance(heights), []
    eye = np.clip([EYE[0] / SPACING[0], last - EYE[1] / SPACING[1]], 0, last)

    def spacing(low, side):
        x, y = (max(at, 0) for at in low)
        m = allowed_m[y : low[1] + (1 << side) + 1, x : low[0] + (1 << side) + 1].min()
        bits = low[0] | low[1] | 1 << side
        j = min((bits & -bits).bit_length() - 1, 5, side - 1)
        end = (low[0] + (1 << side), low[1] + (1 << side))
        while j > 0 and not is_within(tables[j], TILE_LIMITS, 8192.0, low, end, 1 << j, m):
            j -= 1
        return j

    for level in range(1, 5):  # units of 2 posts and more
        (x0, y0), units = ring_origin(eye, 2, level), ring_units(eye, 2, level)
        if level == 1:
            units = np.ones_like(units)
        for row, col in np.ndindex(2, 2):
            own, steps = units[row * 8 : row * 8 + 8, col * 8 : col * 8 + 8], {}
            corner = x0 + (8 * col << level), y0 + (8 * row << level)
            for depth in range(4):
                n = 8 >> depth
                for y, x in np.ndindex(1 << depth, 1 << depth):
                    low, side = (corner[0] + (n * x << level), corner[1] + (n * y << level)), level + 3 - depth
                    on_map = all(at < last and at + (1 << side) > 0 for at in low)
                    whole = own[y * n : y * n + n, x * n : x * n + n]
                    if whole.any() and on_map:
                        steps[depth, x, y] = spacing(low, side) if whole.all() or depth == 3 else None
            leaves = cut_block(steps, level)
            for y, x in np.ndindex(8, 8):
                size, step = leaves[y, x].tolist()
                if size >= 0 and x % (1 << size) == y % (1 << size) == 0:
                    found.append((corner[0] + (x << level), corner[1] + (y << level), level + size, step))
    return np.array(found)


def mesh(heights):
    """Posts and triangles."""
    return clipmap(heights)


def clipmap(heights):
    """Posts and triangles of all squares, each with its own spacing; posts beyond the map are clamped to its rim."""
    parts = [grid(x, y, 1 << side, 1 << side, 1 << step) for x, y, side, step in squares_of(heights).tolist()]
    posts, triangles = together([(np.clip(posts, 0, len(heights) - 1), triangles) for posts, triangles in parts])
    x, y = posts[triangles].transpose(2, 1, 0)
    area = (x[1] - x[0]) * (y[2] - y[0]) - (x[2] - x[0]) * (y[1] - y[0])
    return posts, triangles[area != 0]
