"""Land in the scene of another program: objects drawn before and after meet it at the right pixel."""

import moderngl
import numpy as np
import pytest

import terrain_gl as tg
from terrain_gl.basics.exceptions import UsageError
from terrain_gl.gpu.calls import calls

SIZE = (96, 54)
OBJECT = """
#version 430 core
uniform mat4 u_clip;
in vec3 in_place;
void main() { gl_Position = u_clip * vec4(in_place, 1.0); }
"""
RED = "#version 430 core\nout vec4 colour;\nvoid main() { colour = vec4(1.0, 0.0, 0.0, 1.0); }"


def hills():
    t = np.linspace(0, 7, 97)
    return tg.Heightmap(40 * np.sin(t)[:, None] * np.cos(1.3 * t)[None] + 60, 10.0)


def look_at(eye, target):
    eye, target = np.asarray(eye, float), np.asarray(target, float)
    forward = (target - eye) / np.linalg.norm(target - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    turn = np.stack([right, np.cross(right, forward), -forward])
    view = np.eye(4)
    view[:3, :3], view[:3, 3] = turn, -turn @ eye
    return view


def perspective(fov_deg, size, near, far, reverse=False, zero_to_one=False):
    f = 1 / np.tan(np.radians(fov_deg) / 2)
    n, f_ = (far, near) if reverse else (near, far)
    p = np.zeros((4, 4))
    p[0, 0], p[1, 1], p[3, 2] = f * size[1] / size[0], f, -1
    if zero_to_one:
        p[2, 2], p[2, 3] = f_ / (n - f_), n * f_ / (n - f_)
    else:
        p[2, 2], p[2, 3] = (f_ + n) / (n - f_), 2 * f_ * n / (n - f_)
    return p


class Program:
    """The other program: a framebuffer, and red triangles with depth."""

    def __init__(self, ctx, depth="<", samples=0, colours=1, zero_to_one=False):
        self.ctx, self.depth, self.zero_to_one = ctx, depth, zero_to_one
        kept = [ctx.texture(SIZE, 4, samples=samples) for _ in range(colours)]
        self.framebuffer = ctx.framebuffer(kept, ctx.depth_texture(SIZE, samples=samples))
        self.program = ctx.program(vertex_shader=OBJECT, fragment_shader=RED)

    def clear(self):
        self.framebuffer.use()
        self.ctx.clear(0.0, 0.0, 1.0, 1.0, depth=0.0 if ">" in self.depth else 1.0)

    def draw(self, triangles, clip):
        self.program["u_clip"].write(np.ascontiguousarray(clip.T, "f4").tobytes())
        buffer = self.ctx.buffer(np.ascontiguousarray(triangles, "f4").tobytes())
        vao = self.ctx.vertex_array(self.program, [(buffer, "3f", "in_place")])
        self.framebuffer.use()
        self.ctx.enable_only(moderngl.DEPTH_TEST)
        self.ctx.depth_func = self.depth
        # tests without a session leave another one
        calls(self.ctx).ClipControl(0x8CA1, 0x935F if self.zero_to_one else 0x935E)
        vao.render(moderngl.TRIANGLES)
        calls(self.ctx).ClipControl(0x8CA1, 0x935E)  # the default
        vao.release()
        buffer.release()

    def red(self):
        """Pixels, first row on top, that the triangles own."""
        plain = self.ctx.framebuffer([self.ctx.texture(SIZE, 4)])
        self.ctx.copy_framebuffer(plain, self.framebuffer)
        pixels = np.frombuffer(plain.read(components=4), "u1").reshape(SIZE[1], SIZE[0], 4)[::-1]
        return (pixels[..., 0] > 200) & (pixels[..., 1] < 40) & (pixels[..., 2] < 40), pixels


def rays(view, projection):
    """Eye and directions of all pixel centres, first row on top: an independent ray caster's."""
    x = (np.arange(SIZE[0]) + 0.5) / SIZE[0] * 2 - 1
    y = 1 - (np.arange(SIZE[1]) + 0.5) / SIZE[1] * 2
    xx, yy = np.meshgrid(x / projection[0, 0], y / projection[1, 1])
    along = np.stack([xx, yy, -np.ones_like(xx)], -1) @ view[:3, :3]
    return -view[:3, :3].T @ view[:3, 3], along


def triangle_depths(triangles, eye, along):
    """View depth of the nearest triangle along each ray; infinite without one (Möller and Trumbore 1997)."""
    found = np.full(along.shape[:2], np.inf)
    for a, b, c in triangles:
        edge1, edge2 = b - a, c - a
        p = np.cross(along, edge2)
        det = p @ edge1
        with np.errstate(divide="ignore", invalid="ignore"):
            u = (p @ (eye - a)) / det
            q = np.cross(eye - a, edge1)
            v = along @ q / det
            t = edge2 @ q / det
        hit = (u >= 0) & (v >= 0) & (u + v <= 1) & (t > 0)
        found = np.where(hit & (t < found), t, found)
    return found


def bilinear(heightmap, x, y):
    """The land's height, in plain numpy; minus infinity off the map."""
    h, spacing = heightmap.heights.astype(float), heightmap.spacing_m[0]
    u, v = x / spacing, heightmap.rows - 1 - y / spacing
    on_map = (u >= 0) & (v >= 0) & (u <= heightmap.cols - 1) & (v <= heightmap.rows - 1)
    i, j = (np.clip(np.floor(each).astype(int), 0, n - 2) for each, n in ((u, heightmap.cols), (v, heightmap.rows)))
    f, g = u - i, v - j
    upper, lower = h[j, i] * (1 - f) + h[j, i + 1] * f, h[j + 1, i] * (1 - f) + h[j + 1, i + 1] * f
    return np.where(on_map, upper * (1 - g) + lower * g, -1e9)


def land_depths(heightmap, eye, along):
    """View depth at which each ray meets the bilinear land, by a fine march and bisection; infinite without one."""

    def is_under(z):
        at = eye + along * z[..., None]
        return at[..., 2] < bilinear(heightmap, at[..., 0], at[..., 1])

    found = np.full(along.shape[:2], np.inf)
    for z in np.arange(2.0, 2000.0, 2.0):
        fresh = is_under(np.full(found.shape, z)) & ~np.isfinite(found)
        if fresh.any():
            low, high = np.full(found.shape, z - 2.0), np.full(found.shape, z)
            for _ in range(12):
                middle = 0.5 * (low + high)
                below = is_under(middle)
                low, high = np.where(below, low, middle), np.where(below, middle, high)
            found = np.where(fresh, high, found)
    return found


def scene(rng):
    """A view from above the map: no ray comes from below the land."""
    eye = np.array([rng.uniform(150, 800), rng.uniform(5, 60), rng.uniform(170, 350)])
    return look_at(eye, [rng.uniform(300, 660), rng.uniform(300, 660), 60])


CONVENTIONS = {
    "usual": ("<", False, False),
    "reversed, 0 to 1": (">", True, True),
    "usual, 0 to 1": ("<=", False, True),
    "reversed, -1 to 1": (">=", True, False),
}


def at_edges(*depths):
    """Pixels whose neighbours are of another surface, or much nearer: an edge may pass through them."""
    edge = np.zeros(depths[0].shape, bool)
    for depth in depths:
        z = np.where(np.isfinite(depth), depth, 1e6)
        padded = np.pad(z, 1, mode="edge")
        around = np.stack(
            [padded[1 + i : 1 + i + z.shape[0], 1 + j : 1 + j + z.shape[1]] for i in (-1, 0, 1) for j in (-1, 0, 1)]
        )
        edge |= around.max(0) - around.min(0) > 0.2 * z
    return edge


@pytest.mark.slow
@pytest.mark.parametrize("convention", CONVENTIONS)
def test_objects_before_and_after_meet_the_land(ctx, convention):
    depth, reverse, zero_to_one = CONVENTIONS[convention]
    heightmap, rng = hills(), np.random.default_rng(len(convention))
    program = Program(ctx, depth, zero_to_one=zero_to_one)
    own = {"depth": depth, "zero_to_one": zero_to_one, "style": "lambert"}
    shown = 0
    with tg.Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        for _ in range(3):
            view = scene(rng)
            projection = perspective(50, SIZE, 5, 20000, reverse, zero_to_one)
            triangles = rng.uniform([200, 300, 60], [760, 800, 200], (8, 1, 3)) + rng.normal(0, 90, (8, 3, 3))
            eye, along = rays(view, projection)
            objects = triangle_depths(triangles, eye, along)
            land = land_depths(heightmap, eye, along)
            expected = objects < land
            for before in (True, False):
                program.clear()
                clip = projection @ view
                if before:
                    program.draw(triangles, clip)
                stats = renderer.draw_into(program.framebuffer, view, projection, 0.5, **own)
                if not before:
                    program.draw(triangles, clip)
                assert stats["certified_max_error_px"] <= 0.5
                red, pixels = program.red()
                with np.errstate(invalid="ignore"):  # where both are equally far, the error in pixels decides
                    near = np.abs(objects - land) < 0.01 * land
                sure = ~(at_edges(objects, land, np.where(expected, 1.0, 2.0)) | near)
                assert sure.mean() > 0.6
                shown += expected[sure].sum()
                assert (red == expected)[sure].all(), f"{(red != expected)[sure].sum()} pixels"
                sky = ~np.isfinite(land) & ~np.isfinite(objects) & ~at_edges(objects, land)
                assert (pixels[sky] == [0, 0, 255, 255]).all()
    assert shown > 100


def test_samples_a_part_and_several_colours(ctx):
    """A framebuffer of four samples; a viewport; a second colour stays, and the choice of colours, too."""
    heightmap = hills()
    view, projection = look_at([480, -200, 300], [480, 480, 60]), perspective(50, (80, 45), 5, 20000)
    many, two = Program(ctx, samples=4), Program(ctx, colours=2)
    with tg.Renderer(heightmap, (80, 45), ctx=ctx) as renderer:
        many.clear()
        renderer.draw_into(many.framebuffer, view, projection, viewport=(10, 5, 80, 45), style="lambert")
        _, pixels = many.red()
        inside = np.zeros(SIZE[::-1], bool)
        inside[54 - 50 : 54 - 5, 10:90] = True
        assert (pixels[~inside] == [0, 0, 255, 255]).all() and (pixels[inside][:, 1] > 0).mean() > 0.3
        two.clear()
        before = two.framebuffer.read(attachment=1, components=4)
        renderer.draw_into(two.framebuffer, view, projection, viewport=(10, 5, 80, 45), style="lambert")
        assert two.framebuffer.read(attachment=1, components=4) == before
        two.framebuffer.use()
        ctx.clear(0.0, 1.0, 0.0, 1.0)
        assert set(two.framebuffer.read(attachment=1, components=4)) == {0, 255}


def test_water_and_sky_have_depth(ctx):
    heightmap = hills()
    view, projection = look_at([480, -200, 200], [480, 480, 80]), perspective(50, SIZE, 5, 20000)
    program = Program(ctx)
    under = np.array([[[0, 0, 65], [960, 0, 65], [480, 960, 65]]], float)  # under the water, over most of the bed
    with tg.Renderer(heightmap, SIZE, ctx=ctx) as renderer:
        reds = []
        for water_m in (None, 80.0):
            program.clear()
            renderer.draw_into(program.framebuffer, view, projection, water_m=water_m)
            program.draw(under, projection @ view)
            reds.append(program.red()[0].sum())
        assert reds[0] > 500 > 20 > reds[1]


def test_wrong_use_is_one_line(ctx):
    with tg.Renderer(hills(), SIZE) as other, tg.Renderer(hills(), SIZE, ctx=ctx) as renderer:
        view, projection = look_at([480, -200, 300], [480, 480, 60]), perspective(50, SIZE, 5, 20000)
        flat = ctx.framebuffer([ctx.texture(SIZE, 4)])
        with pytest.raises(UsageError, match="another context"):
            other.draw_into(flat, view, projection)
        with pytest.raises(UsageError, match="no depth"):
            renderer.draw_into(flat, view, projection)
        with pytest.raises(UsageError, match="depth test of <, <=, >, >="):
            renderer.draw_into(Program(ctx).framebuffer, view, projection, depth="==")
