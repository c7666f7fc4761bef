"""The window in a notebook: the same camera, keys and panels, drawn without a display and sent as pictures.

    from terrain_gl.viewer.notebook import View
    View("alpine")

Without a live front end (in a script, or on a web page), a still picture is shown instead. The picture is an output of
its own, because programs that make pages from notebooks show only the widget of an output with a widget. The extra
`[notebook]` is needed: jupyter_rfb (https://jupyter-rfb.readthedocs.io) sends pictures to the browser and receives its
events.
"""

import asyncio
import base64
import gc
import os
import time
from typing import Any, Unpack
from weakref import finalize, ref

import moderngl
import numpy as np

try:
    from IPython import get_ipython
    from IPython.display import DisplayHandle, display
    from ipywidgets.widgets import widget
    from jupyter_rfb import RemoteFrameBuffer
except ImportError as error:
    raise ImportError(
        f"{error}: the notebook's view needs the extra [notebook]: pip install 'terrain-gl[notebook]'"
    ) from None

from ..basics.exceptions import UsageError
from ..camera import Camera
from ..files.maps import open_map
from ..files.views import standard_sun, standard_view
from ..gpu import gl
from ..gpu.context import create_context
from ..gpu.current import kept
from ..gpu.textures import from_top
from ..heightmap import Heightmap
from ..image import png_bytes
from ..renderer import Renderer
from ..renderer.frame import Stats
from ..renderer.options import FrameOptions, RenderOptions
from ..renderer.overlay import Overlay
from .app import App
from .loading import Opened
from .settings import Settings
from .viewer import Viewer
from .window_state import Size

NOTCH_PX = 100.0  # pixels that browsers report for one notch of the wheel
MOST_PX = 8192
_KEPT = getattr(widget, "_instances", {})  # ipywidgets keeps every widget here until it is closed
_SHOWN: dict[str, tuple[str, list[Any]]] = {}  # of each cell of a notebook: its last run, and the views that it shows
_BUTTONS = {1: "left", 2: "right", 3: "middle"}
_NAMED = {"ArrowLeft": "left", "ArrowRight": "right", "ArrowUp": "up", "ArrowDown": "down", " ": "space"}
_DIGITS = dict(zip("!@#$%^&*(", "123456789", strict=True))  # with Shift, on most keyboards


