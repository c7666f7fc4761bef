"""`terrain-gl mesh`: the triangles that the GPU draws, as a file."""

from __future__ import annotations

import argparse
from typing import Any

from ..exceptions import TerrainError, UsageError
from ..files.export import make_mesh, mesh_format, write_mesh
from ..shade import UNLIT
from . import options, report, values


def add(commands: Any) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "mesh",
        run,
        help="the triangles of a view as a .ply, .glb or .obj file",
        description="Write the triangles that the GPU draws for a view, in world metres: x east, y north, z up\n"
        "(.glb: y up, as glTF requires). Voids are filled from their rim. With --max-error-m there is no view:\n"
        "the mesh of the whole map is within M metres of every post.",
        example="mesh dem.tif --spacing 30 -o dem.ply --max-error 2 --weld",
    )
    options.add_map(command)
    options.add_output(command, "mesh, .ply, .glb or .obj")
    command.add_argument("--weld", action="store_true", help="triangles share the vertices that stand on one post")
    command.add_argument("--cull", action="store_true", help="leave out patches outside the picture, as drawing does")
    command.add_argument(
        "--max-error-m", type=values.positive, metavar="M", help="metres of height, everywhere, instead of pixels"
    )
    options.add_rendering(command)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    mesh_format(args.output)
    if args.max_error_m and (args.triangles or args.max_error_px):
        raise UsageError("--max-error-m has no view: leave out --triangles and --max-error")
    scene = options.open_scene(args)
    with options.make_renderer(args, scene) as renderer:
        if args.max_error_m:
            triangles, stats = renderer.inspector.triangulate(args.max_error_m)
            heights = renderer.terrain.filled
        else:
            stats = renderer.draw(**options.view_of(args, scene) | {"style": UNLIT})
            triangles, heights = renderer.triangles(), renderer.inspector.drawn_heights()
    if not len(triangles):
        raise TerrainError(f"{scene.heightmap.name}: no triangles in this view: turn the camera or drop --cull")
    mesh = make_mesh(triangles, heights, scene.heightmap.spacing_m, args.weld)
    about = {"map": scene.heightmap.name} | stats | {"vertices": len(mesh.posts)}
    with report.json_output(args.json, about), report.progress_bar("writing") as progress:
        write_mesh(args.output, mesh, progress)
    report.say(args.json, f"{report.shown(args.output)}: {len(mesh.faces):,} triangles, {len(mesh.posts):,} vertices")
    return 0
