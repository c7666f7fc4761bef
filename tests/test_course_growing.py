"""my_terrain.py grows: it is made of the student's functions, and draws land."""

import ast
import re

import numpy as np
import pytest
from courses import NUMBERS, checking, solved, solving

from course import __main__, grow
from course.shaders import missing
from terrain_gl.basics.steps import drain


@pytest.fixture
def students(monkeypatch):
    """Answers by lesson in place of the files in the lessons' folders."""
    texts = {}
    own = grow._student
    monkeypatch.setattr(grow, "_student", lambda found: texts.get(found.number) or own(found))
    return texts


def test_every_lesson_has_a_stage_and_its_page_says_so():
    assert set(grow.ORDER) == set(NUMBERS)
    for number in grow.ORDER:
        folder = checking.lesson(number).folder
        page = (folder / "page.md").read_text(encoding="utf-8")
        assert f"python -m course picture {number}" in page and "(picture.png)" in page
        assert (folder / "picture.png").read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize("number", grow.ORDER)
def test_the_program_is_made_of_the_students_functions(number, students):
    students.update({n: solved(n) for n in grow.ORDER})
    text = grow.grown(number, fill=False)
    names = {part.name for part in ast.parse(text).body if isinstance(part, ast.FunctionDef)}
    own = set(re.findall(r"^def (\w+)", students[number], re.MULTILINE))
    assert names & own and "NotImplementedError" not in text
    assert len(text.splitlines()) < 510  # "about 500 lines", says course/README.md


def test_it_grows_to_about_four_hundred_lines():
    lines = [len(grow.grown(number, fill=True).splitlines()) for number in grow.ORDER]
    assert lines[0] < 200 and 300 < lines[-1] < 500


def blanks(*numbers):
    return {n: solving.blank(solving.solution(checking.lesson(n).folder).read_text(encoding="utf-8")) for n in numbers}


def test_what_is_not_written_is_one_line_or_filled(students):
    students.update({n: solved(n) for n in grow.ORDER} | blanks(2, 5, 7))
    with pytest.raises(grow.GrowError) as told:
        grow.grown(9, fill=False)
    named = "lesson 2: tolerance_m; lesson 5: quad_errors; lesson 7: repair"
    assert str(told.value).startswith(f"not written yet: {named}; --fill")
    assert "def quad_errors" in grow.grown(5, fill=True)
    assert "def quad_errors" not in grow.grown(4, fill=False)
    assert "quad_errors" not in grow.grown(14, fill=False)  # only what a picture uses is asked for


def test_all_that_is_not_written_is_told_at_once(students, monkeypatch):
    """By lesson. A copy without the solutions says so."""
    students.update({n: checking.lesson(n).original for n in grow.ORDER})
    with pytest.raises(grow.GrowError) as error:
        grow.grown(14, fill=False)
    told = "not written yet: lesson 6: rtin_mesh; lesson 14: fly, held, jump_px, surface; --fill"
    assert str(error.value).startswith(told)
    monkeypatch.setattr(grow, "_solved", lambda found: "")
    with pytest.raises(grow.GrowError, match="lesson 14: .*; your copy has no solution: ask your lecturer"):
        grow.grown(14, fill=True)


def test_a_part_that_the_frame_can_do_without_is_left_out_and_told(students, tmp_path):
    """Lesson 14 after lesson 6, as its page has it: the light is that of lesson 1."""
    if missing(330):
        pytest.skip(missing(330))
    students.update({n: solved(n) for n in (1, 2, 3, 4, 5, 6, 14)} | blanks(7, 8, 9, 10, 11, 12, 13))
    out = tmp_path / "picture.png"
    said = grow.picture(6, False, out, tmp_path / "my_terrain.py")
    assert "left out" not in said
    text = grow.grown(14, fill=False)
    assert "def normals" in text and not re.search(r"\bsunlit\b|\bdiffuse\b", text)
    students.update(blanks(1))
    said = grow.picture(6, False, out, tmp_path / "my_terrain.py")
    assert said.endswith("left out, because it is not written yet: lesson 1: normals, world")


