"""Grading: forty folders become a table; nothing hangs, and nothing gets out of its folder."""

import ast
import base64
import csv
import os
import re
import shutil
import subprocess
import sys
import time
import zlib
from pathlib import Path

import courses
import pytest
from courses import ROOT, checking, solved, solving

pytest.importorskip("course.grading")
from course import grading, similar  # noqa: E402
from course.box import walls  # noqa: E402
from course.remote import StudentError  # noqa: E402
from terrain_gl import reference  # noqa: E402

LESSON = checking.lesson(2)
BLANK = solving.blank(solving.solution(LESSON.folder).read_text(encoding="utf-8"))
HEAD = "def shift_px(*a):\n"
MALICIOUS = {
    "endless": HEAD + "    while True: pass\n",
    "endless_import": "while True: pass\n",
    "prints": HEAD + "    while True: print('x' * 10**6)\n",
    "allocates": HEAD + "    return [bytes(10**8) for _ in range(10**4)]\n",
    "deletes": "import shutil, os\nshutil.rmtree(OUTSIDE, ignore_errors=True)\n"
    + HEAD
    + "    return os.listdir(OUTSIDE)\n",
    "deletes_own": "import shutil\nshutil.rmtree('.', ignore_errors=True)\n",
    "exits": "import os\nos._exit(0)\n",
    "forges": HEAD
    + "    import os\n    for n in range(3, 20):\n        try: os.write(n, bytes(64))\n        except OSError: pass\n",
    "huge_answer": HEAD + "    import numpy as np\n    return np.zeros(2**28)\n",
    "forks": HEAD + "    import os\n    os.fork()\n    os.setsid()\n    while True: pass\n",
    "forks_on": HEAD + "    import os\n    while True:\n        try: os.fork()\n        except OSError: pass\n",
    "threads": HEAD + "    import threading\n    while True: threading.Thread(target=input).start()\n",
    "raises": HEAD + "    raise SystemExit(0)\n",
    "object": HEAD + "    return object()\n",
    "unreadable": b"\xff\xfe\x00",
    "deep": HEAD + "    deep = []\n    for _ in range(3000): deep = [deep]\n    return deep\n",
    "endless_print": "import sys\n" + HEAD + "    while True: sys.stderr.write('x' * 10**6)\n",
    "nan": HEAD + "    return float('nan')\n",
    "imports_reference": "from terrain_gl import reference\n" + HEAD + "    return reference.error_px(*a)\n",
    "tall": HEAD + "    import numpy as np\n    return np.zeros((10**6, 1, 1))\n",
}
REFERENCE = Path(reference.__file__).parent  # installed, editable or not
WHERE = f"PACKAGE, SAT, CHECK, ROOT = {str(REFERENCE.parent)!r}, {str(REFERENCE / 'sat.py')!r}, "
WHERE += f"{str(LESSON.folder / 'check.py')!r}, {str(ROOT)!r}\n"
# ways to what the project computes: each makes a function `found` where there are no walls
STOLEN = {
    "by_import": "from terrain_gl import reference\nfound = reference.sat\n",
    "by_importlib": "import importlib\nfound = importlib.import_module('terrain_' + 'gl.reference').sat\n",
    "without_guard": "import sys\nsys.meta_path[:] = [e for e in sys.meta_path if type(e).__name__ != 'LookUp']\n"
    "sys.path.append(ROOT)\nfrom terrain_gl import reference\nfound = reference.sat\n",
    "by_place": "import importlib.util as util\nspec = util.spec_from_file_location('sat', SAT)\n"
    "module = util.module_from_spec(spec)\nspec.loader.exec_module(module)\nfound = module.sat\n",
    "by_text": "names = {}\nexec(open(SAT).read(), names)\nfound = names['sat']\n",
    "by_runpy": "import runpy\nfound = runpy.run_path(SAT)['sat']\n",
    "by_link": "import os, runpy\nos.symlink(SAT, 'mine.py')\nfound = runpy.run_path('mine.py')['sat']\n",
    "by_process": "import subprocess\ntext = subprocess.run(['cat', SAT], capture_output=True, check=True).stdout\n"
    "names = {}\nexec(text, names)\nfound = names['sat']\n",
    "by_check": "names = {}\nexec(open(CHECK).read(), names)\nfound = names['moved_px']\n",
    "by_course": "import sys\nsys.path.append(ROOT)\nfrom course import land\nfound = land.land\n",
    "by_gpu": "import terrain_gl\nfound = terrain_gl.Renderer\n",
    "by_own_gpu": "import moderngl\nfound = moderngl.create_context\n",
}
# an answer whose shape makes a check's own arithmetic need more memory than there is: 1.4 compares it with a map
TALL_FILL = "\n\ndef fill(*a):\n    return np.zeros((1000000, 1, 1))\n"


