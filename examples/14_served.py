"""Example 14: pictures from a server
==================================

A server with many threads, of the standard library alone, and one renderer. Each call of the renderer takes its turn,
enters its own OpenGL context in the thread that calls, and leaves it again. Twelve clients ask at once.

``/view?azimuth=DEGREES&px=TOLERANCE`` answers with a picture, and with its certificate in a header. With a third
argument, the server stays at that port until Ctrl-C.

Run: ``python 14_served.py [PICTURE.png [MAP [PORT]]]``
"""

import sys
import threading
import urllib.request
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from tempfile import TemporaryDirectory
from urllib.parse import parse_qsl, urlsplit

import numpy as np

from terrain_gl import Camera, Heightmap, Renderer, TerrainError
from terrain_gl.files.maps import bundled
from terrain_gl.image import png_bytes, read_image, write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "14_served.png"
known = bundled()[sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"]
port = int(sys.argv[3]) if len(sys.argv) > 3 else None
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
renderer = Renderer(terrain, (400, 225))


class Views(BaseHTTPRequestHandler):
    """Answers ``/view?azimuth=DEGREES&px=TOLERANCE``."""

    def do_GET(self):  # noqa: N802
        asked = urlsplit(self.path)
        if asked.path != "/view":
            return self.send_error(404, "ask for /view?azimuth=30")
        try:
            given = {name: float(text) for name, text in parse_qsl(asked.query)}
            low, high = terrain.range_m
            middle = *(side / 2 for side in terrain.extent_m), (low + high) / 2
            camera = Camera.over(middle, (*(side / 2 for side in terrain.extent_m), high - low), 45, given["azimuth"])
            frame = renderer.render(camera, given.get("px", 1.0), sun=known.sun)
        except (KeyError, ValueError, TerrainError) as error:
            return self.send_error(400, str(error))
        self.send_response(200)
        self.send_header("Content-Type", "image/png")
        self.send_header("X-Certified-Max-Error-Px", f"{frame.stats['certified_max_error_px']:.3f}")
        self.end_headers()
        self.wfile.write(png_bytes(frame.image))

    def log_message(self, *_):
        pass


def ask(azimuth):
    """A client: the picture of a view, and its certificate."""
    with urllib.request.urlopen(f"http://127.0.0.1:{server.server_port}/view?azimuth={azimuth}") as answer:
        png, certified_px = answer.read(), answer.headers["X-Certified-Max-Error-Px"]
    with TemporaryDirectory() as place:
        (Path(place) / "view.png").write_bytes(png)
        return read_image(Path(place) / "view.png"), float(certified_px)


server = ThreadingHTTPServer(("127.0.0.1", port or 0), Views)
threading.Thread(target=server.serve_forever, daemon=True).start()
with ThreadPoolExecutor(12) as clients:
    views, certified_px = zip(*clients.map(ask, range(0, 360, 30)), strict=True)
print(f"12 views from one renderer in as many threads, every point within {max(certified_px):.3f} px")
write_png(picture, np.concatenate([np.concatenate(views[row : row + 3], 1) for row in range(0, 12, 3)]))
print(f"wrote {picture}")

if port:
    print(f"http://127.0.0.1:{port}/view?azimuth=30")
    with suppress(KeyboardInterrupt):
        threading.Event().wait()
server.shutdown()
server.server_close()
renderer.release()
