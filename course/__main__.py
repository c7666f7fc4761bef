"""The course's command: check a lesson, grade folders, make the students' tree.

Run: python -m course check 2
"""

from __future__ import annotations

import argparse
import io
import os
import secrets
import subprocess
import sys
from pathlib import Path

from . import truths
from .checking import EXACT, SECONDS, Lesson, check, lesson, points_text
from .folders import HERE, SEED, lessons
from .remote import StudentError

PICTURE = "check_{number:02d}.png"
GROWN = "picture_{number:02d}.png"


class UsageError(Exception):
    """Wrong use: one line."""


def main(arguments: list[str] | None = None) -> int:
    """Run a command; return the exit status."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):  # on Windows, a pipe cannot encode κ by default
            stream.reconfigure(errors="replace")
    options = _parser().parse_args(arguments)
    try:
        return options.run(options)
    except UsageError as error:
        print(f"course: {error}", file=sys.stderr)
        return 2
    except KeyboardInterrupt:
        return 130


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m course", description=__doc__.splitlines()[0])
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    one = commands.add_parser("check", help="check what you wrote for a lesson")
    one.add_argument("lesson", type=int, help="its number")
    one.add_argument("file", type=Path, nargs="?", help="your file; left out: the one in the lesson's folder")
    one.add_argument("--seed", type=int, default=_own_seed(), help="other maps, sizes and voids")
    one.add_argument("-o", "--picture", type=Path, help="where to draw the largest difference (check_NN.png)")
    one.set_defaults(run=_check)
    grow = commands.add_parser("picture", help="draw land with your own functions, up to a lesson")
    grow.add_argument("lesson", type=int, help="its number")
    grow.add_argument(
        "--fill", action="store_true", help="take the course's functions where you have none, if you were given them"
    )
    grow.add_argument("-o", "--picture", type=Path, help="the picture (picture_NN.png)")
    grow.add_argument(
        "--file", type=Path, default=Path("my_terrain.py"), help="the program that is written (my_terrain.py)"
    )
    grow.set_defaults(run=_picture)
    if (HERE / "solutions").is_dir():
        _lecturers(commands)
    return parser


def _own_seed() -> int:
    """The seed of this copy of the course."""
    return int(SEED.read_text(encoding="utf-8")) if SEED.is_file() else 1


def _lecturers(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    many = commands.add_parser("grade", help="grade folders, one for each student")
    many.add_argument("folder", type=Path, help="a folder with one folder for each student")
    many.add_argument("-o", "--output", type=Path, required=True, help="the table of points, CSV")
    many.add_argument("--lessons", default="", help="numbers with commas; left out: all")
    many.add_argument("--seed", type=int, help="left out: a random one, which the table records")
    many.add_argument("--seconds", type=float, default=SECONDS, help="time for a task")
    many.add_argument("--feedback", type=Path, help="a folder for one page to each student")
    many.add_argument("--jobs", type=int, default=max(1, (os.cpu_count() or 2) // 2), help="students at once")
    many.add_argument("--trust", action="store_true", help="grade although the sandbox is incomplete on this system")
    many.set_defaults(run=_grade)
    enter = commands.add_parser("enter", help="rank files that make meshes: fewest triangles at a checked error")
    enter.add_argument("folder", type=Path, help="a folder with one file for each entry")
    enter.add_argument("-o", "--output", type=Path, required=True, help="the table, CSV")
    enter.add_argument("--seed", type=int, help="left out: a random one, which is printed")
    enter.add_argument("--seconds", type=float, default=SECONDS, help="time for a mesh")
    enter.add_argument("--trust", action="store_true", help="run entries although the sandbox is incomplete")
    enter.set_defaults(run=_enter)
    tree = commands.add_parser("strip", help="copy the project without the course's solutions, for students")
    tree.add_argument("folder", type=Path, help="a new folder")
    tree.add_argument(
        "--seed", type=int, default=1, help="chooses the maps of its checks: one for each student, or all"
    )
    tree.add_argument("--solved", default="", help="lessons whose solutions are added for `picture --fill`, as 1,2")
    tree.set_defaults(run=_strip)
    mutants = commands.add_parser(
        "mutants", help="change the solutions token by token, and list what the checks accept"
    )
    mutants.add_argument("--lessons", default="", help="numbers with commas; left out: all")
    mutants.add_argument("--count", type=int, default=20, help="mutants of a lesson")
    mutants.add_argument("--seed", type=int, default=1, help="chooses the mutants, and the maps of the checks")
    mutants.set_defaults(run=_mutants)
    pictures = commands.add_parser("pictures", help="draw every lesson's picture of a right solution again")
    pictures.set_defaults(run=_pictures)
    blanks = commands.add_parser("blanks", help="write every lesson's blanks, and its task in the real code, again")
    blanks.set_defaults(run=_blanks)
    figures = commands.add_parser("figures", help="draw every lesson's figure again")
    figures.set_defaults(run=_figures)


def _lesson(number: int) -> Lesson:
    try:
        return lesson(number)
    except KeyError:
        known = ", ".join(str(int(path.name[:2])) for path in lessons())
        raise UsageError(f"there is no lesson {number}; there are {known}") from None


def _check(options: argparse.Namespace) -> int:
    found = _lesson(options.lesson)
    file = options.file or found.folder / found.file
    if not file.is_file():
        raise UsageError(f"{file}: no such file")
    known = truths.seeds(found.folder)
    if known and options.seed not in known:
        raise UsageError(f"this copy has maps of the seeds {', '.join(map(str, known))}")
    print(f"Lesson {found.number}: {found.title}")
    worst, points, not_run, printed = [], 0.0, 0.0, ""
    for outcome in check(found, file, options.seed):
        points, not_run = points + outcome.points, not_run + outcome.not_run
        print(f"  {outcome.verdict:7}  {outcome.task.title}")
        for line in outcome.lines:
            print(f"         {line}")
        if outcome.printed not in ("", printed):
            printed = outcome.printed
            print("         your code printed:", *printed.splitlines()[:20], sep="\n         | ")
        worst += [finding for finding in outcome.findings if finding.verdict != EXACT]
    print(f"{points_text(points, not_run)} of {found.points} points")
    picture = options.picture or Path(PICTURE.format(number=found.number))
    if worst:
        from .picture import draw

        if any(draw(finding, picture) for finding in worst):
            print(f"the difference is drawn in {picture}")
    return 1 if worst else 0


def _picture(options: argparse.Namespace) -> int:
    from .grow import GrowError, picture

    found = _lesson(options.lesson)
    out = options.picture or Path(GROWN.format(number=found.number))
    try:
        said = picture(found.number, options.fill, out, options.file)
    except GrowError as error:
        raise UsageError(str(error)) from None
    print(said)
    print(f"{options.file} drew {out}: left yours, right that of a right solution")
    return 0


def _grade(options: argparse.Namespace) -> int:
    from .grading import grade, submissions, write_feedback, write_table

    if not options.folder.is_dir():
        raise UsageError(f"{options.folder}: no such folder")
    if not submissions(options.folder):
        raise UsageError(f"{options.folder}: it is empty; each student has a folder in it")
    if not options.output.parent.is_dir():
        raise UsageError(f"{options.output.parent}: no such folder")
    if options.feedback is not None and options.feedback.exists():
        raise UsageError(f"{options.feedback}: exists already")
    _try_walls(options)
    chosen = _chosen(options)
    seed = secrets.randbelow(2**31) if options.seed is None else options.seed
    found = grade(options.folder, chosen, seed, options.seconds, options.jobs, lambda name: print(name, flush=True))
    write_table(found, chosen, seed, options.output)
    print(f"wrote {options.output}: {len(found)} students, {len(chosen)} lessons, seed {seed}")
    if options.feedback is not None:
        write_feedback(found, options.feedback)
        print(f"wrote {options.feedback}: a page for each student")
    why = sorted({why for student in found.values() for each in student for why in each.why_not_run})
    if why:
        print(f"some tasks were not run, and count neither way: {'; '.join(why)}")
    return 0


def _try_walls(options: argparse.Namespace) -> None:
    """Try to get out of the sandbox, before any student's code runs."""
    from .grading import open_walls

    try:
        missing = open_walls()
    except StudentError as error:  # the sandbox may not allow reading the folder of Python, for example if it is a link
        raise UsageError(f"no code runs behind the walls with {sys.executable}: {error}") from None
    if missing and not options.trust:
        raise UsageError(f"on this system a student's code {', '.join(missing)}; use the container, or --trust")


