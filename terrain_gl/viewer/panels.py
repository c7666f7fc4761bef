"""All panels over the picture: controls at the left, help, explanations, progress and messages."""

from __future__ import annotations

from collections.abc import Callable

from ..verify.explain import Explanation
from . import (
    charts,
    error_box,
    explain_text,
    file_list,
    help_page,
    map_section,
    orientation,
    picture_section,
    profile_plot,
    sections,
)
from .legend import COLOURS, legend
from .theme import ACCENT, FONT_PX, INK_OF_NAMES, PAPER_OF_NAMES, WARNING
from .viewer import Progress, Viewer
from .widgets import Widgets
from .window_state import Size

PANEL_EM = 22.0  # width of the panel, in heights of the typeface
LEGEND_EM = 18.0  # width of the legend that is shown without the panel
_LINE_EM = 40.0  # least length of a lecture's lines, in heights of the typeface
FULL_HD = 1080  # in windows with more rows of pixels than this, type grows with the window
LARGE = 1.5  # size of the type of a lecture, relative to that of the panels; less in a narrow window
LOW_EM = 36.0  # where there is less room than this many heights of the typeface, explanations are short
NARROW_EM = 11.0  # a side of a split picture that is narrower has no legend
MARGIN = 10.0  # around the panel, in units of length
_ENDINGS_OF_EDITS = "name.tif: a window of the map   name.npz: for this store alone"
_ABOUT = {
    "Map": "Which map is shown, and its scale.",
    "Detail": "How fine the mesh is.",
    "Understand": "How detail is chosen.",
    "Sculpt": "A brush that changes the land.",
    "Picture": "How the picture looks.",
    "Camera": "Views, and how the camera moves.",
    "Save": "Pictures, films, meshes and paths.",
}
_OPEN = ("Detail", "Understand")  # sections that are open at first


def panel_px(size: Size, scale: float) -> float:
    """Width of the panel in a window of `size`, with `scale` pixels per unit of length."""
    return min(PANEL_EM * FONT_PX * scale, 0.45 * size[0])


def scale_of(size: Size, screen: float, wanted: float) -> float:
    """Pixels per unit of length: the user's choice, and more on a fine screen or in a very large window.

    Type grows only until the panel takes half of the window.
    """
    natural = max(screen, size[1] / FULL_HD, 1.0)
    return min(natural * wanted, max(0.45 * size[0] / (PANEL_EM * FONT_PX), min(1.0, wanted)))


def taken_px(size: Size, scale: float) -> float:
    """Columns of pixels that the panel takes, with its margins."""
    return panel_px(size, scale) + 2 * MARGIN * scale


