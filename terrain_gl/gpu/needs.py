"""What our shaders and tables need of a driver, compared with the limits that it gives, before the first picture.

OpenGL 4.3 guarantees each of these numbers; a driver that gives less would fail later, in words of its own.
`tests/test_needs.py` counts them in the text of all shaders.
"""

from collections.abc import Iterator, Mapping

NEEDS = {  # a key of `gl.limits`: the least value, and what it counts
    "compute_storage_blocks": (8, "storage blocks in a compute shader"),
    "fragment_storage_blocks": (5, "storage blocks in a fragment shader"),
    "storage_block_bytes": (2**24, "bytes in a storage block"),
    "uniform_block_bytes": (2**14, "bytes in a uniform block"),
    "compute_images": (2, "images in a compute shader"),
    "fragment_images": (3, "images in a fragment shader"),
    "image_units": (4, "image units"),
    "compute_textures": (5, "textures in a compute shader"),
    "fragment_textures": (10, "textures in a fragment shader"),
    "texture_size": (2560, "texels along a side of a texture"),  # places of a region of `verify.measure`
    "tess_level": (64, "segments of a tessellated edge"),
    "compute_invocations": (256, "threads in a work group"),
    "shared_bytes": (2**15, "bytes that a work group shares"),
}


def lacking(limits: Mapping[str, int]) -> Iterator[str]:
    """Compare limits, as `gl.limits` returns them, with `NEEDS`; yields a few words for each that is too low."""
    for name, (least, what) in NEEDS.items():
        if limits[name] < least:
            yield f"has {limits[name]:,} {what}, and {least:,} are needed"
