"""The argument parser: a short and a full help, errors in one line, and a suggestion for an unknown command."""

import argparse
import difflib
import os
import re
import sys
import textwrap
from collections.abc import Sequence
from typing import Any, NoReturn

from .text import printable

# Shared options that the short help shows, together with all of a command's own options.
COMMON = {
    *("--spacing", "--z-scale", "--view", "--eye", "--target", "--at", "--size", "--max-error", "--triangles"),
    *("--method", "--style", "--look", "--sun", "--material", "--json"),
}
WIDTH = 80  # columns of the short help
SHARED = ("map", "camera", "detail", "picture", "technical")  # of these groups, the short help shows `COMMON`


class Parser(argparse.ArgumentParser):
    """An argument parser with errors in one line. It accepts no abbreviations, because new options could break them.

    `--help` shows the options that most people need. `--help-all` shows every option, if the command has it.
    """

    def __init__(self, **settings: Any) -> None:
        usual: dict[str, Any] = {"allow_abbrev": False, "formatter_class": argparse.RawDescriptionHelpFormatter}
        super().__init__(**usual | settings)
        self._positionals.title = "arguments"

    def error(self, message: str) -> NoReturn:
        """Print the error and exit with status 2."""
        self.exit(2, f"{self.prog}: {printable(message)} (see {self.prog} --help)\n")

    def parse_known_args(self, args: Any = None, namespace: Any = None) -> tuple[Any, list[str]]:
        """Parse; what a command doesn't know is refused by the command itself, with the option that is most like it."""
        given, unknown = super().parse_known_args(args, namespace)
        if unknown:
            near = difflib.get_close_matches(unknown[0].split("=")[0], self._option_string_actions, n=1)
            advice = f": did you mean {near[0]}?" if near else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}{advice}")
        return given, unknown

    def format_help(self) -> str:
        """The short help: the command's own options and the common ones."""
        if not any(isinstance(action, HelpAll) for action in self._actions):
            return super().format_help()
        formatter = self._get_formatter()
        formatter.add_text(f"usage: {self.prog} {self._needed()} [options]")
        formatter.add_text(textwrap.fill(" ".join(str(self.description).split()), WIDTH))
        groups = [(group.title in SHARED, group._group_actions) for group in self._action_groups]
        own = [action for is_shared, actions in groups if not is_shared for action in actions]
        common = [action for is_shared, actions in groups if is_shared for action in actions if _is_common(action)]
        for title, actions in (("arguments", own), ("common options", common)):
            formatter.start_section(title)
            formatter.add_arguments(map(_brief, actions))
            formatter.end_section()
        formatter.add_text(f"every option: {self.prog} --help-all\n{self.epilog}")
        return formatter.format_help()

    def format_all(self) -> str:
        """The help of all options."""
        self.usage = f"{self.prog} {self._needed()} [options]"
        return super().format_help()

    def _needed(self) -> str:
        """The required arguments, and the optional positional ones."""
        words = []
        for action in self._actions:
            if not action.option_strings:
                name = str(action.metavar)
                words.append({"?": f"[{name}]", "*": f"[{name} ...]"}.get(str(action.nargs), name))
            elif action.required:
                words.append(f"{action.option_strings[0]} {action.metavar}")
        return " ".join(words)


class HelpAll(argparse.Action):
    """Print the full help and exit."""

    def __init__(self, option_strings: Sequence[str], dest: str, **how: Any) -> None:
        super().__init__(option_strings, argparse.SUPPRESS, nargs=0, default=argparse.SUPPRESS, **how)

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        """Print the full help and exit."""
        assert isinstance(parser, Parser)
        parser._print_message(parser.format_all(), sys.stdout)
        parser.exit()


def join_negative(argv: Sequence[str]) -> list[str]:
    """Join `--eye -5,0,2` into `--eye=-5,0,2`: argparse would take -5,0,2 for an option."""
    joined: list[str] = []
    for word in argv:
        option = joined[-1] if joined else ""
        takes_it = re.fullmatch(r"--[a-z-]+", option) and "--" not in joined
        if takes_it and re.match(r"-(\.?\d|inf|nan)", word, re.IGNORECASE):
            joined[-1] = f"{option}={word}"
        else:
            joined.append(word)
    return joined


def with_command(words: list[str], commands: Sequence[str], maps: Sequence[str]) -> list[str]:
    """Put `view` before a map without a command: a bundled name, or a word that looks like a file."""
    first = words[0] if words else "-"
    if first in commands or first.startswith("-"):
        return words
    looks_like_a_file = os.path.exists(first) or os.path.sep in first or os.path.splitext(first)[1]
    return ["view", *words] if first in maps or looks_like_a_file else words


def unknown(word: str, commands: Sequence[str], maps: Sequence[str]) -> str:
    """The error for an unknown command, with a suggestion."""
    near = difflib.get_close_matches(word.lower(), [*commands, *maps], n=1)
    advice = f"did you mean {near[0]}?" if near else f"commands are {', '.join(commands)}"
    return f"{word}: neither a command nor a map: {advice}"


def _is_common(action: argparse.Action) -> bool:
    return action.help is not argparse.SUPPRESS and not COMMON.isdisjoint(action.option_strings)


def _brief(action: argparse.Action) -> argparse.Action:
    """The action with its choices in place of its help text. argparse itself would put them after the flag."""
    if not action.choices or not action.option_strings:
        return action
    names = textwrap.shorten(", ".join(map(str, action.choices)), WIDTH - 26, placeholder=" …")
    return argparse.Action(action.option_strings, action.dest, metavar="NAME", help=names)
