"""Binding numbers: GLSL declares them, Python reads the declarations.

    bind("sat/reduce.comp", Words=buffer, StripSums=sums)

binds each resource to the binding number that the file, or a file that it includes, declares for that name. The numbers
are read from the source, not from a program: a block that all programs share belongs to no program, and moderngl does
not report the binding numbers of images.
"""

import re
from functools import cache
from typing import Any, NamedTuple

import moderngl

from . import gl, shaders

Resource = moderngl.Buffer | moderngl.Texture | moderngl.TextureArray | gl.WordTexture

# layout(std430, binding = 1) readonly buffer Boxes { ...
# layout(r32f, binding = 0) uniform writeonly image2D u_out;
_DECLARATION = re.compile(
    r"layout\s*\([^)]*?\bbinding\s*=\s*(?P<number>\d+)[^)]*\)\s*"
    r"(?P<before>(?:\w+\s+)*?)(?P<storage>uniform|buffer)\s+(?P<after>(?:\w+\s+)*?)(?P<name>\w+)\s*(?P<end>[{;])"
)


class Binding(NamedTuple):
    """The binding of a resource in a shader."""

    kind: str  # "uniform block", "storage block", "sampler" or "image"
    number: int
    read: bool  # whether shaders read it, and whether they write it
    write: bool


@cache
def places(path: str) -> dict[str, Binding]:
    """Read all declarations in the shader `path` and in the files that it includes, by name."""
    return {match["name"]: _place(match) for match in _DECLARATION.finditer(shaders.source(path))}


def _place(match: re.Match[str]) -> Binding:
    words = (match["before"] + match["after"]).split()
    block = match["end"] == "{"
    kind = f"{'storage' if match['storage'] == 'buffer' else 'uniform'} block" if block else "sampler"
    if any("image" in word for word in words):
        kind = "image"
    return Binding(kind, int(match["number"]), "writeonly" not in words, "readonly" not in words)


def bind(path: str, **resources: Any) -> None:
    """Bind buffers, textures and `gl.WordTexture`s to the places that the shader `path` declares for them.

    Raises
    ------
    ShaderError
        If the shader declares no block, sampler or image of that name.
    """
    declared = places(path)
    for name, resource in resources.items():
        if name not in declared:
            raise shaders.ShaderError(f"glsl/{path} has no binding for {name}; it declares {', '.join(declared)}")
        kind, number, read, write = declared[name]
        if kind == "storage block":
            resource.bind_to_storage_buffer(number)
        elif kind == "uniform block":
            resource.bind_to_uniform_block(number)
        elif kind == "image":
            resource.bind_to_image(number, read=read, write=write)
        else:
            resource.use(number)
