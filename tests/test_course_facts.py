"""Statements on the course's pages that can be computed: each stands in a page as it is asserted here."""

import numpy as np
import pytest
from courses import checking, folders

LESSONS = {int(folder.name[:2]): folder for folder in folders.lessons()}


def page(number):
    """A page in one line."""
    return " ".join((LESSONS[number] / "page.md").read_text(encoding="utf-8").split())


def height_of_the_sun(latitude, azimuth, declination):
    """Degrees above the horizon, where the sun has this azimuth: sin d = sin φ sin h + cos φ cos h cos A."""
    a, b = np.sin(np.radians(latitude)), np.cos(np.radians(latitude)) * np.cos(np.radians(azimuth))
    return np.degrees(np.arcsin(np.sin(np.radians(declination)) / np.hypot(a, b)) - np.arctan2(b, a))


def test_lesson_1_the_sun_in_the_north_west_is_low():
    assert "less than 11° high, and south of 55° N not at all" in page(1)
    highest = height_of_the_sun(np.arange(35, 72), 315.0, 23.44)  # on the longest day, from Crete to the North Cape
    assert highest.max() < 11 and (highest[: 55 - 35] < -0.6).all() and (highest[60 - 35 :] > 0).all()


def test_lesson_4_a_bound_is_loose_only_below_the_last_limit():
    assert "as long as the largest error of the box is above the last limit" in page(4)
    limits = 500.0 * 2.0 ** (-(np.arange(48) + 1) / 4)
    errors = 500.0 * 2.0 ** -np.linspace(0, 20, 2000)
    bounds = np.append(500.0, limits)[(errors[:, None] <= limits).sum(1)]
    above = errors > limits[-1]
    assert (bounds >= errors).all() and (bounds[above] <= errors[above] * 2**0.25 * (1 + 1e-12)).all()
    assert (bounds / errors)[~above].max() > 100


def test_lesson_4_tables_of_maxima_are_exact():
    rivals, rng = checking.load(LESSONS[4] / "rivals.py"), np.random.default_rng(3)
    errors = rng.random((50, 70))
    tables = rivals.windows(errors)
    low = rng.integers(0, 40, (100, 2))
    boxes = np.concatenate([low, np.minimum(low + rng.integers(1, 30, (100, 2)), (70, 50))], 1)
    true = np.array([errors[y0:y1, x0:x1].max() for x0, y0, x1, y1 in boxes])
    assert (rivals.largest(tables, boxes)[0] == true).all()
    squares = np.concatenate([low // 2, low // 2 + rng.integers(8, 16, (100, 1))], 1)
    true = [errors[y0:y1, x0:x1].max() for x0, y0, x1, y1 in squares]
    assert (rivals.of_one_size(tables, 3, squares) == true).all() and rivals.largest(tables, squares)[1] <= 4


def test_lesson_6_compares_at_equal_error():
    """The true error of right triangles, at the posts."""
    figure, rng = checking.load(LESSONS[6] / "figure.py"), np.random.default_rng(8)
    heights = figure.spike(figure.land(rng, 65, 65), rng)
    errors = figure.truth.true_rtin(heights)
    for tolerance_m, said in ((30.0, "890 of them"), (20.0, "973, and 27.1 metres off")):
        found = figure.triangles(errors, tolerance_m)
        worst = max(farthest(np.array(each[:3]), heights) for each in found)
        assert said in page(6) and said.startswith(str(len(found))) and f"{worst:.1f}" in page(6)
    leaves = figure.tree(figure.truth.node_errors(heights), 30.0)
    assert f"{len(leaves)} leaves, which is {2 * len(leaves)} triangles" in page(6)


def farthest(corners, heights):
    """The largest distance of a triangle's posts from the land."""
    (x0, y0), (x1, y1) = corners.min(0).astype(int), corners.max(0).astype(int)
    y, x = np.mgrid[y0 : y1 + 1, x0 : x1 + 1].reshape(2, -1)
    shares = np.linalg.solve(np.vstack([corners.T, np.ones(3)]), np.stack([x, y, np.ones(len(x))]))
    inside = (shares > -1e-9).all(0)
    z = heights[corners[:, 1].astype(int), corners[:, 0].astype(int)] @ shares
    return np.abs(z - heights[y, x])[inside].max()


def test_lesson_13_compares_at_equal_tolerance():
    figure = checking.load(LESSONS[13] / "figure.py")
    errors = figure.cell_errors(figure.land(np.random.default_rng(8), 257, 257))
    plain, steered, tree = figure.plain(), figure.steered(errors), figure.quadtree(errors)
    over, ratio = figure.worst(plain, errors)
    assert f"{over} of its {len(plain)} squares are over tolerance, the worst one by a factor of {ratio:.1f}" in page(
        13
    )
    assert figure.worst(steered, errors)[0] == figure.worst(tree, errors)[0] == 0
    few, many = figure.triangles(tree), figure.triangles(steered)
    assert f"the quadtree has fewer triangles, {few} against {many:,}" in page(13) and few == 8 * len(tree)
    assert f"fewer patches, {len(steered)} against {len(tree)}" in page(13)
    assert f"it is {many + 14 * len(steered):,} against {few + 14 * len(tree):,}" in page(13)
    assert f"rings have {figure.triangles(plain)} triangles" in page(13)


def test_lesson_8_floats_are_exact_for_powers_of_two():
    assert "The divisors of 60 that are powers of two are 1, 2 and 4." in page(8)
    divisors = [n for n in range(1, 61) if 60 % n == 0]
    assert len(divisors) == 12 and "all twelve divisors" in page(8) and "the other nine" in page(8)
    exact = [n for n in divisors if all(float(np.float32(k) / np.float32(n)) * n == k for k in range(n))]
    assert exact == [1, 2, 4]


def test_lesson_10_the_mean_vector_is_exact_where_all_normals_face_the_light():
    assert "Under this condition the mean vector" in page(10) and "it gives too little" in page(10)
    rng = np.random.default_rng(10)
    normals = np.concatenate([rng.normal(0, 0.3, (500, 2)), np.ones((500, 1))], 1)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    for light, faced in ((np.array([0, 0, 1.0]), True), (np.array([0.97, 0, 0.24]), False)):
        cosines = normals @ light
        assert (cosines > 0).all() == faced
        mean, true = normals.mean(0) @ light, np.maximum(cosines, 0).mean()
        assert mean == pytest.approx(true) if faced else mean < 0.99 * true
