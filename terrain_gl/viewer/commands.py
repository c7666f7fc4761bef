"""Every key and what it does, in one table, which the window executes and the help page shows."""

from collections.abc import Callable
from functools import partial
from typing import NamedTuple

from .controller import MODES
from .state import apply, state_of
from .viewer import Viewer


class Command(NamedTuple):
    """One command."""

    shown: str  # the keys as the help page shows them; "" if another line already shows them
    help: str  # the effect of the keys, in a line
    keys: tuple[str, ...] = ()  # such as "ctrl+shift+z"; none if the camera or the mouse handles them
    act: Callable[[Viewer], None] | None = None
    repeats: bool = False  # whether a held key repeats the command


def press(viewer: Viewer, key: str, repeated: bool = False) -> None:
    """Execute the command of a key; `repeated` says that the key is held. Without a map, only Esc and Ctrl Q work."""
    command = BY_KEY.get(key)
    if not command or not command.act or (repeated and not command.repeats):
        return
    if viewer.scene.is_visible or key in ("escape", "ctrl+q"):
        command.act(viewer)
        viewer.window.refresh()


def _cycle(viewer: Viewer, option: str, step: int = 1) -> None:
    if option == "method" and viewer.scene.is_paged:
        viewer.window.say(f"a store is drawn by the method sat: {viewer.scene.in_memory}")
        return
    viewer.window.say(f"{option}: {viewer.settings.cycle(option, step)}")


def _next_mode(viewer: Viewer) -> None:
    controller = viewer.scene.controller
    mode = MODES[(MODES.index(controller.mode) + 1) % len(MODES)]
    controller.change_mode(mode)
    words = {"fly": "flying", "orbit": "orbiting the middle of the picture", "walk": "walking at eye height"}
    viewer.window.say(words[mode])


def _toggle_ground(viewer: Viewer) -> None:
    controller = viewer.scene.controller
    controller.above_ground = not controller.above_ground
    viewer.window.say("the camera stays above ground" if controller.above_ground else "the camera goes anywhere")


def _capture_mouse(viewer: Viewer) -> None:
    captured = viewer.window.capture_mouse()
    viewer.window.say("the mouse looks around: C or Esc frees it" if captured else "the mouse is free")


def _toggle_ruler(viewer: Viewer) -> None:
    if viewer.sculpting.brushing:
        viewer.sculpting.toggle()
    viewer.explainer.explanation = None
    if viewer.ruler.toggle():
        viewer.settings.panel = True  # the panel shows the lengths
        viewer.window.say("ruler: click on the land; a double click ends the line, Esc puts it away")


def _toggle_lecture(viewer: Viewer) -> None:
    if viewer.lecture and viewer.lecture.station:
        viewer.lecture.end()
    else:
        viewer.give_lecture()


def _escape(viewer: Viewer) -> None:
    """Cancel one piece of work. If there is none, close one open thing. If nothing is open, ask whether to quit."""
    if viewer.cancel() or viewer.files.close():
        return
    if viewer.settings.help:
        viewer.settings.help = False
    elif viewer.sculpting.save_as is not None:
        viewer.sculpting.save_as = None
    elif viewer.sculpting.brushing:
        viewer.sculpting.brushing = False
    elif viewer.ruler.taken:
        viewer.ruler.toggle()
    elif viewer.explainer.explanation:
        viewer.explainer.explanation = None
    elif viewer.lecture and viewer.lecture.station:
        viewer.lecture.end()
        viewer.window.say("Ctrl L goes on with the lecture")
    elif not viewer.explainer.close_one():
        viewer.ask_quit()


def _go_to(viewer: Viewer, n: int) -> None:
    if state := viewer.scene.bookmarks.get(n):
        apply(viewer.scene, viewer.explainer, viewer.layers, state)
    else:
        viewer.window.say(f"bookmark {n} is not set: Ctrl {n} sets it")


def _set_bookmark(viewer: Viewer, n: int) -> None:
    viewer.scene.bookmarks[n] = state_of(viewer.scene, viewer.layers)
    viewer.window.say(f"bookmark {n} is set here")


