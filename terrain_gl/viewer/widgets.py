"""The controls of the panels. Each has a line of help."""

import contextlib
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from .legend import Legend
from .window_state import Size

Box = tuple[float, float, float, float]
PATH = "a path, then Enter"  # shown in an empty field for a file


class Widgets:
    """Builds the controls of one frame with Dear ImGui; `imgui` is its module.

    Attributes
    ----------
    scale
        Pixels per unit of length.
    hints, places
        For each control of the last frame, by label: its line of help; its left, top, right and bottom in pixels.
    covered
        Left, top, right and bottom of each window of the last frame.
    hovered_hint
        The line of help of the control under the cursor.
    """

    def __init__(self, imgui: Any) -> None:
        self.imgui = imgui
        self.scale = 1.0
        self.hints: dict[str, str] = {}
        self.places: dict[str, Box] = {}
        self.covered: list[Box] = []
        self.hovered_hint = ""
        self._texts: dict[str, str] = {}  # texts that the user is typing, by label

    def begin_frame(self) -> None:
        """Forget the controls of the last frame."""
        self.hints = {}
        self.places = {}
        self.covered = []
        self.hovered_hint = ""

    @property
    def em(self) -> float:
        """Height of the typeface in pixels."""
        return self.imgui.get_font_size()

    def at(self, x: float, y: float) -> str:
        """Label of the control at a pixel; "" if there is none."""
        inside = (name for name, (x0, y0, x1, y1) in self.places.items() if x0 <= x <= x1 and y0 <= y <= y1)
        return next(inside, "")

    # --- Windows ------------------------------------------------------------------------------------------------------

    @contextlib.contextmanager
    def window(
        self,
        name: str,
        anchor: tuple[float, float],
        size: Size,
        on_close: Callable[[], None] | None = None,
        pivot: tuple[float, float] | None = None,
        takes_mouse: bool = True,
    ) -> Iterator[None]:
        """Build a window that sizes itself.

        Parameters
        ----------
        anchor
            The window's place in the picture of `size`, from 0 to 1.
        on_close
            Called by its close button. Without it, the window has no title.
        pivot
            The point of the window that is put at the anchor, from 0 to 1; by default as `anchor`.
        takes_mouse
            Whether the window takes clicks on it. If not, they reach the land behind it.
        """
        imgui = self.imgui
        flags = self.imgui.WindowFlags_
        pivot = pivot or anchor
        imgui.set_next_window_pos((anchor[0] * size[0], anchor[1] * size[1]), imgui.Cond_.always, pivot)
        above, below = anchor[1] / max(pivot[1], 1e-6), (1 - anchor[1]) / max(1 - pivot[1], 1e-6)
        most = min(0.92, 0.98 * above, 0.98 * below)  # of the height: the window ends inside the picture, and scrolls
        imgui.set_next_window_size_constraints((0, 0), (0.96 * size[0], most * size[1]))
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize | flags.no_collapse | flags.no_nav
        if on_close is None:  # such a window opens by itself, and must not take the focus from a dragged slider
            fixed |= flags.no_title_bar | flags.no_focus_on_appearing
        if not takes_mouse:
            fixed |= flags.no_inputs
        _, stays_open = imgui.begin(name, True if on_close else None, fixed)
        if takes_mouse:
            self.note_window()
        yield
        imgui.end()
        if on_close and not stays_open:
            on_close()

    def note_window(self) -> None:
        """Note the place of the window that is being built."""
        x, y = self.imgui.get_window_pos()
        width, height = self.imgui.get_window_size()
        self.covered.append((x, y, x + width, y + height))

    @contextlib.contextmanager
    def wrapped(self, width: float = 0.0) -> Iterator[None]:
        """Wrap text at `width` pixels; 0 for the width of the window."""
        self.imgui.push_text_wrap_pos(width)
        yield
        self.imgui.pop_text_wrap_pos()

    # --- Controls -----------------------------------------------------------------------------------------------------

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

    def choose(self, label: str, value: str, choices: Sequence[str], hint: str) -> str | None:
        """A list of choices; returns the new choice, or None."""
        changed, index = self.imgui.combo(label, choices.index(value), list(choices))
        self.hint(label, hint)
        return choices[index] if changed else None

    def slide(
        self,
        label: str,
        value: float,
        least: float,
        most: float,
        hint: str,
        form: str = "%.2f",
        logarithmic: bool = False,
    ) -> float | None:
        """A slider; returns the new number while it is being changed."""
        flags = self.imgui.SliderFlags_.logarithmic if logarithmic else self.imgui.SliderFlags_.none
        flags |= self.imgui.SliderFlags_.always_clamp
        changed, new = self.imgui.slider_float(label, value, least, most, form, flags)
        self.hint(label, hint + "  (Ctrl click to type a number.)")
        return new if changed else None

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

    def tick(self, label: str, value: bool, hint: str) -> bool:
        """A check box; returns whether it was changed."""
        changed, _ = self.imgui.checkbox(label, value)
        self.hint(label, hint)
        return changed

    def button(self, label: str, hint: str, enabled: bool = True) -> bool:
        """A button; returns whether it was pressed."""
        self.imgui.begin_disabled(not enabled)
        pressed = self.imgui.button(label)
        self.imgui.end_disabled()
        self.hint(label, hint)
        return pressed

    def legend(self, shown: Legend) -> None:
        """A ramp of colours, and its meaning."""
        imgui = self.imgui
        width = self.imgui.get_content_region_avail()[0]
        left, top = imgui.get_cursor_screen_pos()
        step = width / (len(shown.ramp) - 1)
        bottom = top + 0.6 * self.em
        colours = [imgui.color_convert_float4_to_u32((*colour, 1.0)) for colour in shown.ramp]
        for i, (a, b) in enumerate(zip(colours, colours[1:], strict=False)):
            corners = (left + i * step, top), (left + (i + 1) * step, bottom)
            imgui.get_window_draw_list().add_rect_filled_multi_color(*corners, a, b, b, a)
        imgui.dummy((width, 0.6 * self.em))
        imgui.push_text_wrap_pos(-1.0)  # words at fixed places do not wrap
        imgui.text(shown.least)
        if shown.middle:
            imgui.same_line(left - imgui.get_window_pos()[0] + (width - imgui.calc_text_size(shown.middle)[0]) / 2)
            imgui.text(shown.middle)
        imgui.same_line(left - imgui.get_window_pos()[0] + width - imgui.calc_text_size(shown.most)[0])
        imgui.text(shown.most)
        imgui.pop_text_wrap_pos()
        imgui.text_disabled(shown.note)
