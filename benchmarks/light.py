"""Light compared with the truth, and its cost, as tables for docs/light.md.

    visibility   visible fractions of sun and sky against ray marching, on pieces of two generated and two real maps
    pictures     pictures of all prefilters against light by brute force, by posts under a pixel
    steps        from our shading to the supplement's own, step by step
    lobes        from which footprint on the table of the ground's lobes should be used: RMSE by posts under a pixel
    horizons     time to build all horizons, and to follow the sun, by size of the map
    memory       bytes a post

Real maps are in the folder that the variable TERRAIN_GL_DEM names. A picture takes minutes on a
software renderer. Each number is written to a file at once, and a run that is started again continues.

Run: python benchmarks/light.py FOLDER [visibility|pictures|steps|lobes|horizons|memory ...]
"""

import itertools
import json
import math
import os
import sys
import time
from pathlib import Path

import numpy as np
import table
from light_truth import render_light_truth
from prefilters import LIGHT_LABELS, PRINTED, compare_light, shade_as_printed

from terrain_gl import Camera, Heightmap, Renderer, reference
from terrain_gl.basics.replacing import replacing
from terrain_gl.comparison.likeness import flip, rmse
from terrain_gl.files.generate import Land, write_land
from terrain_gl.files.maps import open_map
from terrain_gl.gpu.context import create_context
from terrain_gl.image import read_image, write_png
from terrain_gl.light import horizon
from terrain_gl.light.gaussians import SKY_AXES, SKY_SHARPNESS
from terrain_gl.light.ground import towards_sun
from terrain_gl.light.horizon import SUN_RADIUS, SkyVisibility, SunVisibility, Visibility, lattice_direction
from terrain_gl.light.lighting import Lighting
from terrain_gl.renderer.options import FrameOptions
from terrain_gl.terrain import Terrain

LANDS = {
    "canyon": {"cols": 2049, "rows": 2049, "seed": 5, "recipe": "canyon", "spacing_m": 10.0, "relief_m": 1000.0},
    "alpine": {"cols": 2049, "rows": 2049, "seed": 8, "recipe": "alpine", "spacing_m": 20.0, "relief_m": 2500.0},
}
REAL = {
    "narok": ("narok_srtm_z12_4608_f32.tif", {"spacing_m": 19.1}),
    "moon": ("moon_gld100_lon100-116_lat28-44_4096.png", {"spacing_m": (96, 118), "z_offset_m": -10000.0}),
}
SIZE = (64, 36)
SUN = (300.0, 30.0)
FOOTPRINTS = {1000: 28, 30: 20, 1: 12}  # posts under a pixel, and places that the truth lights for it along a side
LARGEST = 2049  # posts a side of the shaded part of a map
PIECE = 65  # posts a side of a piece for ray marching
EVERY = (1, 2, 3, 4)  # the sky is swept over every post, every second, every third, every fourth
SQUARE = 12  # cells a side of squares whose means are compared, too
STUDIED = ("alpine-30m", "canyon-15m")  # bundled maps of the parts `steps` and `lobes`
LOBES_FROM = (1.2, 1.5, 2.0, 3.0, 4.5, 6.0, 1e6)  # posts across a footprint
SIDES = (512, 1024, 2048, 4096)


def main(folder: str, *wanted: str) -> None:
    """Fill in the numbers that are missing, and print the tables."""
    kept = Kept(Path(folder))
    for name in wanted or TABLES:
        TABLES[name](kept)