def _enter(options: argparse.Namespace) -> int:
    from .leaderboard import board, write

    if not options.folder.is_dir() or not (files := sorted(options.folder.glob("*.py"))):
        raise UsageError(f"{options.folder}: no folder with files of entries, such as anna.py")
    _try_walls(options)
    seed = secrets.randbelow(2**31) if options.seed is None else options.seed
    rows = board({path.stem: path for path in files}, seed, options.seconds)
    for place, row in enumerate(rows, 1):
        print(f"{'-' if row.reason else place:>3}  {row.name:20} {sum(row.triangles):8,} triangles  {row.reason}")
    write(rows, options.output)
    print(f"wrote {options.output}: {len(rows)} entries, seed {seed}")
    return 0


def _numbers(text: str) -> list[int]:
    try:
        return [int(part) for part in text.split(",") if part]
    except ValueError:
        raise UsageError(f"{text}: expected numbers of lessons with commas, as 2,3,6") from None


def _strip(options: argparse.Namespace) -> int:
    from .solving import students_tree

    if options.folder.exists():
        raise UsageError(f"{options.folder}: exists already")
    students_tree(options.folder, options.seed, [_lesson(number).folder for number in _numbers(options.solved)])
    print(f"wrote {options.folder}")
    return 0


def _chosen(options: argparse.Namespace) -> list[Lesson]:
    """The lessons that an option names, or all."""
    named = [_lesson(number) for number in _numbers(options.lessons)]
    return named or [_lesson(int(path.name[:2])) for path in lessons()]


def _mutants(options: argparse.Namespace) -> int:
    from .mutants import SURVIVED, verdicts

    left = 0
    for each in _chosen(options):
        counts: dict[str, int] = {}
        for mutant, said, why in verdicts(each, options.count, options.seed):
            counts[said] = counts.get(said, 0) + 1
            if why or said == SURVIVED:
                print(f"  {mutant.task}  {mutant.line}\n    now  {mutant.changed}\n    {why or 'NOT EXPLAINED'}")
        left += counts.get(SURVIVED, 0)
        print(f"lesson {each.number}: {', '.join(f'{n} {said}' for said, n in sorted(counts.items()))}", flush=True)
    print(f"{left} mutants survive without a reason")
    return 1 if left else 0


def _blanks(options: argparse.Namespace) -> int:
    from .real import write_tasks
    from .solving import write_blanks

    for path in [*write_blanks(), *write_tasks(lessons())]:
        print(f"wrote {path}")
    return 0


def _pictures(options: argparse.Namespace) -> int:
    from .grow import ORDER, draw_right

    for number in ORDER:
        print(f"lesson {number}: {draw_right(number)}")
    return 0


def _figures(options: argparse.Namespace) -> int:
    for folder in lessons():
        subprocess.run([sys.executable, str(folder / "figure.py"), str(folder / "figure.png")], check=True)
        print(f"drew {folder / 'figure.png'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