class Panels:
    """Builds the panels of a viewer.

    Parameters
    ----------
    press
        Executes the command of a key.

    Attributes
    ----------
    opened
        The sections of the panel by title, and whether they are open.
    """

    def __init__(self, viewer: Viewer, press: sections.Press) -> None:
        self._viewer = viewer
        self._settings = viewer.settings
        self._press = press
        self._draft = picture_section.PictureDraft()
        self._foot = 0.0  # height in pixels of the part under the sections
        self._status_px = 0.0  # height of the status window, with its margin
        self._lecture_px = 0.0  # height of the window with a station of a lecture, with its margin
        self._map_px = 0.0  # height of the window with north and scale, with its margin
        self._sections = self._make_sections()
        self.opened = {title: title in _OPEN for title in self._sections}

    def _make_sections(self) -> dict[str, Callable[[Widgets], None]]:
        s = self._viewer
        press = self._press
        return {
            "Map": lambda ui: map_section.map_section(ui, s, press),
            "Detail": lambda ui: sections.detail_section(ui, s.settings, s.painter, s.scene),
            "Understand": lambda ui: sections.understand_section(ui, s.scene, s.sculpting.brushing, press),
            "Sculpt": lambda ui: sections.sculpt_section(ui, s.scene, s.sculpting, press),
            "Picture": lambda ui: picture_section.picture_section(ui, s, self._draft),
            "Camera": lambda ui: sections.camera_section(ui, s.scene, press),
            "Save": lambda ui: sections.save_section(ui, s.saver, s.scene, press),
        }

    def _shows_panel(self, ui: Widgets, size: Size) -> bool:
        """Whether the panel is shown. In a small window, the help page takes its place."""
        has_room = not self._settings.help or size[0] > (PANEL_EM + help_page.WIDTH_EM) * ui.em
        return self._viewer.scene.has_map and self._settings.panel and has_room

    def build(self, ui: Widgets) -> None:
        """Build all panels of this frame."""
        size = self._viewer.window.size
        self._names(ui)
        if self._shows_panel(ui, size):
            self._panel(ui, size)
        middle = self._free_middle(ui, size)
        self._lecture(ui, size)
        self._status(ui, size, middle)
        if self._settings.help:
            above = size[0], round(size[1] - self._status_px)
            with ui.window("Help", (middle, 0.5), above, lambda: self._press("h"), (0.5, 0.5)):
                help_page.show(ui)
        elif self._viewer.files.folder:
            with ui.window("Open a map##open", (middle, 0.5), size, lambda: self._press("escape"), (0.5, 0.5)):
                file_list.show(ui, self._viewer.files, size)
        elif self._viewer.sculpting.save_as is not None:
            with ui.window("Save the map##save", (middle, 0.6), size, on_close=lambda: self._press("escape")):
                self._ask_path(ui)
        elif self._viewer.scene.has_map:
            self._orientation(ui, size)
            self._explanations(ui, size)
            if not self._shows_panel(ui, size):
                self._legend_alone(ui, size)

    def _names(self, ui: Widgets) -> None:
        """The names of points and heights of contours, over the picture and behind all panels."""
        imgui = ui.imgui
        draw = imgui.get_background_draw_list()
        ink, paper = (imgui.color_convert_float4_to_u32(colour) for colour in (INK_OF_NAMES, PAPER_OF_NAMES))
        taken = self._taken(ui, self._viewer.window.size)  # heights of contours would shine through the panel
        for name, x, y, is_centred in self._viewer.painter.labels:
            if is_centred and x < taken:
                continue
            width, height = imgui.calc_text_size(name)
            left, top = (x - width / 2, y - height / 2) if is_centred else (x + 0.4 * ui.em, y + 0.4 * ui.em)
            draw.add_rect_filled((left - 0.2 * ui.em, top), (left + width + 0.2 * ui.em, top + height), paper)
            draw.add_text((left, top), ink, name)

    def status_alone(self, ui: Widgets) -> None:
        """Build only the window with messages, because the others cannot be built."""
        self._status(ui, self._viewer.window.size, 0.5)

    # --- The panel at the left ----------------------------------------------------------------------------------------

    def _taken(self, ui: Widgets, size: Size) -> float:
        """Columns of pixels that the panel takes, with its margins."""
        return taken_px(size, ui.scale) if self._shows_panel(ui, size) else 0.0

    def _free_middle(self, ui: Widgets, size: Size) -> float:
        """The middle of the part that the panel leaves free, from 0 at the left edge to 1."""
        return 0.5 + 0.5 * self._taken(ui, size) / size[0]

    def _panel(self, ui: Widgets, size: Size) -> None:
        imgui = ui.imgui
        flags = ui.imgui.WindowFlags_
        margin = MARGIN * ui.scale
        width = panel_px(size, ui.scale)
        imgui.set_next_window_pos((margin, margin))
        imgui.set_next_window_size_constraints((width, 0), (width, size[1] - 2 * margin))
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize | flags.no_saved_settings | flags.no_nav
        expanded, _ = imgui.begin(f"{self._title()}###panel", None, fixed)
        ui.note_window()
        if expanded:
            most = size[1] - 2 * margin - imgui.get_cursor_pos_y() - max(self._foot, 4 * ui.em)
            imgui.set_next_window_size_constraints((0, 0), (width, max(most, 4 * ui.em)))
            imgui.begin_child("body", (0, 0), imgui.ChildFlags_.auto_resize_y)  # this part scrolls
            imgui.push_item_width(0.56 * width)
            if (viewer := self._viewer).ruler.taken:
                measured = viewer.ruler.profile(viewer.scene.heightmap)
                profile_plot.show(ui, measured)
            charts.show(ui, self._viewer.painter, self._viewer.scene.controller)
            self._show_sections(ui)
            imgui.pop_item_width()
            imgui.end_child()
            top = imgui.get_cursor_pos_y()
            self._show_foot(ui)
            self._foot = imgui.get_cursor_pos_y() - top + imgui.get_style().window_padding[1]
        imgui.end()

    def _title(self) -> str:
        frame = self._viewer.painter.frame
        return f"{frame.name}   " + ("preview" if frame.is_preview else f"{frame.posts[0]} × {frame.posts[1]} posts")

    def _show_sections(self, ui: Widgets) -> None:
        for title, show in self._sections.items():
            ui.imgui.set_next_item_open(self.opened[title])
            self.opened[title] = ui.imgui.collapsing_header(title)
            ui.hint(title, _ABOUT[title])
            if self.opened[title]:
                show(ui)

    def _show_foot(self, ui: Widgets) -> None:
        ui.imgui.separator()
        if ui.button("All keys", "Every key and what it does (H)."):
            self._press("h")
        ui.imgui.same_line()
        if ui.button("Hide", "Hide this panel; the key I shows it again."):
            self._press("i")
        with ui.wrapped():
            ui.imgui.text_disabled(ui.hovered_hint or "Point at a control to read what it does.")

    # --- North and scale, at the lower right --------------------------------------------------------------------------

    def _orientation(self, ui: Widgets, size: Size) -> None:
        """North, scale, and the place under the cursor; hidden with the panel."""
        self._map_px = 0.0
        if not self._shows_panel(ui, size) or not self._viewer.scene.is_visible:
            return
        scene = self._viewer.scene
        pointer = self._viewer.pointer
        anchor = 1 - MARGIN * ui.scale / size[0], (size[1] - self._status_px - MARGIN * ui.scale) / size[1]
        with ui.window("##map", anchor, size, pivot=(1.0, 1.0), takes_mouse=False):
            bar = orientation.scale_bar(scene.controller, size, orientation.LONGEST_EM * ui.em)
            orientation.show(ui, scene.controller.azimuth_deg, bar)
            place = pointer.place_under(*pointer.over_land) if pointer.over_land else None
            for line in orientation.place_lines(scene.heightmap, place) if place is not None else []:
                ui.imgui.text_disabled(line)
            self._map_px = ui.imgui.get_window_size()[1] + MARGIN * ui.scale

    def _legend_alone(self, ui: Widgets, size: Size) -> None:
        """Build the legend of the colours at the lower left while the panel is hidden, for a projector."""
        scene = self._viewer.scene
        shown = None if self._settings.split or scene.is_preview else legend(self._settings.options)
        if shown is None or not scene.is_visible:
            return
        anchor = MARGIN * ui.scale / size[0], (size[1] - self._status_px - MARGIN * ui.scale) / size[1]
        with ui.window("##legend", anchor, size, pivot=(0.0, 1.0), takes_mouse=False):
            frame = self._viewer.painter.frame
            ui.imgui.text(COLOURS.get(self._settings.options.style, self._settings.options.style))
            ui.imgui.dummy((LEGEND_EM * ui.em, 0.0))
            ui.legend(shown)
            ui.imgui.text(f"{frame.stats.get('triangles', 0):,} triangles, {charts.error_words(frame)}")

    # --- Explanations at the right ------------------------------------------------------------------------------------

    def _explanations(self, ui: Widgets, size: Size) -> None:
        if self._settings.split:
            for side in range(2):
                self._side(ui, size, side)
        if patch := self._viewer.explainer.explanation:
            bottom = (size[1] - self._status_px - self._map_px - MARGIN * ui.scale) / size[1]
            with ui.window("##patch", (0.99, bottom), size, pivot=(1.0, 1.0)):
                self._patch(ui, patch, is_short=bottom * size[1] < LOW_EM * ui.em)
        elif self._settings.sums:
            self._sums(ui, size)

    def _side(self, ui: Widgets, size: Size, side: int) -> None:
        """Build the text on a side of the split picture."""
        begin, end = self._viewer.scene.frame_spec().part(side)
        anchor = (end - 0.01, 0.02) if side == 0 else (begin + 0.01, 0.02)
        right = self._viewer.sums_frame[0] if side and self._settings.sums else end * size[0]
        left = begin * size[0] + (0.0 if side else self._taken(ui, size))
        width = max(right - left - 4 * MARGIN * ui.scale, 8 * ui.em)
        if side and right - begin * size[0] < 10 * ui.em:  # the summed-area table is there instead
            return
        painter = self._viewer.painter
        frame = painter.frame
        with ui.window(f"##side {side}", anchor, size, pivot=(1.0 - side, 0.0)), ui.wrapped(width):
            if frame.is_sketch or len(painter.side_stats) < 2:
                preview = f"preview of {self._settings.sides[side].method}; it promises nothing"
                before = "choosing the mesh …" if side else "the picture before"
                ui.imgui.text(preview if frame.is_sketch else before)
                ui.imgui.dummy((min(width, LEGEND_EM * ui.em), 0.0))  # one width for both texts: no text is cut
                return
            stats = painter.side_stats[side]
            words = frame.way.words(stats["requested_max_error_px"] is not None)
            coarse = f"; in motion {words}" if words else ""
            options = self._settings.sides[side]
            measured = painter.side_measured[side] if painter.side_measured else None
            ui.imgui.text(explain_text.side_line(options, stats, frame.is_preview, measured) + coarse)
            if (shown := legend(options)) and not frame.is_preview and width > NARROW_EM * ui.em:
                ui.imgui.dummy((min(width, LEGEND_EM * ui.em), 0.0))
                ui.legend(shown)

    def _sums(self, ui: Widgets, size: Size) -> None:
        """Build the numbers of the summed-area table."""
        bottom = self._viewer.sums_frame[1]
        anchor = 1.0 - MARGIN * ui.scale / size[0], (size[1] - bottom + 6 * ui.scale) / size[1]
        box = self._viewer.explainer.box
        with ui.window("##sums", anchor, size, pivot=(1.0, 0.0)):
            ui.imgui.text("S(x, y): the sum of all heights north and west of (x, y)")
            if box and self._viewer.scene.is_paged:
                ui.imgui.text(
                    f"of the tile under the cursor; its posts are {1 << box.table.level} posts of the map apart"
                )
            for line in box.lines() if box else ["Point at the land to read a box."]:
                ui.imgui.text_disabled(line)

    def _patch(self, ui: Widgets, patch: Explanation, is_short: bool) -> None:
        """Build the explanation of a patch; a short one has only the levels next to the chosen one, and no reasons."""
        imgui = ui.imgui
        scene = self._viewer.scene
        place = self._viewer.explainer.place
        if place is not None:
            imgui.text(", ".join(orientation.place_lines(scene.heightmap, place)))
        imgui.text(explain_text.plain(patch))
        imgui.text_colored(ACCENT, explain_text.title(patch))
        if box := self._viewer.explainer.error_box:
            error_box.show(ui, box)
            for line in error_box.lines(patch):
                imgui.text(line)
        if imgui.begin_table("choices", len(explain_text.HEADINGS), imgui.TableFlags_.sizing_fixed_fit):
            for heading in explain_text.HEADINGS:
                imgui.table_next_column()
                imgui.text_disabled(heading)
            for row in explain_text.rows(patch, is_short):
                for cell in row:
                    imgui.table_next_column()
                    if row[-1] == "drawn":
                        imgui.text_colored(ACCENT, cell)
                    else:
                        imgui.text(cell)
            imgui.end_table()
        if is_short:
            return
        with ui.wrapped(26 * ui.em):
            for sentence in explain_text.reasons(patch):
                imgui.text(sentence)
            imgui.text_disabled("Click elsewhere to explain another patch; Esc closes this.")

    # --- A lecture, at the bottom -------------------------------------------------------------------------------------

    def _lecture(self, ui: Widgets, size: Size) -> None:
        """The station of a lecture in large type: its sentences and its question."""
        self._lecture_px = 0.0
        lecture = self._viewer.lecture
        if not (lecture and lecture.station and self._viewer.scene.has_map) or self._settings.help:
            return
        imgui = ui.imgui
        sentences, question = lecture.texts()
        width = size[0] - 2 * MARGIN * ui.scale
        anchor = 0.5, 1 - MARGIN * ui.scale / size[1]
        with ui.window("##lecture", anchor, size, pivot=(0.5, 1.0), takes_mouse=False):
            inner = width - 2 * imgui.get_style().window_padding.x
            imgui.dummy((inner, 0.0))
            imgui.text_disabled(f"{lecture.station.name}   {(lecture.number or 0) + 1} of {len(lecture.stations)}")
            imgui.push_font(None, max(1.0, min(LARGE, width / (_LINE_EM * ui.em))) * FONT_PX)
            with ui.wrapped(inner):
                for sentence in sentences:
                    imgui.text(sentence)
                imgui.push_style_color(imgui.Col_.text, ACCENT)
                imgui.text(question)
                imgui.pop_style_color()
            imgui.pop_font()
            imgui.text_disabled("Space or right arrow: next   left arrow: back   Esc ends the lecture")
            self._lecture_px = imgui.get_window_size()[1] + MARGIN * ui.scale

    # --- Messages, progress and questions -----------------------------------------------------------------------------

    def _status(self, ui: Widgets, size: Size, middle: float) -> None:
        """Build one window at the bottom for all present activities: a recording, a message, and long work."""
        progress = self._viewer.progress
        message = self._viewer.window.message
        recording = self._viewer.saver.filming.running
        note = self._viewer.tiles.note
        self._status_px = self._lecture_px
        if not (recording or message or progress or note):
            return
        anchor = (middle, 1 - (MARGIN * ui.scale + self._lecture_px) / size[1])
        takes_mouse = bool(progress and progress.can_cancel)
        with ui.window("##status", anchor, size, pivot=(0.5, 1.0), takes_mouse=takes_mouse):
            with ui.wrapped(0.9 * (size[0] - self._taken(ui, size))):
                if recording:
                    ui.imgui.text_colored(WARNING, "recording: R stops")
                if message:
                    ui.imgui.text(message)
                if note:
                    ui.imgui.text(note)
            if progress:
                self._progress(ui, progress)
            self._status_px += ui.imgui.get_window_size()[1] + MARGIN * ui.scale

    def _progress(self, ui: Widgets, progress: Progress) -> None:
        if self._viewer.loader.job and self._viewer.scene.is_preview:
            ui.imgui.text("preview: a coarse sample of the map, without a certified bound")
        ui.imgui.text(progress.text)
        ui.imgui.progress_bar(progress.share, (20 * ui.em, 0.5 * ui.em), "")
        if progress.can_cancel and ui.button("Cancel", "Stop; everything stays as it is (Esc)."):
            self._press("escape")

    def _ask_path(self, ui: Widgets) -> None:
        """Ask where to save the map."""
        imgui = ui.imgui
        sculpting = self._viewer.sculpting
        assert sculpting.save_as is not None
        is_store = self._viewer.scene.is_paged
        imgui.text_disabled(_ENDINGS_OF_EDITS if is_store else "name.png: 16-bit steps   name.tif, name.exr: metres")
        imgui.set_next_item_width(26 * ui.em)
        if imgui.is_window_appearing():
            imgui.set_keyboard_focus_here()
        flags = imgui.InputTextFlags_.enter_returns_true
        entered, sculpting.save_as = imgui.input_text("##path", sculpting.save_as, flags)
        ui.hint("path", "Where to write; the ending decides the format.")
        if ui.button("Save", "Write the map as it is now (Enter).") or entered:
            sculpting.save(sculpting.save_as)
