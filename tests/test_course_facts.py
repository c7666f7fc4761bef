"""What the pages state: computed here where it can be, and course/FACTS.md names the check of each statement."""

import numpy as np
import pytest
from courses import checking, folders

from terrain_gl import reference
from terrain_gl.reference import rings

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
    assert (rivals.largest_of_any(rivals.all_windows(errors), boxes) == true).all()
    square = np.pad(errors, ((0, 78), (0, 58)))  # a pyramid has a power of two
    assert (rivals.bound_of_nodes(rivals.pyramid(square), boxes) >= true).all()
    squares = np.concatenate([low // 2, low // 2 + rng.integers(8, 16, (100, 1))], 1)
    true = [errors[y0:y1, x0:x1].max() for x0, y0, x1, y1 in squares]
    assert (rivals.of_one_size(tables, 3, squares) == true).all() and rivals.largest(tables, squares)[1] <= 4


def test_lesson_6_compares_at_equal_error():
    """The true error of right triangles, at the posts."""
    figure, rng = checking.load(LESSONS[6] / "figure.py"), np.random.default_rng(8)
    heights = figure.spike(figure.land(rng, 65, 65), rng)
    errors = figure.truth.true_rtin(heights)
    for tolerance_m, said in ((30.0, "890 of them"), (20.0, "973 right triangles")):
        found = figure.triangles(errors, tolerance_m)
        worst = max(farthest(np.array(each[:3]), heights) for each in found)
        assert said in page(6) and said.startswith(str(len(found))) and f"{worst:.1f}" in page(6)
    leaves = figure.tree(figure.truth.node_errors(heights), 30.0)
    assert f"{len(leaves)} leaves are {2 * len(leaves)} triangles" in page(6)


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
    told = f"{over} of its {len(plain)} squares are over tolerance, the worst one by a factor of {ratio:.1f}"
    assert told in page(13)
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


def test_lesson_1_edges_are_straight_and_slopes_are_means():
    rng = np.random.default_rng(1)
    a, b, c, d = rng.normal(0, 9, 4)
    cell = lambda f, g: (1 - g) * ((1 - f) * a + f * b) + g * ((1 - f) * c + f * d)  # noqa: E731
    share = np.linspace(0, 1, 9)
    for edge in (cell(share, 0), cell(share, 1), cell(0, share), cell(1, share)):
        assert np.diff(edge, 2) == pytest.approx(0, abs=1e-12)
    assert np.abs(np.diff(cell(share, share), 2)).max() > 1e-3  # a diagonal is not straight
    assert (cell(0.51, 0.5) - cell(0.49, 0.5)) / 0.02 == pytest.approx(((b - a) + (d - c)) / 2)


def test_lesson_1_a_mirrored_map_is_lit_on_its_northern_slopes():
    ridge = np.repeat(10 - np.abs(np.arange(21.0) - 10)[:, None], 3, 1)  # from west to east; row 0 is the north
    noon = np.array([0, -1, 1]) / np.sqrt(2)  # the sun in the south
    right, mirrored = (reference.normals_of(h, (1.0, 1.0)) @ noon for h in (ridge, ridge[::-1]))
    assert right[:10] == pytest.approx(0) and right[10:] == pytest.approx(1)
    assert mirrored[10:] == pytest.approx(1)  # here the file's northern slope is drawn


def test_lesson_2_the_upper_corner_moves_most():
    figure, tan_y = checking.load(LESSONS[2] / "figure.py"), np.tan(np.radians(30))
    x, y = np.meshgrid(np.linspace(-1, 1, 33) * tan_y * 16 / 9, np.linspace(1, -1, 19) * tan_y)
    ratios, away = figure.ratio(-20, x, y), np.sqrt(1 + x * x + y * y)
    assert ratios.max() == ratios[0, 0] and f"the largest factor, {ratios[0, 0]:.2f}" in page(2)
    assert f"by a factor of up to {np.floor(100 * away.max()) / 100:.2f}" in page(2)
    assert figure.ratio(0, x, y) / away == pytest.approx(1)  # f of a level camera
    assert figure.ratio(-90, 0.01, 0.0) < 0.011


def test_lesson_2_corners_bound_a_box():
    rng = np.random.default_rng(2)
    signs = np.array(np.meshgrid(*[[-1, 1]] * 3)).reshape(3, 8)
    for _ in range(50):
        up, (axes, _) = rng.normal(size=3), np.linalg.qr(rng.normal(size=(3, 3)))
        up /= np.linalg.norm(up)
        middle, half = np.array([*rng.normal(0, 20, 2), 60.0]), rng.uniform(1, 15, 3)
        corners = middle[:, None] + axes @ (half[:, None] * signs)
        inside = middle[:, None] + axes @ (half[:, None] * rng.uniform(-1, 1, (3, 500)))
        assert inside[2].min() >= corners[2].min() > 0
        ends = [(corners[k] / corners[2]).min() for k in (0, 1)], [(corners[k] / corners[2]).max() for k in (0, 1)]
        places = inside[:2] / inside[2]
        assert (places >= np.array(ends[0])[:, None]).all() and (places <= np.array(ends[1])[:, None]).all()
        bound = np.hypot(*np.abs(up[:2] - np.array(ends) * up[2]).max(0))
        assert np.hypot(*(up[:2, None] - places * up[2])).max() <= bound


def test_lesson_3_numbers_of_words_and_floats():
    assert np.finfo(np.float32).nmant + 1 == 24 and 0.5e12 < 4096**2 * 2**15 < 4096**2 * 2**16 < 1.2e12
    assert np.spacing(np.float32(1e12)) == 2**16
    sum_bits = np.log2(81 * 40000)  # of a box of 9 × 9 heights
    assert sum_bits < 22 and sum_bits - 16 < sum_bits / 2
    assert 65536 * 65535 < 2**32
    values = np.random.default_rng(3).integers(0, 65536, 400_000).astype(np.uint32)
    sums = values.cumsum(dtype=np.uint32)
    assert values.sum(dtype=np.uint64) > 2**33 and values.cumsum().dtype == np.uint64
    box = slice(300_001, 365_001)
    assert sums[365_000] - sums[300_000] == values[box].sum(dtype=np.uint64) < 2**32
    assert np.sqrt(np.square([9.0] + 80 * [0.0]).mean()) == 1


def test_lesson_3_the_strips_of_the_page():
    values = np.array([[3, 1, 4, 1], [5, 9, 2, 6], [5, 3, 5, 8]])
    strips, running = values.sum(1), values.cumsum().reshape(3, 4)
    before = np.concatenate([[0], strips[:-1].cumsum()])  # without the last strip
    assert (before[:, None] + values.cumsum(1) == running).all()
    for name, cells in (("reduce", strips), ("scan", before)):
        assert f"{name} │ " + " │ ".join(map(str, cells)) + " │" in page(3)
    assert "propagate │ " + " │ ".join(" ".join(map(str, row)) for row in running) + " │" in page(3)


def test_lesson_4_numbers_of_sums_and_counters():
    one = np.full(1024, 0.1)
    one[7] = 10
    equal = np.full(1024, 0.5)
    assert f"= {np.sqrt(np.square(one).sum()):.1f}$ metres" in page(4)
    assert np.sqrt(np.square(equal).sum()) == 16 == 32 * equal.max()
    counts = np.arange(1, 600).astype(np.uint8)
    assert (counts == 0).argmax() + 1 == 256  # the first number of cells that seems to be none
    assert f"{np.floor(4 * sum((513 - 2**k) ** 2 for k in range(10)) / 512**2):.0f} bytes: a float" in page(4)
    wide, high = np.meshgrid(np.arange(128, 257), np.arange(4, 9))
    step = 2 ** np.floor(np.log2(high)).astype(int)
    assert f"{(-(-wide // step) * -(-high // step)).mean():.0f} fetches on average" in page(4)


def test_lesson_5_a_twist_is_a_quarter_off_on_either_diagonal():
    rng = np.random.default_rng(5)
    a, b, c, d = rng.normal(0, 9, (4, 40, 1, 1))
    s, t = np.mgrid[0:1:33j, 0:1:33j]
    truth = (1 - s) * ((1 - t) * a + t * b) + s * ((1 - t) * c + t * d)
    falling = np.where(t >= s, a + (b - a) * t + (d - b) * s, a + (c - a) * s + (d - c) * t)
    rising = np.where(s + t <= 1, a + (b - a) * t + (c - a) * s, d + (c - d) * (1 - t) + (b - d) * (1 - s))
    for drawn in (falling, rising):
        off = np.abs(drawn - truth)
        quarter = np.abs(a - b - c + d)[:, 0, 0] / 4
        assert off.max((1, 2)) == pytest.approx(quarter) and off[:, 16, 16] == pytest.approx(quarter)


def test_lesson_5_a_child_may_be_worse_and_level_1_never_is_better():
    truth, rng = checking.load(LESSONS[5] / "check.py"), np.random.default_rng(6)
    bumps = np.arange(5) * 10 + np.array([0.0, 1, -1, 1, 0])  # a slope with bumps
    heights = np.repeat(bumps[None], 5, 0)
    assert truth.true_quads(heights, 2).max() < truth.true_quads(heights, 1).max()
    for noise in (rng.normal(0, 1, (65, 65)), rng.standard_cauchy((65, 65))):
        twists = np.abs(noise[:-1, :-1] - noise[:-1, 1:] - noise[1:, :-1] + noise[1:, 1:]) / 4
        children = twists.reshape(32, 2, 32, 2).max((1, 3))
        assert (truth.true_quads(noise, 1) >= children * (1 - 1e-9)).all()


def test_lesson_5_shares_of_the_bundled_maps():
    """Nodes of 16 × 16 cells, in a part of 1025 × 1025 posts of each map."""
    figure = checking.load(LESSONS[5] / "figure.py")
    found = [figure.shares(figure.bundled(name), (1, 2, 3, 4))[3] for name in ("alpine-30m", "canyon-15m")]
    assert found == pytest.approx([0.10, 0.20], abs=0.012)


def test_lesson_7_floats_are_near_and_parts_cover_the_whole():
    assert round(0.4999) != round(0.5001)
    rng = np.random.default_rng(7)
    cross = lambda u, v: u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]  # noqa: E731
    p, q, s = rng.uniform(0, 30, (3, 1000, 2))
    r = p + rng.uniform(0.1, 0.9, (1000, 1)) * (q - p)
    whole, parts = cross(q - p, s - p), np.array([cross(r - p, s - p), cross(q - r, s - r)])
    assert parts.sum(0) == pytest.approx(whole) and (np.sign(parts) == np.sign(whole)).all()
    off = np.abs(cross(q - p, r - p))
    assert off.max() > 1e-14 and (off < 1e-12).all()
    d = q - p
    shares = (d * (d / np.square(d).sum(1, keepdims=True))).sum(1)  # the end's own share, by one formula of many
    assert (shares < 1).any() and shares == pytest.approx(1, abs=1e-14)


def test_lesson_8_roundings_are_far_below_half_a_post():
    assert f"{np.nextafter(np.float32(3), np.float32(0)):.7f} is post 3" in page(8)
    for n in range(1, 65):
        k, step = np.arange(n + 1), np.float32(1) / np.float32(n)
        u = k.astype(np.float32) * step
        assert np.abs(u.astype(float) * 60 - k * 60 / n).max() < 1e-4
        rounded = [int(i) * 2**24 % n != 0 for i in range(1, n)]  # the share i/n is not a binary number of 24 bits
        assert np.mean(rounded) > 0.5 if n & (n - 1) else not any(rounded)


def test_lesson_9_trees_and_prices():
    trees = 1
    for _ in range(4):
        trees = 1 + trees**4
    assert trees > 10**19
    truth, rng = checking.load(LESSONS[9] / "check.py"), np.random.default_rng(9)
    squares = truth.tree_of(rng.normal(0, 9, (17, 17)))
    least = truth.least_errors(squares)
    numbers, chosen = np.arange(len(least)), {n for n, _ in truth.hull(least)}
    found = [int(np.argmin(least + 2 * price * numbers)) for price in np.geomspace(1e-3, 1e6, 300)]
    assert (np.diff(found) <= 0).all() and set(found) <= chosen and len(set(found)) > 20
    for n in set(found):  # no tree with as few leaves or fewer has less error
        assert least[n] == least[: n + 1].min()


def test_lesson_9_the_tower():
    """The tower of the right figure."""
    figure, rng = checking.load(LESSONS[9] / "figure.py"), np.random.default_rng(4)
    truth, plain = figure.truth, figure.spike(np.full((33, 33), 100.0) + rng.normal(0, 0.1, (33, 33)), rng)
    squares = truth.tree_of(plain)
    assert len(squares) == 6 and 2 * squares[0].size == 2048
    least = truth.least_errors(squares)
    drawn = 2 * int(np.flatnonzero(least < 300**2 / 2)[0])
    assert f"draws the tower with {drawn} triangles" in page(9)
    errors = [truth.true_totals(squares, truth.true_greedy(squares, n))[1] for n in (1900, 2048)]
    assert errors[0] > 0.9 * 300**2 / 2 and errors[1] == 0
    times = figure.away(squares, least, figure.nested_greedy)
    assert f"{np.median(times):.2f} times that of the best tree in the median, and at most {times.max():.2f}" in page(9)


def test_lesson_10_lobes():
    z = -1 + (np.arange(20000) + 0.5) / 10000
    for kappa in (0.01, 0.5, 3.0, 50.0):
        weights = np.exp(kappa * (z - 1))
        length = 1 / np.tanh(kappa) - 1 / kappa
        assert (weights * z).sum() / weights.sum() == pytest.approx(length, rel=1e-4)
        assert kappa > 0.5 or length == pytest.approx(kappa / 3 - kappa**3 / 45, rel=1e-2)
        near = length * (3 - length**2) / (1 - length**2)
        assert near == pytest.approx(kappa, rel=0.05) and (kappa < 0.1 or abs(near / kappa - 1) > 1e-4)
    rng, lengths = np.random.default_rng(10), []
    for spread in (0.1, 0.5, 2.0):
        normals = np.concatenate([rng.normal(0, spread, (500, 2)), np.ones((500, 1))], 1)
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        lengths.append(np.linalg.norm(normals.mean(0)))
        for light in rng.normal(size=(50, 3)):
            assert max(0, normals.mean(0) @ light) <= np.maximum(normals @ light, 0).mean() * (1 + 1e-12) + 1e-12
    assert 1 > lengths[0] > lengths[1] > lengths[2]


def test_lesson_10_the_furnace():
    z = -1 + (np.arange(200000) + 0.5) / 100000
    lobe = 2 * np.pi * 1.17 * np.exp(2.133 * (z - 1)) * 1e-5
    whole, upper = lobe.sum(), lobe[z > 0].sum()
    assert 2 * np.pi * z[z > 0].sum() * 1e-5 == pytest.approx(np.pi)
    assert f"receives {whole:.3f} in place of 3.142" in page(10)
    assert f"{upper:.3f} comes from the upper half" in page(10)
    assert f"received {np.pi / upper * whole:.2f}" in page(10)  # the scale of the upper half alone


def test_lesson_11_steps_and_the_disc():
    assert f"{np.degrees(np.arcsin(695_700 / 149_597_871)):.2f}°" in page(11)
    for x in (-0.9, -0.2, 0.5):
        chords = np.sqrt(1 - np.square((np.arange(100000) + 0.5) / 50000 - 1))
        below = (np.arange(100000) + 0.5) / 50000 - 1 < x  # from one end of the disc to the line
        assert chords[below].sum() / chords.sum() == pytest.approx(
            0.5 + (x * np.sqrt(1 - x * x) + np.arcsin(x)) / np.pi, abs=1e-4
        )
    for h in (np.random.default_rng(11).normal(0, 1, 3000), np.arange(3000.0) ** 2, -(np.arange(3000.0) ** 2)):
        stack, steps = [], 0
        for i in range(len(h) - 1, -1, -1):
            while len(stack) > 1 and (h[stack[-1]] - h[i]) * (stack[-2] - i) <= (h[stack[-2]] - h[i]) * (stack[-1] - i):
                stack.pop()
                steps += 1
            stack.append(i)
            steps += 1
        assert len(h) <= steps <= 2 * len(h)


def test_lesson_13_places_and_costs():
    rng = np.random.default_rng(13)
    for level in range(5):
        places = np.array([rings.ring_origin(tuple(eye), (2, 2), level) for eye in rng.uniform(0, 900, (200, 2))])
        assert (places % (4 << level) == 0).all() and (places % (8 << level) != 0).any()
    cost = lambda segments: 2 * segments**2 + rings.PATCH_COST  # noqa: E731
    assert 4 * cost(2) == 88 and cost(4) == 46
    assert max(cost(1), cost(2), cost(4)) < 4 * cost(2) < cost(8)


def test_lesson_14_bounds_are_nested_and_hold():
    """No mesh that leaves a post out, and all posts inside, is farther off there than the bound; no set has a gap."""
    figure, rng = checking.load(LESSONS[14] / "figure.py"), np.random.default_rng(14)
    mine, heights = figure.mine, rng.normal(0, 10, (33, 33))
    bounds = mine.bounds(heights)
    for error_m in np.quantile(bounds, (0.2, 0.5, 0.9, 0.99)):
        active = bounds > error_m
        assert np.abs(mine.surface(heights, active) - heights).max() <= error_m + 1e-9
        for middle, _, other in mine.middles(33):
            for sign in (-1, 1):  # the right angles of both triangles
                y = middle[0] + sign * (other[1] - middle[1])
                x = middle[1] - sign * (other[0] - middle[0])
                there = (y >= 0) & (y < 33) & (x >= 0) & (x < 33)
                corner = np.isin(y, (0, 32)) & np.isin(x, (0, 32))
                assert (~active[middle][there] | corner[there] | active[y[there], x[there]]).all()


def test_lesson_14_heights_within_an_error_are_an_interval():
    """The shift on the screen grows with the rise, upwards and downwards, for cameras that look and roll anyhow."""
    check, rng = checking.load(LESSONS[2] / "check.py"), np.random.default_rng(14)
    for looks in (-1, 1):
        axes, focal_px, extent = check.view(rng, looks)
        p, v = check.points(rng, extent, 200), axes[:, 2]
        for sign in (-1, 1):
            rises = sign * np.linspace(0, 0.9, 40)[:, None] * p[2]
            px = np.array([check.moved_px(p, v, focal_px, rise) for rise in rises])
            assert (np.diff(px, axis=0) >= 0).all()


def random_flights(count):
    """Heights, eyes, bounds in pixels, pixels of a metre: eyes jump about, and drop below the highest post or rise."""
    mine, rng = checking.load(LESSONS[14] / "figure.py").mine, np.random.default_rng(14)
    check = checking.load(LESSONS[14] / "check.py")
    for _ in range(count):
        heights, frames = check.spike(check.land(rng, 33, 33), rng), int(rng.integers(6, 20))
        up = heights.max() + np.where(rng.random(frames) < 0.5, rng.uniform(-300, 0, frames), 2500)
        eyes = np.column_stack([rng.uniform(-200, 1200, (frames, 2)), up])
        y, x = np.indices(heights.shape) * 30.0
        scale = np.array([400 / np.sqrt((x - e) ** 2 + (y - s) ** 2 + (z - heights) ** 2) for e, s, z in eyes])
        yield mine, rng, heights, eyes, mine.pixels(heights, mine.bounds(heights), 30.0, eyes, 400.0), scale


def test_lesson_14_pixels_hold_wherever_the_eye_is():
    """The vertical distance to the map's highest post alone, also for an eye below it, is no bound."""
    worst = np.zeros(2)
    for mine, rng, heights, eyes, px, scale in random_flights(8):
        error_px = float(rng.uniform(1, 6))
        for middle, _, other in mine.middles(33):  # nested: no post has less than the posts inside
            for sign in (-1, 1):
                y = middle[0] + sign * (other[1] - middle[1])
                x = middle[1] - sign * (other[0] - middle[0])
                there = (y >= 0) & (y < 33) & (x >= 0) & (x < 33)
                there[there] = ~(np.isin(y[there], (0, 32)) & np.isin(x[there], (0, 32)))
                assert (px[:, y[there], x[there]] >= px[:, middle[0][there], middle[1][there]]).all()
        above = eyes.copy()
        above[:, 2] = heights.max() + np.abs(eyes[:, 2] - heights.max())
        to_the_top = mine.pixels(heights, mine.bounds(heights), 30.0, above, 400.0)
        for k, bounds_px in enumerate((px, to_the_top)):
            drawn = np.array([mine.surface(heights, each > error_px) for each in bounds_px])
            worst[k] = max(worst[k], (np.abs(drawn - heights) * scale).max() / error_px)
    assert worst[0] <= 1 and worst[1] > 2


def test_lesson_14_jumps_of_meshes_that_were_chosen_for_one_frame():
    most = 0.0
    for mine, rng, heights, _, px, scale in random_flights(20):
        error_px = float(rng.uniform(1, 6))
        anew = np.array([mine.surface(heights, each > error_px) for each in px])
        jumps = (np.abs(np.diff(anew, axis=0)) * scale[1:] / error_px).max((1, 2))
        assert (jumps <= 1 + (scale[1:] / scale[:-1]).max((1, 2))).all()
        most = max(most, jumps.max())
    assert most > 2


def test_lesson_14_a_blend_keeps_its_error_and_its_jumps_on_any_flight():
    """A key that does not hold in the next key's frame still keeps the error, and no longer the jumps."""
    most = np.zeros(2)
    for mine, rng, heights, _, px, scale in random_flights(20):
        error_px, period = float(rng.uniform(1, 6)), int(rng.integers(1, 8))
        keys = range(-(-(len(px) - 1) // period) + 1)
        drawn_frames = [px[max((i - 1) * period + 1, 0) : (i + 1) * period] > error_px for i in keys]
        surfaces = [mine.surface(heights, each.any(0)) for each in drawn_frames]
        at = np.arange(len(px)) / period
        weights = np.maximum(0, 1 - np.abs(at[:, None] - np.array(keys)))
        for k, drawn in enumerate((mine.fly(heights, px, error_px, period), np.tensordot(weights, surfaces, 1))):
            assert (np.abs(drawn - heights) * scale).max() <= error_px
            jumps = np.abs(np.diff(drawn, axis=0)) * scale[1:]
            most[k] = max(most[k], jumps.max() / (2 * error_px / period))
    assert most[0] <= 1 and most[1] > 3


def test_lesson_14_numbers_of_the_flight():
    figure = checking.load(LESSONS[14] / "figure.py")
    heights, px, scale = figure.flight()
    found = figure.flights(heights, px)
    for drawn, _ in found.values():
        assert (np.abs(drawn - heights) * scale).max() <= figure.ERROR_PX
    (anew, few), (lazy, _), (blended, many) = found.values()
    (one, jump), (_, less), (other, _) = (figure.jumps(each, scale) for each in (anew, lazy, blended))
    assert f"is {one.max():.2f} pixels, and {other.max():.2f} pixels with the blend" in page(14)
    assert f"{less.mean():.0f} posts a frame jump" in page(14) and f"in place of {jump.mean():.0f}, but" in page(14)
    more = f"{100 * (many.mean() / few.mean() - 1):.0f} per cent more"
    assert f"{many.mean():.0f} posts in place of {few.mean():.0f}, {more}" in page(14)
    kept = found["with hysteresis"][1]
    assert f"in the figure, {100 * (kept.mean() / few.mean() - 1):.0f} per cent more" in page(14)
    assert (kept / few).argmax() > 0.9 * len(few) and (one <= figure.bound_px(scale)).all()


FACTS = (folders.HERE / "FACTS.md").read_text(encoding="utf-8")


def facts():
    """Lesson, quoted sentence and checks of each row of FACTS.md."""
    found = []
    for part in FACTS.split("\n## Lesson ")[1:]:
        number, *lines = part.splitlines()
        cells = [line.strip("| ").rsplit(" | ", 1) for line in lines if line.startswith("| ")][1:]
        found += [(int(number), sentence.strip(), checks) for sentence, checks in cells]
    return found


def missing(number, kind, words):
    """The names in a check that do not exist."""
    root = folders.HERE.parent
    if kind == "test":
        path, name = words.split("::")
        return f"def {name}(" not in (root / path).read_text(encoding="utf-8")
    if kind == "task":
        return f'@task("{words} ' not in (LESSONS[number] / "check.py").read_text(encoding="utf-8")
    if kind == "proof":
        path, section = words.split(" section ")
        return f"\n## {section}. " not in (root / path).read_text(encoding="utf-8")
    if kind == "code":
        path, text = words.split(": ", 1)
        return text not in (root / path).read_text(encoding="utf-8")
    if kind == "source:":
        return words not in page(number).split("## Further reading")[1]
    if kind == "measured:":
        return not words.startswith("python -m course ") and not (root / words.split()[1]).is_file()
    return (kind, bool(words)) not in (("derived:", True), ("definition", False))


def test_every_fact_stands_in_its_page_and_has_its_check():
    found = facts()
    assert {number for number, *_ in found} == set(LESSONS) and len(found) > 150
    for number, sentence, checks in found:
        at, text = 0, page(number)
        for words in sentence.split(" … "):
            at = text.find(words, at)
            assert at >= 0, f"lesson {number} does not say: {words}"
            at += len(words)
        each = [check.partition(" ") for check in checks.split("; ")]
        assert not [words for kind, _, words in each if missing(number, kind, words)], (number, sentence, checks)


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("test", "tests/test_course_facts.py::test_that_nobody_wrote"),
        ("task", "1.9"),
        ("proof", "docs/guarantee.md section 99"),
        ("code", "terrain_gl/lod/budget.py: TRIES = 32"),
        ("source:", "Nobody"),
        ("measured:", "python course/nothing.py"),
        ("derived:", ""),
        ("believed", ""),
    ],
)
def test_a_check_that_is_not_there_is_noticed(kind, words):
    assert missing(1, kind, words)
