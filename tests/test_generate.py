"""Generated land: the same bits as the reference, on every driver, for any bands; and it looks like land."""

import json
import os
import resource
import shlex
import subprocess
import sys

import numpy as np
import pytest

from terrain_gl import cli, reference
from terrain_gl.basics.exceptions import TerrainError, UsageError
from terrain_gl.files import generate
from terrain_gl.files.generate import RECIPES, Land, bands_of, open_options, write_land
from terrain_gl.files.writers import FORMATS
from terrain_gl.gpu.context import create_context, probe_backends
from terrain_gl.heightmap import Heightmap
from terrain_gl.image import read_image

LANDS = [
    Land(97, 61, seed=7, cliffs=0.7, spacing_m=20),
    Land(64, 33, seed=1, cliffs=0, spacing_m=1),
    Land(33, 130, seed=2**24 - 1, cliffs=1, octaves=16, spacing_m=300),
    Land(65, 2, seed=0, cliffs=0.3, octaves=2),
    Land(70, 71, seed=3, cliffs=1, relief_m=3000, spacing_m=30, recipe="alpine"),
]


def parts(ctx, land, **settings):
    """Heights as fractions of the relief."""
    return np.concatenate(list(bands_of(ctx, land, **settings)))


def twin(land, dtype):
    """The reference's heights at the shader's places, which are float32."""
    posts = np.stack(np.meshgrid(np.arange(land.cols), np.arange(land.rows))).astype(np.float32)
    places = posts * np.float32(generate.step_of(land))
    cliffs = float(np.float32(land.cliffs))
    recipe = reference.LandRecipe(land.seed, cliffs, land.octaves_made, land.recipe == "alpine")
    heights = reference.land(places.astype(dtype), recipe)
    assert heights.dtype == dtype
    return heights


def slopes(heights, spacing_m):
    """Slopes as rise over run."""
    return np.hypot(*np.gradient(heights.astype(np.float64), spacing_m))


# --- The same numbers -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("land", LANDS, ids=str)
def test_every_bit_is_the_reference_in_float32(ctx, land):
    assert np.array_equal(parts(ctx, land), twin(land, np.float32))


@pytest.mark.parametrize("land", LANDS, ids=str)
def test_float32_is_close_to_float64(ctx, land):
    """Places, up to 5 units, are rounded by 2^-22 of a unit, and slopes over 1/256 unit by 2^-14: cliffs move a bit."""
    off = np.abs(parts(ctx, land) - twin(land, np.float64))
    assert np.median(off) < 1e-5 and off.max() < 5e-3


@pytest.mark.parametrize("land", LANDS[:3], ids=str)
@pytest.mark.parametrize("posts", [1, 1000])
def test_bands_change_nothing(ctx, land, posts):
    assert np.array_equal(parts(ctx, land, posts=posts), parts(ctx, land))


def test_a_larger_map_goes_on_where_a_smaller_ends(ctx):
    small, large = (parts(ctx, Land(n, n + 1, seed=4, cliffs=0.6)) for n in (100, 230))
    assert np.array_equal(small, large[:101, :100])


@pytest.mark.parametrize("suffix", FORMATS)
def test_the_same_bytes_again(ctx, tmp_path, suffix):
    land = Land(120, 77, seed=9, cliffs=0.8)
    one, other = tmp_path / f"one{suffix}", tmp_path / f"other{suffix}"
    for path in (one, other):
        write_land(ctx, land, path)
    assert one.read_bytes() == other.read_bytes()
    assert suffix == ".png" or b"1970:01:01" in one.read_bytes()  # no date in the file


@pytest.mark.skipif(not all(p.works for p in probe_backends() if p.name != "glfw"), reason="needs EGL and OSMesa")
def test_the_same_bytes_on_egl_and_osmesa(tmp_path):
    for backend in ("egl", "osmesa"):
        ctx = create_context(backend)
        with ctx:
            write_land(ctx, Land(257, 131, seed=7, cliffs=0.7), tmp_path / f"{backend}.png")
        ctx.release()
    assert (tmp_path / "egl.png").read_bytes() == (tmp_path / "osmesa.png").read_bytes()


