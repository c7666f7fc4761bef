"""The panels of the window, with Dear ImGui (the extra `[gui]`); what they show and change is the flight's.

Without the extra there is `hud.py`, text alone.
"""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import moderngl

from ..explain import Explanation
from . import charts, help_page, lesson, sections
from .gui_draw import GuiDraw
from .legend import Legend

if TYPE_CHECKING:
    from .flight import Flight

PANEL_EM = 22.0  # width of the panel, in heights of the typeface
FONT_PX = 15.0
LIVELY_S = 0.8  # after an event, for buttons to come up and hints to appear
LIVELY_FRAMES = 8  # as many at least: quick events are taken one a frame
_BUTTONS = {"left": 0, "right": 1, "middle": 2}
_KEYS = {
    "tab": "tab",
    "left": "left_arrow",
    "right": "right_arrow",
    "up": "up_arrow",
    "down": "down_arrow",
    "home": "home",
    "end": "end",
    "backspace": "backspace",
    "delete": "delete",
    "enter": "enter",
    "escape": "escape",
    "ctrl": "mod_ctrl",
    "shift": "mod_shift",
    **{letter: letter for letter in "acvxyz"},
}
_COLOURS = {
    "text": (0.93, 0.94, 0.95, 1.0),
    "text_disabled": (0.62, 0.66, 0.70, 1.0),
    "window_bg": (0.04, 0.055, 0.08, 0.86),
    "popup_bg": (0.05, 0.065, 0.09, 0.96),
    "border": (1.0, 1.0, 1.0, 0.14),
    "frame_bg": (1.0, 1.0, 1.0, 0.09),
    "frame_bg_hovered": (1.0, 1.0, 1.0, 0.13),
    "frame_bg_active": (1.0, 1.0, 1.0, 0.18),
    "title_bg": (0.04, 0.055, 0.08, 0.90),
    "title_bg_active": (0.04, 0.055, 0.08, 0.90),
    "title_bg_collapsed": (0.04, 0.055, 0.08, 0.80),
    "check_mark": (1.0, 0.80, 0.47, 1.0),
    "slider_grab": (1.0, 0.80, 0.47, 0.62),
    "slider_grab_active": (1.0, 0.80, 0.47, 0.75),
    "button": (1.0, 1.0, 1.0, 0.08),
    "button_hovered": (1.0, 0.80, 0.47, 0.30),
    "button_active": (1.0, 0.80, 0.47, 0.50),
    "header": (1.0, 1.0, 1.0, 0.06),
    "header_hovered": (1.0, 0.80, 0.47, 0.20),
    "header_active": (1.0, 0.80, 0.47, 0.30),
    "tab": (1.0, 1.0, 1.0, 0.06),
    "tab_hovered": (1.0, 0.80, 0.47, 0.30),
    "tab_selected": (1.0, 0.80, 0.47, 0.20),
    "tab_selected_overline": (1.0, 0.80, 0.47, 0.60),
    "separator": (1.0, 1.0, 1.0, 0.12),
    "plot_histogram": (1.0, 0.80, 0.47, 0.80),
    "scrollbar_bg": (0.0, 0.0, 0.0, 0.0),
    "scrollbar_grab": (1.0, 1.0, 1.0, 0.15),
}


def library() -> Any:
    """Dear ImGui's module, or None where the extra is not installed."""
    try:
        import glfw  # noqa: F401  imgui_bundle brings a GLFW of its own, which must not take this one's place
        from imgui_bundle import imgui
    except ImportError:
        return None
    return imgui


_RECORDING = (1.0, 0.45, 0.40, 1.0)


