"""The GLFW window: opens it, hands its events to the app, and shows frames."""

import sys
from collections.abc import Callable
from functools import partial
from typing import Any, Unpack

from ..basics.exceptions import UsageError
from ..camera import Camera
from ..files.views import standard_sun, standard_view
from ..gpu.context import from_glfw_window
from ..heightmap import Heightmap
from ..renderer.frame import Stats
from ..renderer.options import FrameOptions, RenderOptions
from ..renderer.overlay import Overlay
from .app import App
from .glfw_window import library, open_window
from .gui import load_imgui
from .layers import is_layer
from .lecture import Station, read_lecture
from .loading import LoadJob, Opened, Opener
from .memory import Memory
from .recovery import lost_land, offer_of, recovery_folder, state_path
from .settings import UI_SCALES, Settings
from .tour import REST_S
from .window_state import MESSAGE_S

SIZE = (1280, 720)
OFFER_S = 20.0  # how long the window says that there is land to be recovered


def run(
    source: Heightmap | Opener,
    camera: Camera | None = None,
    *,
    size: tuple[int, int] | None = None,
    name: str = "",
    backend: str = "auto",
    fresh: bool = False,
    panel: bool | None = None,
    ui_scale: float | None = None,
    lecture: str | None = None,
    line_of: Callable[..., str] | None = None,
    overlays: tuple[Overlay, ...] = (),
    **options: Unpack[RenderOptions],
) -> Stats:
    """Show a map in a window until the user closes it.

    Parameters
    ----------
    source
        The map, or a function that reads it (`viewer.Opener`). The function runs in a thread while the window opens.
    camera
        The first view; by default the last view of this map in an earlier run, or the map's own view.
    size
        Width and height of the window in screen coordinates; by default as in the last run.
    name
        The title of the window; by default the name of the map.
    backend
        How the OpenGL context is made: "egl", "glfw" for the system's own way, or "auto" for the first that works.
    fresh
        Ignore the settings of earlier runs.
    panel
        Whether the panel is shown at first; by default as in the last run.
    ui_scale
        Factor of the sizes of type and panels, 0.5 to 4; by default as in the last run.
    lecture
        A file of stations to go through by Space and arrows, or "" for the lecture that comes with the package.
    line_of
        Returns the command line of a view, from heightmap, camera, size and options.
    overlays
        Lines and points, if `source` is a map. A function that reads the map also gives its overlays.
    options
        Fields of `FrameOptions` by name: how the map is drawn at first.

    Returns
    -------
    dict
        The stats of the last frame.

    Raises
    ------
    TerrainError
        There is no display, no OpenGL 4.3, too little GPU memory or no extra [gui], or the map cannot be read.
    UsageError
        An option is outside its range.
    """
    FrameOptions(**options)  # a wrong option gives an error before a window opens
    load_imgui()
    memory = Memory(None if fresh else state_path())
    panel = memory.panel if panel is None else panel
    ui_scale = memory.ui_scale if ui_scale is None else ui_scale
    if not UI_SCALES[0] <= ui_scale <= UI_SCALES[1]:
        raise UsageError(f"ui scale: expected {UI_SCALES[0]:g} to {UI_SCALES[1]:g}, got {ui_scale:g}")
    settings = Settings([FrameOptions(**memory.options).otherwise(**options)], panel=panel, ui_scale=ui_scale)
    opener = _opener(source, camera, options, overlays) if isinstance(source, Heightmap) else source
    stations = None if lecture is None else read_lecture(lecture or None)
    name = name or (source.name if isinstance(source, Heightmap) else "terrain")
    job = LoadJob(name, opener)
    try:
        window = Window(size or memory.window or SIZE, name, backend)
    except BaseException:
        job.cancel()
        job.join()
        raise
    try:
        return window.show(job, settings, memory, line_of, stations)
    finally:
        window.close()


def _opener(
    heightmap: Heightmap, camera: Camera | None, options: RenderOptions, overlays: tuple[Overlay, ...]
) -> Opener:
    sun = options.get("sun") or standard_sun(heightmap)
    first = camera or standard_view(heightmap)
    opened = Opened(heightmap, first, sun, heightmap.name, bool(camera), overlays)
    return lambda progress: opened