def test_hash_is_pcg3d_of_plain_integers():
    def pcg3d(v):
        mask = 2**32 - 1
        x, y, z = ((c * 1664525 + 1013904223) & mask for c in v)
        for turn in range(2):
            x = x + y * z & mask
            y = y + z * x & mask
            z = z + x * y & mask
            if not turn:
                x, y, z = (c ^ c >> 16 for c in (x, y, z))
        return [x, y, z]

    for v in [(0, 0, 0), (1, 2, 3), (-1, -70000, 2**32 - 1)]:
        got = reference.pcg3d(np.array([v[0]]), np.array([v[1]]), v[2])
        assert [int(c[0]) for c in got] == pcg3d([c & 2**32 - 1 for c in v])


# --- It is land -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("recipe", RECIPES)
def test_seeds_are_different_lands(ctx, recipe):
    one, other = (parts(ctx, Land(200, 200, seed=seed, spacing_m=40, recipe=recipe)) for seed in (1, 2))
    assert np.mean(np.abs(one - other) > 0.01) > 0.8


@pytest.mark.parametrize("recipe", RECIPES)
@pytest.mark.parametrize("seed", [1, 7])
def test_more_cliffs_are_steeper(ctx, seed, recipe):
    lands = [Land(400, 400, seed=seed, cliffs=c, spacing_m=20, recipe=recipe) for c in (0, 0.25, 0.5, 0.75, 1)]
    steep = [np.percentile(slopes(parts(ctx, land) * 1000, 20), 99) for land in lands]
    assert np.all(np.diff(steep) > 0) and steep[-1] > 2 * steep[0]


def test_plains_plateaus_and_cliffs_all_occur(ctx):
    heights = parts(ctx, Land(600, 600, seed=7, cliffs=0.7, spacing_m=30))
    slope = slopes(heights * 1000, 30)
    flat = slope < 0.1
    assert np.mean(flat & (heights < 0.35)) > 0.1  # plains
    assert np.mean(flat & (heights > 0.5)) > 0.01  # plateaus
    assert np.mean(slope > 1.2) > 0.03  # cliffs, steeper than 50°


def test_no_direction_is_preferred(ctx):
    """Slopes face the lattice's directions, multiples of 45°, about as often as any other: all 16 within a third."""
    south, east = np.gradient(parts(ctx, Land(1000, 1000, seed=5, cliffs=0.3, spacing_m=100)).astype(np.float64))
    facing = np.round(np.arctan2(south, east) / (2 * np.pi) * 16).astype(int) % 16
    share = np.bincount(facing.ravel(), minlength=16) / facing.size * 16
    assert share.min() > 0.67 and share.max() < 1.5


def test_fewer_octaves_are_smoother(ctx):
    rough = [slopes(parts(ctx, Land(200, 200, octaves=k)) * 1000, 10).std() for k in (1, 4, 8)]
    assert rough[0] < rough[1] < rough[2]


def test_relief_scales_the_land_in_all_directions(ctx):
    low, high = (parts(ctx, Land(90, 90, relief_m=r, spacing_m=r / 50)) for r in (512.0, 4096.0))
    assert np.array_equal(low, high)


# --- Files ------------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("relief_m", [1000.0, 65.535, 8848.0])
def test_files_read_back_as_they_were_made(ctx, tmp_path, suffix, relief_m):
    land = Land(70, 50, seed=3, cliffs=0.9, relief_m=relief_m, spacing_m=relief_m / 40)
    path = tmp_path / f"land{suffix}"
    low, high = write_land(ctx, land, path)
    words = open_options(land, suffix).split()
    spacing, z_scale, z_offset = (float(value) for value in words[1::2])
    got = Heightmap.open(path, spacing, z_scale, z_offset)
    step = land.z_scale if suffix == ".png" else land.z_scale / generate.FINER
    rounding = step / 2 + relief_m * 2**-23  # of the step, and of float32
    assert np.abs(got.heights - parts(ctx, land).astype(np.float64) * relief_m).max() <= rounding
    assert got.range_m == pytest.approx((low, high)) and got.spacing_m == (spacing, spacing)
    if suffix != ".png":
        assert np.array_equal(got.heights, generate.generate(ctx, land).heights)


