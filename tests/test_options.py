"""Options of a frame: a choice resets earlier choices that are not allowed with it."""

import itertools

import pytest
from commands import parse
from maps import rough

import terrain_gl as tg
from terrain_gl import cli
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.cli import options as cli_options
from terrain_gl.comparison.clipmap import Rings
from terrain_gl.comparison.tessellated import Edges
from terrain_gl.renderer.methods import CERTIFIED, REGISTRY, Method
from terrain_gl.renderer.options import METHODS, OPTIONS, FrameOptions, Option

CHOICES = [
    {"max_error_px": 2.0},
    {"triangles": 500},
    {"method": "clipmap", "parameters": Rings(101)},
    {"method": "tessellated", "parameters": Edges(9.0)},
    *({"method": method} for method in METHODS),
]


@pytest.mark.parametrize(("first", "then"), [*itertools.product(CHOICES, CHOICES)])
def test_the_later_choice_holds(first, then):
    changed = FrameOptions(**first, style="normals").otherwise(**then)
    assert {key: getattr(changed, key) for key in then} == then and changed.style == "normals"


def test_what_goes_with_the_change_stays():
    budget = FrameOptions(triangles=500, metric="rms").otherwise(method="clipmap")
    assert (budget.triangles, budget.metric, budget.method) == (500, "rms", "clipmap")
    assert FrameOptions(3.0).otherwise(method="full").otherwise(method="sat").max_error_px == 3.0
    assert FrameOptions(method="clipmap", parameters=Rings(101)).otherwise(style="lod").parameters == Rings(101)


def test_choices_that_exclude_each_other_are_refused_together():
    with pytest.raises(UsageError, match="give only one of them"):
        FrameOptions().otherwise(triangles=500, max_error_px=2.0)
    with pytest.raises(UsageError, match="draws every post"):
        FrameOptions().otherwise(triangles=500, method="full")


@pytest.mark.parametrize("sun", [(float("nan"), 5.0), (1.0, 100.0), (1.0, 2.0, 3.0), None])
def test_suns_that_are_none(sun):
    with pytest.raises(UsageError, match="sun: expected azimuth and elevation"):
        FrameOptions(sun=sun)


@pytest.mark.parametrize("option", ["triangles", "water_m", "near_m", "max_error_px"])
def test_what_is_no_number_is_refused(option):
    with pytest.raises(UsageError, match="nan"):
        FrameOptions(**{option: float("nan")})


def test_the_command_line_is_made_from_the_declaration(monkeypatch, capsys):
    """Each declared flag is there; a flag whose declaration was removed is refused."""
    words = ["shot", "alpine", "-o", "picture.png"]
    told = ["--water", "3", "--near", "2", "--method", "tessellated", "--edge", "4", "--metric", "rms"]
    frame = parse(*words, *told).frame
    assert (frame.water_m, frame.near_m, frame.parameters, frame.metric) == (3.0, 2.0, Edges(4.0), "rms")
    monkeypatch.setattr(cli_options, "OPTIONS", OPTIONS | {"water_m": Option("picture")})
    assert cli.main([*words, "--water", "3"]) == 2
    assert "--water" in capsys.readouterr().err


def test_a_removed_method_is_refused_in_one_line(capsys):
    with pytest.raises(UsageError, match="quadtree was removed before 1.0: use sat"):
        FrameOptions(method="quadtree")
    assert cli.main(["shot", "alpine", "-o", "picture.png", "--method", "quadtree"]) == 2
    told = capsys.readouterr().err
    assert told.count("\n") == 1 and "quadtree was removed before 1.0: use sat" in told


def test_every_method_is_a_line_of_the_registry(monkeypatch):
    """Another method takes one line; without that line it is unknown."""
    mine = Method(CERTIFIED, "renderer.methods:every_post", "mine")
    with tg.Renderer(tg.Heightmap(rough(33, 40), 10.0), (32, 24)) as renderer, renderer.ctx:
        with pytest.raises(KeyError):
            renderer.selectors["mine"]
        monkeypatch.setitem(REGISTRY, "mine", mine)
        assert renderer.selectors["mine"] is renderer.selectors["full"]
        assert renderer.selectors["truth"] is not renderer.selectors["full"]
