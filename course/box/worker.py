"""Run one student's file: read a request, call the function that it names, write the answer.

Run: python -I worker.py FILE walled|open|ours. Requests come on standard input, answers go to standard output. What the
student's code prints goes to the file `printed` beside it. The file as it was handed out is beside it, as `ORIGINAL`.
"""

from __future__ import annotations

import ast
import errno
import os
import sys
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, BinaryIO

HERE = Path(__file__).parent
WITHOUT = ("terrain_gl", "course")  # cannot be imported, because students write these functions themselves
ORIGINAL = "handed_out.py"


class LookUp:
    """Refuses to import what the student writes."""

    def find_spec(self, name: str, path: object = None, target: object = None) -> None:
        """None for every other module, so that Python goes on with its search."""
        if name.partition(".")[0] in WITHOUT:
            raise ImportError(f"a check runs without {name}: write it yourself, and look it up afterwards")


def main() -> None:
    """Serve requests until standard input ends."""
    file, walled = Path(sys.argv[1]), sys.argv[2] == "walled"
    requests, answers = _own_streams(file.with_name("printed"))
    os.environ |= {
        f"{name}_NUM_THREADS": "1" for name in ("OPENBLAS", "OMP", "MKL")
    }  # a thread that starts before the walls are up is not limited by them
    sys.path.insert(0, str(HERE))
    import walls

    walls.limit(walled)
    if walled:
        walls.landlock(file.parent)
        walls.seccomp()
    import wire

    sys.path.remove(str(HERE))
    sys.meta_path.insert(0, LookUp())
    names: dict[str, Any] = {"__name__": "student", "__file__": str(file)}
    problem = _attempt(lambda: exec(compile(file.read_text(encoding="utf-8"), file.name, "exec"), names), file)
    while True:
        try:
            name, args, kwargs, replaced = wire.read(requests)
        except EOFError:
            return
        answer = problem if "error" in problem else _attempt(partial(_call, names, name, args, kwargs, replaced), file)
        try:
            message = wire.pack(answer)
        except (TypeError, ValueError, RecursionError) as error:
            why = "lists in lists, too deep" if isinstance(error, RecursionError) else error
            message = wire.pack({"error": f"{name}(): {why}", "blank": False})
        answers.write(message)
        answers.flush()


def _own_streams(printed: Path) -> tuple[BinaryIO, BinaryIO]:
    """Keep the pipes for requests and answers, and give the student's code other streams."""
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


def _call(
    names: dict[str, Any], name: str, args: tuple[Any, ...], kwargs: dict[str, Any], replaced: dict[str, str]
) -> object:
    """Call a function. Other functions may be replaced by our expressions, to see whether this function uses them."""
    if not name:  # the request only asks whether the file can be loaded
        return None
    if name not in names:
        raise NameError(f"there is no function {name}()")
    kept = {other: names.get(other) for other in replaced}
    try:
        names.update({other: eval(text, {}) for other, text in replaced.items()})
        return names[name](*args, **kwargs)
    finally:
        names.update(kept)


def _attempt(action: Callable[[], object], file: Path) -> dict[str, Any]:
    """Run an action; return its value, or its error with the line in the student's file."""
    try:
        return {"value": action()}
    except BaseException as error:
        if sys.argv[2] == "ours":  # the line of an error in our file would not help a student
            return {"error": str(error)[:2000], "blank": False}
        frames = [frame for frame in traceback.extract_tb(error.__traceback__) if frame.filename == file.name]
        if isinstance(error, NotImplementedError) and frames:
            if frames[-1].name in _unwritten(file):
                return {"error": f"{frames[-1].name}() is not written yet", "blank": True}
            return {"error": f"line {frames[-1].lineno} still raises NotImplementedError: delete it", "blank": False}
        line = error.lineno if isinstance(error, SyntaxError) else frames[-1].lineno if frames else None
        where = f"line {line}: " if line else ""
        if isinstance(error, OSError) and error.errno == errno.EFBIG:
            return {"error": f"{where}File too large: your code prints or writes more than it may", "blank": False}
        return {"error": f"{where}{type(error).__name__}: {error}"[:300], "blank": False}


def _unwritten(file: Path) -> set[str]:
    """Functions that have the same code as in the file that was handed out; comments do not matter."""
    mine, theirs = (
        {part.name: ast.dump(part) for part in ast.parse(path.read_text("utf-8")).body if hasattr(part, "name")}
        for path in (file, file.with_name(ORIGINAL))
    )
    return {name for name, code in mine.items() if theirs.get(name) == code}


if __name__ == "__main__":
    main()
