"""Statements on the course's pages that can be computed: each stands in a page as it is asserted here."""

import numpy as np
import pytest
from courses import checking

LESSONS = {int(folder.name[:2]): folder for folder in checking.lessons()}


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
