"""Grade a class of forty students, for the numbers in course/LECTURERS.md.

Every student hands in all lessons. Twelve folders are hostile (`HOSTILE`); of the others a third is blank, a third
wrong and a third right. The table must have all points for right answers and none for blank and hostile ones, and a
page of feedback for each folder, with a reason for each task without points. Files beside the folder of submissions
must still be there, and no process may be left.

Run: python benchmarks/grading.py FOLDER [STUDENTS [SECONDS]]
"""

import ast
import csv
import os
import re
import resource
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from course import folders, solving  # noqa: E402

KINDS = ("blank", "wrong", "right")
# What each function of a hostile hand-in does, or its whole file.
FUNCTIONS = {
    "deep": "    found = []\n    for _ in range(3000): found = [found]\n    return found\n",
    "huge": "    import numpy as np\n    return np.zeros((1000000, 1, 1))\n",
    "nan": "    return float('nan')\n",
    "exits": "    import os\n    os._exit(0)\n",
    "prints": "    for _ in range(200): print('x' * 10**6)\n",
}
FILES = {
    "endless": "while True: pass\n",
    "forks": "import os\nwhile True: os.fork()\n",
    "deletes": "import os, shutil\nfor path in (OUTSIDE, os.path.expanduser('~'), '.', '/tmp'):\n"
    "    shutil.rmtree(path, ignore_errors=True)\n",
    "imports": "from terrain_gl import reference\n",
}
HOSTILE = (*FUNCTIONS, *FILES, "links", "copies", "empty")


def main(folder: str, students: str = "40", seconds: str = "20") -> None:
    """Make the class, grade it, and look at the table and the feedback."""
    root = Path(folder).resolve()
    submissions, outside, scratch, table = root / "submissions", root / "outside", root / "scratch", root / "points.csv"
    feedback = root / "feedback"
    for each in (submissions, feedback):
        shutil.rmtree(each, ignore_errors=True)
    for each in (submissions, outside, scratch):
        each.mkdir(parents=True, exist_ok=True)
    (outside / "kept").write_text("kept")
    for kind in HOSTILE:
        hostile(submissions / f"hostile_{kind}", kind, outside)
    for i in range(int(students) - len(HOSTILE)):
        hand_in(submissions / f"{i:02d}_{KINDS[i % len(KINDS)]}", i)
    started = time.monotonic()
    words = ["grade", str(submissions), "-o", str(table), "--seconds", seconds, "--feedback", str(feedback)]
    subprocess.run(
        [sys.executable, "-m", "course", *words],
        cwd=ROOT,
        env=os.environ | {"TMPDIR": str(scratch)},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    took, largest = time.monotonic() - started, resource.getrusage(resource.RUSAGE_CHILDREN).ru_maxrss
    with open(table, newline="") as file:
        most, *rows = csv.DictReader(file)
    assert len(rows) == int(students), "a folder has no row"
    for kind in KINDS:
        sums = [float(row["sum"]) for row in rows if row["student"].endswith(f"_{kind}")]
        print(f"{kind:9}  {len(sums)} students, {min(sums):g} to {max(sums):g} of {most['sum']} points")
        if kind == "right":
            assert all(each == float(most["sum"]) for each in sums), "a right answer has lost points"
        elif kind == "wrong":
            assert all(0 < each < float(most["sum"]) for each in sums), "a wrong answer has all points, or none"
        else:
            assert not any(sums), "a blank answer has points"
    for row in rows:
        text = (feedback / f"{row['student']}.txt").read_text()
        for part in re.split(r"^  (?=\w+ +\d+\.\d)", text, flags=re.M)[1:]:
            assert part.startswith(("exact", "close", "not run")) or re.search(r"^ {11}\S", part, re.M), part
        if row["student"].startswith("hostile_"):
            print(f"{row['student']:16}  {float(row['sum']):g} points; {row['notes'][:90]}")
            assert float(row["sum"]) == (float(most["sum"]) if row["student"].endswith("copies") else 0), row
    assert (outside / "kept").read_text() == "kept", "something got out"
    assert not left(scratch), f"processes are left: {left(scratch)}"
    assert not list(scratch.iterdir()), "files are left"
    print(f"{took:.0f} s, {took / len(rows):.1f} s a student, on {os.cpu_count()} cores; {most['notes']}")
    print(f"the largest process had {largest / 1024:.0f} MB")


def hand_in(student: Path, number: int) -> None:
    """One student's lessons."""
    kind = KINDS[number % len(KINDS)]
    for folder in folders.lessons():
        text = solving.solution(folder).read_text(encoding="utf-8")
        if kind == "blank":
            text = solving.blank(text)
        elif kind == "right":
            text = solving.clean(text)
        else:
            answers = solving.wrong_answers(folder)
            text = answers[number // len(KINDS) % len(answers)].text
        write(student / folder.name, text)


def hostile(student: Path, kind: str, outside: Path) -> None:
    """One hostile folder."""
    student.mkdir()
    for folder in folders.lessons():
        right = solving.clean(solving.solution(folder).read_text(encoding="utf-8"))
        blank = solving.blank(solving.solution(folder).read_text(encoding="utf-8"))
        if kind in FUNCTIONS:
            names = [part.name for part in ast.parse(blank).body if isinstance(part, ast.FunctionDef)]
            write(student / folder.name, "".join(f"def {name}(*a):\n{FUNCTIONS[kind]}" for name in names))
        elif kind in FILES:
            write(student / folder.name, f"OUTSIDE = {str(outside)!r}\n{FILES[kind]}")
        elif kind == "links":
            (student / folder.name).mkdir()
            (student / folder.name / "student.py").symlink_to(solving.solution(folder))
        elif kind == "copies":
            write(student / folder.name, right)
            write(student / "old" / folder.name, blank)


def write(folder: Path, text: str) -> None:
    """A student's file of a lesson."""
    folder.mkdir(parents=True)
    (folder / "student.py").write_text(text, encoding="utf-8")


def left(scratch: Path) -> list[str]:
    """Numbers of processes that still run a student's code."""
    commands = {path.parent.name: path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if path.exists()}
    return [number for number, words in commands.items() if bytes(scratch) in words]


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
