"""The course: blanks fail, solutions pass, wrong answers are rejected."""

import importlib
import json
import keyword
import os
import re
import subprocess
import sys
import time

import courses
import numpy as np
import pytest
from courses import NUMBERS, ROOT, checking, folders, outcomes, solved, solving, told

from course import mutants, real, similar, withheld  # noqa: E402

WRONG = [(number, wrong.name) for number in NUMBERS for wrong in solving.wrong_answers(checking.lesson(number).folder)]
SLOW = ("loop_of_means",)


def skip_without_opengl(found):
    for outcome in found:
        if outcome.verdict == checking.NOT_RUN:
            pytest.skip(outcome.lines[0])


@pytest.mark.parametrize("number", NUMBERS)
def test_blanks_fail_every_task(number):
    text = solving.blank(solving.solution(checking.lesson(number).folder).read_text(encoding="utf-8"))
    assert {outcome.verdict for outcome in outcomes(number, text)} == {checking.BLANK}


@pytest.mark.parametrize("number", NUMBERS)
def test_the_blanks_in_the_lesson_are_made_of_its_solution(number):
    lesson = checking.lesson(number)
    source = solving.solution(lesson.folder)
    assert lesson.file == f"student{source.suffix}"
    made = solving.blank(source.read_text(encoding="utf-8"))
    assert (lesson.folder / lesson.file).read_text(encoding="utf-8") == made


@pytest.mark.parametrize("seed", [101, 202, 303])
@pytest.mark.parametrize("number", NUMBERS)
def test_solutions_are_exact_on_hidden_seeds(number, seed):
    found = outcomes(number, solved(number), seed)
    skip_without_opengl(found)
    assert [outcome.verdict for outcome in found] == [checking.EXACT] * len(found), told(found)


@pytest.mark.sampled(4, "number")
@pytest.mark.parametrize(
    "number, name", [pytest.param(*each, marks=[pytest.mark.slow] * (each[1] in SLOW)) for each in WRONG]
)
def test_wrong_answers_are_rejected(number, name):
    wrong = next(each for each in solving.wrong_answers(checking.lesson(number).folder) if each.name == name)
    found = outcomes(number, wrong.text, seed=5, until=(checking.WRONG,), first=wrong.task)
    skip_without_opengl(found)
    assert found[-1].verdict == checking.WRONG, wrong.why
    assert not any("SyntaxError" in text or "NameError" in text for _, text in told(found))


@pytest.mark.parametrize("number", NUMBERS)
def test_every_check_has_seventeen_wrong_answers_on_file(number):
    assert sum(n == number for n, _ in WRONG) >= 17
    assert all(wrong.task for wrong in solving.wrong_answers(checking.lesson(number).folder))


@pytest.mark.parametrize("number", NUMBERS)
def test_a_page_has_all_its_parts(number):
    folder = checking.lesson(number).folder
    page = (folder / "page.md").read_text(encoding="utf-8")
    parts = ["Goal", "What you should know", "A prediction", "Derivation", "Task", "If your picture looks like this"]
    parts += ["An open question", "In this project", "Further reading"]
    assert [part for part in re.findall(r"^## (.*)$", page, re.MULTILINE) if part in parts] == parts
    for target in re.findall(r"\]\(([^)#]+)\)", page):
        if "://" not in target and target != "figure.png":
            assert (folder / target).resolve().exists(), target


@pytest.mark.parametrize("number", NUMBERS)
def test_a_page_counts_the_tasks_as_the_check_does(number):
    lesson = checking.lesson(number)
    page = (lesson.folder / "page.md").read_text(encoding="utf-8")
    items = re.findall(r"^(\d+)\. `", page.split("## Task\n")[1].split("\nCheck it:")[0], re.MULTILINE)
    assert [f"{number}.{item}" for item in items] == [task.title.split()[0] for task in lesson.tasks]


def test_every_task_belongs_to_an_outcome():
    page = (ROOT / "course" / "OUTCOMES.md").read_text(encoding="utf-8")
    page = page.split("## Its picture")[0]
    rows = re.findall(r"^\|[^|]*\|[^|]*\|([\d., ]+)\|", page, re.MULTILINE)
    tasks = [number for row in rows for number in row.strip().split(", ")]
    wanted = [task.title.split()[0] for number in NUMBERS for task in checking.lesson(number).tasks]
    assert sorted(tasks) == sorted(wanted)


