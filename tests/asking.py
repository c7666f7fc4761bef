"""Call functions of GLSL files from a test: one invocation for each argument; the results are read back."""

import numpy as np

from terrain_gl.gpu import shaders
from terrain_gl.gpu.passes import ComputePass

_KERNEL = """
layout(local_size_x = 64) in;
layout(std430, binding = 14) readonly buffer Questions { vec4 question[]; };
layout(std430, binding = 15) writeonly buffer Answers { vec4 answer[]; };
uniform uint u_questions;
vec4 answer_to(vec4 a, vec4 b) { STATEMENTS }
void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i < u_questions) answer[i] = answer_to(question[2 * i], question[2 * i + 1]);
}
"""


class Asked(ComputePass):
    """A compute shader whose text is made here."""

    def __init__(self, ctx, path, text):
        super(ComputePass, self).__init__(ctx, lambda: ctx.compute_shader(text), path, (text,))


def ask(ctx, path, statements, a, b=0.0, defines=None, resources=None, uniforms=None, offered=None):
    """Run GLSL statements for each row of `a` and `b`, (n, 4) or (4,); returns the results, (n, 4) float64.

    The statements end with a return, and may use all that the file at `path` provides. `resources` and `uniforms` are
    what that file reads; of those `offered`, it gets those that it declares. Storage blocks 14 and 15 are taken.
    """
    a = np.atleast_2d(np.asarray(a, "f4"))
    pairs = np.stack(np.broadcast_arrays(a, np.asarray(b, "f4")), 1)
    asked = Asked(ctx, path, shaders.source(path, defines or {}) + _KERNEL.replace("STATEMENTS", statements))
    questions, answers = ctx.buffer(pairs.tobytes()), ctx.buffer(reserve=16 * len(pairs))
    read = {**(resources or {}), "Questions": questions, "Answers": answers}
    read |= {name: resource for name, resource in (offered or {}).items() if name in asked.declares}
    asked.run((-(-len(pairs) // 64), 1, 1), read, {**(uniforms or {}), "questions": len(pairs)})
    ctx.memory_barrier()
    told = np.frombuffer(answers.read(), "f4").reshape(-1, 4).astype(float)
    for resource in (asked, questions, answers):
        resource.release()
    return told
