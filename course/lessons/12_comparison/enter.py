"""Enter your renderer in the project's comparison: one map, view and ruler for all, read at equal error.

Run: python course/lessons/12_comparison/enter.py [my_terrain.py] [-o curves.png]

`python -m course picture 12` writes my_terrain.py. The project's methods are drawn and measured as `terrain-gl compare`
does. The ruler for your mesh is the same: 5 × 5 places in each cell, the bilinear truth, the exact shift in pixels.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[3]))
import terrain_gl as tg  # noqa: E402
from course.checking import load  # noqa: E402
from course.grow import MAP  # noqa: E402
from terrain_gl.camera import screen_shift_px  # noqa: E402
from terrain_gl.comparison.compare import COMPARED, LABELS  # noqa: E402
from terrain_gl.comparison.curves import curve  # noqa: E402
from terrain_gl.gpu.layout import PLACES  # noqa: E402

BUDGETS = 500, 1000, 2000, 4000, 8000
NEAR_M = 200.0
METRICS = {"max_error_px": "largest error", "rms_error_px": "RMS error"}


def places_of(heights, spacing):
    """Points (rows, cols, 3) of the truth, PLACES × PLACES in each cell: bilinear, so linear along either axis."""
    row, col = (np.arange((n - 1) * PLACES + 1) / PLACES for n in heights.shape)
    along = np.array([np.interp(col, np.arange(heights.shape[1]), line) for line in heights])
    truth = np.array([np.interp(row, np.arange(len(heights)), line) for line in along.T]).T
    x, y = np.meshgrid(col * spacing[0], (len(heights) - 1 - row) * spacing[1])
    return np.stack([x, y, truth], -1)


def weights(n):
    """The weight of each place along n posts: of a cell's six places, those on its rim count 3, those between 4."""
    weight = np.where(np.arange((n - 1) * PLACES + 1) % PLACES, 4.0, 6.0)  # two cells meet at a rim
    weight[[0, -1]] = 3.0
    return weight


def errors_px(mine, camera, heights, posts, triangles):
    """Screen errors and weights (2, n) of a mesh at all places in the picture, drawn from above by the student."""
    points = places_of(heights, mine.SPACING)
    size = points.shape[1::-1]
    x, y = posts.T * PLACES
    above = np.stack([(2 * x + 1) / size[0] - 1, 1 - (2 * y + 1) / size[1], 0 * x, 0 * x + 1], -1)
    metres = heights[posts[:, 1], posts[:, 0]][:, None] * np.ones(3)
    drawn = mine.rasterise(size, above, metres, triangles, (np.nan,) * 3)[..., 0]  # the rim may be left out
    rise = (drawn - points[..., 2]).ravel()
    px, seen = screen_shift_px(camera, mine.SIZE, points.reshape(-1, 3), np.nan_to_num(rise), NEAR_M)
    counts = seen & ~np.isnan(rise)
    return np.stack([px, np.outer(*map(weights, heights.shape)).ravel()])[:, counts]


def in_picture(mine, heights, posts, triangles):
    """The number of triangles that are not wholly beyond one side of the picture. The project counts the same way."""
    x, y, _, w = mine.project(mine.places_of(heights, posts)).T
    beyond = np.stack([x < -w, x > w, y < -w, y > w, w < NEAR_M])
    return int((~beyond[:, triangles].all(-1).any(0)).sum())


def yours(mine, camera, heights):
    """Stats of the student's tree at each budget."""
    found = []
    for triangles in BUDGETS:
        mesh = mine.tree_mesh(heights, triangles)
        px, weight = errors_px(mine, camera, heights, *mesh)
        errors = {"max_error_px": float(px.max()), "rms_error_px": float(np.sqrt(np.average(px**2, weights=weight)))}
        found.append({"triangles": in_picture(mine, heights, *mesh)} | errors)
    return found


def falling(stats, metric):
    """A curve for lesson 12: triangles rise, errors fall; a mesh that is no better than a smaller one is left out."""
    points = []
    for n, error in sorted((each["triangles"], each[metric]) for each in stats):
        if not points or (n > points[-1][0] and error < points[-1][1]):
            points.append((n, error))
    return points


def entered(mine, heights, methods=COMPARED):
    """Stats at each budget, by name: the student's tree, and the project's methods with their best parameters."""
    camera = tg.Camera(eye=tuple(mine.EYE), target=tuple(mine.TARGET), fov_deg=mine.FOV_DEG)
    own = yours(mine, camera, heights)
    budgets = [each["triangles"] for each in own]
    with tg.Renderer(tg.Heightmap(heights, mine.SPACING, "your map"), size=mine.SIZE) as renderer:
        return {"yours": own} | curve(renderer, camera, methods, budgets, between=False, near_m=NEAR_M)


def drawn(found, path):
    """Draw both errors over triangles."""
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(1, 2, figsize=(11, 4.2), layout="constrained")
    for ax, (metric, title) in zip(axes, METRICS.items(), strict=True):
        for name, stats in found.items():
            ax.loglog(*zip(*falling(stats, metric), strict=True), "o-", label=LABELS.get(name, name))
        ax.set(title=title, xlabel="triangles in the picture", ylabel="pixels")
        ax.grid(alpha=0.3, which="both")
    axes[0].legend()
    figure.savefig(path)


def main(arguments=None):
    """Print the table and draw the curves."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("file", type=Path, nargs="?", default=Path("my_terrain.py"), help="as `picture 12` writes it")
    parser.add_argument("-o", "--output", type=Path, default=Path("entered.png"), help="the curves (entered.png)")
    options = parser.parse_args(arguments)
    if not options.file.is_file():
        sys.exit(f"{options.file}: no such file; write it: python -m course picture 12")
    mine = load(options.file)
    if not hasattr(mine, "summary") or not hasattr(mine, "tree_mesh"):
        sys.exit(f"{options.file}: not of lesson 12; write it: python -m course picture 12")
    found = entered(mine, mine.read(MAP))
    for name, stats in found.items():
        points = ", ".join(
            f"{each['triangles']}: {each['max_error_px']:.1f} ({each['rms_error_px']:.2f})" for each in stats
        )
        print(f"{name:12} triangles: largest error (RMS) in pixels  {points}")
    for metric, title in METRICS.items():
        for name in list(found)[1:]:
            ratios = mine.summary(falling(found["yours"], metric), falling(found[name], metric))
            least, median, most = ratios
            print(f"same {title}: {name} needs {median:.2f} times your triangles ({least:.2f} to {most:.2f})")
    drawn(found, options.output)
    print(f"drew {options.output}")


if __name__ == "__main__":
    main()
