"""Grade a class of forty students, for the numbers in course/LECTURERS.md.

Every student hands in all lessons. A quarter of the students hands in blank answers, a quarter wrong, a quarter right
and a quarter malicious ones. A malicious answer loops without end, deletes what it finds, prints a gigabyte, takes all
memory, or starts processes. The table must have all points for the right answers, and none for blank and malicious
ones. Files beside the folder of submissions must still be there, and no process may be left.

Run: python benchmarks/grading.py FOLDER [STUDENTS [SECONDS]]
"""

import csv
import os
import shutil
import subprocess
import sys
import time
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

from course import folders, solving  # noqa: E402

KINDS = ("blank", "wrong", "right", "malicious")
MALICE = {
    "loops": "while True: pass\n",
    "deletes": "import os, shutil\nfor path in (OUTSIDE, os.path.expanduser('~'), '.', '/tmp'):\n"
    "    shutil.rmtree(path, ignore_errors=True)\n",
    "prints": "for _ in range(1000): print('x' * 10**6)\n",
    "allocates": "kept = [bytes(10**8) for _ in range(10**4)]\n",
    "forks": "import os\nwhile True: os.fork()\n",
}


def main(folder: str, students: str = "40", seconds: str = "60") -> None:
    """Make the class, grade it, and look at the table."""
    root = Path(folder).resolve()
    submissions, outside, scratch, table = root / "submissions", root / "outside", root / "scratch", root / "points.csv"
    shutil.rmtree(submissions, ignore_errors=True)
    for each in (outside, scratch):
        each.mkdir(parents=True, exist_ok=True)
    (outside / "kept").write_text("kept")
    for i in range(int(students)):
        hand_in(submissions / f"{i:02d}_{KINDS[i % len(KINDS)]}", i, outside)
    started = time.monotonic()
    subprocess.run(
        [sys.executable, "-m", "course", "grade", str(submissions), "-o", str(table), "--seconds", seconds],
        cwd=ROOT,
        env=os.environ | {"TMPDIR": str(scratch)},
        stdout=subprocess.DEVNULL,
        check=True,
    )
    took = time.monotonic() - started
    with open(table, newline="") as file:
        most, *rows = csv.DictReader(file)
    for kind in KINDS:
        sums = [float(row["sum"]) for row in rows if row["student"].endswith(kind)]
        print(f"{kind:9}  {len(sums)} students, {min(sums):g} to {max(sums):g} of {most['sum']} points")
        if kind == "right":
            assert all(each == float(most["sum"]) for each in sums), "a right answer has lost points"
        elif kind == "wrong":
            assert all(0 < each < float(most["sum"]) for each in sums), "a wrong answer has all points, or none"
        else:
            assert not any(sums), "a blank or malicious answer has points"
    assert (outside / "kept").read_text() == "kept", "something got out"
    assert not left(scratch), f"processes are left: {left(scratch)}"
    assert not list(scratch.iterdir()), "files are left"
    print(f"{took:.0f} s, {took / len(rows):.1f} s a student, on {os.cpu_count()} cores; {most['notes']}")


def hand_in(student: Path, number: int, outside: Path) -> None:
    """One student's lessons."""
    kind = KINDS[number % len(KINDS)]
    for folder in folders.lessons():
        text = solving.solution(folder).read_text(encoding="utf-8")
        if kind == "blank":
            text = solving.blank(text)
        elif kind == "right":
            text = solving.clean(text)
        elif kind == "wrong":
            answers = solving.wrong_answers(folder)
            text = answers[number // len(KINDS) % len(answers)].text
        else:
            malice = list(MALICE.values())
            text = f"OUTSIDE = {str(outside)!r}\n{malice[number // len(KINDS) % len(malice)]}"
        path = student / folder.name / "student.py"
        path.parent.mkdir(parents=True)
        path.write_text(text, encoding="utf-8")


def left(scratch: Path) -> list[str]:
    """Numbers of processes that still run a student's code."""
    commands = {path.parent.name: path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if path.exists()}
    return [number for number, words in commands.items() if bytes(scratch) in words]


if __name__ == "__main__":
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    main(*sys.argv[1:])
