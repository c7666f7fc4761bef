"""Example 12: land in your scene
==============================

A program with a scene of its own draws a mast with moderngl, and asks the renderer for the land around it. Depth
decides which hides which, pixel by pixel. The certificate of the land comes back.

The program owns the context. After each call of the renderer, the context has the state that it had before.

Run: ``python 12_in_your_scene.py [PICTURE.png [MAP]]``
"""

import sys

import moderngl
import numpy as np

from terrain_gl import Heightmap, Renderer
from terrain_gl.files.maps import bundled
from terrain_gl.gpu.context import create_context
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "12_in_your_scene.png"
known = bundled()[sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"]
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
size = 1280, 720

# The camera as two OpenGL matrices, for column vectors: the view of the map's own camera, and a perspective.
camera = known.camera
turn = camera.axes * [[1.0], [1.0], [-1.0]]  # right, up, backward
view = np.eye(4)
view[:3, :3], view[:3, 3] = turn, -turn @ np.asarray(camera.eye)
near, far, up = 10.0, 1e6, 1 / np.tan(np.radians(camera.fov_deg) / 2)
projection = np.array(
    [
        [up * size[1] / size[0], 0, 0, 0],
        [0, up, 0, 0],
        [0, 0, (far + near) / (near - far), 2 * far * near / (near - far)],
        [0, 0, -1, 0],
    ]
)

# A mast of 12 lines in the middle of the view, from 100 m below the land to 500 m above it.
foot = np.asarray(camera.eye) + 0.5 * (np.asarray(camera.target) - camera.eye)
foot[2] = float(terrain.height_at(foot[:1], foot[1:2])[0]) - 100
turns = np.linspace(0, 2 * np.pi, 12, endpoint=False)
rods = [foot + [15 * np.cos(t), 15 * np.sin(t), z] for t in turns for z in (0, 600)]

context = create_context()
framebuffer = context.framebuffer([context.texture(size, 4)], context.depth_texture(size))
program = context.program(
    vertex_shader="""#version 430
        uniform mat4 u_clip;
        in vec3 in_place;
        void main() { gl_Position = u_clip * vec4(in_place, 1.0); }""",
    fragment_shader="""#version 430
        out vec4 colour;
        void main() { colour = vec4(0.9, 0.1, 0.1, 1.0); }""",
)
program["u_clip"].write((projection @ view).T.astype("f4").tobytes())
mast = context.vertex_array(program, [(context.buffer(np.array(rods, "f4").tobytes()), "3f", "in_place")])

with Renderer(terrain, size, ctx=context) as renderer:
    framebuffer.use()
    context.clear(0.55, 0.7, 0.9, 1.0, depth=1.0)
    context.enable(moderngl.DEPTH_TEST)
    context.line_width = 3.0
    mast.render(moderngl.LINES)
    stats = renderer.draw_into(framebuffer, view, projection, max_error_px=1.0, sun=known.sun)
    print("{triangles:,} triangles, every point within {certified_max_error_px:.3f} px".format(**stats))
    pixels = np.frombuffer(framebuffer.read(components=4), np.uint8).reshape(size[1], size[0], 4)[::-1]

write_png(picture, pixels)
print(f"wrote {picture}")