def test_outcomes_and_pages_name_the_lessons_that_a_picture_needs():
    page = (checking.lesson(1).folder.parents[1] / "OUTCOMES.md").read_text(encoding="utf-8")
    rows = re.findall(r"^\| (\d+) \| ([\d, ]+) \| ([\d, ]*) ?\|$", page.split("## Its picture")[1], re.MULTILINE)
    numbers = [tuple([int(n) for n in cell.split(",") if n.strip()] for cell in row) for row in rows]
    assert [n for (n,), *_ in numbers] == list(grow.ORDER)
    for (number,), needed, used in numbers:
        assert (needed, used) == grow.needs(number)
        told = re.search(r"needs your functions of lessons? ([\d, and]+)", lesson_page(number))
        assert (told is None) == (needed == [number])
        if told:
            assert sorted([number, *map(int, re.findall(r"\d+", told[1]))]) == needed


def lesson_page(number):
    return (checking.lesson(number).folder / "page.md").read_text(encoding="utf-8")


def test_the_last_one_draws_alpine_within_an_error(tmp_path, capsys):
    """It starts a process with OpenGL and draws 4000 triangles: that takes a few seconds."""
    if missing(330):
        pytest.skip(missing(330))
    out = tmp_path / "p.png"
    assert __main__.main(["picture", "11", "--fill", "-o", str(out), "--file", str(tmp_path / "my_terrain.py")]) == 0
    said = capsys.readouterr().out
    triangles, error_px = re.search(r"(\d+) triangles, at most ([\d.]+) px off", said).groups()
    assert 2000 < int(triangles) < 6000 and float(error_px) < 10 and out.read_bytes().startswith(b"\x89PNG")


@pytest.fixture
def mine(tmp_path):
    """The program of a lesson, by right functions, as a module; and its map."""
    if missing(330):
        pytest.skip(missing(330))

    def made(number):
        file = tmp_path / f"my_terrain_{number}.py"
        file.write_text(grow.grown(number, fill=True), encoding="utf-8")
        module = checking.load(file)
        return module, module.read(grow.MAP)

    return made


@pytest.mark.slow
def test_lesson_7_marks_vertices_on_open_edges_and_only_before_the_repair(mine):
    program, heights = mine(7)
    left, _, right = np.split(program.show_07(heights, *program.mesh(heights)), [480, 484], axis=1)
    dots = [int((np.abs(half - (0.9, 0.1, 0.05)).max(-1) < 1e-6).sum()) for half in (left, right)]
    assert dots[0] > 200 and dots[1] == 0


@pytest.mark.slow
def test_lesson_9_shows_the_tower_that_greedy_has_not_seen(mine):
    """The halves differ where the top of the tower is."""
    program, heights = mine(9)
    with_tower = heights.copy()
    with_tower[program.TOWER] += 1500
    left, _, right = np.split(program.show_09(heights, *program.grid(0, 0, 128, 128, 8)), [480, 484], axis=1)
    x, y, z = program.in_camera(program.places_of(with_tower, np.array([program.TOWER[::-1]])))[:, 0]
    row, col = (int(middle + program.camera()[1] * at / z) for middle, at in ((135, -y), (240, x)))
    top = slice(row, row + 12), slice(col - 3, col + 4)
    assert np.abs(left[top] - right[top]).max() > 0.3 and left.shape == right.shape == (270, 480, 3)


@pytest.mark.slow
def test_lesson_10_the_mean_vector_is_near_the_truth_and_one_normal_is_not(mine):
    program, heights = mine(10)
    pictures = program.show_10(heights, *program.grid(0, 0, 128, 128, 8))
    one, mean, truth = (pictures[:, 484 * k : 484 * k + 480] for k in range(3))
    assert np.abs(one - truth).mean() > 3 * np.abs(mean - truth).mean() > 0


@pytest.mark.slow
def test_lesson_14_has_a_film_whose_red_is_on_the_left(mine, tmp_path):
    program, heights = mine(14)
    assert "flight.webp" in program.film_14(heights, str(tmp_path / "flight.png"))
    image = pytest.importorskip("PIL.Image")
    with image.open(tmp_path / "flight.webp") as film:
        assert film.n_frames == 32
        red = np.zeros(2)
        for frame in range(32):
            film.seek(frame)
            pixels = np.asarray(film.convert("RGB"), int)
            strong = pixels[..., 0] - pixels[..., 1] > 80
            red += strong[:, :480].sum(), strong[:, 484:].sum()
    assert red[0] > 10 * red[1] and red[0] > 300