class View(RemoteFrameBuffer):  # type: ignore[misc]  # jupyter_rfb has no types
    """A map in a widget.

    A view that nobody has a name for gives back its memory: if it was never shown, or if its cell has run again and
    shows another one. The page still shows any other view until `close`.

    Parameters
    ----------
    source
        A heightmap, a file, or the name of a bundled map.
    camera
        The first view; by default the map's own.
    size
        Width and height of the widget in pixels of the page; the user can change it.
    panels
        Whether the panel is shown at first; the key I shows and hides it.
    backend
        As for `Renderer`.
    overlays
        Lines and points over the land, of `overlay.read_overlay`.
    options
        Fields of `FrameOptions` by name: how the map is drawn at first.

    Raises
    ------
    TerrainError
        There is no OpenGL 4.3 or no extra [gui], or too little GPU memory.
    UsageError
        An option is outside its range.
    """

    _closed = True  # until the view is complete

    def __init__(
        self,
        source: Heightmap | str | os.PathLike[str] = "alpine",
        camera: Camera | None = None,
        *,
        size: Size = (640, 360),
        panels: bool = False,
        backend: str = "auto",
        overlays: tuple[Overlay, ...] = (),
        **options: Unpack[RenderOptions],
    ) -> None:
        heightmap, known = (source, None) if isinstance(source, Heightmap) else open_map(os.fspath(source))
        if min(size) < 1 or max(size) > MOST_PX:
            raise UsageError(f"the view's size must be from 1x1 to {MOST_PX}x{MOST_PX}, got {size[0]}x{size[1]}")
        sun = options.pop("sun", known.sun if known else standard_sun(heightmap))
        settings = Settings([FrameOptions(**options | {"sun": sun})], panel=panels)
        super().__init__(css_width=f"{size[0]}px", css_height=f"{size[1]}px")
        self._timer: asyncio.TimerHandle | None = None
        self._welcomed = False  # whether a front end is live
        self._still: tuple[str, DisplayHandle | None] | None = None  # the still picture: its PNG, and its output
        self._ratio = 1.0  # pixels of the picture for one pixel of the page
        self.ctx = create_context(backend)
        with self.ctx:
            self._target = self.ctx.framebuffer([self.ctx.renderbuffer(size, 4)])
            self.app = App(self.ctx, self._target, size, settings)
            start = camera or (known.camera if known else standard_view(heightmap))
            self._closed = False
            opened = Opened(heightmap, start, sun, heightmap.name, True, overlays)
            self.viewer.show(Renderer(heightmap, size, ctx=self.ctx), opened)
        self._end = finalize(self, _release, self.ctx, self.app)
        self._end.atexit = False
        self._let_drop()

    def _let_drop(self) -> None:
        """Until the view is shown, nobody but its owner keeps it."""
        view = ref(self)
        _KEPT.pop(self.model_id, None)
        self.comm.on_msg(lambda message: (here := view()) and here._handle_msg(message))

    # --- What it shows ------------------------------------------------------------------------------------------------

    @property
    def viewer(self) -> Viewer:
        """The viewer: the scene, and the parts that work on it."""
        return self.app.viewer

    @property
    def camera(self) -> Camera:
        """The present camera, at the heights of the map."""
        scene = self.viewer.scene
        return scene.for_renderer(scene.controller.camera)

    @property
    def stats(self) -> Stats:
        """The stats of the last frame: docs/stats.md."""
        return self.viewer.painter.frame.stats

    def draw(self, **options: Unpack[RenderOptions]) -> None:
        """Change fields of `FrameOptions` by name."""
        factor = options.pop("exaggeration", None)
        self.viewer.settings.change_all(**options)
        if factor is not None:
            self.viewer.exaggerate(factor)  # the eye keeps its place over the land
        self.request_draw()

    def picture(self) -> np.ndarray:
        """The picture of the widget in full size, with light: (height, width, 3) uint8."""
        with self.ctx:
            self._fit_target()
            for _ in range(3):  # panels need one or two frames to find their size
                self.app.frame(time.monotonic())
            while not (self.viewer.settled or self.viewer.scene.controller.moving):
                self.app.frame(time.monotonic())
            return self._pixels()

    def close(self, *args: object, **kwargs: object) -> None:
        """Close the widget, and release GPU resources."""
        if not self._closed:
            super().close(*args, **kwargs)

    # --- What jupyter_rfb calls ---------------------------------------------------------------------------------------

    def get_frame(self) -> np.ndarray | None:
        """The pixels of the next frame; None if nothing has changed."""
        if self._closed:
            return None
        with self.ctx:
            self._fit_target()
            pixels = self._pixels() if self.app.frame(time.monotonic()) else None
        if self._timer:
            self._timer.cancel()
        if self.app.busy:
            self.request_draw()
        else:
            self._timer = asyncio.get_running_loop().call_later(self.app.wait_s, self.request_draw)
        return pixels

    def handle_event(self, event: dict[str, Any]) -> None:
        if self._closed:
            return
        if event["type"] == "close":
            self._stop()
        elif handler := getattr(self, f"_on_{event['type']}", None):
            with self.ctx:
                self.app.attempt(handler, event)
            self.request_draw()

    def _repr_mimebundle_(self, **kwargs: object) -> Any:
        """The widget. Before it, the still picture is shown until a front end is live."""
        _KEPT[self.model_id] = self  # the page may show it when no name has it any more
        _note_shown(self)
        if not self._closed and not self._welcomed:
            picture = base64.b64encode(png_bytes(self.picture())).decode("ascii")
            data = {"image/png": picture, "text/plain": repr(self)}
            self._still = picture, display(data, raw=True, display_id=True)  # type: ignore[no-untyped-call]
        return super()._repr_mimebundle_(**kwargs)

    def _fold_still(self) -> None:
        """Fold the still picture away. A page that is made from the notebook still contains it."""
        if self._still:
            picture, shown = self._still
            image = f'<img src="data:image/png;base64,{picture}">'
            if shown:
                folded = {"text/html": f"<details><summary>still picture</summary>{image}</details>", "text/plain": ""}
                shown.update(folded, raw=True)  # type: ignore[no-untyped-call]
            self._still = None

    # --- Pixels -------------------------------------------------------------------------------------------------------

    def _fit_target(self) -> None:
        size = self.viewer.window.size
        if min(size) > 0 and self._target.size != size:
            gl.release_with_pixels(self._target)
            self._target = self.viewer.target = self.ctx.framebuffer([self.ctx.renderbuffer(size, 4)])

    def _pixels(self) -> np.ndarray:
        return from_top(self._target.read(components=3, alignment=1), "u1", self._target.size, 3)

    def _stop(self) -> None:
        self._closed = True
        if self._timer:
            self._timer.cancel()
        self._end()

    # --- Events -------------------------------------------------------------------------------------------------------

    def _on_resize(self, event: dict[str, Any]) -> None:
        self._ratio = float(event.get("ratio") or 1.0)
        width, height = (max(0, min(MOST_PX, round(event[side] * self._ratio))) for side in ("width", "height"))
        self.app.resize((width, height), max(1.0, self._ratio))
        if not self._welcomed:
            self._welcomed = True
            self._fold_still()
            self.viewer.window.say("click here: W A S D fly, H shows all keys")

    def _on_pointer_down(self, event: dict[str, Any]) -> None:
        self.app.mouse_down(_BUTTONS.get(event["button"], ""), *self._place(event))

    def _on_pointer_up(self, event: dict[str, Any]) -> None:
        self.app.mouse_up(_BUTTONS.get(event["button"], ""), *self._place(event))

    def _on_pointer_move(self, event: dict[str, Any]) -> None:
        self.app.mouse_move(*self._place(event))

    def _on_wheel(self, event: dict[str, Any]) -> None:
        dx, dy = -event["dx"] / NOTCH_PX, -event["dy"] / NOTCH_PX
        actions = {"Control": "zoom", "Shift": "speed"}
        action = next((actions[key] for key in event["modifiers"] if key in actions), "")
        self.app.wheel(dx, dy, *self._place(event), action)

    def _on_key_down(self, event: dict[str, Any]) -> None:
        key = _key_name(event["key"])
        held = set(event["modifiers"])
        names = (("ctrl", {"Control", "Meta"}), ("shift", {"Shift"}))
        command = "+".join([*(name for name, keys in names if keys & held), key])
        self.app.key_down(key, command, moves=not {"Control", "Alt", "Meta"} & held)
        self.viewer.window.closing = False  # a widget has no window to close

    def _on_key_up(self, event: dict[str, Any]) -> None:
        self.app.key_up(_key_name(event["key"]))

    def _on_char(self, event: dict[str, Any]) -> None:
        for character in event.get("data") or "":
            self.app.write(ord(character))

    def _on_hide(self, event: dict[str, Any]) -> None:
        self.app.lose_keyboard()

    def _place(self, event: dict[str, Any]) -> tuple[float, float]:
        """The cursor in pixels of the picture."""
        return event["x"] * self._ratio, event["y"] * self._ratio


