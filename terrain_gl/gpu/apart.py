"""Try a back end in a separate process first, because a missing or broken driver may end the process.

Mesa ends the process if GALLIUM_DRIVER names a driver that it does not have, such as d3d12 of WSL. EGL, the first
choice, normally reports an error instead. So EGL is tried in a separate process only if the environment names a driver.
"""

import json
import os
import signal
import subprocess
import sys
from functools import cache
from typing import Any

from ..basics.exceptions import TerrainError

_NAMED = ("GALLIUM_DRIVER", "MESA_LOADER_DRIVER_OVERRIDE", "LIBGL_DRIVERS_PATH", "LIBGL_ALWAYS_SOFTWARE", "DISPLAY")
_DRIVERS = _NAMED[:3]
_LONGEST_S = 60.0
_CHILD = """
import json, sys
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.gpu.context import newest
try:
    with newest(sys.argv[1]) as ctx:
        told = {"works": [ctx.info["GL_RENDERER"], ctx.info["GL_VERSION"]]}
except TerrainError as error:
    told = {"reason": str(error)}
print(json.dumps(told), flush=True)
"""


def may_crash(name: str) -> bool:
    """Whether a back end must be tried in a separate process first."""
    return name != "egl" or any(os.environ.get(variable) for variable in _DRIVERS)


def try_apart(name: str) -> tuple[str, str]:
    """Renderer and version of a back end, found out in a separate process.

    Raises
    ------
    TerrainError
        The back end does not work; one line says why.
    """
    return _tried(name, tuple(os.environ.get(variable, "") for variable in _NAMED))


@cache
def _tried(name: str, environment: tuple[str, ...]) -> tuple[str, str]:
    command = [sys.executable, "-c", _CHILD, name]
    paths = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    ends: Any = {"stdin": subprocess.DEVNULL, "capture_output": True, "text": True, "timeout": _LONGEST_S}
    try:
        done = subprocess.run(command, env=paths, **ends)
    except subprocess.TimeoutExpired:
        raise TerrainError(f"{name}: its driver does not answer within {_LONGEST_S:g} s{_advice()}") from None
    if status := done.returncode:
        how = signal.Signals(-status).name if status < 0 else f"status {status}"
        raise TerrainError(f"{name}: its driver ends the process ({how}){_advice()}")
    told = json.loads(done.stdout.splitlines()[-1])
    if "reason" in told:
        raise TerrainError(told["reason"])
    renderer, version = told["works"]
    return renderer, version


def _advice() -> str:
    named = [f"{variable}={value}" for variable in _DRIVERS if (value := os.environ.get(variable))]
    return f"; the environment sets {', '.join(named)}: unset it" if named else ""
