"""Lobes of light and ground: spherical Gaussians, merged lobes, and light from footprints, against integration."""

import math

import asking
import numpy as np
import pytest

from terrain_gl import reference

PRINTED = "../benchmarks/glsl/prefilter/printed.glsl"


@pytest.fixture
def ask(ctx):
    """Results (n, 4) of a GLSL expression of two vec4 a, b, with the functions of a GLSL file."""

    def answers(path, call, a, b=0.0):
        return asking.ask(ctx, path, f"return {call};", a, b)

    return answers


def sphere(n=60_000):
    """(n, 3) directions, evenly distributed; each stands for a solid angle of 4π/n."""
    i = np.arange(n) + 0.5
    z, turn = 1 - 2 * i / n, np.pi * (1 + 5**0.5) * i
    flat = np.sqrt(1 - z * z)
    return np.stack([flat * np.cos(turn), flat * np.sin(turn), z], -1)


SPHERE = sphere()


def integrate(values):
    return values.sum(0) * 4 * np.pi / len(SPHERE)


def random_axes(n, seed=0):
    v = np.random.default_rng(seed).normal(size=(n, 3))
    return v / np.linalg.norm(v, axis=1, keepdims=True)


def sg(axis, sharpness):
    return np.exp(np.maximum(sharpness * (SPHERE @ axis - 1), -600))


SHARPNESS = [0.0, 0.01, 0.3, 1.0, 2.133, 8.0, 60.0, 900.0]


@pytest.mark.parametrize("sharpness", SHARPNESS)
def test_integral_of_a_gaussian(ask, sharpness):
    truth = integrate(sg(np.array([0, 0, 1.0]), sharpness))
    assert reference.sg_integral(sharpness) == pytest.approx(truth, rel=1e-3)
    told = ask("light/sg.glsl", "vec4(sg_integral(a.x))", [sharpness, 0, 0, 0])[0, 0]
    assert told == pytest.approx(reference.sg_integral(sharpness), rel=2e-4)  # two terms of a series below 1e-3


def test_product_and_inner_product(ask):
    axes, others = random_axes(40, 1), random_axes(40, 2)
    sharp = np.random.default_rng(3).choice(SHARPNESS[1:-1], (40, 2))
    a, b = np.column_stack([axes, sharp[:, 0]]), np.column_stack([others, sharp[:, 1]])
    lobe = "Lobe(a.xyz, a.w, vec3(1.0)), Lobe(b.xyz, b.w, vec3(1.0))"
    told = ask("light/sg.glsl", f"vec4(sg_inner_product({lobe}).x, sg_product({lobe}).axis)", a, b)
    for i in range(40):
        product = sg(axes[i], sharp[i, 0]) * sg(others[i], sharp[i, 1])
        axis, sharpness, amplitude = reference.sg_product(axes[i], sharp[i, 0], others[i], sharp[i, 1])
        assert np.allclose(amplitude * sg(axis, sharpness), product, rtol=1e-9, atol=1e-12)
        assert amplitude * reference.sg_integral(sharpness) == pytest.approx(integrate(product), rel=1e-3, abs=1e-6)
        assert told[i, 0] == pytest.approx(amplitude * reference.sg_integral(sharpness), rel=1e-4, abs=1e-7)
        assert told[i, 1:] == pytest.approx(axis, abs=1e-4)


def test_a_physical_sun_keeps_its_digits(ask):
    """The product of a lobe of sharpness 92,000 and a wide lobe: plain float32 sums would lose several per cent."""
    axes, sun = random_axes(50, 4), np.array([0, 0.6, 0.8])
    sharpness, wide = 92_438.0, 2.133
    call = "vec4(sg_inner_product(Lobe(a.xyz, a.w, vec3(1.0)), Lobe(b.xyz, b.w, vec3(1.0))).x)"
    told = ask("light/sg.glsl", call, np.column_stack([axes, np.full(50, wide)]), [*sun, sharpness])[:, 0]
    truth = np.exp(wide * (axes @ sun - 1)) * reference.sg_integral(sharpness)  # as if the sun were one direction
    assert told == pytest.approx(truth, rel=1e-3)


LENGTHS = pytest.mark.parametrize("sharpness", [1e-3, 0.05, 0.2, 1, 2.133, 5, 19, 21, 90, 400, 5000])


