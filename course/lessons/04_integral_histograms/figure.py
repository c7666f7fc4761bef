"""Figure of lesson 4: the largest error of many boxes, its bound by classes, and what a sum of squares would say."""

import sys
from pathlib import Path

import numpy as np
from matplotlib import pyplot as plt

sys.path.insert(0, str(Path(__file__).parents[3]))
from course.checking import load

truth = load(Path(__file__).parent / "check.py")


def main(path):
    """Draw one curve for each bound."""
    rng = np.random.default_rng(3)
    errors, limits = truth.errors_of(rng)
    boxes = truth.boxes_of(rng, errors.shape, 400)[2:]
    worst = truth.true_maximum(errors, boxes)
    squares = np.array([np.sqrt(np.square(errors[y0:y1, x0:x1]).sum()) for x0, y0, x1, y1 in boxes])
    order = np.argsort(worst, kind="stable")
    figure, (left, right) = plt.subplots(1, 2, figsize=(12, 4), constrained_layout=True)
    shown = left.imshow(np.log2(errors + 0.1), cmap="magma")
    figure.colorbar(shown, ax=left, label="log2 of the error in metres", shrink=0.7)
    left.set(title="errors of cells", xticks=[], yticks=[])
    right.plot(squares[order], ".", markersize=3, color="0.6", label="root of the sum of squares")
    right.step(np.arange(len(order)), truth.rounded_up(worst, limits)[order], label="limit of the class", color="C1")
    right.plot(worst[order], label="largest error", color="C0")
    right.set(yscale="log", xlabel="398 boxes, sorted", ylabel="metres", title="both are bounds; one is tight")
    right.legend()
    figure.savefig(path, dpi=90)


if __name__ == "__main__":
    main(sys.argv[1])