def hand_in(folder, name, text):
    path = folder / name / LESSON.folder.name / "student.py"
    path.parent.mkdir(parents=True)
    path.write_bytes(text if isinstance(text, bytes) else text.encode())


@pytest.fixture(scope="module")
def graded(tmp_path_factory):
    """Blank, wrong, right and malicious answers of a class, graded by the command: rows by name, and the seconds."""
    root = tmp_path_factory.mktemp("class")
    folder, outside = root / "submissions", root / "outside"
    outside.mkdir()
    (root / "scratch").mkdir()
    (outside / "kept").write_text("kept")
    hand_in(folder, "blank", BLANK)
    hand_in(folder, "right", solved(2))
    wrong = {wrong.name: wrong.text for wrong in solving.wrong_answers(LESSON.folder)}
    hand_in(folder, "wrong", wrong["distance"])
    hand_in(folder, "loops_once", f"{solved(2)}\n\ndef bound_px(*a):\n    while True: pass\n")
    for name, text in MALICIOUS.items():
        hand_in(folder, name, text if isinstance(text, bytes) else f"OUTSIDE = {str(outside)!r}\n{text}")
    for name, text in STOLEN.items():
        hand_in(folder, name, WHERE + text + "shift_px = tolerance_m = bound_px = found\n")
    (folder / "nothing").mkdir()
    (folder / "file.zip").write_text("not unpacked")
    os.symlink(outside, folder / "linked")
    hand_in(folder, "two_copies", solved(2))
    hand_in(folder, "two_copies/old", BLANK)
    renamed = "# mine\n" + solved(2).replace("factor", "what_it_is").replace("rise_m)", "rise_m )")
    hand_in(folder, "copied", renamed)
    hand_in(folder, "link", "")
    os.remove(folder / "link" / LESSON.folder.name / "student.py")
    os.symlink("/etc/passwd", folder / "link" / LESSON.folder.name / "student.py")
    command = [sys.executable, "-m", "course", "grade", str(folder), "-o", str(root / "points.csv"), "--lessons", "2"]
    start = time.monotonic()
    done = subprocess.run(
        [*command, "--seed", "4", "--seconds", "3", "--jobs", "2", "--feedback", str(root / "feedback")],
        cwd=ROOT,
        env=os.environ | {"TMPDIR": str(root / "scratch")},
        capture_output=True,
        text=True,
    )
    if "on this system" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    with open(root / "points.csv", newline="") as file:
        rows = {row["student"]: row for row in csv.DictReader(file)}
    assert "a page for each student" in done.stdout
    return rows, time.monotonic() - start, outside, folder


@pytest.mark.slow
def test_every_student_has_a_row(graded):
    rows, _, _, folder = graded
    assert set(rows) == {"(most)", *(path.name for path in folder.iterdir())}
    assert rows["(most)"]["lesson 2"] == rows["right"]["sum"] == "10"
    assert rows["(most)"]["notes"] == "seed 4"


def test_points_follow_the_answers(graded):
    rows, _, _, _ = graded
    assert rows["blank"]["sum"] == "0" and rows["wrong"]["sum"] == "7" and rows["loops_once"]["sum"] == "6"
    assert rows["nothing"]["notes"] == "2: not handed in" and rows["link"]["notes"] == "2: not a plain file"


@pytest.mark.parametrize("name", MALICIOUS)
def test_malicious_answers_have_no_points(graded, name):
    rows, _, _, _ = graded
    assert rows[name]["sum"] == "0"


