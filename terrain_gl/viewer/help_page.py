"""The help page: every key, from the table of commands, and a short text about the program."""

from .commands import GROUPS, shown_lines
from .widgets import Widgets

AROUND_ROWS = 6  # title, tabs and margins of the page together are as high as this many rows of text
WIDTH_EM = 54.0  # width of two columns, in heights of the typeface
ABOUT = (
    "The program draws terrain with few triangles. It keeps a certified bound: on the screen, no point of the surface"
    " is drawn further from its true place than the tolerance.",
    "When a map is opened, the program measures how far each coarse piece of land is from the true heights, in metres."
    " It stores these errors in tables. For each frame it converts metres to pixels for the present camera, and"
    " chooses the coarsest pieces that are within the tolerance.",
    "Raise the tolerance and watch the number of triangles fall. Under Understand you can see the mesh, its levels, and"
    " the error of each pixel. The panel shows the certified bound. When nothing moves, it also shows the error that"
    " was measured on the drawn mesh.",
)


def show(ui: Widgets) -> None:
    """Build the page in the present window."""
    imgui = ui.imgui
    if not imgui.begin_tab_bar("pages"):
        return
    if imgui.begin_tab_item("Keys")[0]:
        _keys(ui)
        imgui.end_tab_item()
    if imgui.begin_tab_item("What is this?")[0]:
        with ui.wrapped(36 * ui.em):
            for paragraph in ABOUT:
                imgui.text(paragraph)
                imgui.spacing()
        imgui.end_tab_item()
    imgui.end_tab_bar()


def _keys(ui: Widgets) -> None:
    """Keys and their effects: in two columns if the window is wide enough, close together if it is low."""
    imgui = ui.imgui
    lines = shown_lines()
    groups = list(GROUPS)
    width, height = imgui.get_io().display_size
    columns = [groups[:3], groups[3:]] if 0.96 * width > WIDTH_EM * ui.em else [groups]
    longest = max(sum(group in column for group, _, _ in lines) + 2 * len(column) for column in columns)
    spacing = imgui.get_style().item_spacing
    room = height / (longest + AROUND_ROWS) - imgui.get_text_line_height()
    imgui.push_style_var(imgui.StyleVar_.item_spacing, (spacing.x, min(max(room, 0.0), spacing.y)))
    if imgui.begin_table("keys", len(columns)):
        for column in columns:
            imgui.table_next_column()
            for title in column:
                imgui.separator_text(title)
                for _, keys, meaning in (line for line in lines if line[0] == title):
                    imgui.text_colored(imgui.get_style_color_vec4(imgui.Col_.check_mark), keys)
                    imgui.same_line(8 * ui.em)
                    imgui.text(meaning)
        imgui.end_table()
    imgui.pop_style_var()