@LENGTHS
def test_lengths_of_the_reference_are_means(sharpness):
    density = sg(np.array([0, 0, 1.0]), min(sharpness, 900.0))
    if sharpness < 900:
        truth = float(integrate(density * SPHERE[:, 2]) / integrate(density))
        assert reference.mean_length(sharpness) == pytest.approx(truth, abs=1e-4)
    length = reference.mean_length(sharpness)
    assert reference.sharpness_of_length(length) == pytest.approx(sharpness, rel=1e-4)


@LENGTHS
def test_length_and_sharpness_both_ways(ask, sharpness):
    length = 1 / math.tanh(sharpness) - 1 / sharpness  # float64 has digits enough, down to 1e-3
    told = ask("light/vmf.glsl", "vec4(mean_length(a.x), sharpness_of(a.y), 0.0, 0.0)", [sharpness, length, 0, 0])[0]
    assert told[0] == pytest.approx(length, rel=1e-3, abs=2e-7)
    # 1/(1 - |r|) loses as many of a float's 24 bits as the sharpness has
    assert told[1] == pytest.approx(sharpness, rel=2e-3 + 2e-7 * sharpness)


def test_the_papers_cubic_is_within_five_percent():
    for sharpness in np.geomspace(0.01, 1000, 60):
        r = reference.mean_length(sharpness)
        assert (3 * r - r**3) / (1 - r * r) == pytest.approx(sharpness, rel=0.05)
        c = reference.cubic_length(sharpness)
        assert (3 * c - c**3) / (1 - c * c) == pytest.approx(sharpness, rel=1e-6)
        assert c == pytest.approx(r, abs=0.012)


@pytest.mark.parametrize("sharpness", [0.5, 2.133, 30.0, 1000.0])
def test_equal_lobes_merge_into_themselves(ask, sharpness):
    axis = random_axes(1, 5)[0]
    r = np.tile(reference.mean_length(sharpness) * axis, (1000, 1))
    merged_axis, merged_sharpness = reference.merged(r)
    assert merged_axis == pytest.approx(axis, abs=1e-9)
    assert merged_sharpness == pytest.approx(sharpness, rel=1e-6)
    told = ask("light/vmf.glsl", "vec4(vmf_lobe(a.xyz, vec3(1.0)).axis, vmf_lobe(a.xyz, vec3(1.0)).sharpness)",
               [*r.mean(0), 0])[0]  # fmt: skip
    assert told[:3] == pytest.approx(axis, abs=1e-5)
    assert told[3] == pytest.approx(sharpness, rel=3e-3)


def test_a_merged_lobe_has_the_mean_of_its_parts():
    axes, sharp = random_axes(7, 6), np.array([0.5, 1, 3, 8, 20, 60, 2])
    mixture = np.mean([sg(a, k) / reference.sg_integral(k) for a, k in zip(axes, sharp, strict=True)], 0)
    mean = integrate(mixture[:, None] * SPHERE)
    axis, sharpness = reference.merged([reference.mean_length(k) * a for a, k in zip(axes, sharp, strict=True)])
    assert reference.mean_length(sharpness) * axis == pytest.approx(mean, abs=1e-4)


@pytest.mark.parametrize("r", [0.0, 0.2, 0.5, 0.74, 0.76, 0.9, 0.99, 0.9999])
def test_mean_cosine_of_a_footprint(ask, r):
    """Within 0.01 of the integral over the normals' lobe. No light is lost: all directions sum to π."""
    cosines = np.linspace(-1, 1, 401)
    told = ask("light/brdf.glsl", "vec4(cosine_mean(a.x, a.y))", [[r * c, r, 0, 0] for c in cosines])[:, 0]
    assert told == pytest.approx([reference.cosine_mean(r * c, r) for c in cosines], abs=1e-5)
    assert 2 * np.pi * np.trapezoid(told, cosines) == pytest.approx(np.pi, rel=1e-3)
    sharpness = reference.sharpness_of_length(r) if r else 0.0
    for c in np.linspace(-1, 1, 11):
        light = np.array([np.sqrt(1 - c * c), 0, c])
        density = sg(np.array([0, 0, 1.0]), sharpness)
        truth = (density * np.maximum(SPHERE @ light, 0)).sum() / density.sum()
        assert reference.cosine_mean(r * c, r) == pytest.approx(truth, abs=0.01)


