"""Dear ImGui: takes events, builds the controls, and draws them with moderngl. panels.py chooses the controls."""

from collections.abc import Callable
from typing import Any

import moderngl

from ..basics.exceptions import NotInstalledError
from . import theme
from .gui_draw import GuiDraw
from .widgets import Widgets
from .window_state import Size

LIVELY_S = 0.8  # after an event, frames are drawn for this time: controls change, hints appear
LIVELY_FRAMES = 8  # least number of these frames: of several quick events, ImGui handles one in each frame
_BUTTONS = {"left": 0, "right": 1, "middle": 2}
_KEYS = {name: name for name in ("tab", "home", "end", "backspace", "delete", "enter", "escape", *"acvxyz")}
_KEYS |= {name: f"{name}_arrow" for name in ("left", "right", "up", "down")}
_KEYS |= {"ctrl": "mod_ctrl", "shift": "mod_shift"}


def load_imgui() -> Any:
    """Dear ImGui's module.

    Raises
    ------
    NotInstalledError
        The extra [gui] is not installed.
    """
    try:
        import glfw  # noqa: F401  imgui_bundle has a GLFW of its own, which must not replace this one
        from imgui_bundle import imgui
    except ImportError as error:
        raise NotInstalledError("a window", "gui", error) from None
    return imgui


class Gui:
    """Panels over a picture, with `scale` pixels per unit of length; `press` executes the command of a key.

    Raises
    ------
    NotInstalledError
        The extra [gui] is not installed.
    """

    def __init__(self, ctx: moderngl.Context, press: Callable[[str], None], scale: float = 1.0) -> None:
        self._imgui = load_imgui()
        self._context = self._imgui.create_context()
        self._use_context()
        self._imgui.get_io().set_ini_filename(None)
        self._imgui.get_io().config_error_recovery_enable_assert = False
        self._imgui.get_io().config_error_recovery_enable_tooltip = False
        theme.load_typeface(self._imgui)
        self._draw = GuiDraw(ctx, self._imgui)
        self.widgets = Widgets(self._imgui, press)
        self._drawn_s = 0.0
        self._lively_until_s = 0.0
        self._touched = True
        self._frames_due = 0
        self.rescale(scale)

    def rescale(self, scale: float) -> None:
        self.widgets.scale = scale
        self._use_context()
        theme.apply(self._imgui, scale)

    def release(self) -> None:
        self._use_context()
        self._draw.release()
        self._imgui.get_platform_io().textures  # noqa: B018  ImGui expects this before it is destroyed
        self._imgui.destroy_context(self._context)

    # --- Events, in pixels of the picture -----------------------------------------------------------------------------

    def move(self, x: float, y: float) -> None:
        self._io().add_mouse_pos_event(x, y)

    def button(self, name: str, down: bool) -> None:
        if name in _BUTTONS:
            self._io().add_mouse_button_event(_BUTTONS[name], down)

    def wheel(self, dx: float, dy: float) -> None:
        self._io().add_mouse_wheel_event(dx, dy)

    def key(self, name: str, down: bool) -> None:
        if name in _KEYS:
            self._io().add_key_event(getattr(self._imgui.Key, _KEYS[name]), down)

    def write(self, character: int) -> None:
        self._io().add_input_character(character)

    def covers(self, x: float, y: float) -> bool:
        """Whether a panel covers a pixel, a control is being dragged, or a list of choices is open."""
        io = self._io()
        inside = any(x0 <= x <= x1 and y0 <= y <= y1 for x0, y0, x1, y1 in self.widgets.covered)
        return inside or (io.want_capture_mouse and any(io.mouse_down)) or self._list_is_open()

    @property
    def takes_text(self) -> bool:
        return self._io().want_text_input

    def close_list(self) -> bool:
        """Close the list of choices that is open; returns whether there was one."""
        self._use_context()
        if not self._list_is_open():
            return False
        self._imgui.internal.close_popup_to_level(0, True)
        self._touched = True
        return True

    def is_lively(self, now_s: float) -> bool:
        """Whether the panels may soon look different without any event."""
        if self._touched:
            self._touched = False
            self._lively_until_s = now_s + LIVELY_S
            self._frames_due = LIVELY_FRAMES
        return now_s < self._lively_until_s or self._frames_due > 0

    def draw(self, build: Callable[[Widgets], None], target: moderngl.Framebuffer, size: Size, now_s: float) -> None:
        """Build the controls by `build`, and draw them over the picture in the target.

        If `build` raises an error, nothing is drawn, and the next frame begins afresh.
        """
        io = self._io(touch=False)
        io.display_size = size
        io.delta_time = min(max(now_s - self._drawn_s, 1e-4), 0.5)
        self._drawn_s = now_s
        self._frames_due -= 1
        self._imgui.new_frame()
        self.widgets.begin_frame()
        began = self._imgui.internal.ErrorRecoveryState()
        self._imgui.internal.error_recovery_store_state(began)
        try:
            build(self.widgets)
        except BaseException:
            self._imgui.internal.error_recovery_try_to_recover_state(began)  # close the windows that are open
            self._imgui.end_frame()
            raise
        self._imgui.render()
        self._draw.draw(target, size, self._imgui.get_draw_data())

    def _list_is_open(self) -> bool:
        return self._imgui.is_popup_open("", self._imgui.PopupFlags_.any_popup)

    def _use_context(self) -> None:
        self._imgui.set_current_context(self._context)

    def _io(self, touch: bool = True) -> Any:
        self._use_context()
        self._touched |= touch
        return self._imgui.get_io()
