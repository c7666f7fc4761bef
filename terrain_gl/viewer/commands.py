"""Every key and what it does, in one table: the window obeys it, and its help pages are made of it."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from .flight import Flight


class Command(NamedTuple):
    """A line of help, and what is done.

    Attributes
    ----------
    shown
        The keys as people read them.
    help
        One line.
    keys
        Names of keys as the window gives them, "ctrl+shift+z"; empty where the camera listens by itself.
    act
        What they do.
    repeats
        A key that is held does it again and again.
    """

    shown: str
    help: str
    keys: tuple[str, ...] = ()
    act: Callable[[Flight], None] | None = None
    repeats: bool = False


def _bookmarks() -> list[Command]:
    """Nine places; the first tells of all."""

    def goes(n: int) -> Command:
        return Command("1 … 9", "travel to a bookmark", (str(n),), lambda f: f.go_to(n))

    def sets(n: int) -> Command:
        keys = f"ctrl+{n}", f"shift+{n}"
        return Command("Ctrl 1 … 9", "set a bookmark here", keys, lambda f: f.set_bookmark(n))

    return [make(n) for make in (goes, sets) for n in range(1, 10)]


PLUS = "+", "=", "shift+=", "shift++"  # wherever a keyboard has it

GROUPS: dict[str, list[Command]] = {
    "Move": [
        Command("W A S D", "fly ahead, left, back, right"),
        Command("E Q", "up, down"),
        Command("arrows", "turn the head"),
        Command("Shift", "five times as fast"),
        Command("wheel", "speed; with Ctrl, the field of view"),
        Command("left drag", "orbit what is under the cursor"),
        Command("right drag", "look around"),
        Command("C", "look around without a button", ("c",), lambda f: f.capture()),
        Command("V", "fly, orbit the middle, or walk at eye height", ("v",), lambda f: f.next_mode()),
        Command("G", "stay above ground, or not", ("g",), lambda f: f.toggle_ground()),
        Command("Home", "back to the first view", ("home",), lambda f: f.controller.home()),
        *_bookmarks(),
    ],
    "See": [
        Command("Tab  J", "next style; Shift Tab: the one before", ("tab", "j"), lambda f: f.cycle("style")),
        Command("", "", ("shift+tab", "shift+j"), lambda f: f.cycle("style", -1)),
        Command("+ -", "tolerance, in steps of ×√2", PLUS, lambda f: f.settings.loosen(1), True),
        Command("", "", ("-",), lambda f: f.settings.loosen(-1), True),
        Command("M", "metric: what the tolerance bounds", ("m",), lambda f: f.cycle("metric")),
        Command("F", "method: how detail is chosen", ("f",), lambda f: f.cycle("method")),
    ],
    "Understand": [
        Command("click", "explain the patch under the cursor, in numbers"),
        Command("N", "the mesh over whatever is seen", ("n",), lambda f: f.insight.toggle_wires()),
        Command("L", "freeze the levels, and fly around them", ("l",), lambda f: f.insight.toggle_freeze()),
        Command("T", "split the picture: two methods or settings", ("t",), lambda f: f.insight.toggle_split()),
        Command("Z", "magnifying glass", ("z",), lambda f: f.insight.toggle_lens()),
        Command("U", "the summed-area table, and a box read from it", ("u",), lambda f: f.toggle("sums")),
    ],
    "Sculpt": [
        Command("B", "the brush, or the hand that orbits", ("b",), lambda f: f.sculpting.toggle()),
        Command("X", "next tool: raise, lower, smooth, flatten, cliff", ("x",), lambda f: f.sculpting.next_tool()),
        Command("[ ]", "smaller, larger brush", ("]",), lambda f: f.sculpting.widen(1), True),
        Command("", "", ("[",), lambda f: f.sculpting.widen(-1), True),
        Command(", .", "weaker, stronger", (".",), lambda f: f.sculpting.strengthen(1), True),
        Command("", "", (",",), lambda f: f.sculpting.strengthen(-1), True),
        Command("Ctrl Z", "undo the last stroke", ("ctrl+z",), lambda f: f.sculpting.undo(), True),
        Command("Ctrl Shift Z", "do it again", ("ctrl+shift+z", "ctrl+y"), lambda f: f.sculpting.redo(), True),
        Command("Ctrl S", "save the land: PNG, TIFF or EXR", ("ctrl+s",), lambda f: f.sculpting.ask_to_save()),
    ],
    "Keep": [
        Command("P", "save the picture as PNG", ("p",), lambda f: f.keeping.shoot()),
        Command("R", "record what is seen as a film, or stop", ("r",), lambda f: f.keeping.toggle_recording()),
        Command("Y", "this view as a command line", ("y",), lambda f: f.keeping.tell_line()),
        Command("O", "save the mesh as it is drawn: GLB, PLY or OBJ", ("o",), lambda f: f.keeping.save_mesh()),
        Command("K", "bookmarks as a path for terrain-gl fly", ("k",), lambda f: f.keeping.save_path()),
        Command("drop a file", "open a map: drop its file on the window"),
    ],
    "Window": [
        Command("I", "show the figures, or not", ("i",), lambda f: f.toggle("figures")),
        Command("H  F1", "show this help, or not", ("h", "f1"), lambda f: f.turn_help()),
        Command("Esc", "cancel, put away, or quit", ("escape",), lambda f: f.escape()),
    ],
}

BY_KEY = {key: command for commands in GROUPS.values() for command in commands for key in command.keys}


def shown_lines() -> list[tuple[str, str, str]]:
    """Group, keys and help of every line that is to be read, each once."""
    lines = [(group, c.shown, c.help) for group, commands in GROUPS.items() for c in commands if c.shown]
    return list(dict.fromkeys(lines))
