"""Options of a frame: what one choice does to earlier ones that do not go with it."""

import itertools

import pytest

from terrain_gl.drawing import METHODS, Drawing
from terrain_gl.exceptions import UsageError
from terrain_gl.methods.clipmap import Rings
from terrain_gl.methods.tessellated import Edges

CHOICES = [
    {"max_error_px": 2.0},
    {"triangles": 500},
    {"method": "clipmap", "parameters": Rings(101)},
    {"method": "tessellated", "parameters": Edges(9.0)},
    *({"method": method} for method in METHODS),
]


@pytest.mark.parametrize(("first", "then"), [*itertools.product(CHOICES, CHOICES)])
def test_the_later_choice_holds(first, then):
    changed = Drawing(**first, style="normals").otherwise(**then)
    assert {key: getattr(changed, key) for key in then} == then and changed.style == "normals"


def test_what_goes_with_the_change_stays():
    budget = Drawing(triangles=500, metric="rms").otherwise(method="clipmap")
    assert (budget.triangles, budget.metric, budget.method) == (500, "rms", "clipmap")
    assert Drawing(3.0).otherwise(method="full").otherwise(method="sat").max_error_px == 3.0
    assert Drawing(method="clipmap", parameters=Rings(101)).otherwise(style="lod").parameters == Rings(101)


def test_choices_that_exclude_each_other_are_refused_together():
    with pytest.raises(UsageError, match="give one of them"):
        Drawing().otherwise(triangles=500, max_error_px=2.0)
    with pytest.raises(UsageError, match="draws every post"):
        Drawing().otherwise(triangles=500, method="full")


@pytest.mark.parametrize("sun", [(float("nan"), 5.0), (1.0, 100.0), (1.0, 2.0, 3.0), None])
def test_suns_that_are_none(sun):
    with pytest.raises(UsageError, match="sun: expected azimuth and elevation"):
        Drawing(sun=sun)


@pytest.mark.parametrize("option", ["triangles", "water_m", "near_m", "max_error_px"])
def test_what_is_no_number_is_refused(option):
    with pytest.raises(UsageError, match="nan"):
        Drawing(**{option: float("nan")})
