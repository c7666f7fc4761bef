"""Run one student's file: read a request, call the function that it names, write the answer.

Run: python -I worker.py FILE walled|open. Requests come on standard input, answers go to standard output. What the
student's code prints goes to the file `printed` beside it.
"""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

HERE = Path(__file__).parent
WITHOUT = ("terrain_gl", "course")  # cannot be imported: students write a lesson, and do not look it up


def main() -> None:
    """Serve requests until standard input ends."""
    file, walled = Path(sys.argv[1]), sys.argv[2] == "walled"
    requests, answers = _own_streams(file.with_name("printed"))
    os.environ |= {
        f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")
    }  # a thread that started before has no walls
    sys.path.insert(0, str(HERE))
    import walls

    walls.limit(walled)
    if walled:
        walls.landlock(file.parent)
        walls.seccomp()
    import wire

    sys.path.remove(str(HERE))
    sys.modules.update(dict.fromkeys(WITHOUT))  # type: ignore[arg-type]
    names: dict[str, Any] = {"__name__": "student", "__file__": str(file)}
    problem = _attempt(lambda: exec(compile(file.read_text(encoding="utf-8"), file.name, "exec"), names), file)
    while True:
        try:
            name, args, kwargs = wire.read(requests)
        except EOFError:
            return
        answer = problem if "error" in problem else _attempt(partial(_call, names, name, args, kwargs), file)
        try:
            message = wire.pack(answer)
        except (TypeError, ValueError, RecursionError) as error:
            message = wire.pack({"error": f"{name}(): {error}", "blank": False})
        answers.write(message)
        answers.flush()


def _own_streams(printed: Path) -> tuple[BinaryIO, BinaryIO]:
    """Keep the pipes for requests and answers, and give the student's code others."""
    requests, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    for number, path, flags in (
        (0, os.devnull, os.O_RDONLY),
        (1, printed, os.O_WRONLY | os.O_CREAT | os.O_APPEND),
        (2, printed, os.O_WRONLY | os.O_CREAT | os.O_APPEND),
    ):
        opened = os.open(path, flags, 0o600)
        os.dup2(opened, number)
        os.close(opened)
    return requests, answers


def _call(names: dict[str, Any], name: str, args: tuple[Any, ...], kwargs: dict[str, Any]) -> object:
    if name not in names:
        raise NameError(f"there is no function {name}()")
    return names[name](*args, **kwargs)


def _attempt(action: Callable[[], object], file: Path) -> dict[str, Any]:
    """The value of an action, or the error and its line in the student's file."""
    try:
        return {"value": action()}
    except BaseException as error:
        lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file.name]
        if isinstance(error, SyntaxError):
            lines = [error.lineno]
        where = f"line {lines[-1]}: " if lines else ""
        text = f"{where}{type(error).__name__}: {error}"[:300]
        return {"error": text, "blank": isinstance(error, NotImplementedError)}


if __name__ == "__main__":
    main()
