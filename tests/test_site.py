"""The site: code draws its figures, and its tables and checksums are those of the files."""

import csv
import hashlib
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"


def load(path):
    """A script as a module."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def checksums(page):
    """File name -> the (beginning of the) checksum that a page's table gives."""
    return dict(re.findall(r"^\| `([^`]+)` \|.*\| `([0-9a-f]+)…?` \|$", page.read_text(encoding="utf-8"), re.MULTILINE))


@pytest.fixture(scope="module")
def figures():
    """The script that draws the chapters' figures."""
    pytest.importorskip("matplotlib").use("Agg")
    return load(DOCS / "figures.py")


def test_each_figure_of_a_chapter_is_drawn_by_the_script_and_shown(figures):
    pages = "".join(path.read_text(encoding="utf-8") for path in DOCS.glob("*.md"))
    shown = set(re.findall(r"\]\(figures/([^)]+)\)", pages))
    assert shown == set(figures.FIGURES) == {path.name for path in (DOCS / "figures").iterdir()}


def test_figures_are_drawn_alike_twice(figures, tmp_path, monkeypatch):
    monkeypatch.setattr(figures, "FIGURES", {name: figures.FIGURES[name] for name in ("cell.svg", "footprint.svg")})
    drawn = []
    for folder in (tmp_path / "first", tmp_path / "second"):
        figures.main(folder)
        drawn.append([path.read_bytes() for path in sorted(folder.iterdir())])
    assert drawn[0] == drawn[1] and all(picture.startswith(b"<?xml") for picture in drawn[0])


def test_the_squares_of_the_drawn_rings_cover_each_place_once(figures):
    worst = [np.zeros((64 >> j, 64 >> j)) for j in range(4)]
    worst[1][8:12, 8:12] = worst[2][4:6, 4:6] = worst[3][2:3, 2:3] = 9.0
    count = np.zeros((64, 64), int)
    hole = (24, 24, 16)
    for y in range(0, 64, 16):
        for x in range(0, 64, 16):
            for left, top, side, spacing in figures.cut(worst, x, y, 16, 1, hole, lambda *_: 1.0)[0]:
                count[top : top + side, left : left + side] += 1
                assert worst[spacing][top >> spacing, left >> spacing] <= 1.0
    assert (count[24:40, 24:40] == 0).all()
    count[24:40, 24:40] = 1
    assert (count == 1).all()


@pytest.mark.parametrize("page, folder", [("heightmaps/README.md", "heightmaps"), ("docs/maps.md", "TERRAIN_GL_DEM")])
def test_checksums_of_maps(page, folder):
    listed = checksums(ROOT / page)
    if folder == "heightmaps":
        assert set(listed) == {path.name for path in (ROOT / folder).glob("*.png")}
        folder = ROOT / folder
    elif folder not in os.environ:
        pytest.skip("TERRAIN_GL_DEM names no folder of real maps")
    else:
        folder = Path(os.environ[folder])
    assert listed
    for name, checksum in listed.items():
        if (folder / name).exists():
            assert hashlib.sha256((folder / name).read_bytes()).hexdigest().startswith(checksum), name


@pytest.fixture(scope="module")
def projector():
    """The module that cuts projector pages."""
    return load(DOCS / "projector.py")


def test_a_projector_page_is_cut_out_of_each_lesson(projector):
    pages = sorted((ROOT / "course" / "lessons").glob("*/page.md"))
    assert len(pages) == 14
    for path in pages:
        page = path.read_text(encoding="utf-8")
        cut = projector.projector_page(page)
        title, *slides = re.split(r"^##? ", cut, flags=re.MULTILINE)[1:]
        assert page.startswith(f"# {title.strip()}") and slides[0].startswith("A prediction\n")
        assert cut.count("](figure.png)") == 1 and cut.count('class="widget"') == page.count('class="widget"')
        own = [line for line in cut.splitlines() if line and line not in page.splitlines()]
        headings = {"---", "orphan: true", "## The figure", "## Try it"} | {
            f"## {slide.splitlines()[0]}" for slide in slides
        }
        assert set(own) <= headings, "a projector page says nothing of its own"
        assert "[Projector page](projector.md)" in projector.with_link(page)


