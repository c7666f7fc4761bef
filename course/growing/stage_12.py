# Lesson 12: an honest comparison. Both curves have the same map, view, metric and ruler. The picture shows two points
# of them that have the same largest error.


def show_12(heights, posts, triangles):
    """Wires and errors in colour: left a grid, right a tree with about half the triangles."""
    last = len(heights) - 1
    return beside(*(show_errors(heights, *each) for each in (grid(0, 0, last, last, 4), tree_mesh(heights, 1000))))


def report_12(heights):
    """Compare the tree with grids of one spacing: how many times as many triangles grids need for an error."""
    trees = [tree_mesh(heights, triangles) for triangles in (250, 1000, 4000)]
    last = len(heights) - 1
    grids = [grid(0, 0, last, last, step) for step in (16, 8, 4, 2)]
    ours, theirs = ([(len(t), error_px(heights, p, t)) for p, t in each] for each in (trees, grids))
    for name, curve in (("tree", ours), ("grid", theirs)):
        print(f"{name}: {', '.join(f'{n} triangles {px:.1f} px' for n, px in curve)}")
    least, median, most = summary(ours, theirs)
    return f"grids need {median:.1f} times as many triangles ({least:.1f} to {most:.1f})"