class Window:
    """A window with an OpenGL context; it is empty until `show`."""

    def __init__(self, size: tuple[int, int], name: str, backend: str = "auto") -> None:
        self._glfw = library()
        self._handle = open_window(self._glfw, size, f"{name} – terrain-gl", backend)
        self.ctx = from_glfw_window(self._handle)
        self._glfw.swap_interval(1)
        self._cursor = self._glfw.get_cursor_pos(self._handle)
        self._title = name

    def show(
        self,
        job: LoadJob,
        settings: Settings,
        memory: Memory,
        line_of: Callable[..., str] | None = None,
        stations: list[Station] | None = None,
    ) -> Stats:
        """Draw frames until the user closes the window; returns the stats of the last one."""
        app = self._app = App(self.ctx, self.ctx.screen, self._size_px, settings, memory, self._scale)
        viewer = app.viewer
        viewer.loader.start(job)
        if stations:
            viewer.give_lecture(stations)
        viewer.window.capture_mouse = self._capture_mouse
        viewer.saver.on_copy = lambda text: self._glfw.set_clipboard_string(self._handle, text)
        viewer.saver.line_of = line_of
        viewer.files.has_desktop = True
        viewer.tour.after_s = REST_S
        viewer.sculpting.recovery.folder = recovery_folder()
        viewer.alarm.folder = state_path().parent / "reports"
        viewer.lost = [path for path in lost_land(recovery_folder()) if not memory.knows(str(path))]
        hint = offer_of(viewer.lost[0]) if viewer.lost else "H shows all keys; drop a file here to open a map"
        viewer.window.say(memory.complaint or hint, OFFER_S if viewer.lost else MESSAGE_S)
        self._listen()
        try:
            while not viewer.window.closing:
                self._turn()
                if self._glfw.window_should_close(self._handle):
                    self._glfw.set_window_should_close(self._handle, False)
                    viewer.quit()
        except BaseException:
            if kept := viewer.sculpting.rescue():
                sys.stderr.write(f"the sculpted land is in {kept}\n")
            raise
        finally:
            memory.window = self._glfw.get_window_size(self._handle)
            app.close()
        return viewer.painter.frame.stats

    def close(self) -> None:
        self.ctx.release()
        self._glfw.destroy_window(self._handle)
        self._glfw.terminate()

    def _turn(self) -> None:
        """Draw one frame, then handle the events since the last frame."""
        self._frame()
        if self._app.busy and self._app.viewer.window.is_visible:
            self._glfw.poll_events()
        else:
            self._glfw.wait_events_timeout(self._app.wait_s)

    def _frame(self) -> None:
        viewer = self._app.viewer
        if viewer.scene.has_map and viewer.title != self._title:
            self._title = viewer.title
            self._glfw.set_window_title(self._handle, f"{self._title} – terrain-gl")
        if self._app.frame(self._glfw.get_time()):
            self._glfw.swap_buffers(self._handle)

    @property
    def _scale(self) -> float:
        return max(1.0, self._glfw.get_window_content_scale(self._handle)[0])

    @property
    def _size_px(self) -> tuple[int, int]:
        return self._glfw.get_framebuffer_size(self._handle)

    @property
    def _cursor_px(self) -> tuple[float, float]:
        """The cursor in pixels of the picture. A pixel may be smaller than a unit of screen coordinates."""
        width, height = self._glfw.get_window_size(self._handle)
        return self._cursor[0] * self._size_px[0] / max(1, width), self._cursor[1] * self._size_px[1] / max(1, height)

    # --- Events -------------------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        listeners: dict[str, Callable[..., Any]] = {
            "framebuffer_size": lambda *_: self._resize(),
            "window_refresh": lambda _: self._refresh(),
            "window_content_scale": lambda *_: self._resize(),
            "window_focus": lambda _, focused: None if focused else self._app.lose_keyboard(),
            "key": self._on_key,
            "mouse_button": self._on_button,
            "cursor_pos": self._on_cursor,
            "scroll": self._on_scroll,
            "drop": lambda _, paths: self._drop(paths),
            "char": lambda _, character: self._app.write(character),
        }
        for event, listener in listeners.items():
            heard = partial(self._app.attempt, listener)
            getattr(self._glfw, f"set_{event}_callback")(self._handle, heard)
        self._cursor = self._glfw.get_cursor_pos(self._handle)

    def _resize(self) -> None:
        self._app.resize(self._size_px, self._scale)

    def _refresh(self) -> None:
        """Draw a frame now. While a window is being resized, some systems call only this function."""
        self._resize()
        self._frame()

    def _on_key(self, _: object, key: int, scancode: int, action: int, mods: int) -> None:
        glfw = self._glfw
        name = _key_name(glfw, key)
        if action == glfw.RELEASE:
            self._app.key_up(name)
            return
        moves = not mods & (glfw.MOD_CONTROL | glfw.MOD_ALT | glfw.MOD_SUPER)
        self._app.key_down(name, _combination(glfw, key, scancode, mods), action == glfw.REPEAT, moves)

    def _drop(self, paths: list[str]) -> None:
        """Take all layers, and one map."""
        for path in dict.fromkeys([paths[0], *filter(is_layer, paths)]):
            self._app.drop(path, *self._cursor_px)

    def _capture_mouse(self) -> bool:
        """Capture the mouse, or free it; returns whether it is captured now."""
        glfw = self._glfw
        self._app.captured = not self._app.captured
        mode = glfw.CURSOR_DISABLED if self._app.captured else glfw.CURSOR_NORMAL
        glfw.set_input_mode(self._handle, glfw.CURSOR, mode)
        self._cursor = glfw.get_cursor_pos(self._handle)
        return self._app.captured

    def _on_button(self, _: object, button: int, action: int, mods: int) -> None:
        change = self._app.mouse_down if action == self._glfw.PRESS else self._app.mouse_up
        change(_BUTTONS.get(button, ""), *self._cursor_px)

    def _on_cursor(self, _: object, x: float, y: float) -> None:
        self._cursor = x, y
        self._app.mouse_move(*self._cursor_px)

    def _on_scroll(self, _: object, dx: float, dy: float) -> None:
        glfw = self._glfw

        def held(*keys: int) -> bool:
            return any(glfw.get_key(self._handle, key) == glfw.PRESS for key in keys)

        speed = "speed" if held(glfw.KEY_LEFT_SHIFT, glfw.KEY_RIGHT_SHIFT) else ""
        action = "zoom" if held(glfw.KEY_LEFT_CONTROL, glfw.KEY_RIGHT_CONTROL) else speed
        self._app.wheel(dx, dy, *self._cursor_px, action)


