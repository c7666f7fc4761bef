"""From the start of the process to the first picture in the window, and to one in full size and light.

    xvfb-run -s "-screen 0 1280x800x24" python benchmarks/viewer_start.py MAP [OPTION …]     options of terrain-gl view

Needs a display. Opens the window of `terrain-gl view --fresh`, waits until its picture is complete, and closes it.
Each line has seconds since the process began, processor seconds of all threads, and the most memory so far: of the
process, and of its textures and buffers on the GPU. With Mesa's software renderer the latter are part of the former.
"""

from __future__ import annotations

import os
import resource
import sys
import time
from collections.abc import Callable

from terrain_gl import cli
from terrain_gl.viewer.app import App


def main() -> int:
    """Open the window; print a line for the first picture, and for each step until it is complete."""
    frame, seen = App.frame, set[str]()

    def watched(app: App, now_s: float) -> bool:
        is_new = frame(app, now_s)
        painter = app.viewer.painter
        if painter.has_picture and app.viewer.scene.has_map:
            note("first picture", seen, lambda: told(app))
            if painter.frame.way.is_full and painter.frame.stats.get("complete", True):
                note("full size, all tiles", seen, lambda: told(app))
                if app.viewer.settled:
                    note("full size and light", seen, lambda: told(app))
                    app.viewer.quit()
        return is_new

    App.frame = watched  # type: ignore[method-assign]
    print("| | s | processor s | MiB of the process | MiB of these on the GPU | tiles | certified px |")
    print("|---|---|---|---|---|---|---|")
    return cli.main(["view", "--fresh", *sys.argv[1:]])


def note(what: str, seen: set[str], told: Callable[[], str]) -> None:
    """Print a line, once."""
    if what not in seen:
        seen.add(what)
        used = resource.getrusage(resource.RUSAGE_SELF)
        cpu_s, most_mib = used.ru_utime + used.ru_stime, used.ru_maxrss / 1024
        print(f"| {what} | {age_s():.1f} | {cpu_s:.1f} | {most_mib:.0f} | {told()} |", flush=True)


def told(app: App) -> str:
    """Memory on the GPU, tiles and certificate of the present picture."""
    stats = app.viewer.painter.frame.stats
    gpu_mib = stats.get("gpu_bytes", {}).get("total", 0) / 2**20
    return f"{gpu_mib:.0f} | {stats.get('tiles_resident', '')} | {stats.get('certified_max_error_px') or 0:.3g}"


def age_s() -> float:
    """Seconds since this process began (Linux)."""
    with open("/proc/self/stat") as file:
        began = int(file.read().rpartition(")")[2].split()[19]) / os.sysconf("SC_CLK_TCK")
    return time.clock_gettime(time.CLOCK_BOOTTIME) - began


if __name__ == "__main__":
    sys.exit(main())
