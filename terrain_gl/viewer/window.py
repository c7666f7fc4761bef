"""The GLFW window: opens it, hands its events on, and shows frames. All that is decided is decided elsewhere."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ..camera import Camera
from ..context import from_glfw_window
from ..drawing import Drawing
from ..heightmap import Heightmap
from .controller import MOVE_KEYS
from .flight import Flight
from .gui import Gui
from .gui import library as library_of_gui
from .loading import Loading, Opened, Opener
from .memory import Memory, state_path
from .opening import library, open_window
from .overlay import Overlay
from .sections import FILES
from .settings import Settings

SIZE = (1280, 720)


def run(
    source: Heightmap | Opener,
    camera: Camera | None = None,
    *,
    size: tuple[int, int] | None = None,
    name: str = "",
    backend: str = "auto",
    fresh: bool = False,
    gui: bool = True,
    line_of: Callable[..., str] | None = None,
    **options: Any,
) -> dict[str, Any]:
    """Open a window on a map; returns the stats of its last frame when it is closed.

    Parameters
    ----------
    source
        The map, or a function that reads it (`viewer.loading.Opener`): it runs in a thread while the window opens.
    camera
        First view; by default where the window was left last time, or the map's own.
    size
        Width and height of the window in screen coordinates; by default as last time.
    name
        What the window's title says; by default the map's name.
    backend
        What makes the window's context: "egl", "glfw" for the system's own way, or "auto" for the first that works.
    fresh
        Do as if there had been no window before.
    gui
        Show panels to see and change everything with, if the extra `[gui]` is installed; else text alone.
    line_of
        Gives a view as a command line: a function of heightmap, camera, size and drawing.
    options
        Fields of `Drawing` by name: how it is drawn at first.

    Raises
    ------
    TerrainError
        No display, no OpenGL 4.3, too little GPU memory, or the map cannot be read.
    UsageError
        An option outside its range.
    """
    Drawing(**options)  # what is wrong with them is told before a window opens
    memory = Memory(None if fresh else state_path())
    settings = Settings([Drawing(**memory.drawing).otherwise(**options)], **memory.panels)
    opener = _opener(source, camera, options) if isinstance(source, Heightmap) else source
    name = name or (source.name if isinstance(source, Heightmap) else "terrain")
    loading = Loading(name, opener)
    try:
        window = Window(size or memory.window or SIZE, name, backend, gui)
    except BaseException:
        loading.cancel()
        loading.join()
        raise
    try:
        return window.fly(loading, settings, memory, line_of)
    finally:
        window.close()


def _opener(heightmap: Heightmap, camera: Camera | None, options: dict[str, Any]) -> Opener:
    sun = {"sun": options["sun"]} if "sun" in options else {}
    opened = Opened(
        heightmap, camera or Camera.default(heightmap), **sun, key=heightmap.name, camera_given=bool(camera)
    )
    return lambda progress: opened


class Window:
    """A window with an OpenGL context, empty until `fly`."""

    def __init__(self, size: tuple[int, int], name: str, backend: str = "auto", gui: bool = True) -> None:
        self._glfw = library()
        self.name = name
        self._handle = open_window(self._glfw, size, f"{name} – terrain-gl", backend)
        self.ctx = from_glfw_window(self._handle)
        self._glfw.swap_interval(1)
        self._overlay = Overlay(self.ctx, round(self._scale))
        self._gui = Gui(self.ctx, self._scale) if gui and library_of_gui() else None
        self._cursor = (0.0, 0.0)
        self._captured = False

    def fly(
        self, loading: Loading, settings: Settings, memory: Memory, line_of: Callable[..., str] | None = None
    ) -> dict[str, Any]:
        """Draw frames until the user closes the window; the last one's stats."""
        flight = self._flight = Flight(self._overlay, self.ctx.screen, self._pixels, settings, memory, self._gui)
        flight.land.loading, flight.scale = loading, self._scale
        flight.on_capture = self._capture
        flight.keeping.on_copy = lambda text: self._glfw.set_clipboard_string(self._handle, text)
        flight.keeping.line_of = line_of
        flight.say(memory.complaint or "H shows the keys; drop a map's file here to see it")
        self._listen()
        try:
            while not flight.done:
                self._turn()
                if self._glfw.window_should_close(self._handle):
                    self._glfw.set_window_should_close(self._handle, False)
                    flight.quit()
        finally:
            memory.window = self._glfw.get_window_size(self._handle)
            flight.close()
        return flight.figures.stats if flight.has_map else {}

    def close(self) -> None:
        """Close the window and give everything back."""
        if self._gui:
            self._gui.release()
        self._overlay.release()
        self.ctx.release()
        self._glfw.destroy_window(self._handle)
        self._glfw.terminate()

    def _turn(self) -> None:
        if self._flight.frame(self._now):
            self._glfw.swap_buffers(self._handle)
        if self._flight.busy and min(self._flight.size) > 0:
            self._glfw.poll_events()
        else:
            self._glfw.wait_events_timeout(self._flight.wait_s)

    @property
    def _now(self) -> float:
        return self._glfw.get_time()

    @property
    def _scale(self) -> float:
        return max(1.0, self._glfw.get_window_content_scale(self._handle)[0])

    @property
    def _pixels(self) -> tuple[int, int]:
        return self._glfw.get_framebuffer_size(self._handle)

    # --- Events -------------------------------------------------------------------------------------------------------

    def _listen(self) -> None:
        listeners = {
            "framebuffer_size": lambda _, width, height: self._flight.resize((width, height)),
            "window_refresh": lambda _: self._refresh(),
            "window_content_scale": lambda *_: self._rescale(),
            "window_focus": lambda _, focused: None if focused else self._let_go(),
            "key": self._on_key,
            "mouse_button": self._on_button,
            "cursor_pos": self._on_cursor,
            "scroll": self._on_scroll,
            "drop": self._on_drop,
            "char": lambda _, character: self._gui.write(character) if self._gui else None,
        }
        for event, listener in listeners.items():
            getattr(self._glfw, f"set_{event}_callback")(self._handle, listener)
        self._cursor = self._glfw.get_cursor_pos(self._handle)

    def _refresh(self) -> None:
        """While a window is being resized some systems let nothing else run than this."""
        self._flight.resize(self._pixels)
        if self._flight.frame(self._now):
            self._glfw.swap_buffers(self._handle)

    def _rescale(self) -> None:
        self._overlay.scale, self._flight.scale = round(self._scale), self._scale
        if self._gui:
            self._gui.scale = self._scale
        self._flight.resize(self._pixels)

    def _let_go(self) -> None:
        if self._flight.has_map:
            self._flight.controller.let_go_all()

    def _on_key(self, _: Any, key: int, scancode: int, action: int, mods: int) -> None:
        glfw, flight = self._glfw, self._flight
        place = _place(glfw, key)
        if self._gui:
            self._gui.key(_FIELD_KEYS.get(key, place), action != glfw.RELEASE)
            if self._gui.writes and action != glfw.RELEASE:
                return
        moves = place in MOVE_KEYS and not mods & (glfw.MOD_CONTROL | glfw.MOD_ALT | glfw.MOD_SUPER)
        if action == glfw.RELEASE:
            if flight.has_map:
                flight.controller.let_go(place)
        elif moves:
            if flight.has_map and action == glfw.PRESS:
                flight.controller.press(place)
        elif place == "escape" and self._captured:
            flight.press("c")
        else:
            flight.press(_combination(glfw, key, scancode, mods), again=action == glfw.REPEAT)

    def _capture(self) -> bool:
        """Take the mouse, or give it back."""
        glfw = self._glfw
        self._captured = not self._captured
        glfw.set_input_mode(self._handle, glfw.CURSOR, glfw.CURSOR_DISABLED if self._captured else glfw.CURSOR_NORMAL)
        self._cursor = glfw.get_cursor_pos(self._handle)
        return self._captured

    def _on_button(self, _: Any, button: int, action: int, mods: int) -> None:
        glfw, flight = self._glfw, self._flight
        if self._gui and button in _BUTTONS and not self._captured:
            self._gui.button(_BUTTONS[button], action == glfw.PRESS)
            if action == glfw.PRESS and self._gui.covers(*self._cursor_px):
                return
        change = flight.mouse.press if action == glfw.PRESS else flight.mouse.let_go
        change(_BUTTONS.get(button, ""), *self._cursor_px)

    def _on_cursor(self, _: Any, x: float, y: float) -> None:
        self._cursor = x, y
        if self._gui and not self._captured:
            self._gui.move(*self._cursor_px)
        over = bool(self._gui and not self._captured and self._gui.covers(*self._cursor_px))
        self._flight.mouse.point(*self._cursor_px, look=self._captured, over_panels=over)

    def _on_scroll(self, _: Any, dx: float, dy: float) -> None:
        if self._gui and not self._captured and self._gui.covers(*self._cursor_px):
            self._gui.wheel(dx, dy)
            return
        control = any(
            self._glfw.get_key(self._handle, key) == self._glfw.PRESS
            for key in (self._glfw.KEY_LEFT_CONTROL, self._glfw.KEY_RIGHT_CONTROL)
        )
        self._flight.mouse.wheel(dy, zoom=control)

    def _on_drop(self, _: Any, paths: list[str]) -> None:
        kind = FILES.get(self._gui.at(*self._cursor_px)) if self._gui else None
        if kind:
            self._flight.dressing.wear(kind, paths[0])
        else:
            self._flight.land.open(paths[0])

    @property
    def _cursor_px(self) -> tuple[float, float]:
        """The cursor in pixels of the picture, which may be finer than the screen's own coordinates."""
        width, height = self._glfw.get_window_size(self._handle)
        return self._cursor[0] * self._pixels[0] / max(1, width), self._cursor[1] * self._pixels[1] / max(1, height)