# --- Names of buttons and keys ----------------------------------------------------------------------------------------

_BUTTONS = {0: "left", 1: "right", 2: "middle"}


_NAMED = ("tab", "space", "page_up", "page_down", "home", "end", "escape", "enter", "backspace", "delete", "f1")
_OTHER_NAMES = {"left_shift": "shift", "right_shift": "shift", "left_control": "ctrl", "right_control": "ctrl"}
_OTHER_NAMES |= {"kp_enter": "enter", "kp_add": "+", "kp_subtract": "-"}


def _key_name(glfw: Any, key: int) -> str:
    """Name of a key by its place on a US keyboard; "" for a key that nothing listens to."""
    names = {name: name.replace("_", " ") for name in (*_NAMED, "left", "right", "up", "down")} | _OTHER_NAMES
    named = {getattr(glfw, f"KEY_{constant.upper()}"): name for constant, name in names.items()}
    return named.get(key, chr(key).lower() if 32 < key < 127 else "")


def _combination(glfw: Any, key: int, scancode: int, mods: int) -> str:
    """The key with its modifiers, as commands name it. A letter key is named by the letter printed on it."""
    name = _key_name(glfw, key)
    label = glfw.get_key_name(key, scancode) or ""
    name = label if len(name) == 1 and not name.isdigit() and label.isascii() and label else name
    held = (("ctrl", glfw.MOD_CONTROL | glfw.MOD_SUPER), ("shift", glfw.MOD_SHIFT))
    return "+".join([word for word, bit in held if mods & bit] + [name])
