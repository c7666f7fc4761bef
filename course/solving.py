"""Solutions, the students' blanks that are made from them, and the wrong answers that every check rejects.

A solution is between two comments; the blank has one line instead:

    # solution            →    raise NotImplementedError("write this")
    ...
    # end
"""

from __future__ import annotations

import re
import shutil
import tempfile
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from . import truths, withheld
from .folders import BLANKS, HERE, LESSONS, SEED, lessons

SOLUTIONS = HERE / "solutions"
# The students' tree: the entries of the top folder that are copied, and the names that are never copied.
HANDED_OUT = (
    *("README.md", "CHANGELOG.md", "CONTRIBUTING.md", "LICENSE", "Dockerfile", "pyproject.toml", "setup.cfg"),
    *("terrain_gl", "glsl", "heightmaps", "examples", "docs", "tests", "course"),
)
APART = (
    *(
        "solutions",
        "LECTURERS.md",
        "FACTS.md",
        "grading.py",
        "solving.py",
        "mutants.py",
        "similar.py",
        "figure.py",
        "rivals.py",
        "leaderboard.py",
        "real.py",
        "withheld.py",
        "courses.py",
        "test_course*.py",
        "test_reference.py",
        "numbers_of_pages.py",
        "test_numbers.py",
        "blanks",
    ),
    *("*.egg-info", "__pycache__", ".*"),
)
MAPS = 3  # seeds whose true values students get
_LECTURERS = re.compile(r"^<!-- lecturers -->\n.*?^<!-- end -->\n", re.MULTILINE | re.DOTALL)
_PYTHON = re.compile(r"^([ \t]*)# solution\n.*?^[ \t]*# end\n", re.MULTILINE | re.DOTALL)
_SHADER = re.compile(r"^([ \t]*)// solution\n.*?^[ \t]*// end\n", re.MULTILINE | re.DOTALL)


class Wrong(NamedTuple):
    """A wrong answer: the solution with one thing changed."""

    name: str
    why: str
    text: str
    task: str  # the number of the task that is changed, such as 3.2


def solution(folder: Path) -> Path:
    """The solution of a lesson, given by its folder in lessons/."""
    found = [path for path in (SOLUTIONS / folder.name).iterdir() if path.stem == "solution"]
    return found[0]


def clean(text: str) -> str:
    """A solution without the comments `# solution` and `# end`."""
    return re.sub(r"^[ \t]*(#|//) (solution|end)\n", "", text, flags=re.MULTILINE)


def blank(text: str) -> str:
    """What the student gets: a solution with each marked part left out."""
    text = _PYTHON.sub(r'\1raise NotImplementedError("write this")\n', text)
    return _SHADER.sub(r"\1// write this\n", text)


def wrong_answers(folder: Path) -> list[Wrong]:
    """The wrong answers in a lesson's file; each replaces a text that occurs once in the solution."""
    text = clean(solution(folder).read_text(encoding="utf-8"))
    listed = tomllib.loads((SOLUTIONS / folder.name / "wrong.toml").read_text(encoding="utf-8"))
    found = []
    for name, entry in listed.items():
        old, new = entry["old"].strip("\n"), entry["new"].strip("\n")
        if text.count(old) != 1:
            raise ValueError(
                f"{folder.name}/wrong.toml: [{name}]: its old text occurs {text.count(old)} times, not once"
            )
        before = re.findall(r"\b\d+\.\d\b(?= [A-Z])", text[: text.index(old)])  # as functions' first lines have them
        found.append(Wrong(name, entry["why"], text.replace(old, new), before[-1] if before else ""))
    return found


def write_blanks() -> list[Path]:
    """Write the student's file of every lesson again; return those that changed."""
    changed = []
    for folder in lessons():
        source = solution(folder)
        path, text = folder / f"student{source.suffix}", blank(source.read_text(encoding="utf-8"))
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
            changed.append(path)
    return changed


def students_tree(out: Path, seed: int = 1, solved: Sequence[Path] = ()) -> None:
    """Write what students get: this repository without solutions and lecturers' parts, with fresh blanks.

    They install it and read every file that a page names. `seed` and the two seeds after it choose the maps of their
    checks, which have stored values in place of code. The solutions of lessons in `solved` are there for
    `picture --fill`.
    """
    copy_project(out)
    course = out / HERE.name
    (course / SEED.name).write_text(f"{seed}\n", encoding="utf-8")
    (course / BLANKS.name).mkdir()
    for folder in solved:
        (course / "solved").mkdir(exist_ok=True)
        text = clean(solution(folder).read_text(encoding="utf-8"))
        (course / "solved" / folder.name).write_text(text, encoding="utf-8")
    for folder in lessons():
        source = solution(folder)
        text = blank(source.read_text(encoding="utf-8"))
        (course / LESSONS.name / folder.name / f"student{source.suffix}").write_text(text, encoding="utf-8")
        (course / BLANKS.name / folder.name).write_text(text, encoding="utf-8")
        for each in range(seed, seed + MAPS):
            truths.write(course / truths.STORED.name / folder.name / str(each), _true_values(folder, each))
        check = course / LESSONS.name / folder.name / "check.py"
        check.write_text(truths.without_code(check.read_text(encoding="utf-8")), encoding="utf-8")


def copy_project(out: Path) -> None:
    """Copy this repository without what has answers: solutions, lecturers' parts, the reference, tests that need it."""
    shutil.copytree(HERE.parent, out, ignore=_left_out)
    for path in out.rglob("*.md"):
        text = path.read_text(encoding="utf-8")
        path.write_text(withheld.without_links(_LECTURERS.sub("", text)), encoding="utf-8")
    for path in (out / "tests").rglob("*.py"):
        text = path.read_text(encoding="utf-8")
        path.write_text(withheld.without_reference(text), encoding="utf-8")
        if withheld.has_tests(text) and not withheld.has_tests(path.read_text(encoding="utf-8")):
            path.unlink()
    packages = (out / "setup.cfg").read_text(encoding="utf-8")
    (out / "setup.cfg").write_text(packages.replace("    terrain_gl.reference\n", ""), encoding="utf-8")


def _true_values(folder: Path, seed: int) -> list[list[Any]]:
    """What the private functions of a lesson's check return for its solution, task by task."""
    from .checking import EXACT, NOT_RUN, check, lesson

    found: list[list[Any]] = []
    with tempfile.TemporaryDirectory() as beside:
        file = Path(beside, f"student{solution(folder).suffix}")
        file.write_text(clean(solution(folder).read_text(encoding="utf-8")), encoding="utf-8")
        for outcome in check(lesson(int(folder.name[:2])), file, seed):
            if outcome.verdict not in (EXACT, NOT_RUN):
                raise RuntimeError(f"the solution of {outcome.task.title} is {outcome.verdict}: {outcome.lines}")
            found.append(truths.recorded())
    return found


def _left_out(folder: str, names: list[str]) -> set[str]:
    """The names in a folder that the students' tree leaves out."""
    top = Path(folder) == HERE.parent
    kept = {name for name in names if not top or name in HANDED_OUT}
    hidden = shutil.ignore_patterns(*APART)(folder, names)
    if Path(folder) == HERE.parent / "docs":
        hidden |= {"examples", "figures.py"}  # pages that the site's program writes; figures drawn with the reference
    hidden |= {Path(path).name for path in withheld.PATHS if Path(folder) == (HERE.parent / path).parent}
    return set(names) - kept | hidden