class Kept:
    """Numbers that were measured before, in a file."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder, self.path = folder, folder / "light.json"
        self.numbers = json.loads(self.path.read_text("utf-8")) if self.path.exists() else {}

    def of(self, key, measure):
        """The number under a key; it is measured if it is missing."""
        if key not in self.numbers:
            self.numbers[key] = measure()
            with replacing(self.path) as beside:
                beside.write_text(json.dumps(self.numbers, indent=1), "utf-8")
        return self.numbers[key]

    def maps(self):
        """Maps by name, with the options for opening them."""
        for name, land in LANDS.items():
            path = self.folder / f"{name}.tif"
            if not path.exists():
                write_land(create_context(), Land(**land), str(path))
            yield name, str(path), {"spacing_m": land["spacing_m"]}
        if dem := os.environ.get("TERRAIN_GL_DEM"):
            for name, (file, scales) in REAL.items():
                yield name, os.path.join(dem, file), scales


def visibility(kept: Kept) -> None:
    """Mean absolute errors of visible fractions, weighted by the cosine; the truth marches in quarters of a post."""
    of_sky = (name for n in EVERY for name in (f"sky, every {n}", "in squares"))
    table.head("map", "slope, mean", "sun at 12°", "sun at 35°", *of_sky)
    for name, path, scales in kept.maps():
        heightmap = Heightmap.open(path, **scales)
        parts = {"the steepest piece": [steepest(heightmap)], "all over": pieces(heightmap)}
        for part, of in parts.items():
            found = [
                kept.of(f"visibility {name} {part} {i}", lambda each=each: visibility_of(each))
                for i, each in enumerate(of)
            ]
            table.row(f"{name}, {part}", *(f"{number:.4f}" for number in np.mean(found, 0)))


def visibility_of(heightmap):
    """A row of the table: the mean slope, the sun's error at two heights, two errors of the sky for each of `EVERY`."""
    h, spacing = heightmap.heights, heightmap.spacing_m
    terrain = Terrain(create_context(), heightmap)
    sun = SunVisibility(terrain)
    errors = []
    for elevation in (12.0, 35.0):
        towards = towards_sun(SUN[0], elevation)
        sun.follow(towards)
        truth = reference.sunlit(h, towards, SUN_RADIUS, lattice_direction(towards, spacing), spacing)
        faces = (reference.normals_of(h, spacing) @ np.array(towards)).clip(0)
        errors.append(float(np.abs(sun.read()[0] - blocks(truth, 2)).sum() / blocks(faces, 2).sum()))
    lit = [reference.skylit(h, a, s, spacing) for a, s in zip(SKY_AXES, SKY_SHARPNESS, strict=True)]
    got, of_all = (np.array(each) for each in zip(*lit, strict=True))
    used = horizon.TEXEL
    for horizon.TEXEL in EVERY:
        sky = SkyVisibility(terrain, SKY_AXES, SKY_SHARPNESS)
        sky.build()
        texels = sky.read().repeat(horizon.TEXEL, 1).repeat(horizon.TEXEL, 2)
        light = texels[:, : h.shape[0] - 1, : h.shape[1] - 1] * of_all
        for side in (1, SQUARE):
            seen, truth, most = (blocks(cells.sum(0), side) for cells in (light, got, of_all))
            errors.append(float(np.abs(seen / most - truth / most).mean()))
        sky.release()
    horizon.TEXEL = used
    for resource in (sun, terrain):
        resource.release()
    return [slope_of(h, spacing), *errors]


