"""Proofs by machine of the sentences in docs/guarantee.md and docs/precision.md, from the text of the shaders.

Gappa proves bounds of rounding errors, and z3 that integers are exact. Each theorem is tried a second time with a
worse constant in the text, and must fail then.
"""

import itertools
import operator
import re
import shutil
from fractions import Fraction

import numpy as np
import pytest
from forms import Form, Forms, corner, post, unit, weight
from gappa import FUSED, UNIT, Gappa, Number, Roundings, constant
from shader_text import Evaluator, body, macros, parse, source

from terrain_gl.camera.rounding import CLIP_ROUNDINGS
from terrain_gl.gpu.selftest import QUOTIENT

needs_gappa = pytest.mark.skipif(not shutil.which("gappa"), reason="Gappa is not installed: apt install gappa")


def within(found, bound):
    """The goal, in Gappa's language, that a number is at most `bound` from the exact one."""
    return f"{found.held} - {found.exact} in [{constant(-bound)},{constant(bound)}]"


class Floats:
    """Float32 of numpy, for the evaluator."""

    precise = False
    _OPERATORS = {"<": operator.lt, "&": operator.and_, "|": operator.or_, "<<": operator.lshift, "==": operator.eq}
    _OPERATORS |= {"+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv}

    def number(self, text):
        return int(text.rstrip("u"), 0) if text.rstrip("u").isalnum() else np.float32(text)

    def binary(self, name, a, b):
        return self._OPERATORS[name](a, b)

    def unary(self, name, a):
        return -a

    def choose(self, condition, yes, no):
        return np.where(condition, yes, no)

    def call(self, name, arguments):
        functions = {"exp2": np.exp2, "max": np.maximum, "floor": np.floor, "abs": np.abs, "log2": np.log2}
        return functions[name](*arguments)


def of_text(text, expression, **known):
    """A constant expression of a shader as a float."""
    return float(Evaluator(text, Floats(), **known).value(parse(expression), {}))


# --- Heights between posts: guarantee.md, section 7 -------------------------------------------------------------------


def between_is_proved(text, mode="ne", fused="", first=0, end=16):
    """The height between posts up to 1 is off by rounding_between_m() at most, in a part of a cell, in sixteenths."""
    numbers = Gappa(mode, fused)
    heights = iter([numbers.float_(-1, 1) for _ in range(4)])
    t = [numbers.grid(first / 16, end / 16, -6) for _ in range(2)]
    ignored = {"u_last_post": [], "ivec2": lambda *a: [], "min": lambda *a: [0, 0]}
    evaluator = Evaluator(text, numbers, height_m=lambda post: next(heights), **ignored)
    found = evaluator.call("bilinear_m", [numbers.number("0")] * 2, t)
    expression = body(text, "rounding_between_m")[1][0].removeprefix("return ")
    bound = of_text(text, expression, lowest_m=lambda: np.float32(0), highest_m=lambda: np.float32(1))
    means = [f"{name} in [-1,1]" for name in numbers.means]  # of heights, with weights that add up to 1
    pieces = ", ".join(f"{number.held} in {end - first}" for number in t)
    return numbers.proves(within(found, bound), *means, split=f"$ {pieces};")


@needs_gappa
@pytest.mark.parametrize("fused", FUSED)
def test_heights_between_posts_are_as_close_as_the_bound_says(fused):
    """Posts up to 1 suffice, as all heights may be scaled by a power of two; for others see `counted`."""
    assert between_is_proved(source("mesh/between.glsl"), fused=fused)


@needs_gappa
def test_the_bound_between_posts_is_close():
    """Half of it is not proved, nor the bound itself if floats are cut off, or if compilers may take a + t (b - a)."""
    text = source("mesh/between.glsl")
    assert between_is_proved(text, first=15)
    assert not between_is_proved(text.replace("exp2(-22.0)", "exp2(-23.0)"), first=15)
    assert not between_is_proved(text, "zr", first=15)
    assert not between_is_proved(text.replace("a * (1.0 - t) + b * t", "a + t * (b - a)"), first=15)


def counted(text, name, *arguments, **known):
    """The most roundings that any product in a function's result passes, for operands of any size."""
    return Evaluator(text, Roundings(), **known).call(name, *arguments)


def test_a_height_between_posts_is_rounded_four_times():
    """Each of both interpolations rounds twice. 1 - t is exact for 64ths. Then the twist of 2 x 2 parts."""
    text = source("mesh/between.glsl").replace("(1.0 - t)", "rest(t)")
    known = {"height_m": lambda post: 0, "rest": lambda t: 0, "u_last_post": [0, 0], "ivec2": lambda *a: [0, 0]}
    known["min"] = lambda *a: [0, 0]
    heights = iter(Form(unit(i), (0, 0)) for i in range(4))
    of = Evaluator(text, Forms(), height_m=lambda post: next(heights))
    twist = of.call("twist_m", [weight(0), weight(0)])
    own = twist.size[0]  # 2^-24 of the twist itself; all errors are raised by more
    bound = of_text(text, body(text, "rounding_between_m")[1][0].split(" * ", 1)[1])
    of_height = counted(text, "bilinear_m", [0, 0], [0, 0], **known)
    assert (of_height + (twist.error[0] - own) / 4 / 2**2) * UNIT == bound


# --- Clip coordinates, boxes: precision.md, sections 1 and 3; guarantee.md, section 2 ---------------------------------


def position(text, numbers, posts, spacing_m, offset_m, heights_m):
    """East, north and up from the eye; `heights_m`: of the vertex, of the eye, and what the eye's float loses."""
    height, eye, rest = heights_m
    view = {"u_eye_post": [numbers.whole()] * 2, "u_spacing_m": spacing_m, "u_eye_offset_m": offset_m}
    evaluator = Evaluator(text, numbers, u_eye_z_m=eye, u_eye_z_rest_m=rest, **view)
    return [*evaluator.call("post_from_eye_m", posts), evaluator.call("up_from_eye_m", height)]


def dot(numbers, a, b):
    return Evaluator("", numbers).called("dot", [a, b])


def clip_is_proved(text, roundings, mode="ne", fused="", reach=1024):
    """A row of a matrix with entries up to 1, times a vertex up to `reach` posts away: at most so many roundings."""
    numbers = Gappa(mode, fused)
    posts = [numbers.grid(-reach, reach, 0) for _ in range(2)]
    heights = numbers.float_(-reach, reach), numbers.float_(-reach, reach), numbers.float_(-UNIT, UNIT)
    place = position(
        text, numbers, posts, [numbers.real(0.5, 1)] * 2, [numbers.real(-0.5, 0.5) for _ in range(2)], heights
    )
    clip = dot(numbers, [numbers.real(-1, 1) for _ in range(3)], place)
    clip = Number(numbers.rounded(clip), clip.exact)
    return numbers.proves(within(clip, roundings * UNIT * (2 * (reach + 1) + 2 * reach)))


@needs_gappa
@pytest.mark.parametrize("fused", FUSED)
def test_clip_coordinates_are_as_close_as_the_bound_says(fused):
    assert clip_is_proved(source("blocks/view.glsl"), CLIP_ROUNDINGS, fused=fused)


@needs_gappa
def test_positions_relative_to_the_eye_are_needed():
    """With the eye subtracted last, from positions in the map, the same bound is not proved."""
    text = source("blocks/view.glsl")
    worse = text.replace("(h_m - u_eye_z_m) - u_eye_z_rest_m", "(h_m + 65536.0) - (u_eye_z_m + 65536.0)")
    assert worse != text and not clip_is_proved(worse, CLIP_ROUNDINGS)


def test_a_clip_coordinate_is_rounded_eight_times():
    """Of any size: 3 roundings of a position, 5 of a matrix product; the ninth covers products of errors."""
    whole = Roundings.WHOLE
    place = position(source("blocks/view.glsl"), Roundings(), [whole, whole], [1, 1], [1, 1], (0, 0, 0))
    assert max(place) == 3
    assert dot(Roundings(), [1, 1, 1], place) + 1 == CLIP_ROUNDINGS - 1  # and the matrix' last column


def slack_suffices(text):
    """Whether project() adds enough to the coordinates of a box's corners.

    A corner x = d s - o has 3 roundings. The eye is half a post or less from its post, so |d s| + |o| <= 3 |x| for
    every other post: at most 9 of |x|. to_camera() adds those of a sum of three products with rounded axes.
    """
    axes = {f"u_{name}": [1, 1, 1] for name in ("right", "up", "forward")}
    numbers = Roundings()
    coordinates = Evaluator(text, numbers, **axes)
    added = max(coordinates.call("to_camera", [0, 0, 0]))
    return (9 + added) * UNIT * (1 + 2.0**-19) <= float(macros(text)["COORDINATE_SLACK"]) * (1 - 8 * UNIT)


def test_boxes_are_widened_by_more_than_rounding():
    text = source("lod/project.glsl")
    assert slack_suffices(text)
    assert not slack_suffices(text.replace("COORDINATE_SLACK 1e-6", "COORDINATE_SLACK 5e-7"))
    assert "mix(box.low, box.high, bvec3(" in text, "corners must be selected, not computed"


# --- The error of a node at a post: guarantee.md, section 1 -----------------------------------------------------------

HEIGHTS = [[corner(row, col) for col in range(3)] for row in range(3)]
RECIPROCAL = 6  # units of 2^-24 that a reciprocal may be off: selftest.py accepts these


def quad_roundings(text, reciprocal):
    """Bounds of the errors of both diagonals, at the corners of each triangle; a reciprocal of 0 units is exact."""
    if not reciprocal:
        text = text.replace("place * n.per_side", "place")  # per_side is a power of two, which rounds nothing
    per_side = [weight(1, reciprocal)] * 2
    triangles = [(True, True, 0, (0, 0), (1, 0), (1, 1)), (False, True, 0, (0, 0), (0, 1), (1, 1))]
    triangles += [(True, True, 1, (0, 0), (1, 0), (0, 1)), (True, False, 1, (1, 1), (1, 0), (0, 1))]
    for east, north, diagonal, *corners in triangles:
        for place in corners:
            of = Evaluator(text, Forms(east=east, first=north))
            found = of.call("quad_errors_m", {"h": HEIGHTS, "per_side": per_side}, [weight(v) for v in place], post())
            # a place beside the diagonal may count to the other triangle: its plane is off by this
            beside = [3 * 2 * (reciprocal + 1) if reciprocal else 0, 0]
            yield found[diagonal].error + beside


def cut_roundings(text, reciprocal):
    """How far a post lies off the line between an edge's ends, at both ends; the edge is 1 long."""
    heights = {"first": corner(2, 0), "post": post(), "end": corner(0, 2)}
    of = Evaluator(text, Forms(), height_m=heights.get)
    node = {"base_m": weight(0), "per_side": weight(1, reciprocal)}
    expressions = {name: declared(text, "cut_edge_m", name).replace("[axis]", "") for name in ("from", "rise", "off")}
    for along in (0.0, 1.0):
        scope = {"n": node, "i": weight(along), "end": "end"}
        for name, post_ in {"from": "first", "rise": "end", "off": "post"}.items():
            scope[name] = of.value(parse(expressions[name]), scope | {"post": post_})
        yield scope["off"].error


def bend_roundings(text):
    """Bounds of the error of a node's twist, from which the bend at the rim follows."""
    bend = next(part for part in body(text, "bend_bound_m")[1] if "n.h[0][0]" in part)
    twist = bend.split("abs(")[1].split(") * min")[0]
    yield Evaluator(text, Forms()).value(parse(twist), {"n": {"h": HEIGHTS}}).error


def twist_roundings(text):
    """Bounds of the error of t/4, where t is a cell's twist.

    The last rounding counts for the error, as |t| is at most 8 times the cell's largest error where it is added. Before
    that, posts are off the node's corner by at most its largest height and the error. They may be high above the map's
    base, which must cancel at once.
    """
    heights = {name: {"height_m": Form(unit(0, 2.0**12) + unit(i), (0, 0))} for i, name in enumerate("abcd", 1)}
    twist = Evaluator(text, Forms()).value(parse(declared(text, "gather_cell", "twist")), heights)
    before = twist.error[0] - twist.size[0]
    return np.array([before / 4, before / 4 + 2])


CREST = 16  # roundings of crest_m(), in units of 2^-24 of a cell's largest error


def rounding_suffices(text):
    """Whether errors are raised by more than they are off: in units of the node's largest height, and of the error.

    The weights of cut edges have a quotient, and are multiplied and added: 2 roundings, as the move of an edge is not
    larger than the error. In nodes at the rim, bend_bound_m() has two quotients, a sum and a product; two sums follow.
    """
    allowed = [float(macros(text)[name]) for name in ("ROUNDING", "ROUNDING_AT_RIM")]
    square, rim = [*quad_roundings(text, 0)], [*quad_roundings(text, RECIPROCAL)]
    square, rim = np.max(square, 0) + [0, 2], np.max(rim, 0) + [0, 2 + RECIPROCAL + 2]
    square += twist_roundings(text) + [0, CREST]
    rim += twist_roundings(text) + np.max([*bend_roundings(text)], 0) + [0, RECIPROCAL + 2 + 2]
    cut = [np.max([*cut_roundings(text, reciprocal)], 0) for reciprocal in (0, RECIPROCAL)]
    found = [*zip((square, rim), allowed, strict=True), *zip(cut, allowed, strict=True)]
    return all(
        height * (1 + 2.0**-10) + 1 <= most and error + 2 < 32  # raising adds 2^-19 of the error, and rounds twice
        for (height, error), most in found
    )


def check_each_change_breaks(holds, text, changes):
    """A proof holds for the text of a shader, and for none of the wrong texts."""
    assert holds(text)
    for right, wrong in changes.items():
        assert right in text
        assert not holds(text.replace(right, wrong))


def test_errors_are_raised_by_more_than_rounding():
    """With reciprocals as far off as the self-test lets pass, but for powers of two, which it wants exact."""
    assert RECIPROCAL * UNIT == QUOTIENT
    text = source("error/cells.glsl")
    assert "max(cut_m.x, cut_m.y) * (1.0 + exp2(-19.0)) + n.rounding_m" in text
    assert "most * (1.0 + exp2(-19.0)) + n.rounding_m" in text
    assert "* (n.is_whole ? ROUNDING : ROUNDING_AT_RIM) * exp2(-24.0)" in text
    assert "2.0 * raised_m(n, worst_m) + mean_m" in text and "+ bend_m + n.rounding_m" in text
    changes = {
        "ROUNDING 16.0": "ROUNDING 12.0",
        "ROUNDING_AT_RIM 256.0": "ROUNDING_AT_RIM 64.0",
        "h10 - h00, h11 - h10": "h10 + h11 - h00 - h11, h11 - h10",
        "(a.height_m - c.height_m) - (d": "(a.height_m + b.height_m) - (c.height_m + b.height_m) - (d",
        "- n.base_m - from - rise * float(i)": "- n.base_m - (from * 32.0 + rise * float(i) - from * 31.0)",
    }
    check_each_change_breaks(rounding_suffices, text, changes)


class Exact(Floats):
    """Fractions."""

    def number(self, text):
        return Fraction(text)

    def call(self, name, arguments):
        return {"abs": abs, "max": max, "mix": lambda a, b, c: b if c else a, "greaterThan": operator.gt}[name](
            *arguments
        )


def crest_is_the_top(text):
    """crest_m() is the largest value of a (1 - s) + b s + t s (1 - s), without rounding."""
    ends = [Fraction(n, 3) for n in (-4, -1, 0, 2, 3)]
    evaluator = Evaluator(text, Exact())
    for a, b, t in itertools.product(ends, ends, [Fraction(n, 5) for n in range(-20, 41, 4)]):
        s = Fraction(1, 2) + (b - a) / (2 * t) if t > 0 else Fraction(0)
        top = a * (1 - s) + b * s + t * s * (1 - s) if 0 <= s <= 1 else a
        if evaluator.call("crest_m", a, b, t) != max(a, b, top):
            return False
    return True


def crest_is_proved(text, units):
    """The top of a parabola is off by so many units of the largest error, which is between 1/2 and 1.

    Both ends and the top are at most that. The top lies between the ends only if t > |a - b|, so the last summand,
    |a - b|^2 / 4t, is at most |a - b| / 4. If |a - b| or t is below 2^-40, this summand is too small to count. If
    rounding decides the comparison wrongly, the top is above the larger end by (t - |a - b|)^2 / 4t, which is too small
    to count as well.
    """
    numbers, differences = Gappa(quotient=QUOTIENT), []
    a, b, t = numbers.float_(-1, 1), numbers.float_(-1, 1), numbers.float_(2.0**-40, 8)
    known = {"abs": lambda a: a, "max": lambda t, _: t, "mix": lambda ends, top, is_inside: top}  # a >= b: symmetric
    known["greaterThan"] = lambda t, d: differences.append(d)
    found = Evaluator(text, numbers, **known).call("crest_m", a, b, t)
    d = differences[0].exact
    facts = f"{d} in [{constant(2.0**-40)},2]", f"({d} * {d}) / (4 * {t.exact}) in [0,0.5]", f"{found.exact} in [-1,1]"
    return numbers.proves(within(found, units * UNIT / 2), *facts)


@pytest.mark.slow
def test_the_crest_of_a_cell_is_the_top_of_its_parabola():
    text = source("error/cells.glsl")
    changes = {
        "0.25 * t": "0.24 * t",
        "(4.0 * max(t": "(4.5 * max(t",
        "0.5 * (a + b)": "0.5 * max(a, b)",
    }
    check_each_change_breaks(crest_is_the_top, text, changes)


@needs_gappa
def test_the_crest_of_a_cell_is_as_close_as_errors_are_raised_for():
    """crest_m() is off by at most `CREST` units, and raised_m() adds more than all roundings (`rounding_suffices`)."""
    text = source("error/cells.glsl")
    assert crest_is_proved(text, CREST)
    worse = text.replace("0.5 * (a + b) + 0.25 * t", "(0.5 * (a + b) + 64.0 * t) - 63.75 * t")
    assert worse != text and not crest_is_proved(worse, CREST)


# --- The error table: never rounded down. guarantee.md, section 1 -----------------------------------------------------


def declared(text, function, name):
    """The expression that a function declares a variable with."""
    return next(part.split(" = ", 1)[1] for part in body(text, function)[1] if f" {name} = " in f" {part}")


def pair_is_proved(text, quotient):
    """What unpack_errors() gives is at least the error, if half_up() rounds up."""
    numbers = Gappa(quotient=quotient)
    error = numbers.float_(1, 2)  # with any span: scaled by a power of two
    unit = numbers.float_(2.0**-20, 2.0**-19)
    evaluator = Evaluator(text, numbers, error_unit_m=lambda: unit)
    held = evaluator.value(parse(declared(text, "pack_errors", "e")), {"e_m": error})
    returned = body(text, "unpack_errors")[1][0].removeprefix("return ")
    evaluator.known["unpackHalf2x16"] = lambda record: Number(numbers.rounded(held), held.exact)
    found = evaluator.value(parse(returned), {"record": None})
    raised = of_text(text, declared(text, "pack_errors", "e"), e_m=np.float32(1), error_unit_m=lambda: np.float32(1))
    lost = np.nextafter(1 / raised - 1, 1)  # the relative error may lose as much as the factor adds
    return numbers.proves(f"{numbers.rounded(found)} -/ {found.exact} in [{constant(lost)}, 1]")


@needs_gappa
def test_errors_in_the_table_are_not_rounded_down():
    """Also with division as far off as the self-test lets pass, a little more than GLSL allows."""
    text = source("error/nodes.glsl")
    assert pair_is_proved(text, quotient=QUOTIENT)
    assert not pair_is_proved(text.replace("exp2(-20.0)", "exp2(-21.0)"), quotient=QUOTIENT)


def half_up_is_right(text, pack):
    """half_up() of two million floats around 1, and of ends of the range, is at least the float, and close to it."""
    known = {"packHalf2x16": lambda v: pack(v[0]).view("u2").astype("u4"), "vec2": lambda *a: list(a)}
    known["unpackHalf2x16"] = lambda h: [np.asarray(h).astype("u2").view("f2").astype("f4")]
    evaluator = Evaluator(text, Floats(), **known)
    floats = np.arange(0x3F700000, 0x3F900000, dtype="u4").view("f4")
    ends = np.float32([2.0**-30, 2.0**-14, np.nextafter(np.float32(2.0**-14), np.float32(1)), 16383, 16384])
    for x in (floats, ends):
        found = np.asarray(evaluator.call("half_up", x)).astype("u2").view("f2").astype("f4")
        if not ((found >= x) & (found <= np.maximum(x * np.float32(1 + 2.0**-10), np.float32(2.0**-14)))).all():
            return False
    return True


def to_nearest(x):
    return x.astype("f2")


def cut_off(x):
    return (x.view("u4") & np.uint32(0xFFFFE000)).view("f4").astype("f2")


@pytest.mark.parametrize("pack", [to_nearest, cut_off])
def test_half_floats_are_rounded_up(pack):
    """However packHalf2x16() rounds, which GLSL leaves open."""
    text = source("error/nodes.glsl")
    assert half_up_is_right(text, pack)
    assert not half_up_is_right(text.replace("h + 1u : h", "h : h"), pack)


def squares_are_right(text):
    """square_up() gives at least 8 times a share, in units of 2^-32, and little more."""
    rng = np.random.default_rng(3)
    share = np.float32(2.0 ** rng.uniform(-60, 27, 200000))
    known = {"uvec2": lambda *a: list(a), "add64": lambda a, b: (a, b), "uint": np.uint64}
    s = declared(text, "square_up", "s").split(", high")[0]
    of = Evaluator(text, Floats(), **known)
    scaled = of.value(parse(s), {"share": share})
    high = np.floor(scaled)
    words = of.value(parse("uvec2(uint((s - high) * 4294967296.0), uint(high))"), {"s": scaled, "high": high})
    assert "uvec2(uint((s - high) * 4294967296.0), uint(high)), uvec2(1u, 0u)" in text
    found = words[1].astype("f8") * 2.0**32 + words[0].astype("f8") + 1
    exact = share.astype("f8") * 8 * 2.0**32
    return bool(((found >= exact) & (found <= exact * (1 + 2.0**-17) + 1)).all())


def test_squares_are_not_rounded_down():
    text = source("error/nodes.glsl")
    assert squares_are_right(text)
    assert not squares_are_right(text.replace("(1.0 + exp2(-18.0)), high", "(1.0 - exp2(-22.0)), high"))


# --- Pairs of floats: precision.md, section 5 -------------------------------------------------------------------------


def as_fractions(pair):
    return [Fraction(float(x)) + Fraction(float(rest)) for x, rest in zip(*np.broadcast_arrays(*pair), strict=True)]


def pairs_are_exact(text, n=3000):
    """Areas of integers below 2^21 are exact; sums, products and quotients lose at most 2^-44 of their size."""
    rng = np.random.default_rng(8)
    of = Evaluator(text, Floats())
    with np.errstate(all="ignore"):
        corners = [[np.float32(rng.integers(-(2**21), 2**21, n)) for _ in "xy"] for _ in "ab"]
        (ax, ay), (bx, by) = ([[int(v) for v in axis] for axis in corner] for corner in corners)
        areas = as_fractions(of.call("doubled_area", *corners))
        exact = [x * v - y * u for x, y, u, v in zip(ax, ay, bx, by, strict=True)]
        heights = np.float32(rng.uniform(-9000, 9000, (4, n)) * 2.0 ** rng.integers(-12, 1, (4, n)))
        a, b = (of.call("sum_of", *heights[k : k + 2]) for k in (0, 2))
        ones, others = as_fractions(a), as_fractions(b)
        of_b = (Fraction(float(p)) + Fraction(float(q)) for p, q in zip(*heights[2:], strict=True))
        lost = [abs(x - y) for x, y in zip(others, of_b, strict=True)]
        for name, right, size in (
            ("plus", lambda x, y: x + y, lambda x, y: max(abs(x), abs(y))),
            ("times", lambda x, y: x * y, lambda x, y: abs(x * y)),
            ("over", lambda x, y: x / y, lambda x, y: abs(x / y)),
        ):
            got = as_fractions(of.call(name, a, b))
            off = (abs(g - right(x, y)) / size(x, y) for g, x, y in zip(got, ones, others, strict=True))
            lost.append(max(off) - Fraction(1, 2**44))
    return areas == exact and max(lost) <= 0


def test_pairs_of_floats_are_exact_enough():
    text = source("mesh/error.frag")
    assert pairs_are_exact(text)
    for piece in ("(a - (sum - of_b)) + (b - of_b)", "(a.x * b.y + a.y * b.x)", "a_low * b_low", "remainder.x / b.x"):
        assert piece in text and not pairs_are_exact(text.replace(piece, "0.0"), 300), piece


# --- Integers: guarantee.md, sections 3 to 5 --------------------------------------------------------------------------


class Words:
    """z3's words of 32 bits, for the evaluator."""

    precise = False

    def __init__(self, z3):
        self.z3 = z3
        shifts = {"<<": operator.lshift, ">>": z3.LShR}
        self._operators = Floats._OPERATORS | shifts | {"^": operator.xor, "!=": operator.ne}

    def number(self, text):
        return self.z3.BitVecVal(int(float(text)) if re.search("[.e]", text) else int(text.rstrip("u"), 0), 32)

    def binary(self, name, a, b):
        return self._operators[name](a, b)

    def unary(self, name, a):
        return ~a if name == "~" else -a

    def call(self, name, arguments):
        raise NotImplementedError(name)


@pytest.fixture(scope="module")
def z3():
    return pytest.importorskip("z3", reason="z3 is not installed: pip install z3-solver")


def always(z3, claim):
    """Whether a claim holds for all words."""
    solver = z3.Solver()
    solver.add(z3.Not(claim))
    return solver.check() == z3.unsat


def is_lanewise(z3, text, name, operation, *low):
    """Whether a function of packed words works on each lane alone. `low`: all bits except the highest of each lane."""
    a, b = z3.BitVecs("a b", 32)
    bits = 32 if low == (0x7FFFFFFF,) else 8
    found = Evaluator(text, Words(z3)).call(name, a, b, *(z3.BitVecVal(each, 32) for each in low))

    def lane(word, first):
        return z3.Extract(first + bits - 1, first, word)

    lanes = range(0, 32, bits)
    return always(z3, z3.And([lane(found, i) == operation(lane(a, i), lane(b, i)) for i in lanes]))


def test_packed_counters_wrap_each_for_itself(z3):
    for low in (0x7F7F7F7F, 0x7FFFFFFF):
        for name, operation in (("add_apart", operator.add), ("sub_apart", operator.sub)):
            assert is_lanewise(z3, source("sat/word.glsl"), name, operation, low)
    text = source("error/bound.glsl")
    assert is_lanewise(z3, text, "sub8", operator.sub)
    assert not is_lanewise(z3, text.replace("0x7f7f7f7fu", "0x7f7f7fffu"), "sub8", operator.sub)


def test_differences_of_wrapped_sums_are_exact(z3):
    """box = (D - C) - (B - A) modulo 256 is the count in a box, if that is below 256, however the sums wrapped."""
    a, left, top, box = z3.BitVecs("a left top box", 8)
    text = source("sat/box.glsl")
    expression = "sub(sub(D, C), sub(B, A))"
    assert f"return {expression};" in text
    corners = {"A": a, "B": a + top, "C": a + left, "D": a + left + top + box}  # sums over rectangles from the corner
    numbers = Words(z3)
    for words, right in ((expression, True), ("sub(sub(D, C), sub(A, B))", False)):
        found = Evaluator(text, numbers, sub=operator.sub).value(parse(words), corners)
        assert always(z3, found == box) == right


def test_a_shape_keeps_all_its_numbers(z3):
    """shape_of() of mesh/shape.glsl reads what shape_word() has written."""
    side, step, *edges = z3.BitVecs("side step west north east south", 32)
    limits = [z3.ULT(side, 32), step >= -16, step < 48, *(z3.ULT(edge, 8) for edge in edges)]
    text = source("mesh/shape.glsl")
    written = Evaluator(text, Words(z3)).call("shape_word", side, step, edges)

    def same(reader):
        known = {"Shape": lambda *parts: parts}
        read = Evaluator(reader, Words(z3), **known).call("shape_of", [0, 0, written, 0])
        ends = z3.And([a == b for a, b in zip(read[3], edges, strict=True)])
        return always(z3, z3.Implies(z3.And(limits), z3.And(read[1] == side, read[2] == step, ends)))

    assert same(text)
    assert not same(text.replace("uvec4(11, 14, 17, 20)", "uvec4(11, 13, 17, 20)"))


def edge_places(text, corner, side_log2, segments_log2, u_last_post=1 << 30):
    """Places of the vertices along a side, as mesh/shape.glsl computes them, in 64ths of a post."""
    numbers = Integers()
    tess = np.arange(2**segments_log2 + 1, dtype="f4") / np.float32(2**segments_log2)
    known = {"ivec2": lambda a: a, "u_last_post": u_last_post, "clamp": lambda x, low, high: np.clip(x, low, high)}
    shape = {"corner": corner, "side_log2": side_log2}
    return Evaluator(text, numbers, **known).call("place_of", shape, tess)


class Integers(Floats):
    """Numpy's integers and floats."""

    def call(self, name, arguments):
        return np.round(*arguments).astype("i8") if name == "round" else super().call(name, arguments)


def sides_meet(text):
    """Both sides of every edge have the same vertices: a long square, and the shorter ones beside it."""
    for long_log2 in (1, 2, 5, 8, 11):
        for short_log2 in range(max(0, long_log2 - 6), long_log2 + 1):
            for step_log2 in range(max(long_log2 - 6, short_log2 - 6, -5), short_log2 + 1):
                corner = 5 << long_log2
                long = edge_places(text, corner, long_log2, long_log2 - step_log2)
                corners = range(corner, corner + (1 << long_log2), 1 << short_log2)
                short = [edge_places(text, c, short_log2, short_log2 - step_log2) for c in corners]
                if set(np.concatenate(short).tolist()) != set(long.tolist()):
                    return False
    return True


def test_both_sides_of_an_edge_have_the_same_vertices():
    text = source("mesh/shape.glsl")
    assert sides_meet(text)
    assert not sides_meet(text.replace("tess_coord * 64.0", "tess_coord * 32.0"))


def test_squares_stand_on_the_lattice_of_their_spacing(z3):
    """coarsest_step(): the square's corner is a post of the level, so its cells are nodes of the tables."""
    x, y, side, step = z3.BitVecs("x y side step", 32)
    text = source("lod/rings/leaf.glsl")
    returned = body(text, "coarsest_step")[1][0]
    inner = returned[returned.index("findLSB(") + len("findLSB(") : returned.index(")")]
    numbers = Words(z3)
    low = [x, y]

    def on_lattice(expression):
        bits = Evaluator(text, numbers).value(parse(expression), {"low": low, "side_log2": side})
        one = z3.BitVecVal(1, 32)
        mask = (one << step) - 1
        divides = (bits & mask) == 0  # step is at most findLSB(bits)
        given = z3.And(z3.ULT(side, 31), z3.ULT(step, 32), divides)
        return always(z3, z3.Implies(given, z3.And(x & mask == 0, y & mask == 0, (one << side) & mask == 0)))

    assert on_lattice(inner)
    assert not on_lattice(inner.replace("low.x | low.y", "low.x"))
