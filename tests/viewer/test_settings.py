"""Settings, commands and texts."""

import math
import re
from importlib.resources import files

import numpy as np
import pytest
from viewers import hills

from terrain_gl.basics.exceptions import UsageError
from terrain_gl.basics.words import metres
from terrain_gl.camera import Camera
from terrain_gl.heightmap import Heightmap
from terrain_gl.renderer import Renderer
from terrain_gl.renderer.methods import METHODS
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.shade.picture import STYLES
from terrain_gl.verify.explain import Choice, Explanation
from terrain_gl.viewer import explain_text, legend
from terrain_gl.viewer.commands import GROUPS, shown_lines
from terrain_gl.viewer.controller import MOVE_KEYS
from terrain_gl.viewer.frame_stats import FrameStats, clock, without_bounds
from terrain_gl.viewer.settings import STEP, Settings


def test_settings_change_the_options():
    settings = Settings()
    assert [settings.cycle("style") for _ in STYLES] == [*STYLES[1:], STYLES[0]]
    assert settings.cycle("style", -1) == STYLES[-1]
    settings.loosen(1)
    assert settings.options.max_error_px == pytest.approx(STEP)
    settings.loosen(-1)
    assert settings.options.max_error_px == pytest.approx(1)
    settings.loosen(-1000)
    assert settings.options.max_error_px > 0
    assert settings.cycle("metric") == "rms" == settings.options.metric
    settings.sides.append(settings.options)
    settings.active = 1
    settings.change(metric="max")
    assert [side.metric for side in settings.sides] == ["rms", "max"]
    settings.change_all(sun=(1.0, 2.0))
    assert [side.sun for side in settings.sides] == [(1.0, 2.0)] * 2


def test_settings_with_a_budget_change_that():
    settings = Settings([FrameOptions(triangles=1000)])
    settings.loosen(2)
    assert (settings.options.triangles, settings.options.max_error_px) == (500, None)
    settings.loosen(-2)
    assert settings.options.triangles == 1000
    for _ in METHODS:
        assert settings.cycle("method") != "full"  # which draws every post
    settings.loosen(1000)
    assert settings.options.triangles >= 2


def test_every_command_has_a_key_of_its_own_and_a_line_of_help():
    keys = [key for commands in GROUPS.values() for command in commands for key in command.keys]
    assert len(keys) == len(set(keys)) and not set(keys) & set(MOVE_KEYS)
    acting = [command for commands in GROUPS.values() for command in commands if command.act]
    assert all(command.keys for command in acting)
    told = " ".join(shown for _, shown, _ in shown_lines()).lower()
    plain = {key for key in keys if "+" not in key[1:] and key not in "=23456789"}
    assert [key for key in plain if {"escape": "esc"}.get(key, key) not in told] == []
    assert all(1 < len(meaning) <= 60 for _, _, meaning in shown_lines())


def test_metres_read_well():
    texts = [metres(value) for value in (0.853, 12.44, 870.4, 5234, 52345)]
    assert texts == ["0.853 m", "12.4 m", "870 m", "5,234 m", "52.3 km"]


def test_the_clock_is_named_after_what_measures():
    software = {"ms_clock": "gpu", "gl_renderer": "llvmpipe (LLVM 15.0.6, 256 bits)"}
    each = software, software | {"gl_renderer": "NVIDIA H200/PCIe"}, software | {"ms_clock": "cpu"}
    words = "of llvmpipe", "GPU's", "no timer queries"
    assert all(word in clock(stats) for word, stats in zip(words, each, strict=True))


def test_the_measured_error_is_that_of_the_bound():
    frame = FrameStats("hills", (129, 129), stats={"certified_metric": "rms", "certified_max_error_px": 0.9})
    assert frame.achieved_px is None
    frame.measured_px = {"max": 0.5, "rms": 0.25}
    assert (frame.achieved_px, frame.certified_px) == (0.25, 0.9)
    frame.stats |= {"certified_metric": "max"}
    assert frame.achieved_px == 0.5
    assert without_bounds(frame.stats)["certified_max_error_px"] is None


def test_legends_show_the_colours_of_the_shaders():
    text = files("terrain_gl.glsl").joinpath("shade/drawn.glsl").read_text()
    for name, ramp in (("viridis", legend.VIRIDIS), ("inferno", legend.INFERNO)):
        body = text[text.index(f"vec3 {name}(") :]
        colours = re.findall(r"vec3\(([\d., ]+)\)", body[: body.index("}")])
        assert [tuple(map(float, colour.split(","))) for colour in colours] == list(ramp)
    assert set(legend.COLOURS) <= set(STYLES)
    for style in STYLES:
        shown = legend.legend(FrameOptions(2.0, style=style))
        assert (shown is not None) == (style in ("lod", "segments", "cracks", "promise", "error", "visibility"))


def test_an_error_scale_has_one_end_for_all_tolerances_and_a_root(ctx):
    """A quarter of the scale is half of the colours; the tolerance changes nothing."""
    for options in ({"max_error_px": 2.0}, {"triangles": 500}):
        shown = legend.legend(FrameOptions(style="error", error_scale_px=20.0, **options))
        assert (shown.most, shown.middle, shown.note[:17]) == ("20 px", "5 px", "Cyan: over 20 px.")
    with Renderer(hills(65), (96, 64), ctx=ctx) as renderer:
        camera = Camera((320.0, -200.0, 400.0), (320.0, 320.0, 100.0))

        def colours(**options):
            return renderer.render(camera, style="error", **options).image[..., :3].astype(int)

        mesh = {"max_error_px": 4.0}
        plain, wide, wider = (colours(**mesh, error_scale_px=px) for px in (None, 4.0, 16.0))
        assert (wide.sum(-1) >= plain.sum(-1) - 2).mean() > 0.9 and wide.sum() > 1.02 * plain.sum()  # the root
        assert wider.sum() < wide.sum()
    with pytest.raises(UsageError, match="error scale"):
        FrameOptions(error_scale_px=0.0)


@pytest.mark.slow
def test_open_land_has_the_colour_that_the_legend_of_visibility_gives_to_both(ctx):
    with Renderer(Heightmap(np.zeros((17, 17)), 10.0), (32, 24), ctx=ctx) as renderer:
        frame = renderer.render(Camera((80.0, 80.0, 200.0), (80.0, 81.0, 0.0)), style="visibility")
    both = legend.VISIBLE[2]
    assert np.abs(frame.image[12, 16, :3] / 255 - both).max() < 0.01


def test_every_patch_is_explained_in_words():
    drawn = ((1, 8, 9.0, 4.0, 3.0), (0, 4, 5.0, 2.0, 1.5), (2, 4, 4.0, 2.0, 0.9), (8, 1, 0.0, 0.0, 0.0))
    choices = [Choice(*each) for each in drawn]
    for chosen in choices:
        for metric, tolerance, seen in (("max", 1.0, True), ("rms", math.inf, True), ("max", 0.0, False)):
            told = Explanation(
                (8, 8), 8, 2, chosen, tuple(choices), (1.0, 2.0), 900.0, 0.3, seen, tolerance, metric, chosen.px
            )
            assert explain_text.title(told) and len(explain_text.rows(told)) == 4 and explain_text.reasons(told)
    told = Explanation((8, 8), 8, 2, choices[2], tuple(choices), (1.0, 2.0), 900.0, 0.3, True, 1.0, "max", 0.9)
    assert [row[-1] for row in explain_text.rows(told)] == ["too coarse", "too coarse", "drawn", "finer than needed"]
    assert "0.9 px" in explain_text.reasons(told)[1]
