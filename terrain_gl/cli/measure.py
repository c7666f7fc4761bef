"""`terrain-gl measure`: the achieved error of a view, beside the certified one."""

import argparse
from dataclasses import dataclass
from typing import Any

from ..basics.exceptions import TerrainError
from ..shade.picture import UNLIT
from . import options, report, stores, values
from .records import DrawOptions
from .scene import make_renderer, open_scene

# options that change the picture alone: they are accepted for scripts, and the help does not list them
_NO_NUMBER = (
    *("style", "look", "sun", "time", "latitude", "longitude", "sky", "haze", "material", "drape", "ramp"),
    *("ramp_range", "water_m", "surroundings", "grain", "contour_m", "units", "error_scale_px"),
)


@dataclass(frozen=True)
class MeasureOptions(DrawOptions):
    """What `measure` was told."""

    fail_above: float | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "measure",
        MeasureOptions,
        run,
        help="the achieved error of a view",
        description="Draw a view, and compare its mesh with the true surface: at every post in the picture, and at\n"
        "5 x 5 places in each cell.",
        example="measure dem.tif --spacing 30 --max-error 0.5 --json -",
    )
    command.add_argument("--fail-above", type=values.positive, metavar="PX", help="exit with 1 if the error is larger")
    options.add_map(command)
    options.add_rendering(command)
    stores.add_options(command)
    options.describe(command, **dict.fromkeys(_NO_NUMBER, argparse.SUPPRESS))


def run(asked: MeasureOptions) -> int:
    """Run the command."""
    scene = open_scene(asked)
    with make_renderer(scene, asked) as renderer:
        with stores.loading(renderer):
            renderer.draw(**scene.view(style=UNLIT))
        stats = {"map": scene.heightmap.name} | scene.pose(asked.camera.size) | renderer.measure()
    report.write_json(asked.output.json, stats)
    report.say(asked.output.json, text(stats))
    _check_error(stats, asked.fail_above)
    return stores.status_of(stats)


def _check_error(stats: dict[str, Any], most_px: float | None) -> None:
    """Refuse an achieved error, in the metric of the frame, above `most_px`."""
    metric = stats["certified_metric"]
    error_px = stats[f"{metric}_error_px"]
    if most_px is not None and not error_px <= most_px:
        raise TerrainError(
            f"{report.shown(stats['map'])}: the achieved {metric} error is {error_px:.4g} px, more than"
            f" --fail-above {most_px:g}: ask for a smaller --max-error"
        )


def text(stats: dict[str, Any]) -> str:
    """A measurement as text."""
    certified, rounding = stats["certified_max_error_px"], stats["rounding_px"]
    lines = {
        "map": stats["map"],
        "picture": f"{stats['width']} x {stats['height']}, {stats['gl_renderer']} ({stats['backend']})",
        "mesh": f"{stats['triangles']:,} triangles in {stats['patches']:,} patches, {stats['splits']:,} splits",
        "asked": f"{report.asked(stats)}, method {stats['method']}",
        "certified": "nothing" if certified is None else f"{certified:.4g} px",
        **({} if rounding is None else {"float32": f"adds at most {rounding:.2g} px on the screen"}),
        "achieved": f"max {stats['max_error_px']:.4g} px, rms {stats['rms_error_px']:.4g} px",
        "over": f"{stats['posts_measured']:,} posts in the picture, and 5 x 5 places in each cell",
        "land": f"{stats['land_measured']:.1%} of the land in the picture; the rest is hidden",
        "posts alone": f"max {stats['max_error_posts_px']:.4g} px",
        "holes": f"{stats['holes']}",
    }
    return report.facts(lines)