def test_there_are_thirty_oral_questions_with_answers_about_all_lessons():
    text = (solving.SOLUTIONS / "oral.md").read_text(encoding="utf-8")
    parts = re.split(r"^### ", text, flags=re.MULTILINE)[1:]
    heads = [re.match(r"(\d+)\. \(Lesson (\d+)\) .*[?.]\n\n(.+)", part, re.DOTALL) for part in parts]
    assert [int(head[1]) for head in heads] == list(range(1, 31))
    assert {int(head[2]) for head in heads} == set(NUMBERS) and all(len(head[3]) > 80 for head in heads)


def test_the_reference_imports_with_numpy_alone():
    blocked = "moderngl", "glfw", "OpenImageIO", "pyrr", "imgui_bundle", "matplotlib", "rasterio"
    code = f"""
import sys
sys.modules.update(dict.fromkeys({blocked}))
import terrain_gl.reference
from course import checking, folders
for folder in folders.lessons():
    if checking.load(folder / "check.py").__dict__.get("NEEDS") != "OpenGL":
        checking.lesson(int(folder.name[:2]))
loaded = {{name.split(".")[0] for name in sys.modules}}
print(sorted(loaded & set({blocked}) - {{n for n in {blocked} if sys.modules.get(n) is None}}))
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """A students' tree with maps of the seeds 7, 8 and 9."""
    tree = tmp_path_factory.mktemp("students") / "tree"
    solving.students_tree(tree, seed=7)
    return tree


@pytest.mark.slow
def test_the_students_tree_has_no_solutions_and_checks(tree):
    names = {path.name for path in tree.rglob("*")}
    secret = "solutions solution.py wrong.toml real.toml oral.md grading.py rivals.py LECTURERS.md FACTS.md .git"
    assert not names & set(secret.split())
    assert names >= {"setup.cfg", "pyproject.toml", "LICENSE", "rings.py", "place.comp", "alpine.png"}
    code = {path: path.read_text(encoding="utf-8") for path in tree.glob("course/**/*.py")}
    tables = [path for path, text in code.items() if re.search(r"cumsum\(.*\)\.cumsum", text)]  # lessons 3 and 4
    assert len(code) > 60 and tables == []
    pages = {path: path.read_text(encoding="utf-8") for path in tree.rglob("*.md")}
    links = [(path, link) for path, text in pages.items() for link in re.findall(r"\]\(([^)#\s]+)[^)]*\)", text)]
    here = [(path, link) for path, link in links if "://" not in link]
    assert len(here) > 200 and [each for each in here if not (each[0].parent / each[1]).exists()] == []
    assert "grade submissions" not in "".join(pages.values())
    number = NUMBERS[0]
    command = [sys.executable, "-m", "course", "check", str(number)]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True)
    assert done.returncode == 1 and "blank" in done.stdout and "0 of " in done.stdout, done.stderr
    code = "from course import __main__, checking; print(__main__._own_seed(), checking.lesson(3).original[:9])"
    done = subprocess.run([sys.executable, "-c", code], cwd=tree, capture_output=True, text=True)
    assert done.stdout == '7 """Lesson\n', done.stderr


def functions(paths, without=frozenset()):
    """The runs of tokens of all functions with enough of them, by file and name."""
    bodies = ((path, name, body) for path in paths for name, body in similar._bodies(path.read_text("utf-8")).items())
    found = {(str(path), name): similar.runs(body, frozenset(keyword.kwlist)) - without for path, name, body in bodies}
    return {which: runs for which, runs in found.items() if len(runs) >= similar.FEWEST}


def answers_in(paths):
    """Functions of the reference, and solutions, of which most stands in one function of the files."""
    handed, found = functions(paths).values(), []
    blanks = set().union(*functions(path / "student.py" for path in folders.lessons()).values())
    secret = functions((ROOT / "terrain_gl" / "reference").glob("*.py"))
    secret |= functions((solving.solution(folder) for folder in folders.lessons()), blanks)
    assert len(secret) > 60
    for which, runs in secret.items():
        if max(len(runs & theirs) / len(runs) for theirs in handed) > 0.6:
            found.append(which)
    return found


