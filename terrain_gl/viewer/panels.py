"""All panels over the picture: controls at the left, help, explanations, progress and messages."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from ..verify.explain import Explanation
from . import charts, error_box, explain_text, file_list, help_page, orientation, profile_plot, sections
from .legend import COLOURS
from .map_section import map_section
from .picture_section import PictureSection
from .theme import ACCENT, FONT_PX, INK_OF_NAMES, PAPER_OF_NAMES, WARNING
from .viewer import Viewer
from .widgets import Widgets
from .window_state import Size

PANEL_EM = 22.0  # width of the panel, in heights of the typeface
LEGEND_EM = 18.0  # width of the legend that is shown without the panel
_LINE_EM = 40.0  # least length of a lecture's lines, in heights of the typeface
FULL_HD = 1080  # in windows with more rows of pixels than this, type grows with the window
LARGE = 1.7  # size of the type of a lecture's sentences, relative to that of the panels; less in a narrow window
BACK_ROW = 1.25  # the same of legends and explanations; both in a window of `LECTURE_ROWS`, and in proportion to it
LECTURE_ROWS = 720
LOW_EM = 36.0  # if fewer rows are free than this many heights of the typeface, explanations are short
NARROW_EM = 11.0  # a side of a split picture has a legend if it is wider than this
HINT_LINES = 3  # of the line of help under the panel
MARGIN = 10.0  # around the panel, in units of length
_ENDINGS = "name.png: 16-bit steps   name.tif, name.exr: metres"
_ENDINGS_OF_EDITS = "name.tif: a window of the map   name.npz: for this store alone"
_OPEN = ("Detail", "Understand")  # sections that are open at first


def scale_of(size: Size, screen: float, wanted: float) -> float:
    """Pixels per unit of length: the user's choice, and more on a fine screen or in a very large window.

    Type grows only until the panel takes half of the window.
    """
    natural = max(screen, size[1] / FULL_HD, 1.0)
    return min(natural * wanted, max(0.45 * size[0] / (PANEL_EM * FONT_PX), min(1.0, wanted)))


def taken_px(size: Size, scale: float) -> float:
    """Columns of pixels that the panel takes in a window of `size`, with its margins."""
    return min(PANEL_EM * FONT_PX * scale, 0.45 * size[0]) + 2 * MARGIN * scale


class Panels:
    """Builds the panels of a viewer."""

    def __init__(self, viewer: Viewer) -> None:
        self._viewer = viewer
        self._settings = viewer.settings
        self._foot_px = 0.0  # height of the part under the sections
        self._scrolls_to = ""  # a section that was just opened
        self._free_px = 0.0  # rows of pixels above the windows at the bottom
        self._top_px = 0.0  # rows of pixels that the lecture takes at the top
        self._sections: dict[str, tuple[Callable[[Widgets, Viewer], None], str]] = {
            "Map": (map_section, "Which map is shown, and its scale."),
            "Detail": (sections.detail_section, "How fine the mesh is."),
            "Understand": (sections.understand_section, "How detail is chosen."),
            "Layers": (sections.layers_section, "Tracks, outlines and a photo over the land."),
            "Lecture": (sections.lecture_section, "Stations to show to a class."),
            "Sculpt": (sections.sculpt_section, "A brush that changes the land."),
            "Picture": (PictureSection().show, "How the picture looks."),
            "Camera": (sections.CameraSection().show, "Views, and how the camera moves."),
            "Save": (sections.save_section, "Pictures, films, meshes and paths."),
        }
        self.opened = {title: title in _OPEN for title in self._sections}  # whether each section is open

    def build(self, ui: Widgets) -> None:
        viewer = self._viewer
        width, height = viewer.window.size
        self._free_px = height
        self._names(ui)
        if viewer.alarm.line:
            frame = ui.imgui.get_background_draw_list()
            frame.add_rect((0, 0), (width, height), ui.colour(WARNING), 0.0, 8 * ui.scale)
        if self._taken(ui):
            self._panel(ui)
        self._lecture(ui)
        middle = 0.5 * (self._taken(ui) + width)
        self._status(ui, middle)
        if self._settings.help:
            with ui.window("Help", (middle, 0.5 * self._free_px), (0.5, 0.5), "h"):
                help_page.show(ui)
        elif viewer.files.folder:
            with ui.window("Open a map##open", (middle, 0.5 * height), (0.5, 0.5), "escape"):
                file_list.show(ui, viewer.files, viewer.window.size)
        elif viewer.sculpting.save_as is not None:
            with ui.window("Save the map##save", (middle, 0.6 * height), (middle / width, 0.6), "escape"):
                self._ask_path(ui)
        elif viewer.scene.is_visible:
            ui.imgui.push_font(None, (BACK_ROW * self._room(ui) if self._top_px else 1.0) * FONT_PX)
            if self._taken(ui):
                self._orientation(ui)
            else:
                self._legend_alone(ui)
            self._explanations(ui)
            ui.imgui.pop_font()

    def status_alone(self, ui: Widgets) -> None:
        """Build only the window with messages, because the others cannot be built."""
        width, self._free_px = self._viewer.window.size
        self._status(ui, 0.5 * width)

    def _taken(self, ui: Widgets) -> float:
        """Columns of pixels that the panel takes; 0 if it is not shown. In a narrow window, help takes its place."""
        size = self._viewer.window.size
        has_room = not self._settings.help or size[0] > (PANEL_EM + help_page.WIDTH_EM) * ui.em
        is_shown = self._viewer.scene.has_map and self._settings.panel and has_room
        return taken_px(size, ui.scale) if is_shown else 0.0

    def _room(self, ui: Widgets) -> float:
        """How many times as large a lecture's type is as in a window of `LECTURE_ROWS`, beyond the growth of panels."""
        return max(1.0, self._viewer.window.size[1] / (LECTURE_ROWS * ui.scale))

    @contextmanager
    def _at_bottom(self, ui: Widgets, name: str, x: float, pivot: float, takes_mouse: bool = False) -> Iterator[None]:
        """Build a window above those that are already at the bottom."""
        margin = MARGIN * ui.scale
        with ui.window(name, (x, self._free_px - margin), (pivot, 1.0), takes_mouse=takes_mouse):
            yield
            height = ui.imgui.get_window_size()[1]
        self._free_px -= height + margin

    def _names(self, ui: Widgets) -> None:
        """The names of points and heights of contours, over the picture and behind all panels."""
        draw = ui.imgui.get_background_draw_list()
        taken = self._taken(ui)  # heights of contours would shine through the panel
        viewer = self._viewer
        for name, x, y, is_centred in viewer.scene.split.moved(viewer.painter.labels, viewer.window.size[0]):
            if is_centred and x < taken:
                continue
            width, height = ui.imgui.calc_text_size(name)
            left, top = (x - width / 2, y - height / 2) if is_centred else (x + 0.4 * ui.em, y + 0.4 * ui.em)
            corner = left + width + 0.2 * ui.em, top + height
            draw.add_rect_filled((left - 0.2 * ui.em, top), corner, ui.colour(PAPER_OF_NAMES))
            draw.add_text((left, top), ui.colour(INK_OF_NAMES), name)

    # --- The panel at the left ----------------------------------------------------------------------------------------

    def _panel(self, ui: Widgets) -> None:
        imgui = ui.imgui
        viewer = self._viewer
        flags = imgui.WindowFlags_
        margin = MARGIN * ui.scale
        width, height = self._taken(ui) - 2 * margin, viewer.window.size[1] - 2 * margin
        imgui.set_next_window_pos((margin, margin))
        imgui.set_next_window_size_constraints((width, 0), (width, height))
        fixed = flags.no_move | flags.no_resize | flags.always_auto_resize | flags.no_saved_settings | flags.no_nav
        frame = viewer.painter.frame
        words = "preview" if frame.is_preview else f"{frame.posts[0]} × {frame.posts[1]} posts"
        expanded, _ = imgui.begin(f"{frame.name}   {words}###panel", None, fixed)
        ui.note_window()
        if expanded:
            most = height - imgui.get_cursor_pos_y() - max(self._foot_px, 4 * ui.em)
            imgui.set_next_window_size_constraints((0, 0), (width, max(most, 4 * ui.em)))
            imgui.begin_child("body", (0, 0), imgui.ChildFlags_.auto_resize_y)  # this part scrolls
            imgui.push_item_width(0.56 * width)
            if viewer.ruler.taken:
                profile_plot.show(ui, viewer.ruler.profile(viewer.scene.heightmap))
            charts.show(ui, viewer.painter, viewer.scene.controller, viewer.settled)
            for title, (show, about) in self._sections.items():
                imgui.set_next_item_open(self.opened[title])
                was_open, self.opened[title] = self.opened[title], imgui.collapsing_header(title)
                ui.hint(title, about)
                if self.opened[title] and (not was_open or title == self._scrolls_to):
                    imgui.set_scroll_here_y(0.0)
                    self._scrolls_to = "" if was_open else title  # once more when the panel knows its new height
                if self.opened[title]:
                    show(ui, viewer)
            imgui.pop_item_width()
            imgui.end_child()
            top = imgui.get_cursor_pos_y()
            imgui.separator()
            ui.button("All keys", "Every key and what it does (H).", "h")
            imgui.same_line()
            ui.button("Hide", "Hide this panel; the key I shows it again.", "i")
            top_of_hint = imgui.get_cursor_pos_y()
            with ui.wrapped():
                imgui.text_disabled(ui.hovered_hint or "Point at a control to read what it does.")
            if height > LOW_EM * ui.em:
                imgui.set_cursor_pos_y(top_of_hint)  # a long hint does not change the panel's height
                imgui.dummy((0.0, HINT_LINES * imgui.get_text_line_height_with_spacing()))
            self._foot_px = imgui.get_cursor_pos_y() - top + imgui.get_style().window_padding[1]
        imgui.end()

    # --- At the bottom ------------------------------------------------------------------------------------------------

    def _orientation(self, ui: Widgets) -> None:
        """North, scale, and the place under the cursor, at the lower right."""
        scene = self._viewer.scene
        pointer = self._viewer.pointer
        size = self._viewer.window.size
        with self._at_bottom(ui, "##map", size[0] - MARGIN * ui.scale, 1.0):
            bar = orientation.scale_bar(scene.controller, size, orientation.LONGEST_EM * ui.em)
            orientation.show(ui, scene.controller.azimuth_deg - scene.heightmap.north_deg, bar)
            place = pointer.place_under(*pointer.over_land) if pointer.over_land else None
            if place is not None:
                for line in orientation.place_lines(scene.heightmap, place):
                    ui.imgui.text_disabled(line)

    def _legend_alone(self, ui: Widgets) -> None:
        """Build the legend of the colours at the lower left while the panel is hidden, for a projector."""
        options = self._settings.options
        shown = None if self._settings.split else self._viewer.legend(0)
        if shown is None:
            return
        with self._at_bottom(ui, "##legend", MARGIN * ui.scale, 0.0):
            frame = self._viewer.painter.frame
            ui.imgui.text(COLOURS.get(options.style, options.style))
            ui.imgui.dummy((LEGEND_EM * ui.em, 0.0))
            ui.legend(shown)
            ui.imgui.text(f"{frame.stats.get('triangles', 0):,} triangles, {charts.error_words(frame)}")

    def _lecture(self, ui: Widgets) -> None:
        """The station of a lecture in large type, at the top, where there is sky: sentences, question or answer."""
        lecture = self._viewer.lecture
        self._top_px = 0.0
        if not (lecture and lecture.station and self._viewer.scene.has_map) or self._settings.help:
            return
        imgui = ui.imgui
        sentences, question, answer = lecture.texts()
        taken, margin = self._taken(ui), MARGIN * ui.scale
        width = self._viewer.window.size[0] - taken - 2 * margin
        with ui.window("##lecture", (taken + margin, margin), (0.0, 0.0), takes_mouse=False):
            inner = width - 2 * imgui.get_style().window_padding.x
            imgui.dummy((inner, 0.0))
            name = f"{(lecture.number or 0) + 1} of {len(lecture.stations)}   {lecture.station.name}"
            imgui.push_font(None, BACK_ROW * self._room(ui) * FONT_PX)
            imgui.text_disabled(f"{name}   (Space: {lecture.next_words}, Left: back, Esc: end)")
            imgui.pop_font()
            imgui.push_font(None, max(1.0, min(LARGE * self._room(ui), width / (_LINE_EM * ui.em))) * FONT_PX)
            with ui.wrapped(inner):
                for sentence in sentences:
                    imgui.text(sentence)
                imgui.text_colored(ACCENT, answer or question)
            imgui.pop_font()
            self._top_px = margin + imgui.get_window_size()[1] + margin

    def _status(self, ui: Widgets, middle: float) -> None:
        """Build one window for all present activities: a recording, a message, and long work."""
        viewer = self._viewer
        progress, message, note = viewer.progress, viewer.window.message, viewer.tiles.note
        recording = viewer.saver.filming.running
        alarm = viewer.alarm.line
        if not (recording or message or progress or note or alarm):
            return
        with self._at_bottom(ui, "##status", middle, 0.5, takes_mouse=bool(progress and progress.can_cancel)):
            with ui.wrapped(0.9 * (viewer.window.size[0] - self._taken(ui))):
                if alarm:
                    ui.imgui.text_colored(WARNING, alarm)
                if recording:
                    ui.imgui.text_colored(WARNING, "recording: R stops")
                for words in filter(None, (message, note)):
                    ui.imgui.text(words)
            if not progress:
                return
            if viewer.loader.job and viewer.scene.is_preview:
                ui.imgui.text("preview: a coarse sample of the map, without a certified bound")
            ui.imgui.text(progress.text)
            ui.imgui.progress_bar(progress.share, (20 * ui.em, 0.5 * ui.em), "")
            if progress.can_cancel:
                ui.button("Cancel", "Stop; everything stays as it is (Esc).", "escape")

    def _ask_path(self, ui: Widgets) -> None:
        imgui = ui.imgui
        sculpting = self._viewer.sculpting
        assert sculpting.save_as is not None
        imgui.text_disabled(_ENDINGS_OF_EDITS if self._viewer.scene.is_paged else _ENDINGS)
        imgui.set_next_item_width(26 * ui.em)
        if imgui.is_window_appearing():
            imgui.set_keyboard_focus_here()
        flags = imgui.InputTextFlags_.enter_returns_true
        entered, sculpting.save_as = imgui.input_text("##path", sculpting.save_as, flags)
        ui.hint("path", "Where to write; the ending decides the format.")
        if ui.button("Save", "Write the map as it is now (Enter).") or entered:
            sculpting.save(sculpting.save_as)

    # --- Explanations at the right ------------------------------------------------------------------------------------

    def _explanations(self, ui: Widgets) -> None:
        width = self._viewer.window.size[0]
        if self._settings.split:
            heights = [self._side(ui, side) for side in range(2)]
            if self._top_px:
                self._free_px -= max(heights) + MARGIN * ui.scale
        if patch := self._viewer.explainer.explanation:
            bottom = self._free_px - MARGIN * ui.scale
            is_right = self._viewer.explainer.at_px < 0.5 * (self._taken(ui) + width)  # beside its patch, not over it
            corner = (0.99 * width, 1.0) if is_right else (self._taken(ui) + 0.01 * width, 0.0)
            with ui.window("##patch", (corner[0], bottom), (corner[1], 1.0)):
                self._patch(ui, patch, is_short=bottom - self._top_px < LOW_EM * ui.em)
        elif self._settings.sums:
            self._sums(ui)

    def _side(self, ui: Widgets, side: int) -> float:
        """Build the text on a side of the split picture; returns its height.

        It is at the top; in a lecture at the bottom, because the sentences at the top already cover far land.
        """
        columns, rows = self._viewer.window.size
        split = self._viewer.scene.split
        is_right = split.is_right(side)
        begin, end = (columns * share for share in split.part(side))
        right = self._viewer.sums_frame[0] if is_right and self._settings.sums else end
        width = max(right - begin - (0.0 if is_right else self._taken(ui)) - 4 * MARGIN * ui.scale, 8 * ui.em)
        if is_right and right - begin < 10 * ui.em:  # the summed-area table is there instead
            return 0.0
        painter = self._viewer.painter
        frame = painter.frame
        options = self._settings.sides[side]
        is_low = self._top_px > 0
        x = begin + 0.01 * columns if is_right else end - 0.01 * columns
        y = self._free_px - MARGIN * ui.scale if is_low else 0.02 * rows
        with ui.window(f"##side {side}", (x, y), (float(not is_right), float(is_low))), ui.wrapped(width):
            shown = None
            if frame.is_sketch:
                text = f"preview of {options.method}; it promises nothing"
            elif len(painter.side_stats) < 2:
                text = "choosing the mesh …" if side else "the picture before"
            else:
                stats = painter.side_stats[side]
                words = frame.way.words(stats["requested_max_error_px"])
                measured = painter.side_measured[side] if painter.side_measured else None
                text = explain_text.side_line(options, stats, frame.is_preview, measured, is_short=is_low)
                text += f"; in motion {words}" if words else ""
                shown = self._viewer.legend(side) if width > NARROW_EM * ui.em else None
            ui.imgui.text(text)
            ui.imgui.dummy((min(width, LEGEND_EM * ui.em), 0.0))  # the same width for all these texts: none is cut
            if shown:
                ui.legend(shown)
            return float(ui.imgui.get_window_size()[1])

    def _sums(self, ui: Widgets) -> None:
        """Build the numbers of the summed-area table."""
        columns, rows = self._viewer.window.size
        box = self._viewer.explainer.box
        place = columns - MARGIN * ui.scale, rows - self._viewer.sums_frame[1] + 6 * ui.scale
        with ui.window("##sums", place, (1.0, 0.0)):
            ui.imgui.text("S(x, y): the sum of all heights north and west of (x, y)")
            if box and self._viewer.scene.is_paged:
                apart = 1 << box.table.level
                ui.imgui.text(f"of the tile under the cursor; its posts are {apart} posts of the map apart")
            for line in box.lines() if box else ["Point at the land to read a box."]:
                ui.imgui.text_disabled(line)

    def _patch(self, ui: Widgets, patch: Explanation, is_short: bool) -> None:
        """Build the explanation of a patch; a short one has only the levels next to the chosen one, and no reasons."""
        imgui = ui.imgui
        scene = self._viewer.scene
        explainer = self._viewer.explainer
        if explainer.place is not None:
            imgui.text(", ".join(orientation.place_lines(scene.heightmap, explainer.place)))
        imgui.text(explain_text.plain(patch))
        imgui.text_colored(ACCENT, explain_text.title(patch))
        if is_short and patch.hidden_by:
            return
        if explainer.error_box:
            error_box.show(ui, explainer.error_box)
            for line in error_box.lines(patch):
                imgui.text(line)
        if imgui.begin_table("choices", len(explain_text.HEADINGS), imgui.TableFlags_.sizing_fixed_fit):
            for heading in explain_text.HEADINGS:
                imgui.table_next_column()
                imgui.text_disabled(heading)
            for row in explain_text.rows(patch, is_short):
                colour = ACCENT if row[-1] == "drawn" else imgui.get_style_color_vec4(imgui.Col_.text)
                for cell in row:
                    imgui.table_next_column()
                    imgui.text_colored(colour, cell)
            imgui.end_table()
        if is_short:
            return
        with ui.wrapped(26 * ui.em):
            for sentence in explain_text.reasons(patch):
                imgui.text(sentence)
            imgui.text_disabled("Click elsewhere to explain another patch; Esc closes this.")