# GLFW's numbers of buttons, and of keys that only fields of text want
_BUTTONS = {0: "left", 1: "right", 2: "middle"}
_FIELD_KEYS = {257: "enter", 335: "enter", 259: "backspace", 261: "delete", 269: "end", 341: "ctrl", 345: "ctrl"}


# --- Keys -------------------------------------------------------------------------------------------------------------


def _place(glfw: Any, key: int) -> str:
    """Name of a key by its place on a US keyboard."""
    named = {
        glfw.KEY_LEFT_SHIFT: "shift",
        glfw.KEY_RIGHT_SHIFT: "shift",
        glfw.KEY_TAB: "tab",
        glfw.KEY_HOME: "home",
        glfw.KEY_ESCAPE: "escape",
        glfw.KEY_F1: "f1",
        glfw.KEY_LEFT: "left",
        glfw.KEY_RIGHT: "right",
        glfw.KEY_UP: "up",
        glfw.KEY_DOWN: "down",
        glfw.KEY_KP_ADD: "+",
        glfw.KEY_KP_SUBTRACT: "-",
    }
    return named.get(key, chr(key).lower() if 32 < key < 127 else "")


def _combination(glfw: Any, key: int, scancode: int, mods: int) -> str:
    """What is pressed, as commands name it: by what is printed on the key, where that is a plain character."""
    place = _place(glfw, key)
    label = glfw.get_key_name(key, scancode) or ""
    name = label if len(place) == 1 and not place.isdigit() and label.isascii() and label else place
    held = (("ctrl", glfw.MOD_CONTROL | glfw.MOD_SUPER), ("shift", glfw.MOD_SHIFT))
    return "+".join([word for word, bit in held if mods & bit] + [name])
