"""The command line, `terrain-gl`: each subcommand is a short module over the Python API.

Exit status: 0 done, 1 the work failed, 2 wrong use. An error is one line on standard error.
"""

import argparse
import io
import os
import shlex
import sys
from collections.abc import Sequence
from importlib import import_module

from ..basics.exceptions import TerrainError, UsageError
from ..basics.version import __version__
from . import signals
from .parsing import Parser, join_negative, unknown, with_command
from .text import printable

COMMANDS = (
    "info",
    "generate",
    "build",
    "shot",
    "view",
    "measure",
    "mesh",
    "tiles",
    "check",
    "compare",
    "fly",
    "diff",
    "bench",
    "cache",
)


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command; returns the exit status."""
    # a stream is None if the caller has closed it; the next file that is opened would then become standard output
    sys.stdout = sys.stdout or open(os.devnull, "w")  # noqa: SIM115
    sys.stderr = sys.stderr or open(os.devnull, "w")  # noqa: SIM115
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # before numpy: OpenBLAS threads wait busily
    if argv is None:
        for stream in (sys.stdout, sys.stderr):  # ASCII and Latin-1 lack some of our characters
            if isinstance(stream, io.TextIOWrapper):
                stream.reconfigure(errors="backslashreplace")
        signals.listen()
    try:
        # these import numpy, which takes a while; signals are handled already
        told = import_module(".records", __name__).told
        names = tuple(import_module("..files.maps", __package__).bundled())
        words = with_command(join_negative(sys.argv[1:] if argv is None else argv), COMMANDS, names)
        if words and words[0] not in COMMANDS and not words[0].startswith("-"):
            raise UsageError(unknown(words[0], COMMANDS, names))
        given = parser([word for word in words[:1] if word in COMMANDS] or COMMANDS).parse_args(words)
        given.command_line = shlex.join(["terrain-gl", *words])
        status = given.run(told(given.record, given))
        sys.stdout.flush()
        return status
    except SystemExit as done:  # argparse, after --help and on wrong use
        return int(done.code or 0)
    except KeyboardInterrupt:
        return 130
    except BrokenPipeError:
        _drop_output()
        return 1
    except (TerrainError, OSError, MemoryError) as error:
        if isinstance(error, OSError) and error.filename is None:
            _drop_output()
        return _complain(error)
    finally:
        if argv is None:
            signals.rest()


def parser(names: Sequence[str] = COMMANDS) -> argparse.ArgumentParser:
    """Make the parser of the command line, for some commands. This imports them, so `main` first handles Ctrl-C."""
    top = Parser(
        prog="terrain-gl",
        description="Heightmaps drawn with OpenGL tessellation at a certified screen-space error.",
        epilog="terrain-gl dem.tif opens a window on a map; each command has its own --help\n"
        "example: terrain-gl shot alpine -o alpine.png",
    )
    top.add_argument("--version", action="version", version=f"terrain-gl {__version__}")
    commands = top.add_subparsers(metavar="COMMAND", required=True)
    for name in names:
        import_module(f".{name}", __name__).add(commands)
    return top


def _complain(error: Exception) -> int:
    print(f"terrain-gl: {printable(_reason(error))}", file=sys.stderr)
    return 2 if isinstance(error, UsageError) else 1


def _reason(error: Exception) -> str:
    if isinstance(error, OSError):
        return f"{error.filename or 'standard output'}: {error.strerror or error}"
    return str(error) or "not enough memory"


def _drop_output() -> None:
    # from the Python manual: otherwise the interpreter fails again when it flushes the stream
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