@pytest.mark.parametrize(("relief_m", "z_scale"), [(1000, 0.02), (65.535, 0.001), (8848, 0.2), (65536, 2), (0.5, 1e-5)])
def test_steps_are_round_numbers_that_reach_the_relief(relief_m, z_scale):
    land = Land(2, 2, relief_m=relief_m, spacing_m=relief_m / 100)
    assert land.z_scale == z_scale and relief_m <= 65535 * land.z_scale


def test_a_failure_leaves_nothing(ctx, tmp_path, monkeypatch):
    monkeypatch.setattr(generate, "stored", lambda *_: np.zeros((1, 3), np.uint16))  # too narrow
    with pytest.raises(TerrainError, match=r"land\.png"):
        write_land(ctx, Land(70, 50), tmp_path / "land.png")
    assert not list(tmp_path.iterdir())


# --- The command ------------------------------------------------------------------------------------------------------


def test_the_printed_command_draws_the_land(folder, capsys):
    assert cli.main(["generate", "my land.png", "--size", "65x70", "--seed", "3", "--spacing", "40"]) == 0
    out, err = capsys.readouterr()
    told, command = out.splitlines()
    assert told.startswith("my land.png: 65 x 70 posts") and not err
    words = shlex.split(command)
    assert cli.main([*words[1:], "--size", "96x64"]) == 0
    assert read_image(words[-1]).shape == (64, 96, 3) or read_image(words[-1]).shape == (64, 96, 4)


def test_json_says_how_it_was_made(folder, capsys):
    words = "land.tif --size 40 --seed 5 --cliffs 1 --octaves 4 --relief 200 --spacing 2 --recipe alpine --json -"
    assert cli.main(["generate", *words.split()]) == 0
    about = json.loads(capsys.readouterr().out)
    assert about["open_with"] == "--spacing 2 --z-scale 1 --z-offset 0"
    made = {key: about[key] for key in ("cols", "rows", "seed", "cliffs", "octaves", "relief_m", "spacing_m", "recipe")}
    assert Land(**made) == Land(40, 40, 5, 1.0, 4, 200.0, 2.0, "alpine")


@pytest.mark.parametrize(
    "words",
    [
        *(f"--size {size}" for size in ("1", "0", "-5", "16385", "2x16385", "1x5", "5x", "axb", "3x3x3")),
        *(f"--cliffs {cliffs}" for cliffs in ("-0.1", "1.01", "nan", "steep")),
        *(f"--octaves {octaves}" for octaves in ("0", "17", "-1", "2.5")),
        *(f"--relief {relief}" for relief in ("0", "-5", "inf", "1e9")),
        *(f"--spacing {spacing}" for spacing in ("0", "-1", "2000", "1e-9")),
        *(f"--seed {seed}" for seed in ("-1", "16777216", "x")),
        *("--recipe flat", "--backend metal", "--rivers 3"),
    ],
)
def test_wrong_use_is_one_line_and_status_2(folder, capsys, words):
    assert cli.main(["generate", "land.png", *words.split()]) == 2
    out, err = capsys.readouterr()
    assert not out and err.count("\n") == 1 and "Traceback" not in err
    assert not list(folder.iterdir())


@pytest.mark.parametrize(("name", "status"), [("land.jpg", 2), ("land", 2), ("none/land.png", 1), (".", 2)])
def test_wrong_names_are_one_line(folder, capsys, name, status):
    assert cli.main(["generate", name, "--size", "9"]) == status
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(folder.iterdir())


def test_no_room_is_one_line(folder):
    """A limit on the size of files imitates a full disk."""
    run = [sys.executable, "-m", "terrain_gl", "generate", "land.png", "--size", "300"]
    limit = lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (20000, 20000))  # noqa: E731
    done = subprocess.run(
        run, capture_output=True, text=True, preexec_fn=limit, env=os.environ | {"PYTHONWARNINGS": ""}
    )
    assert done.returncode == 1 and done.stderr.count("\n") == 1 and "land.png" in done.stderr
    assert not list(folder.iterdir())


@pytest.mark.parametrize("wrong", [{"cols": 1}, {"cliffs": float("nan")}, {"octaves": 0}, {"recipe": "flat"}])
def test_land_refuses_what_cannot_be(wrong):
    with pytest.raises(UsageError):
        Land(**({"cols": 5, "rows": 5} | wrong))