class Gui:
    """Panels over a picture.

    Parameters
    ----------
    ctx
        The context that they are drawn in.
    scale
        Pixels per unit of length, by which everything grows on fine screens.

    Attributes
    ----------
    hints, places
        Of the controls of the last frame, by label: a line of help; left, top, right and bottom.
    opened
        Sections of the panel, and whether they are open.
    """

    def __init__(self, ctx: moderngl.Context, scale: float = 1.0) -> None:
        self.imgui = library()
        assert self.imgui, "pip install 'terrain-gl[gui]'"
        self._context = self.imgui.create_context()
        self._current()  # another one may have been before
        io = self.imgui.get_io()
        io.set_ini_filename(None)
        _load_typeface(self.imgui)
        self._draw = GuiDraw(ctx, self.imgui)
        self._covered: list[tuple[float, float, float, float]] = []
        self._drawn_s = 0.0
        self._lively_until_s = 0.0
        self._touched = True
        self._frames_due = 0
        self._hint = ""
        self._foot = 0.0  # height of what stands under the sections
        self._texts: dict[str, str] = {}  # being typed, by field
        self.hints: dict[str, str] = {}
        self.places: dict[str, tuple[float, float, float, float]] = {}
        self.opened = {title: opened for title, opened, _ in sections.SECTIONS}
        self.scale = scale

    @property
    def scale(self) -> float:
        """Pixels per unit of length."""
        return self._scale

    @scale.setter
    def scale(self, scale: float) -> None:
        self._scale = scale
        style = self._style()
        style.font_size_base = FONT_PX
        style.font_scale_dpi = scale

    def release(self) -> None:
        """Give the GPU's memory back."""
        self._current()
        self._draw.release()
        self.imgui.get_platform_io().textures  # noqa: B018  ImGui wants to be asked once more before it goes
        self.imgui.destroy_context(self._context)

    # --- Events, in pixels of the picture -----------------------------------------------------------------------------

    def move(self, x: float, y: float) -> None:
        """The cursor is here."""
        self._io().add_mouse_pos_event(x, y)

    def button(self, name: str, down: bool) -> None:
        """A mouse button went down or up."""
        self._io().add_mouse_button_event(_BUTTONS[name], down)

    def wheel(self, dx: float, dy: float) -> None:
        """The wheel was turned."""
        self._io().add_mouse_wheel_event(dx, dy)

    def key(self, name: str, down: bool) -> None:
        """A key went down or up."""
        if name in _KEYS:
            self._io().add_key_event(getattr(self.imgui.Key, _KEYS[name]), down)

    def write(self, character: int) -> None:
        """A character was typed."""
        self._io().add_input_character(character)

    def covers(self, x: float, y: float) -> bool:
        """Whether a panel lies there, or has hold of the mouse."""
        io = self._io()
        inside = any(x0 <= x <= x1 and y0 <= y <= y1 for x0, y0, x1, y1 in self._covered)
        return inside or (io.want_capture_mouse and any(io.mouse_down)) or self._popup_is_open()

    @property
    def writes(self) -> bool:
        """Whether what is typed goes into a field."""
        return self._io().want_text_input

    # --- Frames -------------------------------------------------------------------------------------------------------

    def lively(self, now_s: float) -> bool:
        """Whether the panels may look different soon without any event."""
        if self._touched:
            self._touched, self._lively_until_s, self._frames_due = False, now_s + LIVELY_S, LIVELY_FRAMES
        return now_s < self._lively_until_s or self._frames_due > 0

    def draw(self, flight: Flight, target: moderngl.Framebuffer, size: tuple[int, int], now_s: float) -> None:
        """Lay the panels out, let them act on the flight, and draw them over what is in the target."""
        io = self._io(touch=False)
        io.display_size = size
        io.delta_time = min(max(now_s - self._drawn_s, 1e-4), 0.5)
        self._drawn_s = now_s
        self._frames_due -= 1
        self.imgui.new_frame()
        self._covered, self.hints, self.places = [], {}, {}
        self._build(flight, size)
        self.imgui.render()
        self._draw.draw(target, size, self.imgui.get_draw_data())

    def _build(self, flight: Flight, size: tuple[int, int]) -> None:
        if flight.has_map and flight.settings.figures:
            self._panel(flight, size)
        beside = self._free_middle(flight, size)
        if flight.settings.keys:
            page = beside if size[0] > (PANEL_EM + help_page.WIDTH_EM) * self.em else 0.5
            self.imgui.set_next_window_bg_alpha(0.98)  # it may lie over the panel
            with self._window("Help", (page, 0.5), size, flight.turn_help, (0.5, 0.5)):
                help_page.show(self)
        self._explanations(flight, size)
        if flight.progress:
            with self._window("##progress", (beside, 0.93), size):
                self._progress(flight, *flight.progress)
        if flight.sculpting.save_as is not None:
            with self._window("Save the land##save", (0.5, 0.4), size, closed=lambda: flight.press("escape")):
                self._ask_path(flight)
        if flight.keeping.filming.running:
            with self._window("##recording", (0.99, 0.985), size):
                self.imgui.text_colored(_RECORDING, "recording")
                self.imgui.same_line()
                self.imgui.text("R stops")
        if flight.message:
            with self._window("##message", (beside, 0.985), size):
                self.imgui.push_text_wrap_pos(0.9 * size[0])
                self.imgui.text(flight.message)
                self.imgui.pop_text_wrap_pos()

    def _free_middle(self, flight: Flight, size: tuple[int, int]) -> float:
        """The middle of what the panel leaves free, 0 to 1 from left to right."""
        panel = self._panel_width(size) if flight.has_map and flight.settings.figures else 0.0
        return 0.5 + 0.5 * panel / size[0]

    def _panel_width(self, size: tuple[int, int]) -> float:
        return min(PANEL_EM * self.imgui.get_font_size(), 0.45 * size[0])

    def _panel(self, flight: Flight, size: tuple[int, int]) -> None:
        imgui = self.imgui
        margin = 10 * self.scale
        width = self._panel_width(size)
        imgui.set_next_window_pos((margin, margin))
        imgui.set_next_window_size_constraints((width, 0), (width, size[1] - 2 * margin))
        flags = imgui.WindowFlags_
        name = f"{flight.figures.name}   {flight.figures.posts[0]} × {flight.figures.posts[1]} posts###panel"
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize | flags.no_saved_settings | flags.no_nav
        expanded, _ = imgui.begin(name, None, fixed)
        self._note_window()
        if expanded:
            self._hint = ""
            top = imgui.get_cursor_pos_y()
            most = size[1] - 2 * margin - top - max(self._foot, 4 * self.em)
            imgui.set_next_window_size_constraints((0, 0), (width, max(most, 4 * self.em)))
            imgui.begin_child("body", (0, 0), imgui.ChildFlags_.auto_resize_y)  # scrolls; the foot stays
            imgui.push_item_width(0.56 * width)
            charts.show(self, flight)
            for title, _, show in sections.SECTIONS:
                if self._section(title):
                    show(self, flight)
            imgui.pop_item_width()
            imgui.end_child()
            foot = imgui.get_cursor_pos_y()
            imgui.separator()
            if self.press_button("All keys", "Every key and what it does (H)."):
                flight.press("h")
            imgui.same_line()
            if self.press_button("Hide", "Put this panel away (I); the same key brings it back."):
                flight.press("i")
            imgui.push_text_wrap_pos(0.0)
            imgui.text_disabled(self._hint or "Point at anything to read here what it does.")
            imgui.pop_text_wrap_pos()
            self._foot = imgui.get_cursor_pos_y() - foot + imgui.get_style().window_padding[1]
        imgui.end()

    def _explanations(self, flight: Flight, size: tuple[int, int]) -> None:
        """What stands at the right: the sides' figures, the patch that was clicked, the summed-area table's numbers."""
        if flight.settings.split:
            for side, stats in enumerate(flight.painter.side_stats[:2]):
                begin, end = flight.wanted().part(side)
                place = (end - 0.01, 0.02) if side == 0 else (begin + 0.01, 0.02)
                with self._window(f"##side {side}", place, size, pivot=(1.0 - side, 0.0)):
                    left = self._panel_width(size) + 3 * self.em if side == 0 and flight.settings.figures else 0.0
                    self.imgui.push_text_wrap_pos(max(0.94 * ((end - begin) * size[0] - left), 8 * self.em))
                    coarse = f"; {flight.figures.shrunk} × coarser in motion" if flight.figures.shrunk > 1 else ""
                    self.imgui.text(lesson.side_line(flight.settings.sides[side], stats) + coarse)
                    self.imgui.pop_text_wrap_pos()
        if flight.settings.sums and flight.has_map:
            _, bottom, _, height = flight.insight.sums_frame
            top = (size[1] - bottom + 6 * self.scale) / size[1]
            with self._window("##sums", (1.0 - 10 * self.scale / size[0], top), size, pivot=(1.0, 0.0)):
                self.imgui.text("S(x, y): the sum of all heights north and west of (x, y)")
                for line in flight.insight.box.words() if flight.insight.box else ["Point at the land for a box."]:
                    self.imgui.text_disabled(line)
        if flight.insight.explanation:
            with self._window("##patch", (0.99, 0.92), size, pivot=(1.0, 1.0)):
                self._patch(flight.insight.explanation)

    def _patch(self, told: Explanation) -> None:
        """Why a patch is drawn as it is."""
        imgui = self.imgui
        accent = imgui.get_style_color_vec4(imgui.Col_.check_mark)
        imgui.text_colored(accent, lesson.title(told))
        if imgui.begin_table("choices", len(lesson.HEADINGS), imgui.TableFlags_.sizing_fixed_fit):
            for heading in lesson.HEADINGS:
                imgui.table_next_column()
                imgui.text_disabled(heading)
            for row in lesson.rows(told):
                for cell in row:
                    imgui.table_next_column()
                    if row[-1] == "drawn":
                        imgui.text_colored(accent, cell)
                    else:
                        imgui.text(cell)
            imgui.end_table()
        imgui.push_text_wrap_pos(26 * self.em)
        for sentence in lesson.reasons(told):
            imgui.text(sentence)
        imgui.text_disabled("A click elsewhere explains another patch; Esc puts this away.")
        imgui.pop_text_wrap_pos()

    def _ask_path(self, flight: Flight) -> None:
        """A path to save to, by text."""
        assert flight.sculpting.save_as is not None
        self.imgui.text_disabled("name.png: 16-bit steps   name.tif, name.exr: metres as they are")
        self.imgui.set_next_item_width(26 * self.em)
        if self.imgui.is_window_appearing():
            self.imgui.set_keyboard_focus_here()
        flags = self.imgui.InputTextFlags_.enter_returns_true
        entered, path = self.imgui.input_text("##path", flight.sculpting.save_as, flags)
        flight.sculpting.save_as = path
        self.hint("path", "Where to write; the ending says in which format.")
        if self.press_button("Save", "Write the land as it is now (Enter).") or entered:
            flight.sculpting.save(path)

    def _progress(self, flight: Flight, text: str, share: float, can_cancel: bool) -> None:
        self.imgui.text(text)
        self.imgui.progress_bar(share, (20 * self.em, 0.5 * self.em), "")
        if can_cancel and self.press_button("Cancel", "Leave everything as it is (Esc)."):
            flight.press("escape")

    @contextlib.contextmanager
    def _window(
        self,
        name: str,
        anchor: tuple[float, float],
        size: tuple[int, int],
        closed: Callable[[], None] | None = None,
        pivot: tuple[float, float] | None = None,
    ) -> Iterator[None]:
        """A window that sizes itself, at a place of the picture."""
        imgui, flags = self.imgui, self.imgui.WindowFlags_
        imgui.set_next_window_pos((anchor[0] * size[0], anchor[1] * size[1]), imgui.Cond_.always, pivot or anchor)
        imgui.set_next_window_size_constraints((0, 0), (0.96 * size[0], 0.92 * size[1]))
        plain = flags.no_move | flags.no_resize | flags.always_auto_resize | flags.no_collapse | flags.no_nav
        if closed is None:
            plain |= flags.no_title_bar
        _, stays = imgui.begin(name, True if closed else None, plain)
        self._note_window()
        yield
        imgui.end()
        if closed and not stays:
            closed()

    def _section(self, title: str) -> bool:
        self.imgui.set_next_item_open(self.opened[title])
        self.opened[title] = self.imgui.collapsing_header(title)
        return self.opened[title]

    def _note_window(self) -> None:
        x, y = self.imgui.get_window_pos()
        width, height = self.imgui.get_window_size()
        self._covered.append((x, y, x + width, y + height))

    def close_list(self) -> bool:
        """Close the list that hangs down from a control; whether one did."""
        self._current()
        if not self._popup_is_open():
            return False
        self.imgui.internal.close_popup_to_level(0, True)
        self._touched = True
        return True

    def _popup_is_open(self) -> bool:
        return self.imgui.is_popup_open("", self.imgui.PopupFlags_.any_popup)

    def _current(self) -> None:
        self.imgui.set_current_context(self._context)

    def _io(self, touch: bool = True) -> Any:
        self._current()
        self._touched |= touch
        return self.imgui.get_io()

    def _style(self) -> Any:
        """The look, at the present scale."""
        self._current()
        style = self.imgui.get_style()
        fresh = self.imgui.Style()
        for name, units in (("frame_rounding", 4), ("grab_rounding", 4), ("popup_rounding", 6), ("window_rounding", 8)):
            setattr(style, name, units * self._scale)
        for name in ("window_padding", "frame_padding", "item_spacing", "item_inner_spacing", "cell_padding"):
            x, y = getattr(fresh, name)
            setattr(style, name, (x * self._scale, y * self._scale))
        style.indent_spacing, style.scrollbar_size = 12 * self._scale, 10 * self._scale
        style.grab_min_size = 10 * self._scale
        style.window_border_size = style.popup_border_size = style.frame_border_size = 1.0
        for name, colour in _COLOURS.items():
            style.set_color_(getattr(self.imgui.Col_, name), colour)
        return style

    # --- Controls: each with a line of help ---------------------------------------------------------------------------

    @property
    def em(self) -> float:
        """Height of the typeface in pixels."""
        return self.imgui.get_font_size()

    def hint(self, label: str, text: str) -> None:
        """What the control before is for: at the panel's foot at once, and beside it after a moment."""
        self.hints[label] = text
        self.places[label] = (*self.imgui.get_item_rect_min(), *self.imgui.get_item_rect_max())
        if self.imgui.is_item_hovered(self.imgui.HoveredFlags_.allow_when_disabled):
            self._hint = text
        self.imgui.set_item_tooltip(text.replace("%", "%%"))

    def choose(self, label: str, value: str, choices: Sequence[str], text: str) -> str | None:
        """One of several; what was chosen, if anything."""
        changed, index = self.imgui.combo(label, choices.index(value), list(choices))
        self.hint(label, text)
        return choices[index] if changed else None

    def slide(
        self,
        label: str,
        value: float,
        least: float,
        most: float,
        text: str,
        form: str = "%.2f",
        logarithmic: bool = False,
    ) -> float | None:
        """A number; the new one while it is being changed."""
        flags = self.imgui.SliderFlags_.logarithmic if logarithmic else self.imgui.SliderFlags_.none
        flags |= self.imgui.SliderFlags_.always_clamp
        changed, new = self.imgui.slider_float(label, value, least, most, form, flags)
        self.hint(label, text + "  (Ctrl click to type a number.)")
        return new if changed else None

    def enter(self, label: str, value: str, text: str) -> str | None:
        """A line of text; what was typed when Enter is pressed."""
        imgui = self.imgui
        flags = imgui.InputTextFlags_.enter_returns_true
        typed = self._texts.get(label, value)
        entered, typed = imgui.input_text_with_hint(label, "a path, then Enter", typed, flags)
        if imgui.is_item_active():
            self._texts[label] = typed
        else:
            self._texts.pop(label, None)
        self.hint(label, text)
        return typed if entered else None

    def at(self, x: float, y: float) -> str:
        """Label of the control there."""
        inside = (name for name, (x0, y0, x1, y1) in self.places.items() if x0 <= x <= x1 and y0 <= y <= y1)
        return next(inside, "")

    def show_legend(self, shown: Legend) -> None:
        """A ramp of colours, and what it means."""
        imgui, width = self.imgui, self.imgui.get_content_region_avail()[0]
        left, top = imgui.get_cursor_screen_pos()
        step, bottom = width / (len(shown.ramp) - 1), top + 0.6 * self.em
        colours = [imgui.color_convert_float4_to_u32((*colour, 1.0)) for colour in shown.ramp]
        for i, (a, b) in enumerate(zip(colours, colours[1:], strict=False)):
            corners = (left + i * step, top), (left + (i + 1) * step, bottom)
            imgui.get_window_draw_list().add_rect_filled_multi_color(*corners, a, b, b, a)
        imgui.dummy((width, 0.6 * self.em))
        imgui.text(shown.least)
        imgui.same_line(left - imgui.get_window_pos()[0] + width - imgui.calc_text_size(shown.most)[0])
        imgui.text(shown.most)
        imgui.text_disabled(shown.beside)

    def tick(self, label: str, value: bool, text: str) -> bool:
        """On or off; whether it was changed."""
        changed, _ = self.imgui.checkbox(label, value)
        self.hint(label, text)
        return changed

    def press_button(self, label: str, text: str, enabled: bool = True) -> bool:
        """Whether it was pressed."""
        self.imgui.begin_disabled(not enabled)
        pressed = self.imgui.button(label)
        self.imgui.end_disabled()
        self.hint(label, text)
        return pressed


def _load_typeface(imgui: Any) -> None:
    """Roboto, which imgui_bundle brings along; else ImGui's own."""
    import imgui_bundle

    path = Path(imgui_bundle.__file__).parent / "assets" / "fonts" / "Roboto" / "Roboto-Regular.ttf"
    fonts = imgui.get_io().fonts
    if path.exists():
        fonts.add_font_from_file_ttf(str(path), FONT_PX)
    else:
        fonts.add_font_default()