@pytest.fixture(scope="module")
def entry(tmp_path_factory):
    """Lesson 12's entry, and a right student's program."""
    if missing(430):
        pytest.skip(missing(430))
    file = tmp_path_factory.mktemp("entry") / "my_terrain.py"
    file.write_text(grow.grown(12, fill=True), encoding="utf-8")
    return checking.load(checking.lesson(12).folder / "enter.py"), file


def test_the_students_mesh_is_measured_as_the_projects_are(entry):
    """The project's own mesh, drawn by the student's rasteriser, has the error that the project measures."""
    enter, file = entry
    mine = checking.load(file)
    heights = mine.read(grow.MAP)
    camera = enter.tg.Camera(eye=tuple(mine.EYE), target=tuple(mine.TARGET), fov_deg=mine.FOV_DEG)
    with enter.tg.Renderer(enter.tg.Heightmap(heights, mine.SPACING, "map"), size=mine.SIZE) as renderer:
        options = {"method": "sat", "cull": False, "near_m": enter.NEAR_M}
        renderer.choose(camera, max_error_px=8.0, **options)
        corners = renderer.triangles()
        posts, which = np.unique(corners.reshape(-1, 2), axis=0, return_inverse=True)
        assert (posts == posts.astype(int)).all() and len(corners) > 300
        px, weight = enter.errors_px(mine, camera, heights, posts.astype(int), which.reshape(-1, 3))
        achieved = drain(renderer.inspector.measure_steps())
    assert px.max() == pytest.approx(achieved.max_px, rel=1e-3) and px.max() > 4
    assert np.sqrt(np.average(px**2, weights=weight)) == pytest.approx(achieved.rms_px, rel=2e-3)


def test_a_student_enters_beside_the_projects_methods(entry, tmp_path, monkeypatch, capsys):
    """A method with the student's errors and twice the triangles needs two times as many."""
    enter, file = entry

    def curve(renderer, camera, methods, budgets, **options):
        assert budgets == sorted(budgets) and options == {"between": False, "near_m": enter.NEAR_M}
        assert np.allclose([camera.fov_deg, *renderer.size], [50.0, 480, 270])
        return {name: [each | {"triangles": 2 * each["triangles"]} for each in own[0]] for name in methods}

    own, yours = [], enter.yours
    monkeypatch.setattr(enter, "yours", lambda *asked: own.append(yours(*asked)) or own[0])
    monkeypatch.setattr(enter, "curve", curve)
    monkeypatch.setattr(enter, "BUDGETS", (300, 1000))
    enter.main([str(file), "-o", str(tmp_path / "curves.png")])
    said = capsys.readouterr().out
    for method in ("clipmap", "tessellated", "sat"):
        for error in ("largest error", "RMS error"):
            assert f"same {error}: {method} needs 2.00 times your triangles (2.00 to 2.00)" in said
    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
    assert 100 < own[0][0]["triangles"] < 300  # the tree has up to 300, and some are beyond the picture


def test_a_program_that_cannot_enter_is_one_line(entry, tmp_path):
    enter, _ = entry
    (tmp_path / "my_terrain.py").write_text("def mesh(heights): pass\n")
    for name, told in (("nothing.py", "no such file"), ("my_terrain.py", "not of lesson 12")):
        with pytest.raises(SystemExit, match=f"{name}: {told}; write it: python -m course picture 12"):
            enter.main([str(tmp_path / name)])


def test_wrong_use_of_picture_is_one_line(folder, capsys):
    assert __main__.main(["picture", "99"]) == 2
    assert __main__.main(["picture", "3"]) == 2  # the lessons' own files are blank
    told = capsys.readouterr().err.splitlines()
    assert len(told) == 2 and "no lesson 99" in told[0] and "not written yet" in told[1]
    assert not list(folder.iterdir())


def test_solutions_are_in_the_students_tree_on_request(tmp_path, monkeypatch):
    monkeypatch.setattr(solving, "MAPS", 0)  # no stored values: other tests have them
    solving.students_tree(tmp_path / "tree", solved=[checking.lesson(1).folder])
    found = list((tmp_path / "tree" / "course" / "solved").iterdir())
    assert [path.name for path in found] == [checking.lesson(1).folder.name]
    assert found[0].read_text(encoding="utf-8") == solved(1)