def test_the_papers_diffuse_lobe_is_too_bright():
    """Equation B.3 integrates to 3.398, not π, and gives surfaces that face away an eighth; ours does neither."""
    lobe = 1.170 * sg(np.array([0, 0, 1.0]), 2.133)
    assert integrate(lobe) == pytest.approx(3.398, abs=1e-3)
    assert lobe[np.abs(SPHERE[:, 2]) < 0.01].mean() > 0.12
    assert reference.cosine_mean(0.0, 1.0) == 0


@pytest.mark.parametrize("sharpness", [0.3, 2.133, 9.0, 60.0, 900.0])
def test_the_papers_cubic_both_ways(ask, sharpness):
    length = reference.cubic_length(sharpness)
    assert reference.cubic_sharpness(length) == pytest.approx(sharpness, rel=1e-6)
    call = "vec4(cubic_length(a.x), cubic_sharpness(a.y), 0.0, 0.0)"
    told = ask(PRINTED, call, [sharpness, length, 0, 0])[0]
    assert told[0] == pytest.approx(length, abs=2e-6)
    assert told[1] == pytest.approx(sharpness, rel=1e-3)  # 1 − |r|² loses as many of 24 bits as κ has


def test_the_papers_diffuse_light(ask):
    """B.3, merged: the shader as its twin. For one normal that is B.3 itself over π, in total 8 % too bright."""
    axes, normals = random_axes(40, 8), random_axes(40, 9) * np.linspace(0.02, 1.0, 40)[:, None]
    sharpness = np.geomspace(1.0, 90_000.0, 40)
    call = "vec4(printed_diffuse(Lobe(a.xyz, a.w, vec3(1.0)), b.xyz).x)"
    lobes, places = np.column_stack([axes, sharpness]), np.column_stack([normals, np.zeros(40)])
    told = ask(PRINTED, call, lobes, places)[:, 0]
    expected = [reference.printed_diffuse(*each) for each in zip(axes, sharpness, normals, strict=True)]
    assert told == pytest.approx(expected, rel=2e-3, abs=1e-8)
    up, sun = np.array([0, 0, 1.0]), 90_000.0
    cosines = np.linspace(-1, 1, 201)
    towards = np.stack([np.sqrt(1 - cosines**2), 0 * cosines, cosines], -1)
    light = [reference.printed_diffuse(each, sun, up) / reference.sg_integral(sun) for each in towards]
    assert light == pytest.approx(1.170 * np.exp(2.133 * (cosines - 1)) / np.pi, rel=1e-3)
    assert 2 * np.pi * np.trapezoid(light, cosines) == pytest.approx(3.398 / np.pi, rel=1e-3)


def test_reflection_of_half_vectors(ask):
    """The warped lobe has the direction and the width of the mirrored half-vectors."""
    eye = np.array([0.5, 0.0, np.sqrt(0.75)])
    axis, sharpness = np.array([0, 0, 1.0]), 200.0
    rng = np.random.default_rng(7)
    t = 1 + np.log(rng.random(20_000)) / sharpness  # vMF samples
    turn, flat = rng.random(20_000) * 2 * np.pi, np.sqrt(1 - t * t)
    halves = np.stack([flat * np.cos(turn), flat * np.sin(turn), t], -1)
    mirrored = 2 * (halves @ eye)[:, None] * halves - eye
    mean = mirrored.mean(0)
    centre, width = reference.reflection_lobe(axis, sharpness, eye)
    assert mean / np.linalg.norm(mean) == pytest.approx(centre, abs=0.03)
    # the lobe is isotropic, the true one is stretched: the mean of both widths
    assert reference.mean_length(width) == pytest.approx(float(np.linalg.norm(mean)), abs=0.006)
    r = reference.mean_length(sharpness) * axis
    call = "vec4(reflection_lobe(a.xyz, b.xyz).axis, reflection_lobe(a.xyz, b.xyz).sharpness)"
    told = ask("light/brdf.glsl", call, [*r, 0], [*eye, 0])[0]
    assert told[:3] == pytest.approx(centre, abs=1e-4) and told[3] == pytest.approx(width, rel=2e-3)


@pytest.mark.parametrize("roughness", [0.0, 0.01, 0.5, 1.0])
def test_any_roughness_is_a_lobe(ask, roughness):
    told = ask("light/brdf.glsl", "vec4(sharpness_of_roughness(a.x), schlick(0.0, a.x), schlick(1.0, a.x), 0.0)",
               [roughness, 0, 0, 0])[0]  # fmt: skip
    assert np.all(np.isfinite(told)) and 2 <= told[0] <= 8192 and 0.0299 <= told[2] <= told[1] <= 1