@pytest.mark.slow
def test_what_has_answers_is_not_handed_out(tree):
    """Neither the reference, nor what imports it, nor a function like one of the answers."""
    files = [path for path in tree.rglob("*.py") if path.name != "student.py"]
    texts = {path: path.read_text(encoding="utf-8") for path in files}
    assert [path for path, text in texts.items() if withheld.without_reference(text) != text] == []
    assert not (tree / "terrain_gl" / "reference").exists() and "reference" not in (tree / "setup.cfg").read_text()
    assert len(files) > 300 and answers_in(files) == []
    assert len(answers_in((ROOT / "terrain_gl" / "reference").glob("*.py"))) > 30
    links = re.findall(r"\]\(([^)]*reference/[^)]*)\)", "".join(p.read_text("utf-8") for p in tree.rglob("page.md")))
    assert links == []


@pytest.mark.slow
def test_tests_that_are_handed_out_can_be_collected(tree):
    """No test asks for a helper that was left out."""
    code = f"{real.ALONE}import pytest\nsys.exit(pytest.main(sys.argv[1:]))"
    command = [sys.executable, "-P", "-c", code, "--collect-only", "-q", "-p", "no:cacheprovider"]
    done = subprocess.run(command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr


@pytest.mark.slow
def test_what_needs_the_reference_says_so(tree):
    """The package works without; only the curve of pruned quadtrees does not."""
    code = f"""{real.ALONE}
from terrain_gl.basics.exceptions import TerrainError
from terrain_gl.comparison.study import pruned_curve
try:
    pruned_curve(None, None, [])
except TerrainError as error:
    print(error)
"""
    env = os.environ | {"PYTHONPATH": str(tree)}
    done = subprocess.run([sys.executable, "-P", "-c", code], cwd=tree, env=env, capture_output=True, text=True)
    assert done.stdout == "the curve of pruned quadtrees needs terrain_gl.reference, which is not installed\n", done


def test_what_needs_the_reference_is_left_out_of_a_test_file():
    """Through values, helpers and fixtures, and whatever the import looks like; the others stay as they are."""
    kept = "import pytest\n\n\n@pytest.fixture\ndef land():\n    return 1\n\n\ndef test_land(land):\n    assert land\n"
    needy = """

LIMIT = reference.sat.limit


@pytest.fixture
@staticmethod
def truth():
    return LIMIT


def helper():
    from terrain_gl import reference
    return reference


def test_truth(land, truth):
    assert land < truth


def test_helper():
    assert helper() and table.sums
"""
    imports = "from terrain_gl import Camera, reference\nfrom terrain_gl.reference import sat as table\n"
    assert withheld.without_reference(kept) == kept
    found = withheld.without_reference(imports + kept + needy)
    assert found.split() == ["from", "terrain_gl", "import", "Camera", *kept.split()]
    assert withheld.has_tests(found) and not withheld.has_tests(withheld.without_reference(imports + needy))
    link = "see [`bound.py`](../../../terrain_gl/reference/bound.py), [a](b.md)"
    assert withheld.without_links(link) == "see `bound.py` (not in this tree), [a](b.md)"


def checked_in(tree, number, path, *words):
    """The output of the command `check` in a tree, which has its own package of the project."""
    command = [sys.executable, "-m", "course", "check", str(number), str(path), *words]
    done = subprocess.run(command, cwd=tree, env=os.environ | {"PYTHONPATH": str(tree)}, capture_output=True, text=True)
    return done.stdout + done.stderr


def verdicts_in(tree, number, paths):
    """What the check in a tree says of each file, with the seed 8: the verdicts of its tasks."""
    code = f"""
import json, pathlib
from course.checking import check, lesson
for path in map(pathlib.Path, {[str(path) for path in paths]}):
    print(json.dumps([path.name, [outcome.verdict for outcome in check(lesson({number}), path, 8)]]))
"""
    env = os.environ | {"PYTHONPATH": str(tree)}
    done = subprocess.run([sys.executable, "-c", code], cwd=tree, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return {name: set(said) for name, said in map(json.loads, done.stdout.splitlines())}


@pytest.mark.slow
@pytest.mark.parametrize("number", NUMBERS)
def test_students_checks_have_values_in_place_of_code(tree, tmp_path, number):
    """Their checks accept and reject as ours, without the reference, whatever is changed in the project."""
    folder = checking.lesson(number).folder
    check = (tree / "course" / "lessons" / folder.name / "check.py").read_text(encoding="utf-8")
    code = check.partition('"""\n\n')[2]
    assert "terrain_gl" not in code and not re.search(r"\breference\.|\brings\.", code)
    answers = {"right": solved(number)} | {wrong.name: wrong.text for wrong in solving.wrong_answers(folder)[::9]}
    for name, text in answers.items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    found = verdicts_in(tree, number, [tmp_path / name for name in answers])
    assert found.pop("right") <= {"exact", "not run"}
    assert all({"wrong", "not run"} & said for said in found.values()), found


@pytest.mark.slow
def test_students_have_maps_of_three_seeds_and_no_reference_in_checks(tree, tmp_path):
    (tmp_path / "a.py").write_text(solved(5))
    assert "seeds 7, 8, 9" in checked_in(tree, 5, tmp_path / "a.py", "--seed", "10")
    assert "12 of 12 points" in checked_in(tree, 5, tmp_path / "a.py")


def test_a_mutant_that_survives_is_explained():
    """A sample of the mutants of each lesson; `python -m course mutants --count 999` tries all."""
    for number in NUMBERS:
        lesson = checking.lesson(number)
        every = mutants.mutants(lesson.folder)
        known = {(mutant.line, mutant.changed) for mutant in every}
        listed = [pair for n, *pair in mutants.explained() if n == number]
        assert len(every) > 20 and [pair for pair in listed if tuple(pair) not in known] == []
        for mutant, said, _ in mutants.verdicts(lesson, 2, seed=3):
            assert said != mutants.SURVIVED, (mutant.line, mutant.changed)


@pytest.mark.slow
def test_check_draws_the_difference(tmp_path):
    pytest.importorskip("matplotlib")
    wrong = next(w for w in solving.wrong_answers(checking.lesson(2).folder) if w.name == "distance")
    (tmp_path / "answer.py").write_text(wrong.text)
    command = [sys.executable, "-m", "course", "check", "2", str(tmp_path / "answer.py"), "-o", str(tmp_path / "d.png")]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 1 and "wrong    2.1" in done.stdout and "largest difference" in done.stdout, done.stderr
    assert (tmp_path / "d.png").read_bytes().startswith(b"\x89PNG")


def test_of_many_pictures_the_one_with_the_largest_difference_is_drawn():
    from course.picture import shown

    want = np.arange(3 * 9 * 11).reshape(3, 9, 11)
    got = want + 0
    got[2, 4, 5] += 7
    assert [values.tolist() for values in shown(got, want)] == [got[2].tolist(), want[2].tolist()]
    last = np.moveaxis(got, 0, 2), np.moveaxis(want, 0, 2)  # rows, columns, numbers
    assert (shown(*last)[0] - shown(*last)[1]).max() == 7 and shown(*last)[0].shape == (9, 11)
    infinite = np.where(np.arange(10) == 3, np.inf, 1.0)
    holes = np.where(want == 5, np.nan, want)  # expected to be there
    assert (shown(np.where(want == 5, np.nan, got), holes)[0] == got[2]).all()
    assert np.isnan(shown(infinite, np.ones(10))[0][3]) and shown(got[0, :4], want[0, :4])[0].shape == (44,)


@pytest.mark.parametrize("words", [["check", "99"], ["check", "2", "nothing.py"], ["grade", "nothing", "-o", "p.csv"]])
def test_wrong_use_is_one_line(words, tmp_path):
    done = subprocess.run([sys.executable, "-m", "course", *words], cwd=ROOT, capture_output=True, text=True)
    assert done.returncode == 2 and len(done.stderr.splitlines()) == 1 and "course:" in done.stderr


def test_a_wrong_answer_that_changes_nothing_is_noticed(tmp_path, monkeypatch):
    monkeypatch.setattr(solving, "SOLUTIONS", tmp_path)
    (tmp_path / "02_screen_error").mkdir()
    (tmp_path / "02_screen_error" / "solution.py").write_text("x = 1\n")
    (tmp_path / "02_screen_error" / "wrong.toml").write_text('[a]\nwhy = ""\nold = "y = 1"\nnew = "y = 2"\n')
    with pytest.raises(ValueError, match="0 times"):
        solving.wrong_answers(checking.lesson(2).folder)


def test_a_console_without_greek_letters_is_no_hindrance(tmp_path):
    wrong = solved(10).replace("return 2.0**low", "return 0 * low")
    (tmp_path / "answer.py").write_text(wrong, encoding="utf-8")
    files = [str(tmp_path / "answer.py"), "-o", str(tmp_path / "d.png")]
    command = [sys.executable, "-m", "course", "check", "10", *files]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, env=os.environ | {"PYTHONIOENCODING": "cp1252"})
    assert done.returncode == 1 and b"A of your ?" in done.stdout, done.stderr


def test_findings():
    compare, want = checking.compare, [1.0, 2.0]
    assert compare("", [1.0, 2.0 + 1e-12], want).verdict == checking.EXACT
    assert compare("", [1.0, 2.01], want, close=0.02).verdict == checking.CLOSE
    assert compare("", [1.0, 2.1], want, close=0.02).verdict == checking.WRONG
    assert "at post 1" in compare("", [1.0, 2.1], want, axes=("post",)).text
    for bad in ([1.0], [1.0, float("nan")], "text", None, [[1.0], [1.0, 2.0]], [1.0, float("inf")]):
        assert compare("", bad, want, close=1.0).verdict == checking.WRONG, bad
    assert compare("", [1.0, 2.0 + 1e-12], want, rounding=0).verdict == checking.WRONG
    assert checking.at_least("", [1.0, 2.0 - 1e-12], want).verdict == checking.EXACT
    assert checking.at_least("", [1.0, 2.0 - 1e-12], want, rounding=0).verdict == checking.WRONG
    assert compare("", [1, 3], [1, 2], close=0).verdict == checking.WRONG
    assert checking.at_least("", [1.0, 1.9], want).verdict == checking.WRONG
    assert checking.at_most("", [1.0, 2.1], want).verdict == checking.WRONG
    assert checking.at_most("", [0.0, 2.0], want).verdict == checking.EXACT
    assert checking.at_least("", [float("nan"), 3.0], want).verdict == checking.WRONG


def test_messages_carry_values_and_refuse_objects():
    wire = courses.wire
    value = {"a": [1, 2.5, None, True], 3: (np.arange(6, dtype=np.uint32).reshape(2, 3), np.float64(1.5)), "n": 2**70}
    back = wire.unpack(wire.pack(value)[8:])
    assert back[3][0].dtype == np.uint32 and (back[3][0] == value[3][0]).all() and back["n"] == 2**70
    for bad in (object(), np.array([object()]), lambda: 0):
        with pytest.raises(TypeError):
            wire.pack(bad)


def test_the_site_has_every_page():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    pages = [path for path in (ROOT / "docs").glob("*.md") if path.name != "index.md"]
    pages += set((ROOT / "course").glob("*.md")) - {ROOT / "course" / name for name in ("LECTURERS.md", "FACTS.md")}
    pages += [folder / "page.md" for folder in folders.lessons()]
    listed = {(ROOT / "docs" / f"{line}.md").resolve() for line in re.findall(r"^[\w./]+$", index, re.MULTILINE)}
    assert {path.resolve() for path in pages} <= listed
    gallery = (ROOT / "docs" / "examples" / "index.md").resolve()  # made by the build
    assert gallery in listed and all(path.is_file() for path in listed - {gallery})


@pytest.mark.parametrize("number", NUMBERS)
def test_the_index_and_the_course_name_each_lesson(number):
    folder = checking.lesson(number).folder
    assert f"(lessons/{folder.name}/page.md)" in (ROOT / "course" / "README.md").read_text(encoding="utf-8")
    assert (folder / "figure.png").read_bytes().startswith(b"\x89PNG")


def checked(tmp_path, number, text, seconds=20.0):
    """Outcomes of a file that runs in a process of its own."""
    (tmp_path / "student.py").write_text(text, encoding="utf-8")
    return list(checking.check(checking.lesson(number), tmp_path / "student.py", 3, seconds))


def test_a_loop_without_end_costs_its_own_task_alone(tmp_path):
    text = solved(4).replace("    return (errors[:, None] <= limits).sum(1) - 1", "    while True: pass")
    found = checked(tmp_path, 4, text, seconds=3.0)
    assert [outcome.verdict for outcome in found] == ["exact", "wrong", "exact", "exact", "exact"], told(found)
    assert found[1].lines == ["class_of(): the time limit is over"]


def test_a_file_without_end_is_waited_for_once(tmp_path):
    start = time.monotonic()
    found = checked(tmp_path, 4, "while True: pass\n", seconds=1.0)
    assert {tuple(outcome.lines) for outcome in found} == {("the file: the time limit is over",)}
    assert time.monotonic() - start < 4.0 < len(found)


@pytest.mark.parametrize("number", [3, 8])
def test_comments_that_are_left_do_not_make_an_answer_blank(number):
    """A blank is what is still as it was handed out, whatever comments stand there."""
    right = solving.solution(checking.lesson(number).folder).read_text(encoding="utf-8")
    found = outcomes(number, solving.clean(re.sub("// solution", "// write this\n// solution", right)))
    skip_without_opengl(found)
    assert {outcome.verdict for outcome in found} == {checking.EXACT}, told(found)
    blanks = re.sub("// write this", "// I do not know", solving.blank(right))
    assert {outcome.verdict for outcome in outcomes(number, blanks)} == {checking.BLANK}


def test_a_blank_is_told_from_a_line_that_was_left(tmp_path):
    blank = solving.blank(solving.solution(checking.lesson(2).folder).read_text(encoding="utf-8"))
    line = "    raise NotImplementedError"
    found = checked(tmp_path, 2, blank.replace(line, f"    # later\n{line}").replace(line, f"    eye = 1\n{line}", 1))
    at = next(i for i, text in enumerate((tmp_path / "student.py").read_text().splitlines(), 1) if line in text)
    assert [outcome.verdict for outcome in found] == [checking.WRONG, checking.BLANK, checking.BLANK]
    assert found[0].lines == [f"line {at} still raises NotImplementedError: delete it"]
    assert found[1].lines == ["tolerance_m() is not written yet"]


@pytest.mark.parametrize(
    "number, name, old",
    [
        (3, "propagate", "        sum += word"),
        (8, "evaluation", "    v_place = vec3"),
        (8, "control", "    bool drawn ="),
    ],
)
def test_a_compile_error_names_its_shader_and_the_line_of_the_file(tmp_path, number, name, old):
    text = solved(number).replace(old, f"    nothing = 3;\n{old}")
    found = [outcome for outcome in checked(tmp_path, number, text) if outcome.verdict != checking.EXACT]
    skip_without_opengl(found)
    line = text.splitlines().index("    nothing = 3;") + 1
    for outcome in found:
        assert len(outcome.lines) == 1 and outcome.lines[0].startswith(f"the shader {name}: line {line}"), outcome.lines


def test_on_opengl_4_1_only_compute_shaders_do_not_run(tmp_path):
    """Where macOS ends: Mesa's own settings make such a context. Lesson 8 is right there, and draws its picture."""
    env = os.environ | {"MESA_GL_VERSION_OVERRIDE": "4.1", "MESA_GLSL_VERSION_OVERRIDE": "410"}

    def said(*words):
        return subprocess.run([sys.executable, *words], cwd=ROOT, env=env, capture_output=True, text=True).stdout

    if said("-c", "from course.box import shaders; print(shaders.context(410).version_code)") != "410\n":
        pytest.skip("this driver makes no context of OpenGL 4.1")
    for number, wanted in ((8, "10 of 10 points"), (3, "11 + 4 not run of 15 points")):
        path = tmp_path / f"{number}.py"
        path.write_text(solved(number), encoding="utf-8")
        text = said("-m", "course", "check", str(number), str(path))
        assert wanted in text and ("no OpenGL 4.3" in text) == (number == 3), text
    words = ["picture", "8", "--fill", "-o", str(tmp_path / "p.png"), "--file", str(tmp_path / "my_terrain.py")]
    assert re.search(r"\d+ triangles, at most [\d.]+ px off", said("-m", "course", *words))


def test_a_layout_that_makes_no_triangles_is_told(tmp_path):
    text = solved(8)
    assert text.count("layout(quads, equal_spacing,") == 1
    found = checked(
        tmp_path, 8, text.replace("layout(quads, equal_spacing,", "layout(quads, point_mode, equal_spacing,")
    )
    skip_without_opengl(found)
    assert [outcome.verdict for outcome in found] == [checking.EXACT, checking.WRONG, checking.WRONG]
    assert "it makes no triangles" in found[1].lines[0]


def test_what_could_not_run_has_no_points_and_loses_none(monkeypatch):
    monkeypatch.setattr("course.shaders.missing", lambda version: "no OpenGL here")
    *rest, last = outcomes(3, solved(3))
    assert (last.verdict, last.points, last.not_run) == (checking.NOT_RUN, 0, 4)
    assert {outcome.not_run for outcome in rest} == {0}
    texts = [checking.points_text(*points) for points in ((11, 4), (0, 10), (7.5, 0))]
    assert texts == ["11 + 4 not run", "10 not run", "7.5"]


def test_the_same_text_is_said_once_and_long_lists_are_cut():
    task = checking.Task("1.1", 1, iter)
    same = [checking.Finding(f"case {i}", checking.WRONG, "too large") for i in range(9)]
    assert checking.Outcome(task, checking.WRONG, same).lines == ["case 0, and 8 more: too large"]
    unlike = [checking.Finding(f"case {i}", checking.WRONG, f"off by {i}") for i in range(9)]
    assert checking.Outcome(task, checking.WRONG, unlike).lines[-2:] == ["case 4: off by 4", "and 4 more"]


def test_what_a_student_writes_cannot_be_imported(tmp_path):
    found = checked(tmp_path, 2, "import numpy\nfrom terrain_gl import reference\n")
    assert found[0].lines == [
        "line 2: ImportError: a check runs without terrain_gl: write it yourself, and look it up afterwards"
    ]


def test_a_task_whose_process_ends_does_not_end_the_next(tmp_path):
    text = solved(2).replace("def shift_px(", "def shift_px(*a):\n    import os\n    os._exit(0)\n\n\ndef unused(")
    found = checked(tmp_path, 2, "print('hello')\n" + text)
    assert [outcome.verdict for outcome in found] == [checking.WRONG, checking.EXACT, checking.EXACT]
    assert [outcome.printed for outcome in found] == ["hello\n", "hello\n", ""]


def fault_of_lesson_12(key, value, worse):
    """An answer to 12.6 that takes one row from another experiment."""
    row = f"next(r for r in measured if r['method'] == {worse!r} and r[{key!r}] == {value!r})"
    pair = f"[{row}, measured[1]]" if worse == "ours" else f"[measured[0], {row}]"
    return f"def doctored(measured):\n    return {pair}\n"


@pytest.mark.parametrize(
    "key, value, worse, fault",
    [
        ("tuned", False, "theirs", "tuning"),
        ("metric", "max", "theirs", "metric"),
        ("measured", "certified", "theirs", "own metric"),
        ("map", "alpine", "ours", "inputs"),
        ("view", "high", "ours", "inputs"),
    ],
)
def test_a_comparison_can_be_broken_in_each_way_and_a_peer_finds_it(tmp_path, key, value, worse, fault):
    lesson = checking.lesson(12)
    breaking, finding = (next(t for t in lesson.tasks if t.title.startswith(n)) for n in ("12.6", "12.7"))
    text = fault_of_lesson_12(key, value, worse)
    found = checking.outcome_of(breaking, courses.answer(text, lesson), np.random.default_rng(6))
    assert found.verdict == checking.EXACT, told([found])
    (tmp_path / "student.py").write_text(text)
    command = [sys.executable, str(lesson.folder / "hand_out.py"), str(tmp_path / "student.py")]
    table = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    for said, verdict in ((fault, checking.EXACT), ("budgets", checking.WRONG)):
        peer = courses.answer(f"def verdict():\n    return {table!r}, {said!r}\n", lesson)
        assert checking.outcome_of(finding, peer, np.random.default_rng(0)).verdict == verdict


@pytest.mark.parametrize("words, told", [([], "12.6 is not written yet"), (["nothing.py"], "nothing.py: no such file")])
def test_a_table_that_cannot_be_written_is_one_line(tmp_path, words, told):
    command = [sys.executable, str(checking.lesson(12).folder / "hand_out.py"), *words]
    done = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 1 and done.stdout == "" and told in done.stderr
    assert len(done.stderr.splitlines()) == 1


@pytest.mark.parametrize(
    "name, page",
    [
        ("clusters", "CLUSTERS"),
        ("meshlets", "CLUSTERS"),
        ("depths", "CLUSTERS"),
        ("pages", "SCALE"),
        ("planet", "SCALE"),
    ],
)
def test_the_map_of_the_field_says_what_its_experiments_print(name, page, capsys):
    """The blanks are filled with the course's functions here."""
    path = ROOT / "course" / "field" / f"{name}.py"
    lines = [line for line in path.read_text(encoding="utf-8").splitlines() if line.strip()]
    assert len(lines) <= 40
    importlib.import_module(f"course.field.{name}").main()
    text = (ROOT / "course" / f"FIELD_{page}.md").read_text(encoding="utf-8")
    said = capsys.readouterr().out.splitlines()
    assert said and [line for line in said if f"    {line}\n" not in text] == []
