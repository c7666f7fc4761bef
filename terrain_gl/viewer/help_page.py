"""The help page: every key, made of the table of commands, and what the window is about."""

from __future__ import annotations

from typing import TYPE_CHECKING

from .commands import GROUPS, shown_lines

if TYPE_CHECKING:
    from .gui import Gui

WIDTH_EM = 48.0  # of two columns, in heights of the typeface
ABOUT = (
    "Terrain is drawn with as few triangles as a promise allows: no post of the map stands further from its place in"
    " the picture than the tolerance says.",
    "How far off each piece of land would be, drawn coarsely, was measured once, when the map was opened, and summed up"
    " in summed-area tables: four look-ups tell the worst of any rectangle. Each frame turns those metres into pixels"
    " for the eye where it is now, and takes the coarsest pieces that keep the promise.",
    "Raise the tolerance and watch the triangles go. Look at the mesh, at its levels and at the error of each pixel"
    " under Understand. The panel shows what was promised and, as soon as nothing moves, what was achieved,"
    " measured on the very mesh that is drawn.",
)


def show(gui: Gui) -> None:
    """Lay the page out in the window that is being built."""
    imgui = gui.imgui
    if not imgui.begin_tab_bar("pages"):
        return
    if imgui.begin_tab_item("Keys")[0]:
        _keys(gui)
        imgui.end_tab_item()
    if imgui.begin_tab_item("What is this?")[0]:
        imgui.push_text_wrap_pos(36 * gui.em)
        for paragraph in ABOUT:
            imgui.text(paragraph)
            imgui.spacing()
        imgui.pop_text_wrap_pos()
        imgui.end_tab_item()
    imgui.end_tab_bar()


def _keys(gui: Gui) -> None:
    """Keys and what they do, in two columns where there is room for them."""
    imgui = gui.imgui
    groups = list(GROUPS)
    lines = shown_lines()
    columns = [groups]
    if imgui.get_io().display_size[0] > WIDTH_EM * gui.em:
        columns = _halves({group: sum(line[0] == group for line in lines) + 2 for group in groups})
    if not imgui.begin_table("keys", len(columns)):
        return
    for half in columns:
        imgui.table_next_column()
        for group in half:
            imgui.separator_text(group)
            for _, keys, meaning in (line for line in lines if line[0] == group):
                imgui.text_colored(imgui.get_style_color_vec4(imgui.Col_.check_mark), keys)
                imgui.same_line(8 * gui.em)
                imgui.text(meaning)
    imgui.end_table()


def _halves(sizes: dict[str, int]) -> list[list[str]]:
    """Groups in order, cut where both columns come out about as long."""
    left: list[str] = []
    for group, size in sizes.items():
        if 2 * (sum(sizes[g] for g in left) + size) > sum(sizes.values()) + size and left:
            break
        left.append(group)
    return [left, [group for group in sizes if group not in left]]
