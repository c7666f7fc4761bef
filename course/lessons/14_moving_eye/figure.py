"""Figure of lesson 14: the largest jump of each frame of a flight, with three ways to choose the mesh."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load
from course.land import land
from course.solving import SOLUTIONS

mine = load(SOLUTIONS / "14_moving_eye" / "solution.py")
FRAMES, PERIOD, ERROR_PX, SHARE, SPACING_M, FOCAL_PX = 97, 8, 1.0, 0.5, 30.0, 900.0


def flight():
    """Heights, bounds in pixels, and pixels of a metre at each post, frame by frame."""
    heights = land(np.random.default_rng(14), 129, 129)
    t = np.linspace(0.1, 0.9, FRAMES)[:, None]
    eyes = np.hstack([t * [3840.0, 3000.0], np.full((FRAMES, 1), heights.max() + 150.0)])
    px = mine.pixels(heights, mine.bounds(heights), SPACING_M, eyes, FOCAL_PX)
    y, x = np.indices(heights.shape) * SPACING_M
    scale = np.array([FOCAL_PX / np.hypot(np.hypot(x - e, y - s), up - heights) for e, s, up in eyes])
    return heights, px, scale


def flights(heights, px):
    """For each way: the drawn surface of every frame, and how many posts are active in it."""
    plain = px > ERROR_PX
    lazy, active = [], plain[0]
    for each in px:
        active = mine.still(active, each, ERROR_PX, SHARE)
        lazy.append(active)
    keys = mine.held(px, ERROR_PX, PERIOD)
    both = [keys[i // PERIOD] | keys[-(-i // PERIOD)] for i in range(FRAMES)]  # a blend has the posts of both keys
    surfaces = {
        "each frame anew": (np.array([mine.surface(heights, each) for each in plain]), plain),
        "with hysteresis": (np.array([mine.surface(heights, each) for each in lazy]), np.array(lazy)),
        "blended": (mine.fly(heights, px, ERROR_PX, PERIOD), np.array(both)),
    }
    return {name: (drawn, each.sum((1, 2))) for name, (drawn, each) in surfaces.items()}


def jumps(drawn, scale):
    """The largest jump of each frame but the first, and how many posts jump by more than a tenth of a pixel."""
    moved = np.abs(np.diff(drawn, axis=0)) * scale[1:]
    return moved.max((1, 2)), (moved > 0.1).sum((1, 2))


def bound_px(scale):
    """E₁ + E₂ of each frame but the first: errors of the mesh before, as the later eye sees it, and of the new one."""
    return ERROR_PX * ((scale[1:] / scale[:-1]).max((1, 2)) + 1)


def main(path):
    """Draw the jumps, and print the numbers of the page."""
    heights, px, scale = flight()
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4), constrained_layout=True)
    for name, (drawn, count) in flights(heights, px).items():
        largest, many = jumps(drawn, scale)
        off = (np.abs(drawn - heights) * scale).max()
        left.plot(np.arange(1, FRAMES), largest, label=name)
        right.plot(count, label=name)
        told = f"largest jump {largest.max():.2f} px, {many.mean():.0f} posts a frame jump, {count.mean():.0f} active"
        print(f"{name}: {told}, error {off:.2f} px")
    left.plot(np.arange(1, FRAMES), bound_px(scale), "k:", label="$E_1 + E_2$")
    left.axhline(2 * ERROR_PX / PERIOD, color="k", linestyle="--", label="$2E / 8$")
    print(f"E1 + E2: at most {bound_px(scale).max():.2f} px")
    left.set(xlabel="frame", ylabel="pixels", title="The largest jump", yscale="log", ylim=(0.02, 4))
    right.set(xlabel="frame", title="Posts of the mesh", ylim=(0, None))
    left.legend(fontsize=8, ncols=2)
    right.legend(fontsize=8)
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
