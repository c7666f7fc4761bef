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
    "While the tables of a large map are being built, the window shows a preview: a coarse sample of the map. A preview"
    " has no certified bound.",
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
    columns = [list(GROUPS)]
    sizes = {group: sum(line[0] == group for line in lines) + 2 for group in GROUPS}
    width, height = imgui.get_io().display_size
    if 0.96 * width > WIDTH_EM * ui.em:
        columns = _halves(sizes)
    longest = max(sum(sizes[group] for group in column) for column in columns)
    spacing = imgui.get_style().item_spacing
    room = height / (longest + AROUND_ROWS) - imgui.get_text_line_height()
    imgui.push_style_var(imgui.StyleVar_.item_spacing, (spacing.x, min(max(room, 0.0), spacing.y)))
    _table(ui, lines, columns)
    imgui.pop_style_var()


def _table(ui: Widgets, lines: list[tuple[str, str, str]], columns: list[list[str]]) -> None:
    """One or two columns of groups, side by side."""
    imgui = ui.imgui
    if not imgui.begin_table("keys", len(columns)):
        return
    for half in columns:
        imgui.table_next_column()
        for group in half:
            imgui.separator_text(group)
            for _, keys, meaning in (line for line in lines if line[0] == group):
                imgui.text_colored(imgui.get_style_color_vec4(imgui.Col_.check_mark), keys)
                imgui.same_line(8 * ui.em)
                imgui.text(meaning)
    imgui.end_table()


def _halves(sizes: dict[str, int]) -> list[list[str]]:
    """The groups in order, in two columns of about the same length."""
    left: list[str] = []
    for group, size in sizes.items():
        if 2 * (sum(sizes[g] for g in left) + size) > sum(sizes.values()) + size and left:
            break
        left.append(group)
    return [left, [group for group in sizes if group not in left]]
