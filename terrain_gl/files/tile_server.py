"""A page that shows a folder of tiles, served to this machine alone.

The page is `html/tiles.html`. It draws with three.js, as `html/land.html` does, and 3d-tiles-renderer (`.ci/three`).
"""

import html
from collections.abc import Callable
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib.resources import files
from pathlib import Path

from ..basics.exceptions import TerrainError

HOST = "127.0.0.1"


class _Tiles(SimpleHTTPRequestHandler):
    """Answers with the page, and with the files of the folder."""

    extensions_map = SimpleHTTPRequestHandler.extensions_map | {".glb": "model/gltf-binary"}  # noqa: RUF012

    def __init__(self, *args: object, page: bytes, directory: str) -> None:
        self.page = page
        super().__init__(*args, directory=directory)  # type: ignore[arg-type]

    def do_GET(self) -> None:
        if self.path != "/":
            return super().do_GET()
        self.send_response(200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(self.page)))
        self.end_headers()
        self.wfile.write(self.page)

    def end_headers(self) -> None:
        """A browser must not show the tiles of another folder that was served at this port."""
        self.send_header("Cache-Control", "no-store")
        super().end_headers()

    def log_message(self, *_: object) -> None:
        """Print nothing."""


def serve(folder: Path, port: int, ready: Callable[[str], None]) -> None:
    """Serve the page of a tile set until Ctrl-C. `ready` gets its address; with port 0 the system chooses one."""
    parts = files(__package__) / "html"
    page = (parts / "tiles.html").read_text("utf-8").replace("{title}", html.escape(folder.name))
    library = [(parts / f"{name}.min.js").read_text("utf-8") for name in ("three", "tiles")]
    page = page.replace("{library}", "".join(library))
    answers = partial(_Tiles, page=page.encode(), directory=str(folder))
    try:
        server = ThreadingHTTPServer((HOST, port), answers)
    except (OSError, OverflowError) as error:
        raise TerrainError(f"port {port}: {error}: give another, --serve PORT") from None
    with server:
        ready(f"http://{HOST}:{server.server_port}/")
        try:
            server.serve_forever()
        except KeyboardInterrupt:
            return
