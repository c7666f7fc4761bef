"""The controls of the panels. Each has a line of help."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from .legend import Legend

Rgba = tuple[float, ...]
Pair = tuple[float, float]
Box = tuple[float, float, float, float]
PATH = "a path, then Enter"  # shown in an empty field for a file


class Widgets:
    """Builds the controls of one frame with Dear ImGui; `imgui` is its module, `press` executes a key's command."""

    def __init__(self, imgui: Any, press: Callable[[str], None]) -> None:
        self.imgui = imgui
        self.press = press
        self.scale = 1.0  # pixels per unit of length
        self._texts: dict[str, str] = {}  # texts that the user is typing, by label
        self.begin_frame()

    def begin_frame(self) -> None:
        """Forget the controls of the last frame."""
        self.hints: dict[str, str] = {}  # the line of help of each control, by label
        self.places: dict[str, Box] = {}  # left, top, right and bottom of each control in pixels
        self.covered: list[Box] = []  # the same of each window
        self.hovered_hint = ""  # the line of help of the control under the cursor

    @property
    def em(self) -> float:
        """Height of the typeface in pixels."""
        return self.imgui.get_font_size()

    def at(self, x: float, y: float) -> str:
        """Label of the control at a pixel; "" if there is none."""
        inside = (name for name, (x0, y0, x1, y1) in self.places.items() if x0 <= x <= x1 and y0 <= y <= y1)
        return next(inside, "")

    @contextlib.contextmanager
    def window(
        self, name: str, place: Pair, pivot: Pair, close_key: str = "", takes_mouse: bool = True
    ) -> Iterator[None]:
        """Build a window that sizes itself. Its point `pivot`, from 0 to 1, is put at the pixel `place`.

        Its close button executes the command of `close_key`; without a key, the window has no title. If not
        `takes_mouse`, clicks on the window reach the land behind it.
        """
        imgui = self.imgui
        flags = imgui.WindowFlags_
        width, height = imgui.get_io().display_size
        above, below = place[1] / max(pivot[1], 1e-6), (height - place[1]) / max(1 - pivot[1], 1e-6)
        most = min(0.92 * height, 0.98 * above, 0.98 * below)  # the window ends inside the picture, and scrolls
        imgui.set_next_window_pos(place, imgui.Cond_.always, pivot)
        imgui.set_next_window_size_constraints((0, 0), (0.96 * width, most))
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize | flags.no_collapse | flags.no_nav
        if not close_key:  # a window without it opens by itself, and must not take the focus from a slider
            fixed |= flags.no_title_bar | flags.no_focus_on_appearing
        if not takes_mouse:
            fixed |= flags.no_inputs
        _, stays_open = imgui.begin(name, True if close_key else None, fixed)
        if takes_mouse:
            self.note_window()
        yield
        imgui.end()
        if close_key and not stays_open:
            self.press(close_key)

    def note_window(self) -> None:
        x, y = self.imgui.get_window_pos()
        width, height = self.imgui.get_window_size()
        self.covered.append((x, y, x + width, y + height))

    @contextlib.contextmanager
    def wrapped(self, width: float = 0.0) -> Iterator[None]:
        """Wrap text at `width` pixels; 0 for the width of the window."""
        self.imgui.push_text_wrap_pos(width)
        yield
        self.imgui.pop_text_wrap_pos()

    def colour(self, rgba: Rgba) -> int:
        """A colour as Dear ImGui's lists of shapes need it."""
        return int(self.imgui.color_convert_float4_to_u32(rgba))

    def line(self, name: str, value: str) -> None:
        """A line of text: a name, and its value in a second column."""
        self.imgui.text_disabled(name)
        self.imgui.same_line(4.5 * self.em)
        self.imgui.text(value)

    def hint(self, label: str, text: str) -> None:
        """Give the last control a line of help: below the panel at once, and beside the control after a moment."""
        self.hints[label] = text
        self.places[label] = (*self.imgui.get_item_rect_min(), *self.imgui.get_item_rect_max())
        if self.imgui.is_item_hovered(self.imgui.HoveredFlags_.allow_when_disabled):
            self.hovered_hint = text
        if self.imgui.is_item_hovered(self.imgui.HoveredFlags_.for_tooltip):
            self._tooltip(text)

    def _tooltip(self, text: str) -> None:
        """Show a text beside the window of the last control, where it covers no other control."""
        imgui = self.imgui
        right = imgui.get_window_pos()[0] + imgui.get_window_size()[0]
        width, _ = imgui.get_io().display_size
        if right + 12 * self.em < width:
            imgui.set_next_window_pos((right + 0.5 * self.em, imgui.get_item_rect_min()[1]))
        imgui.begin_tooltip()
        with self.wrapped(min(28 * self.em, max(width - right - 2 * self.em, 12 * self.em))):
            imgui.text(text)
        imgui.end_tooltip()

    def choose(self, label: str, value: str, choices: Sequence[str], hint: str) -> str:
        """A list of choices; returns the present choice."""
        _, index = self.imgui.combo(label, choices.index(value), list(choices))
        self.hint(label, hint)
        return choices[index]

    def slide(self, label: str, value: float, ends: Pair, hint: str, form: str = "%.2f", log: bool = False) -> float:
        """A slider from `ends[0]` to `ends[1]`; returns the present number."""
        flags = self.imgui.SliderFlags_
        bounded = flags.always_clamp | (flags.logarithmic if log else flags.none)
        changed, new = self.imgui.slider_float(label, value, *ends, form, bounded)
        self.hint(label, hint + "  (Ctrl click to type a number.)")
        return new if changed else value  # `new` is rounded to float32

    def enter(self, label: str, value: str, empty: str, hint: str) -> str | None:
        """A field for a line of text; without text it shows `empty`. Returns the text when Enter is pressed."""
        imgui = self.imgui
        typed = self._texts.get(label, value)
        entered, typed = imgui.input_text_with_hint(label, empty, typed, imgui.InputTextFlags_.enter_returns_true)
        if imgui.is_item_active():
            self._texts[label] = typed
        else:
            self._texts.pop(label, None)
        self.hint(label, hint)
        return typed if entered else None

    def tick(self, label: str, value: bool, hint: str, key: str = "") -> bool:
        """A check box; returns whether it was changed. A change executes the command of `key`."""
        changed, _ = self.imgui.checkbox(label, value)
        return self._touched(changed, label, hint, key)

    def button(self, label: str, hint: str, key: str = "", enabled: bool = True) -> bool:
        """A button; returns whether it was pressed. A press executes the command of `key`."""
        self.imgui.begin_disabled(not enabled)
        pressed = self.imgui.button(label)
        self.imgui.end_disabled()
        return self._touched(pressed, label, hint, key)

    def _touched(self, touched: bool, label: str, hint: str, key: str) -> bool:
        self.hint(label, hint)
        if touched and key:
            self.press(key)
        return touched

    def legend(self, shown: Legend) -> None:
        """A ramp of colours, and its meaning."""
        imgui = self.imgui
        width = imgui.get_content_region_avail()[0]
        left, top = imgui.get_cursor_screen_pos()
        step = width / (len(shown.ramp) - 1)
        bottom = top + 0.6 * self.em
        colours = [self.colour((*colour, 1.0)) for colour in shown.ramp]
        for i, (a, b) in enumerate(zip(colours, colours[1:], strict=False)):
            corners = (left + i * step, top), (left + (i + 1) * step, bottom)
            imgui.get_window_draw_list().add_rect_filled_multi_color(*corners, a, b, b, a)
        imgui.dummy((width, 0.6 * self.em))
        imgui.push_text_wrap_pos(-1.0)  # words at fixed places do not wrap
        imgui.text(shown.least)
        for words, place in ((shown.middle, 0.5), (shown.most, 1.0)):
            imgui.same_line(left - imgui.get_window_pos()[0] + place * (width - imgui.calc_text_size(words)[0]))
            imgui.text(words)
        imgui.pop_text_wrap_pos()
        imgui.text_disabled(shown.note)
