"""Ways to run the shaders: `pytest --driver NAME` sets these variables before the first context is made."""

from pathlib import Path

import pytest

from terrain_gl.gpu.gl import CODE_FOR

VULKAN = Path("/usr/share/vulkan/icd.d")
DRIVERS = {
    "llvmpipe": {"LIBGL_ALWAYS_SOFTWARE": "1"},
    "zink": {  # OpenGL over Vulkan: another way from GLSL to the processor
        "LIBGL_ALWAYS_SOFTWARE": "1",
        "MESA_LOADER_DRIVER_OVERRIDE": "zink",
        "ZINK_INLINE_UNIFORMS": "0",  # else it computes wrongly: terrain_gl/gpu/selftest.py
    },
    "gpu-code": {CODE_FOR: "gpu"},  # groups of 64 threads, and sums in strips
    "narrow": {"LP_NATIVE_VECTOR_WIDTH": "128"},
    "one-thread": {"LP_NUM_THREADS": "0"},
}


def lavapipe():
    """The file of Mesa's Vulkan driver for the processor; None if it is not installed."""
    return next(VULKAN.glob("lvp_icd.*.json"), None)


def environment(name):
    """Variables of a driver; none for the one that the machine selects itself.

    Raises
    ------
    LookupError
        It is not installed.
    """
    if name != "zink":
        return DRIVERS.get(name, {})
    if not lavapipe():
        raise LookupError("zink needs lavapipe: apt install mesa-vulkan-drivers")
    return DRIVERS[name] | {"VK_ICD_FILENAMES": str(lavapipe())}


def must_be_one_driver(*contexts):
    """Skip a test that compares bytes of contexts of different drivers: only one driver promises the same bytes."""
    names = set()
    for context in contexts:
        with context:
            names.add(context.info["GL_RENDERER"])
    if len(names) > 1:
        pytest.skip(f"{' and '.join(sorted(names))} are different drivers")
