# Lesson 8: the driver cuts the squares. Neighbours agree on their edges, so there is nothing to repair. The
# picture shows the triangles of the driver.

PATCH = """
#version 410
in ivec4 in_square; in ivec4 in_edges; in int in_inner;
out ivec4 v_square; out ivec4 v_edges; out int v_inner;
void main() { v_square = in_square; v_edges = in_edges; v_inner = in_inner; }
"""


def mesh(heights):
    """Posts and triangles as the driver has made them."""
    squares = squares_of(heights)
    north_east_south_west = 1, 2, 3, 0
    steps = [[edge_step(squares, i, side) for side in north_east_south_west] for i in range(len(squares))]
    side, step = squares[:, 2:].T
    drawn = np.column_stack([squares[:, :2], 1 << side, np.ones_like(side)])
    edges, inner = 1 << side[:, None] - np.array(steps), 1 << side - step
    ctx, texts = context(410), shaders()
    stages = {f"tess_{name}_shader": texts[name].strip() for name in ("control", "evaluation")}
    program = ctx.program(PATCH.strip(), **stages, varyings=("v_place",))
    values = ((drawn, "4i", "in_square"), (edges, "4i", "in_edges"), (inner, "1i", "in_inner"))
    buffers = [(ctx.buffer(np.int32(each).tobytes()), kind, name) for each, kind, name in values if name in program]
    ctx.texture(heights.shape[::-1], 1, np.float32(heights).tobytes(), dtype="f4").use(0)
    ctx.patch_vertices = 1
    ctx.simple_framebuffer((1, 1)).use()
    found = ctx.buffer(reserve=36 * 4 * int((np.maximum(edges.max(1), inner) ** 2).sum()))
    array, counted = ctx.vertex_array(program, buffers), ctx.query(primitives=True)

    def call(name, *words):
        ctypes.CFUNCTYPE(None, *[ctypes.c_uint] * len(words))(ctx.extra.load(name))(*words)

    array.render(moderngl.PATCHES, vertices=0)  # binds the program and the array: moderngl captures no patches itself
    with counted:
        call("glBindBufferBase", 0x8C8E, 0, found.glo)  # GL_TRANSFORM_FEEDBACK_BUFFER
        call("glBeginTransformFeedback", moderngl.TRIANGLES)
        call("glDrawArrays", moderngl.PATCHES, 0, len(squares))
        call("glEndTransformFeedback")
    corners = np.frombuffer(found.read(36 * counted.primitives), np.float32).reshape(-1, 3)[:, :2].astype(int)
    posts, which = np.unique(corners, axis=0, return_inverse=True)
    ctx.release()
    return posts, which.reshape(-1, 3)


def show_08(heights, posts, triangles):
    """The driver's triangles as wires."""
    clay = light(heights, posts)[:, None] * np.ones(3)
    return wired(heights, posts, triangles, draw(heights, posts, triangles, clay))
