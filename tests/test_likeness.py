"""Measures of likeness, for pictures whose difference is computed by hand."""

import numpy as np
import pytest

from terrain_gl.comparison.likeness import difference_of, flip, rmse, skyline


def grey(value, size=(40, 60)):
    return np.full((*size, 3), value, np.uint8)


def noise(seed=0, size=(40, 60)):
    return np.random.default_rng(seed).integers(0, 256, (*size, 3), np.uint8)


def test_equal_pictures_do_not_differ():
    assert rmse(noise(), noise()) == 0
    assert flip(noise(), noise()) in (0.0, None)
    assert skyline(np.eye(5), np.eye(5)) == (0, 0)


def test_rmse_by_hand():
    assert rmse(grey(0), grey(255)) == 1.0
    assert rmse(grey(100), grey(151)) == pytest.approx(0.2)
    one = grey(0, (2, 2))
    other = one.copy()
    other[0, 0, 1] = 255  # one channel of twelve
    assert rmse(one, other) == pytest.approx(np.sqrt(1 / 12))
    assert difference_of(one, other)[0, 0] == pytest.approx(np.sqrt(1 / 3))
    assert difference_of(one, other)[1, 1] == 0


def test_rmse_does_not_wrap_around():
    assert rmse(grey(1), grey(255)) == rmse(grey(255), grey(1)) == pytest.approx(254 / 255)


def test_alpha_does_not_count():
    one = np.concatenate([noise(), np.full((40, 60, 1), 255, np.uint8)], -1)
    other = one.copy()
    other[..., 3] = 0
    assert rmse(one, other) == 0
    assert flip(one, other) in (0.0, None)


def test_flip_grows_with_what_is_seen():
    if flip(grey(0), grey(0)) is None:
        pytest.skip("this OpenImageIO has no FLIP; it came with 3.2")
    black_white = flip(grey(0), grey(255))
    assert black_white > 0.9
    steps = [flip(grey(100), grey(100 + step)) for step in (1, 4, 16, 64)]
    assert 0 < steps[0] < steps[1] < steps[2] < steps[3] < black_white


def test_flip_is_the_authors():
    authors = pytest.importorskip("flip_evaluator", reason="the authors' flip-evaluator is not installed")
    if flip(grey(0), grey(0)) is None:
        pytest.skip("this OpenImageIO has no FLIP; it came with 3.2")
    one, other = noise(1), noise(2)
    shifted = np.roll(one, 1, 1)
    for test in (other, shifted, grey(90)):
        _, expected, _ = authors.evaluate(np.float32(one / 255), np.float32(test / 255), "LDR")
        assert flip(one, test) == pytest.approx(expected, abs=2e-4)


def test_skyline_by_hand():
    truth = np.zeros((20, 4))
    truth[:10] = 1  # sky above row 10
    test = truth.copy()
    test[10, 1] = 1  # a pixel lower
    test[9, 2] = 0.25  # three quarters of a pixel higher
    assert skyline(truth, test) == pytest.approx((1.75 / 4, 1.0))


def test_shapes_that_differ_are_refused():
    for measure in (rmse, flip, skyline):
        with pytest.raises(ValueError, match="one shape"):
            measure(grey(0), grey(0, (40, 61)))