def test_every_row_without_points_has_a_reason(graded):
    """Those that got nothing: in the notes, or in the feedback under each task."""
    rows, _, _, folder = graded
    notes = {name: row["notes"] for name, row in rows.items()}
    assert notes["file.zip"] == "2: not a folder" and notes["linked"] == "2: not a folder: a link"
    assert "2 files: 02_screen_error/student.py is graded" in notes["two_copies"] and rows["two_copies"]["sum"] == "10"
    for name in set(rows) - {"(most)"}:
        text = (folder.parent / "feedback" / f"{name}.txt").read_text()
        wrong = [
            part
            for part in re.split(r"^  (?=\w+ +\d\.\d)", text, flags=re.M)[1:]
            if part.startswith(("wrong", "blank"))
        ]
        assert all(re.search(r"^ {11}\S", part, re.M) for part in wrong), text
        assert rows[name]["sum"] != "0" or wrong or notes[name], name


def test_copies_are_told_whatever_their_names_and_comments(graded):
    notes = {name: row["notes"] for name, row in graded[0].items()}
    assert all("100% like" in notes[name] for name in ("copied", "right", "two_copies"))
    assert not any("like" in notes[name] for name in (*MALICIOUS, "blank", "nothing"))


def test_a_copied_shader_is_told_whatever_its_names_are(tmp_path):
    """Words in the blank's comments, such as `post`, are no names of its code."""
    lesson = checking.lesson(8)
    changed = re.sub(r"//.*", "// mine", solved(8))
    for old, new in (("drawn", "seen"), ("levels", "parts"), ("post", "where")):
        assert re.search(rf"\b{old}\b", changed)
        changed = re.sub(rf"\b{old}\b", new, changed)
    (tmp_path / "anna.py").write_text(solved(8))
    (tmp_path / "ben.py").write_text(changed)
    found = similar.likenesses(lesson, {name: tmp_path / f"{name}.py" for name in ("anna", "ben")})
    assert [each.share for each in found if {each.one, each.other} == {"anna", "ben"}] == [1.0]


def test_other_solutions_of_one_task_are_not_alike():
    """The checks' own computations are answers by another hand: they share less than a fifth with the solutions."""
    for number in courses.NUMBERS:
        lesson = checking.lesson(number)
        found = similar.likenesses(lesson, {"anna": solving.solution(lesson.folder), "ben": lesson.folder / "check.py"})
        assert [each for each in found if "anna" in (each.one, each.other) and "solution" not in each.other] == []


def test_nothing_hangs_and_nothing_gets_out(graded):
    rows, seconds, outside, _ = graded
    assert seconds < 3 * 3 * len(rows)  # three tasks; most end at once
    assert (outside / "kept").read_text() == "kept"
    assert "too deep" in rows["deep"]["notes"] and "ImportError" in rows["imports_reference"]["notes"]
    assert "the time limit" in rows["endless"]["notes"] and "File too large" in rows["prints"]["notes"]


def test_no_process_and_no_file_is_left(graded):
    scratch = graded[2].parent / "scratch"
    commands = [path.read_bytes() for path in Path("/proc").glob("[0-9]*/cmdline") if os.access(path, os.R_OK)]
    assert not any(bytes(scratch) in words for words in commands) and not list(scratch.iterdir())


def test_the_walls_stand_and_are_tried_out(tmp_path):
    """Without walls the probe gets out, so its failure with walls means something."""
    if not walls.namespaces():
        pytest.skip("this system has no user namespaces")
    assert grading.open_walls() == []
    (tmp_path / "kept").write_text("kept")
    with courses.checking.Student(ROOT / "course" / "box" / "probe.py", 20.0) as probe:
        assert len(probe.escapes(str(tmp_path), os.getpid(), grading._answers())) == 9


