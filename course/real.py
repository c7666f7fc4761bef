"""Tasks in the real code: one line of glsl/ or terrain_gl/ is changed, and named tests say what breaks.

The line and the tests are in the tree that students get.
"""

from __future__ import annotations

import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import NamedTuple

from . import withheld
from .solving import SOLUTIONS, copy_project

# The package that is installed here does not lend a tree what it lacks.
ALONE = f"import sys\nsys.modules |= dict.fromkeys({withheld.REFERENCE})\n"
HEADING = "## A task in the real code\n"


class Change(NamedTuple):
    """A changed line: where it is, why tests fail, and which tests fail and pass."""

    file: str
    old: str
    new: str
    why: str
    fails: list[str]
    passes: list[str]


def change(folder: Path) -> Change:
    """The change of a lesson, given by its folder in lessons/."""
    text = (SOLUTIONS / folder.name / "real.toml").read_text(encoding="utf-8")
    return Change(**tomllib.loads(text))


def changed_tree(each: Change, out: Path) -> None:
    """Copy what students get, and change the line there. The project's own files stay as they are."""
    copy_project(out)
    path = out / each.file
    text = path.read_text(encoding="utf-8")
    if text.count(each.old) != 1:
        raise ValueError(f"{each.file}: the old line occurs {text.count(each.old)} times, not once")
    path.write_text(text.replace(each.old, each.new), encoding="utf-8")


def outcomes(tree: Path, tests: list[str]) -> dict[str, str]:
    """What tests of a tree say of its code: passed, failed or skipped."""
    code = f"{ALONE}import pytest\nsys.exit(pytest.main(sys.argv[1:]))"
    command = [sys.executable, "-P", "-c", code, "-q", "-rA", "--tb=no", "-p", "no:cacheprovider", *tests]
    done = subprocess.run(command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, capture_output=True, text=True)
    found = {
        name: word.lower() for word, name in re.findall(r"^(PASSED|FAILED|ERROR) (.*?)(?: - .*)?$", done.stdout, re.M)
    }
    if not found and "skipped" not in done.stdout:
        raise RuntimeError(done.stdout + done.stderr)
    return {test: found.get(test, "skipped") for test in tests}


def task_text(each: Change) -> str:
    """The task as a lesson's page has it; the order of the tests does not show which of them fail."""
    tests = "\n".join(f'        "{test}" \\' for test in sorted([*each.fails, *each.passes])).rstrip(" \\")
    new = f"by\n\n    {each.new.strip()}" if each.new else "by nothing."
    return f"""In [`{each.file}`](../../../{each.file}) replace the line

    {each.old.strip()}

{new}

Which of these tests fail now, and why? Write down your answer. Run the tests, explain the result, and restore the line.

    .venv/bin/python -m pytest -q \\
{tests}
"""


def write_tasks(lessons: list[Path]) -> list[Path]:
    """Write the tasks into the pages again; return those that changed."""
    changed = []
    for folder in lessons:
        path = folder / "page.md"
        if not (SOLUTIONS / folder.name / "real.toml").is_file():
            continue
        page = path.read_text(encoding="utf-8")
        before, _, after = page.partition("## An open question\n")
        before = before.partition(HEADING)[0]
        text = f"{before}{HEADING}\n{task_text(change(folder))}\n## An open question\n{after}"
        if text != page:
            path.write_text(text, encoding="utf-8")
            changed.append(path)
    return changed