PLUS = "+", "=", "shift+=", "shift++"  # the plus sign is on different keys of different keyboards
CTRL_PLUS = "ctrl++", "ctrl+=", "ctrl+shift+=", "ctrl+shift++"
_NUMBERS = range(1, 10)  # of bookmarks; the help page shows one line for all
GROUPS: dict[str, list[Command]] = {
    "Move": [
        Command("W A S D", "forward, left, back, right"),
        Command("E Q", "up, down"),
        Command("arrows", "turn the head"),
        Command("Shift", "five times as fast"),
        Command("wheel", "nearer to the place under the cursor, or away"),
        Command("double click", "fly to the place under the cursor"),
        Command("left drag", "orbit the place under the cursor"),
        Command("middle drag", "move the land with the cursor"),
        Command("right drag", "look around"),
        Command("Shift wheel", "speed, which follows the height above ground"),
        Command("Ctrl wheel", "field of view"),
        Command("C", "look around without a button", ("c",), _capture_mouse),
        Command("V", "fly, orbit the middle, or walk at eye height", ("v",), _next_mode),
        Command("G", "stay above ground, or not", ("g",), _toggle_ground),
        Command("Home", "back to the first view", ("home",), lambda s: s.scene.controller.home()),
        *(Command("1 … 9", "travel to a bookmark", (f"{n}",), partial(_go_to, n=n)) for n in _NUMBERS),
        *(
            Command("Ctrl 1 … 9", "set a bookmark here", (f"ctrl+{n}", f"shift+{n}"), partial(_set_bookmark, n=n))
            for n in _NUMBERS
        ),
    ],
    "See": [
        Command("Tab  J", "next style; Shift Tab: the style before", ("tab", "j"), lambda s: _cycle(s, "style")),
        Command("", "", ("shift+tab", "shift+j"), lambda s: _cycle(s, "style", -1)),
        Command("Shift C", "contour lines, or none", ("shift+c",), lambda s: s.settings.toggle_contours()),
        Command("+ -", "change the tolerance by a factor of √2", PLUS, lambda s: s.settings.loosen(1), True),
        Command("", "", ("-",), lambda s: s.settings.loosen(-1), True),
        Command("M", "metric: what is bounded, or minimised", ("m",), lambda s: _cycle(s, "metric")),
        Command("F", "method: how detail is chosen", ("f",), lambda s: _cycle(s, "method")),
    ],
    "Window": [
        Command("I", "show or hide the panel", ("i",), lambda s: s.settings.toggle("panel")),
        Command("Ctrl + -", "larger or smaller type and panels", CTRL_PLUS, lambda s: s.settings.enlarge(1), True),
        Command("", "", ("ctrl+-",), lambda s: s.settings.enlarge(-1), True),
        Command("H  F1", "show or hide this help", ("h", "f1"), lambda s: s.settings.toggle("help")),
        Command("Esc", "cancel, or close what is open; twice: quit", ("escape",), _escape),
        Command("Ctrl Q", "quit", ("ctrl+q",), lambda s: s.quit()),
    ],
    "Understand": [
        Command("click", "explain the patch under the cursor"),
        Command("Shift R", "ruler: lengths, climb, profile", ("shift+r",), _toggle_ruler),
        Command("N", "draw the mesh over the picture", ("n",), lambda s: s.explainer.toggle_wires()),
        Command("L", "freeze the levels, and fly around them", ("l",), lambda s: s.explainer.toggle_freeze()),
        Command("T", "split the picture: two methods, equal triangles", ("t",), lambda s: s.explainer.toggle_split()),
        Command("Shift T", "swap its sides; Ctrl T: the same land on both", ("shift+t",), lambda s: s.explainer.swap()),
        Command("", "", ("ctrl+t",), lambda s: s.settings.toggle("centred")),
        Command("Ctrl L", "the lecture: begin, go on, or end", ("ctrl+l",), _toggle_lecture),
        Command("Z", "magnifying glass", ("z",), lambda s: s.explainer.toggle_lens()),
        Command("U", "the summed-area table, and a box of it", ("u",), lambda s: s.explainer.toggle_sums()),
    ],
    "Sculpt": [
        Command("B", "take the brush, or put it away", ("b",), lambda s: s.sculpting.toggle()),
        Command("X", "next tool: raise, lower, smooth, flatten, cliff", ("x",), lambda s: s.sculpting.next_tool()),
        Command("[ ]", "smaller or larger brush", ("]",), lambda s: s.sculpting.widen(1), True),
        Command("", "", ("[",), lambda s: s.sculpting.widen(-1), True),
        Command(", .", "weaker or stronger brush", (".",), lambda s: s.sculpting.strengthen(1), True),
        Command("", "", (",",), lambda s: s.sculpting.strengthen(-1), True),
        Command("Ctrl Z", "undo the last stroke", ("ctrl+z",), lambda s: s.sculpting.undo(), True),
        Command("Ctrl Shift Z", "redo it", ("ctrl+shift+z", "ctrl+y"), lambda s: s.sculpting.redo(), True),
        Command("Ctrl S", "save the map: PNG, TIFF or EXR", ("ctrl+s",), lambda s: s.sculpting.ask_to_save()),
    ],
    "Save": [
        Command("P", "save the picture as PNG", ("p",), lambda s: s.saver.save_picture()),
        Command("R", "record the flight, or stop and draw its film", ("r",), lambda s: s.saver.toggle_recording()),
        Command("Ctrl R", "film a turn around the middle; Ctrl D: a day", ("ctrl+r",), lambda s: s.saver.turn()),
        Command("", "", ("ctrl+d",), lambda s: s.saver.day()),
        Command("Y", "copy the command line that draws this view", ("y",), lambda s: s.saver.copy_line()),
        Command("O", "save the drawn mesh, for example as .glb", ("o",), lambda s: s.saver.save_mesh()),
        Command("K", "save bookmarks as a path for terrain-gl fly", ("k",), lambda s: s.saver.save_path()),
        Command("Ctrl O", "open a map", ("ctrl+o",), lambda s: s.files.open(s.scene.opened.key)),
        Command("drop a file", "open a map, or lay tracks and photos over it"),
    ],
}

BY_KEY = {key: command for commands in GROUPS.values() for command in commands for key in command.keys}


def shown_lines() -> list[tuple[str, str, str]]:
    """Group, keys and help of each line of the help page."""
    lines = [(group, c.shown, c.help) for group, commands in GROUPS.items() for c in commands if c.shown]
    return list(dict.fromkeys(lines))