def build(folder):
    """Build a site of one example with the gallery's own scraper; return the picture's bytes."""
    (folder / "conf.py").write_text(
        f"import sys\nsys.path.insert(0, {str(DOCS)!r})\nfrom pictures import Arguments, Scraper\n"
        "extensions = ['sphinx_gallery.gen_gallery']\nexclude_patterns = ['examples']\n"
        "sphinx_gallery_conf = dict(examples_dirs='examples', gallery_dirs='shown', filename_pattern='/01',\n"
        "    image_scrapers=(Scraper(),), reset_argv=Arguments(), abort_on_example_error=True,\n"
        "    write_computation_times=False)\n"
    )
    (folder / "index.rst").write_text("Site\n====\n\n.. toctree::\n\n   shown/index\n")
    command = [sys.executable, "-m", "sphinx", "-q", "-W", str(folder), str(folder / "site")]
    done = subprocess.run(command, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    (picture,) = (folder / "shown" / "images").glob("*01_grey*.png")
    return picture.read_bytes()


@pytest.mark.slow
def test_the_gallery_draws_a_changed_example_anew_and_no_other(tmp_path):
    pytest.importorskip("sphinx_gallery")
    script = tmp_path / "examples" / "01_grey.py"
    script.parent.mkdir()
    (script.parent / "GALLERY_HEADER.txt").write_text("Shown\n=====\n\nOne.\n")
    text = (
        '"""Grey\n====\n\nA square.\n"""\n\nimport sys\n\nimport numpy as np\n'
        "from terrain_gl.image import write_png\n\nopen('runs', 'a').write('.')\n"
        "write_png(sys.argv[1], np.full((64, 64, 3), 80, np.uint8))\n"
    )
    script.write_text(text)
    first = build(tmp_path)
    assert build(tmp_path) == first and (script.parent / "runs").read_text() == "."
    script.write_text(text.replace("80", "200"))
    assert build(tmp_path) != first and (script.parent / "runs").read_text() == ".."


def test_the_gallery_draws_every_example():
    conf = (DOCS / "conf.py").read_text(encoding="utf-8")
    pattern = re.search(r'"filename_pattern": r"([^"]+)"', conf)[1]
    scripts = list((ROOT / "examples").glob("*.py"))
    assert scripts and all(re.search(pattern, str(path)) for path in scripts)
    for path in scripts:
        title, line = path.read_text(encoding="utf-8").splitlines()[:2]
        assert line == "=" * (len(title) - 3), f"{path.name}: the title is underlined"


def test_each_table_is_linked_from_a_page():
    pages = "".join(path.read_text(encoding="utf-8") for path in DOCS.glob("*.md"))
    assert set(re.findall(r"\]\(tables/([^)]+)\)", pages)) == {path.name for path in (DOCS / "tables").iterdir()}


def test_the_page_on_performance_says_what_its_table_holds():
    with open(DOCS / "tables" / "other_programs.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    page = (DOCS / "performance.md").read_text(encoding="utf-8")
    several = r"([\d.]+) to ([\d.]+) times as many"
    (numbers,) = re.findall(rf"pydelatin's mesh has {several}.* has {several}.* and {several}", page)
    ratios = [
        [int(row[program]) / int(row[other]) for row in rows]
        for program, other in (("pydelatin there", "pymartini"), ("sat", "pydelatin"), ("sat there", "pymartini"))
    ]
    said = [limit(each) for each in ratios for limit in (min, max)]
    assert said == pytest.approx([float(number) for number in numbers], abs=0.06)


def test_the_comparison_says_what_its_table_holds(figures):
    """The page's ranges of ratios are those of docs/tables/screen_error.csv."""
    page = (DOCS / "comparison.md").read_text(encoding="utf-8")
    errors = {
        key: {name: np.array(column) for name, column in c.items()}
        for key, c in figures.table("screen_error.csv").items()
    }
    assert len(errors) > 12
    baselines = np.concatenate([np.minimum(c["clipmap"], c["tessellated"]) / c["sat"] for c in errors.values()])
    (said,) = re.findall(r"the better baseline is ([\d.]+) to ([\d.]+) times", page)
    assert [baselines.min(), baselines.max()] == pytest.approx([float(number) for number in said], abs=0.006)
