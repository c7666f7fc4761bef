"""Check of lesson 10: against means over every normal, and against integrals over the sphere."""

import numpy as np

from course.checking import compare, grows_with_the_box, holds, task
from course.land import land
from course.truths import private, referee
from terrain_gl import reference

TITLE = "Light over a footprint"


@private
def true_length(k):
    """A(κ) for small κ by its power series, else by its definition."""
    k = np.asarray(k, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.where(k < 0.05, k / 3 - k**3 / 45 + 2 * k**5 / 945, 1 / np.tanh(k) - 1 / k)


@referee("mean_length")
def length_of(student, k):
    """A(κ) of a student's κ."""
    return true_length(k)


@task("10.1 the length of a mean vector", points=1)
def mean_length(student, rng):
    """Tested from κ = 0 to very sharp lobes."""
    kappa = np.concatenate([[0.0, 1e-9, 1e-6, 1e-4], 10 ** rng.uniform(-3, 6, 300)])
    want = true_length(kappa)
    yield compare("A", student.mean_length(kappa), want, axes=("kappa",))
    small = 10.0 ** np.linspace(-9, -2.001, 60)
    want = true_length(small) / small
    yield compare("A / κ near 0", student.mean_length(small) / small, want, close=1e-4, axes=("kappa",))


@private
def inverse(length):
    """κ by bisection, from A of the material's κ and of the means' length."""
    low, high = np.full(length.shape, -15.0), np.full(length.shape, 15.0)
    for _ in range(90):
        middle = 0.5 * (low + high)
        low, high = (
            np.where(true_length(np.exp(middle)) < length, middle, low),
            np.where(true_length(np.exp(middle)) < length, high, middle),
        )
    return np.exp(0.5 * (low + high))


@task("10.2 from a length to a sharpness", points=2)
def kappa_of(student, rng):
    """A(κ) of the answer must be the given length."""
    length = np.concatenate([[0.001, 0.999], rng.uniform(0.001, 0.999, 300)])
    got = np.asarray(student.kappa_of(length), float)
    yield compare("A of your κ", length_of(student, got), length, close=1e-4, axes=("length",))


def footprints(rng):
    """Normals of rough land, and boxes over them."""
    heights = land(rng, 60, 70) + rng.normal(0, 6, (60, 70))
    normals = true_normals(heights, (20.0, 25.0))
    low = rng.integers(0, [60, 50], (200, 2))
    boxes = np.concatenate([low, np.minimum(low + rng.integers(1, 25, (200, 2)), [69, 59])], 1)
    return normals, boxes


@private
def true_normals(heights, spacing):
    """Normals in the middle of the cells."""
    return reference.normals_of(heights, spacing)


@private
def true_means(normals, boxes):
    """Mean vector of the normals of each box."""
    return np.array([normals[y0:y1, x0:x1].reshape(-1, 3).mean(0) for x0, y0, x1, y1 in boxes])


@task("10.3 mean normals", points=2)
def mean_normals(student, rng):
    """The mean vectors must not be made unit vectors, and the time must not grow with the footprints."""
    normals, boxes = footprints(rng)
    want = true_means(normals, boxes)
    yield compare("200 footprints", student.mean_normals(normals, boxes), want, axes=("box", "axis"))
    normals, corner = np.full((500, 500, 3), 0.5), np.zeros((500, 2), int)
    small, large = (np.concatenate([corner, corner + side], 1) for side in (1, 500))
    slow = grows_with_the_box(lambda asked: student.mean_normals(normals, asked), small, large)
    yield holds("large footprints", not slow, "500 large footprints take far longer than small ones: make a table")


@task("10.4 diffuse light", points=3)
def diffuse(student, rng):
    """Compared with the mean of the light over every normal of the footprint."""
    normals, boxes = footprints(rng)
    albedo = float(rng.uniform(0.2, 0.9))
    light = np.array([*rng.uniform(-0.1, 0.1, 2), 1.0])
    light /= np.linalg.norm(light)
    facing = np.where(normals @ light > 0.02, normals @ light, np.nan)
    lit = [i for i, (x0, y0, x1, y1) in enumerate(boxes) if np.isfinite(facing[y0:y1, x0:x1]).all()]
    want = [albedo * facing[y0:y1, x0:x1].mean() for x0, y0, x1, y1 in boxes[lit]]
    got = student.diffuse(true_means(normals, boxes[lit]), light, albedo)
    yield compare("footprints that face the light", got, want, axes=("box",))


@private
def true_merged(means, kappa):
    """κ of a material on a footprint with this mean normal."""
    return inverse(np.linalg.norm(means, axis=1) * true_length(kappa))


@task("10.5 the highlight of a footprint", points=3)
def merged_kappa(student, rng):
    """Rough ground must widen the highlight."""
    normals, boxes = footprints(rng)
    means = true_means(normals, boxes)
    for kappa in (3.0, 200.0):
        want = true_merged(means, kappa)
        got = np.asarray(student.merged_kappa(means, kappa), float)
        yield compare(
            f"κ of the material {kappa:g}", np.log(np.maximum(got, 1e-300)), np.log(want), 1e-3, axes=("box",)
        )


@task("10.6 the furnace", points=2)
def furnace_scale(student, rng):
    """Compared with a sum over the sphere."""
    for amplitude, sharpness in ((1.17, 2.133), (float(rng.uniform(0.5, 2)), float(rng.uniform(0.5, 20)))):
        z, share = np.polynomial.legendre.leggauss(64)  # exact to the last digits
        received = 2 * np.pi * (share * amplitude * np.exp(sharpness * (z - 1))).sum()
        scale = student.furnace_scale(amplitude, sharpness)
        yield compare(f"{amplitude:.3g} exp({sharpness:.3g} (ω·n − 1)): received", scale * received, np.pi, 1e-3)
