"""The list of a folder's maps, where the system has no dialog."""

from .file_dialog import FileDialog
from .widgets import Widgets
from .window_state import Size

WIDTH_EM = 28.0


def show(ui: Widgets, files: FileDialog, size: Size) -> None:
    """Build the list in the present window."""
    imgui = ui.imgui
    width = min(WIDTH_EM * ui.em, 0.5 * size[0])
    with ui.wrapped(width):
        imgui.text_disabled(str(files.folder))
    imgui.begin_child("maps", (width, 0.5 * size[1]))
    for entry in files.entries or []:
        chosen, _ = imgui.selectable(entry, False)
        ui.hint(entry, "Go into this folder." if entry.endswith("/") else "Open this map.")
        if chosen:
            files.choose(entry)
            break
    if files.entries is None:
        imgui.text_disabled("…")
    imgui.end_child()