def test_ways_to_the_reference_lead_there_without_walls_and_nowhere_in_grading(graded, tmp_path, monkeypatch):
    """Each attack works as a program of its own; graded, it has no point and a reason."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", list(sys.path))
    monkeypatch.setattr(sys, "meta_path", list(sys.meta_path))
    for name, text in STOLEN.items():
        names = {}
        exec(WHERE + text, names)
        assert callable(names["found"]), name
        row = graded[0][name]
        assert row["sum"] == "0" and re.search(
            "ImportError|Error: .*(not permitted|denied|unavailable)|No module", row["notes"]
        ), row


def test_a_function_of_the_reference_under_other_names_is_told(tmp_path):
    """Names, brackets, lines and the first line of a function do not hide a copy, nor do the other functions."""
    lesson, text = checking.lesson(5), (REFERENCE / "error.py").read_text(encoding="utf-8")
    body = next(part for part in ast.parse(text).body if getattr(part, "name", "") == "largest_errors")
    copied = "\n".join(f"    {line}" for part in body.body[1:] for line in ast.unparse(part).splitlines())
    for old in sorted({each.id for each in ast.walk(body) if isinstance(each, ast.Name)} - {"np"}):
        copied = re.sub(rf"\b{old}\b", f"my_{old}", copied)
    path = tmp_path / "student.py"
    path.write_text(f"{solved(5)}\n\ndef bounds(heights):\n{copied}\n")
    found = [each for each in similar.likenesses(lesson, {"anna": path}) if each.other != "the solution"]
    assert [(each.other, each.share) for each in found] == [("the reference in bounds()", 1.0)]


def test_a_hand_in_that_can_run_a_hidden_text_is_told(tmp_path):
    hidden = base64.b64encode(zlib.compress(solved(2).encode())).decode()
    hand_in(tmp_path, "anna", f"import base64, zlib\nexec(zlib.decompress(base64.b64decode('{hidden}')))\n")
    hand_in(tmp_path, "ben", solved(2) + "# exec: a comment\n")
    found = grading.grade(tmp_path, [LESSON], 5, 20.0, 1, lambda name: None)
    assert found["anna"][0].points == 10 and "has exec: it can run a hidden text" in found["anna"][0].note
    assert "exec" not in found["ben"][0].note


@pytest.mark.parametrize("read", ["import terrain_gl", "sys.meta_path.clear(); import terrain_gl", "open(OWN).read()"])
def test_no_answer_reads_this_project(tmp_path, read):
    """Neither by an import, nor without the guard of imports, nor as a file, wherever the project is installed."""
    if not walls.namespaces():
        pytest.skip("this system has no user namespaces")
    import numpy

    own = Path(numpy.__file__).parent.parent / "terrain_gl_beside_numpy.py"  # as if the project were installed there
    path = tmp_path / "student.py"
    path.write_text(f"import sys\nOWN = {str(own)!r}\ndef look():\n    {read}\n    return 1\n")
    own.write_text("answer = 1\n")
    try:
        with courses.checking.Student(path, 20.0, walled=True) as student, pytest.raises(StudentError):
            student.look()
    finally:
        own.unlink()


def test_the_walls_stand_where_the_grader_is_the_first_process():
    """As in a container: the probe's own number in its namespace may be the grader's, too."""
    if not walls.namespaces():
        pytest.skip("this system has no user namespaces")
    code = "import os\nfrom course.grading import open_walls\nprint(os.getpid(), open_walls())"
    command = ["unshare", "--user", "--map-root-user", "--pid", "--fork", sys.executable, "-c", code]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "1 []\n", done.stderr


def test_grading_stops_where_a_wall_is_missing(tmp_path, monkeypatch, capsys):
    from course.__main__ import main

    hand_in(tmp_path, "anna", BLANK)
    monkeypatch.setattr(grading, "open_walls", lambda: ["writes files"])
    assert main(["grade", str(tmp_path), "-o", str(tmp_path / "p.csv")]) == 2
    assert "writes files" in capsys.readouterr().err and not (tmp_path / "p.csv").exists()


def test_a_python_that_no_wall_lets_run_is_one_line(tmp_path, monkeypatch, capsys):
    from course.__main__ import main

    def ends():
        raise StudentError("the process ended")

    hand_in(tmp_path, "anna", BLANK)
    monkeypatch.setattr(grading, "open_walls", ends)
    assert main(["grade", str(tmp_path), "-o", str(tmp_path / "p.csv")]) == 2
    assert capsys.readouterr().err.endswith("the process ended\n") and not (tmp_path / "p.csv").exists()


def test_every_student_has_a_page_with_every_task(graded):
    pages = {path.stem: path.read_text() for path in (graded[2].parent / "feedback").iterdir()}
    assert set(pages) == set(graded[0]) - {"(most)"}
    assert pages["right"].splitlines()[1] == "10 of 10 points" and pages["right"].count("exact") == 3
    assert "not handed in" in pages["nothing"] and "bound_px() is not written yet" in pages["blank"]
    assert "bound_px(): the time limit is over" in pages["loops_once"] and "largest difference" in pages["wrong"]
    assert max(map(len, pages.values())) < 4000


def test_an_answer_that_needs_the_checks_memory_costs_its_own_task_alone(tmp_path, monkeypatch):
    lessons = [checking.lesson(1)]
    path = tmp_path / "class" / "anna" / lessons[0].folder.name / "student.py"
    path.parent.mkdir(parents=True)
    path.write_text(solved(1) + TALL_FILL)
    (graded,) = grading.grade(tmp_path / "class", lessons, 5, 20.0, 1, lambda name: None)["anna"]
    verdicts = {outcome.task.title[:3]: outcome.verdict for outcome in graded.outcomes}
    assert verdicts.pop("1.4") == "wrong" and set(verdicts.values()) == {"exact"}


def test_a_task_that_ends_its_check_does_not_end_the_next_tasks(tmp_path):
    """In a copy of the course whose first task ends the check's process, as a machine without memory does."""
    shutil.copytree(ROOT / "course", tmp_path / "course", ignore=shutil.ignore_patterns("*.png", "__pycache__"))
    check = tmp_path / "course" / "lessons" / LESSON.folder.name / "check.py"
    text = check.read_text(encoding="utf-8")
    assert text.count("    axes, focal_px, extent = view(rng)\n") == 1
    check.write_text(text.replace("    axes, focal_px, extent = view(rng)\n", "    import os\n    os._exit(9)\n"))
    hand_in(tmp_path / "class", "anna", solved(2))
    command = [sys.executable, "-m", "course", "grade", "class", "-o", "p.csv", "--lessons", "2", "--trust"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    row = list(csv.DictReader((tmp_path / "p.csv").read_text().splitlines()))[1]
    assert row["sum"] == "7" and "the check ended" in row["notes"], done.stderr


def test_a_check_that_ends_leaves_a_row_with_the_reason(tmp_path, monkeypatch):
    """A check that dies is a task that is wrong, with a reason, and no end of the grading."""
    monkeypatch.setattr("sys.executable", "/bin/false")
    hand_in(tmp_path, "anna", solved(2))
    (graded,) = grading.grade(tmp_path, [LESSON], 5, 20.0, 1, lambda name: None)["anna"]
    assert len(graded.outcomes) == 3 and graded.points == 0 and "the check ended" in graded.note


def test_copies_and_misplaced_files_are_told(tmp_path):
    hand_in(tmp_path, "anna/old", BLANK)
    hand_in(tmp_path, "anna", solved(2))
    (tmp_path / "ben").mkdir()
    (tmp_path / "ben" / "student.py").write_text(solved(2))
    found = grading.grade(tmp_path, [LESSON], 5, 20.0, 1, lambda name: None)
    grading.write_feedback(found, tmp_path / "feedback")
    anna, ben = ((tmp_path / "feedback" / f"{name}.txt").read_text() for name in ("anna", "ben"))
    assert (
        "10 of 10 points (2 files: 02_screen_error/student.py is graded, old/02_screen_error/student.py is not)" in anna
    )
    assert "student.py is in no lesson's folder: put it into 02_screen_error/" in ben


def test_without_opengl_a_right_answer_loses_nothing_silently(tmp_path, monkeypatch):
    monkeypatch.setenv("__EGL_VENDOR_LIBRARY_FILENAMES", str(tmp_path / "none.json"))
    for number in (3, 8):
        path = tmp_path / "class" / "anna" / checking.lesson(number).folder.name / "student.py"
        path.parent.mkdir(parents=True)
        path.write_text(solved(number))
    lessons = [checking.lesson(3), checking.lesson(8)]
    found = grading.grade(tmp_path / "class", lessons, 5, 20.0, 1, lambda name: None)
    grading.write_table(found, lessons, 5, tmp_path / "p.csv")
    row = list(csv.DictReader((tmp_path / "p.csv").read_text().splitlines()))[1]
    assert (row["lesson 3"], row["lesson 8"]) == ("11 + 4 not run", "10 not run")
    assert (row["sum"], row["not run"]) == ("11", "14")
    assert "3: 3.6 not run" in row["notes"] and "8: 8.1, 8.2, 8.3 not run" in row["notes"]
    grading.write_feedback(found, tmp_path / "feedback")
    text = (tmp_path / "feedback" / "anna.txt").read_text()
    assert (
        "11 + 14 not run of 25 points" in text and text.count("no OpenGL 4.3") == 1 and text.count("no OpenGL 4.1") == 3
    )


def test_no_cell_is_a_formula(tmp_path):
    grading.write_table({"=HYPERLINK(1)": []}, [LESSON], 1, tmp_path / "p.csv")
    assert (tmp_path / "p.csv").read_text().splitlines()[-1].startswith("'=HYPERLINK(1),")
    assert grading._harmless("-1") == "-1"


@pytest.fixture(scope="module")
def ranked(tmp_path_factory):
    """The leaderboard's rows by name: the course's own entry, the project's, and entries that are wrong."""
    pytest.importorskip("course.leaderboard")
    folder = tmp_path_factory.mktemp("entries")
    head = "import numpy as np\n\n\ndef mesh(heights, spacing_m, camera, size, tolerance_px):\n"
    flat = (
        "    n = len(heights) - 1\n    e, s = n * spacing_m[0], n * spacing_m[1]\n"
        "    corners = [[0, 0], [e, 0], [e, s], [0, s]]\n"
        "    vertices = np.column_stack([corners, heights[[n, n, 0, 0], [0, n, n, 0]]])\n"
    )
    entries = {
        "copy": (solving.SOLUTIONS / "entry.py").read_text(encoding="utf-8"),
        "two_triangles": head + flat + "    return vertices, np.array([[0, 1, 2], [0, 2, 3]])\n",
        "half": head + flat + "    return vertices, np.array([[0, 1, 2]])\n",
        "nan": head + flat + "    return vertices * np.nan, np.array([[0, 1, 2]])\n",
        "none": head + "    return None\n",
        "beyond": head + flat + "    return vertices, np.array([[0, 1, 9]])\n",
        "endless": head + "    while True: pass\n",
        "imports": "import terrain_gl\n" + head + "    return None\n",
    }
    for name, text in entries.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "course", "enter", str(folder), "-o", str(folder / "b.csv"), "--seed", "3"]
    done = subprocess.run([*command, "--seconds", "8"], cwd=ROOT, capture_output=True, text=True)
    if "on this system" in done.stderr:
        pytest.skip(done.stderr)
    assert done.returncode == 0, done.stderr
    with open(folder / "b.csv", newline="", encoding="utf-8") as file:
        return {row["entry"]: row for row in csv.DictReader(file)}


@pytest.mark.slow
def test_every_entry_has_a_row_and_a_reason(ranked):
    reasons = {name: row["not ranked because"] for name, row in ranked.items()}
    assert set(reasons) >= {"(course)", "(every_post)", "copy", "endless"}
    told = {
        "two_triangles": "px off", "half": "posts without land", "nan": "finite", "none": "expected vertices and",
        "beyond": "vertex that is not there", "endless": "time limit", "imports": "without terrain_gl",
    }  # fmt: skip
    assert {name for name, text in told.items() if text not in reasons[name]} == set()
    assert reasons["copy"] == reasons["(course)"] == reasons["(every_post)"] == ""


@pytest.mark.slow
def test_who_is_ranked_keeps_the_error_with_fewer_triangles(ranked):
    places = sorted((row for row in ranked.values() if row["place"]), key=lambda row: int(row["place"]))
    counts = [int(row["triangles"]) for row in places]
    assert counts == sorted(counts) and all(float(row["largest error in tolerances"]) <= 1 for row in places)
    assert int(ranked["(course)"]["triangles"]) < 0.2 * int(ranked["(every_post)"]["triangles"])
    assert ranked["(every_post)"]["place"] == str(len(places))