def blocks(cells, side):
    """Means over blocks of side × side; incomplete blocks are left out."""
    rows, cols = (n // side for n in cells.shape)
    return cells[: rows * side, : cols * side].reshape(rows, side, cols, side).mean((1, 3))


def slope_of(h, spacing):
    """Mean length of the gradient."""
    return float(np.hypot(*np.gradient(h.astype(float), spacing[1], spacing[0])).mean())


def steepest(heightmap):
    """The steepest piece without voids."""
    rows, cols = ([PIECE * i for i in range((n - 1) // PIECE)] for n in heightmap.heights.shape)
    whole = [at for at in itertools.product(rows, cols) if is_whole(heightmap, *at)]
    return piece(heightmap, *max(whole, key=lambda at: slope_of(piece(heightmap, *at).heights, heightmap.spacing_m)))


def pieces(heightmap):
    """Nine pieces, evenly spread over the map, less those with voids."""
    rows, cols = ([int((i + 0.5) / 3 * (n - PIECE)) for i in range(3)] for n in heightmap.heights.shape)
    return [piece(heightmap, *at) for at in itertools.product(rows, cols) if is_whole(heightmap, *at)]


def is_whole(heightmap, row, col):
    """Whether a piece has no voids."""
    return bool(np.isfinite(heightmap.heights[row : row + PIECE, col : col + PIECE]).all())


def piece(heightmap, row, col):
    """The piece of `PIECE` posts a side whose first post this is."""
    heights = heightmap.heights[row : row + PIECE, col : col + PIECE]
    return Heightmap(np.ascontiguousarray(heights), heightmap.spacing_m)


def pictures(kept: Kept) -> None:
    """RMSE and FLIP of every way to prefilter."""
    table.head("map", "posts a pixel", *LIGHT_LABELS.values())
    for posts, fine in FOOTPRINTS.items():
        for name, path, scales in kept.maps():
            key = f"picture {name} {posts}"
            numbers = kept.of(key, lambda *of, at=(kept, key, path, scales, posts, fine): picture_of(*at))
            table.row(name, posts, *(f"{numbers[way][0]:.4f} ({numbers[way][1]:.3f})" for way in LIGHT_LABELS))


def picture_of(kept, key, path, scales, posts, fine):
    """RMSE and FLIP by way to prefilter, of one view; the truth, which takes long, is kept beside the numbers."""
    heightmap = middle_of(Heightmap.open(path, **scales))
    known = kept.folder / f"{key.replace(' ', '-')}-truth.png"
    truth = read_image(known) if known.exists() else None
    with Renderer(heightmap, SIZE) as renderer, renderer.session:
        truth, images = compare_light(renderer, camera_over(heightmap, posts), fine, truth, sun=SUN)
    write_png(known, truth)
    row = [truth, *images.values()]
    write_png(kept.folder / f"{key.replace(' ', '-')}.png", np.concatenate(row, 1).repeat(4, 0).repeat(4, 1))
    return {way: [rmse(truth, image), flip(truth, image)] for way, image in images.items()}


def middle_of(heightmap):
    """The middle of a map, at most `LARGEST` posts a side."""
    rows, cols = (
        slice(max(0, (n - LARGEST) // 2), max(0, (n - LARGEST) // 2) + LARGEST) for n in heightmap.heights.shape
    )
    return Heightmap(np.ascontiguousarray(heightmap.heights[rows, cols]), heightmap.spacing_m)


def camera_over(heightmap, posts, pitch_deg=35.0, yaw_deg=15.0, fov_deg=45.0):
    """Look down at the map's middle from a distance at which a pixel covers `posts` posts."""
    pitch, yaw = math.radians(pitch_deg), math.radians(yaw_deg)
    forward = np.array([math.sin(yaw) * math.cos(pitch), math.cos(yaw) * math.cos(pitch), -math.sin(pitch)])
    focal_px = 0.5 * SIZE[1] / math.tan(math.radians(fov_deg) / 2)
    away = focal_px * math.sqrt(math.prod(heightmap.spacing_m) * posts * math.sin(pitch))
    row, col = heightmap.rows // 2, heightmap.cols // 2
    height = float(np.nan_to_num(heightmap.heights[row, col]))
    middle = np.array([*np.divide(heightmap.extent_m, 2), height])
    return Camera(tuple(middle - away * forward), tuple(middle), fov_deg)


class Entering(Lighting):
    """Our light, with the table of lobes for all footprints from a given size on."""

    posts = 3.0

    @property
    def defines(self):
        return super().defines | {"LOBES_FROM": self.posts}


def steps(kept: Kept) -> None:
    """RMSE of our shading, and after each step towards the shading as Li et al. printed it (docs/light.md)."""
    table.head("map", "posts a pixel", "ours", *(f"step {i}" for i in range(1, PRINTED + 1)))
    for name, posts in itertools.product(STUDIED, (30, 3, 1)):
        numbers = kept.of(f"steps {name} {posts}", lambda name=name, posts=posts: of_view(kept, name, posts, steps_of))
        table.row(name, posts, *(f"{number:.4f}" for number in numbers))


def lobes(kept: Kept) -> None:
    """RMSE for each size of footprint from which the table of lobes is used."""
    table.head("map", "posts a pixel", *(f"from {each:g}" for each in LOBES_FROM[:-1]), "never")
    for name, posts in itertools.product(STUDIED, (30, 12, 6, 3)):
        numbers = kept.of(f"lobes {name} {posts}", lambda name=name, posts=posts: of_view(kept, name, posts, lobes_of))
        table.row(name, posts, *(f"{number:.5f}" for number in numbers))


def of_view(kept, name, posts, measure):
    """Numbers of one view of a bundled map; the truth is kept beside them."""
    heightmap, look = open_map(name)[0], FrameOptions(method="full", sun=SUN, surroundings="none", grain="off")
    camera, known = camera_over(heightmap, posts), kept.folder / f"view-{name}-{posts}-truth.png"
    with Renderer(heightmap, SIZE) as renderer, renderer.session:
        if not known.exists():
            write_png(known, render_light_truth(renderer, camera, SIZE, 12, look)[..., :3])
            renderer.resize(SIZE)
        renderer.draw(camera, method="full", style="shaded", sun=SUN, surroundings="none", grain="off")
        return measure(renderer.picture, camera, look.shading, read_image(known)[..., :3])


def steps_of(picture, camera, look, truth):
    """RMSE of our shading, and after each step."""
    found = [rmse(truth, picture.read()[..., :3])]
    for step in range(1, PRINTED + 1):
        shade_as_printed(picture, camera, look, step)
        found.append(rmse(truth, picture.read()[..., :3]))
    return found


def lobes_of(picture, camera, look, truth):
    """RMSE for each of `LOBES_FROM`."""
    ours, found = picture.lighting, []
    picture.lighting = Entering(picture.terrain, picture.sums)
    for Entering.posts in LOBES_FROM:
        picture.shade(camera, look)
        found.append(rmse(truth, picture.read()[..., :3]))
    picture.lighting.release()
    picture.lighting = ours
    return found


def horizons(kept: Kept) -> None:
    """Processor seconds for the tables of the sky and of the sun."""
    table.head("posts", "sky, s", "sun, s", "sky, ns a post")
    path = next(path for name, path, _ in kept.maps() if name == "alpine")
    heights = np.tile(Heightmap.open(path, spacing_m=20.0).heights[:2048, :2048], (2, 2))
    for side in SIDES:
        part = np.ascontiguousarray(heights[:side, :side])
        sky_s, sun_s = kept.of(f"horizons {side}", lambda part=part: horizons_of(part))
        table.row(f"{side}²", f"{sky_s:.2f}", f"{sun_s:.3f}", f"{1e9 * sky_s / side**2:.0f}")


def horizons_of(heights):
    """Processor seconds to build the tables, without compiling shaders."""
    ctx = create_context()
    terrain = Terrain(ctx, Heightmap(heights, 20.0))
    tables = Visibility(terrain, SKY_AXES, SKY_SHARPNESS)
    spent = []
    for build in (tables.sky.build, lambda: tables.sun.follow(towards_sun(*SUN))):
        ctx.finish()
        started = time.process_time()
        build()
        ctx.finish()
        spent.append(time.process_time() - started)
    tables.release()
    terrain.release()
    return spent


def memory(kept: Kept) -> None:
    """Bytes a post of all tables for shading."""
    rng = np.random.default_rng(0)
    with Renderer(Heightmap(rng.normal(size=(513, 513)).cumsum(0), 10.0), (64, 36)) as renderer:
        renderer.render(Camera.default(renderer.heightmap))
        print(
            f"{renderer.resources.gpu_bytes['shade'] / 513**2:.1f} bytes a post for light, the sums of heights included"
        )


TABLES = {"visibility": visibility, "pictures": pictures, "steps": steps, "lobes": lobes}
TABLES |= {"horizons": horizons, "memory": memory}

if __name__ == "__main__":
    if len(sys.argv) < 2 or set(sys.argv[2:]) - set(TABLES):
        sys.exit(__doc__)
    main(*sys.argv[1:])