def _note_shown(view: View) -> None:
    """Let go of the views that an earlier run of this cell showed: the page has no output of that run any more."""
    shell: Any = get_ipython()
    parent: dict[str, Any] = getattr(shell, "get_parent", dict)()
    cell, run = parent.get("metadata", {}).get("cellId"), parent.get("header", {}).get("msg_id")
    if not cell:
        return
    before, shown = _SHOWN.get(cell, (run, []))
    _SHOWN[cell] = run, [*shown, view] if before == run else [view]
    still = {id(each) for _, views in _SHOWN.values() for each in views}
    for old in shown:
        if id(old) not in still:
            _KEPT.pop(old.model_id, None)
            _forget_output(shell, old)
    if shown and before != run:
        shell.events.register("post_run_cell", _collect)  # the run's own result still has the view


def _collect(_: object) -> None:
    """Free what has no name now: views are in cycles, and Python does not count their memory."""
    shell: Any = get_ipython()
    shell.events.unregister("post_run_cell", _collect)
    gc.collect()


def _forget_output(shell: Any, view: View) -> None:
    """Forget a view as a result of IPython (`_`, `__`, `___`, `_5`, `Out[5]`); names that the user gave stay."""
    for name in ("_", "__", "___"):
        if getattr(shell.displayhook, name, None) is view:
            setattr(shell.displayhook, name, "")
            shell.push({name: ""}, interactive=False)
    results = shell.user_ns.get("_oh", {})
    for number in [number for number, result in results.items() if result is view]:
        for names in (shell.user_ns, shell.user_ns_hidden):
            names.pop(f"_{number}", None)
        del results[number]


def _release(ctx: moderngl.Context, app: App) -> None:
    """Release everything on the GPU, whatever is current."""
    with kept():
        with ctx:
            gl.release_with_pixels(app.viewer.target)
            app.close()
        ctx.release()


def _key_name(name: str) -> str:
    return _NAMED.get(name) or _DIGITS.get(name) or name.lower()
