"""The built site in Chromium without a network: every page, its formulas, and the widgets under a real mouse."""

import base64
import json
import os
from itertools import pairwise
from pathlib import Path
from urllib.parse import unquote, urldefrag

import browser
import numpy as np
import pytest

ROOT = Path(__file__).parent.parent
SITE = ROOT / "build" / "site"
PAGES = sorted(str(path.relative_to(SITE)) for path in SITE.rglob("*.html"))
LESSONS = SITE / "course" / "lessons"
PICTURES = os.environ.get("TERRAIN_GL_SCREENSHOTS")  # folder for screenshots

if browser.CHROMIUM is None:
    pytest.skip("Chromium is not there: apt-get install chromium", allow_module_level=True)
if not PAGES:
    pytest.skip("build/site is not there: python -m sphinx -c docs . build/site", allow_module_level=True)

# What a page shows: formulas, and how many of them are set; pictures that are not there; places and links.
LOOK = """(async () => {
    const formulas = [...document.querySelectorAll(".math")];
    if (formulas.length) await MathJax.startup.promise;
    const pictures = [...document.images];
    pictures.forEach((one) => (one.loading = "eager"));
    await Promise.all(pictures.map((one) => one.decode().catch(() => 0)));
    return {
        formulas: formulas.length,
        unset: formulas.filter((one) => !one.querySelector("mjx-container")).map((one) => one.textContent),
        wrong: [...document.querySelectorAll("mjx-merror, [data-mjx-error]")].map((one) => one.textContent),
        missing: pictures.filter((one) => !one.naturalWidth).map((one) => one.src),
        ids: [...document.querySelectorAll("[id]")].map((one) => one.id),
        links: [...document.links].map((one) => one.href).filter((href) => href.startsWith("file:")),
        overflow: document.documentElement.scrollWidth - document.documentElement.clientWidth,
    };
})()"""


def address(page):
    """Address of a page by its name in the site."""
    return (SITE / page).as_uri()


def taken(page, name):
    """Save a screenshot, if there is a folder for it."""
    if PICTURES:
        Path(PICTURES).mkdir(parents=True, exist_ok=True)
        page.picture(Path(PICTURES) / f"{name}.png")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page in Chromium."""
    opened = browser.Page(tmp_path_factory.mktemp("chromium"))
    yield opened
    opened.close()


@pytest.fixture(scope="module")
def looks(page):
    """For each page of the site, by name: what it shows, and its faults."""
    found = {}
    for name in PAGES:
        page.requests, page.complaints = [], []
        page.open(address(name))
        found[name] = page.value(LOOK) | {"requests": page.requests, "complaints": page.complaints}
        if PICTURES:
            taken(page, name.replace("/", "-")[: -len(".html")])
    return found


def bad(looks, key):
    """Pages where a list is not empty."""
    return {name: look[key] for name, look in looks.items() if look[key]}


def test_no_page_asks_for_anything_outside_the_site(looks):
    outside = {
        url
        for look in looks.values()
        for url in look["requests"]
        if not url.startswith((SITE.as_uri() + "/", "data:", "blob:"))
    }
    assert not outside and sum(len(look["requests"]) for look in looks.values()) > len(PAGES)


def test_a_request_that_leaves_would_be_seen(page):
    page.open(address("docs/index.html"))
    page.requests, page.complaints = [], []
    assert page.value("fetch('https://example.org/').then(() => 'came back', () => 'refused')") == "refused"
    assert page.requests == ["https://example.org/"] and page.complaints


def test_no_console_complains(looks):
    assert not bad(looks, "complaints")


def test_formulas_are_set(looks):
    assert not bad(looks, "unset") and not bad(looks, "wrong")
    assert sum(look["formulas"] for look in looks.values()) > 100


def test_pictures_are_there(looks):
    assert not bad(looks, "missing")


def test_no_page_is_wider_than_the_window(looks):
    assert not {name: look["overflow"] for name, look in looks.items() if look["overflow"] > 0}


def test_links_within_the_site_lead_somewhere(looks):
    ids = {(SITE / name).resolve(): set(look["ids"]) for name, look in looks.items()}
    lost = []
    for name, look in looks.items():
        for link in look["links"]:
            url, place = urldefrag(link)
            path = Path(unquote(url.removeprefix("file://")))
            if not path.is_file() or (place and path in ids and unquote(place) not in ids[path]):
                lost.append((name, link))
    assert not lost


# Of each slide: how much is cut, the smallest letters, and the heights of its pictures.
SLIDES = """(async () => {
    if (document.querySelector(".math")) await MathJax.startup.promise;
    await Promise.all([...document.images].map((one) => one.decode()));
    return [...document.querySelectorAll("main.projector > section > section")].map((slide) => {
        const bottom = Math.max(...[...slide.children].map((part) => part.getBoundingClientRect().bottom));
        const top = slide.querySelector("h2").getBoundingClientRect().top, box = slide.getBoundingClientRect();
        const words = [...slide.querySelectorAll("p, li, blockquote")].filter((one) => one.textContent.trim());
        const wide = slide.scrollWidth - innerWidth;
        return {
            cut: Math.max(bottom - box.bottom, box.top + 40 - top, wide, box.height - innerHeight),
            letters: Math.min(...words.map((one) => parseFloat(getComputedStyle(one).fontSize)), 99),
            pictures: [...slide.querySelectorAll("img, canvas")].map((one) => one.getBoundingClientRect().height),
        };
    });
})()"""


@pytest.fixture
def projected(page):
    """The page, in a window of a projector's size."""
    page.ask("Emulation.setDeviceMetricsOverride", width=1280, height=720, deviceScaleFactor=1, mobile=False)
    yield page
    page.ask("Emulation.clearDeviceMetricsOverride")


@pytest.mark.parametrize("folder", sorted(path.name for path in LESSONS.iterdir()))
def test_nothing_of_a_projector_page_is_cut_and_keys_turn_its_slides(projected, folder):
    projected.open((LESSONS / folder / "projector.html").as_uri())
    slides = projected.value(SLIDES)
    assert len(slides) >= 2 and sum(len(slide["pictures"]) for slide in slides) >= 1
    for slide in slides:
        assert slide["cut"] <= 0 and slide["letters"] >= 26 and min(slide["pictures"], default=720) > 250, slides
    at = 0
    for key, step in [("PageDown", 1), ("ArrowRight", 1), ("PageUp", -1), (" ", 1), ("ArrowLeft", -1)]:
        projected.press(key)
        at = min(max(at + step, 0), len(slides) - 1)
        assert projected.value("scrollY") == 720 * at, key
        taken(projected, f"projector-{folder}-{at}")


class Widget:
    """A widget of a lesson's page, in the middle of the window."""

    def __init__(self, page, folder, name):
        self.page, self.name = page, name
        page.requests, page.complaints = [], []
        page.open((LESSONS / folder / "page.html").as_uri())
        self.value("element.scrollIntoView({ block: 'center', behavior: 'instant' })")

    def value(self, expression):
        """Value of an expression that knows the widget's `element`."""
        return self.page.value(
            f"(() => {{ const element = document.querySelector('[data-widget={self.name}]'); return {expression}; }})()"
        )

    def said(self, key):
        """A number that the widget shows."""
        return json.loads(self.value(f"element.dataset.{key}"))

    def box(self, selector, index=0):
        """Left, top, width and height of a part, in the window's pixels."""
        part = f"element.querySelectorAll('{selector}')[{index}].getBoundingClientRect()"
        return self.value(f"[{', '.join(f'{part}.{side}' for side in ('left', 'top', 'width', 'height'))}]")

    def drag(self, *places):
        """Drag the mouse over places in the canvas' own pixels."""
        left, top, width, height = self.box("canvas")
        columns, rows = self.value("[element.querySelector('canvas').width, element.querySelector('canvas').height]")
        self.page.drag(*((left + x * width / columns, top + y * height / rows) for x, y in places))

    def slide(self, index, share):
        """Drag a slider's knob to a share of its way; return the value that it has there."""
        left, top, width, height = self.box("input[type=range]", index)
        slider = f"element.querySelectorAll('input[type=range]')[{index}]"
        at = self.value(f"({slider}.value - {slider}.min) / ({slider}.max - {slider}.min)")
        knob, middle = 16, top + height / 2
        self.page.drag(*((left + knob / 2 + s * (width - knob), middle) for s in np.linspace(at, share, 5)))
        return float(self.value(f"{slider}.value"))

    def drawn(self):
        """The canvas' pixels, as text."""
        return self.value("element.querySelector('canvas').toDataURL()")

    def error(self):
        """The rms error that the widget tells."""
        return float(self.told().split("rms error ")[1].split()[0])

    def focus(self, selector, index=0):
        """Move the keyboard's focus to a part."""
        self.value(f"element.querySelectorAll('{selector}')[{index}].focus()")

    def told(self):
        """What the widget says below its canvas."""
        return self.value("element.querySelector('pre').textContent")


@pytest.fixture
def widget(page):
    """Open a lesson's widget; at the end nothing was asked for outside, and the console is silent."""
    yield lambda folder, name: Widget(page, folder, name)
    assert not page.complaints
    assert all(url.startswith((SITE.as_uri() + "/", "data:")) for url in page.requests)


def test_a_box_is_dragged_over_the_summed_area_table(widget):
    sums = widget("03_summed_area_tables", "sums")
    before = sums.drawn()
    posts = np.frombuffer(base64.b64decode(sums.value("MAP.base64")), "u1").reshape(257, 257)
    for (x0, y0), (x1, y1) in [((40, 30), (200, 170)), ((220, 240), (100, 7)), ((5, 5), (6, 6)), ((0, 0), (256, 256))]:
        sums.drag((2 * x0, 2 * y0), (x0 + x1, y0 + y1), (2 * x1, 2 * y1))
        (x0, x1), (y0, y1) = sorted((x0, x1)), sorted((y0, y1))
        truth = int(posts[y0:y1, x0:x1].astype(int).sum()) * 257
        assert sums.said("sum") == truth % 2**32
        assert f"box of {x1 - x0} × {y1 - y0} posts" in sums.told()
        assert f"mean {truth / ((x1 - x0) * (y1 - y0)):.3f}," in sums.told()
    sums.drag((80, 60), (240, 200), (400, 340))
    taken(sums.page, "widget-sums")
    assert sums.drawn() != before


def test_sliders_of_tolerance_and_budget_change_the_mesh(widget):
    budget = widget("09_budgets", "budget")
    counts = []
    for share in (0.05, 0.3, 0.6, 0.95):
        tolerance = 2 ** budget.slide(0, share)
        assert budget.told().startswith(f"tolerance {tolerance:.2f}: {budget.said('triangles')} triangles, rms error")
        assert budget.error() <= tolerance
        counts.append(budget.said("triangles"))
    assert all(finer > coarser for finer, coarser in pairwise(counts))
    drawings, errors = set(), []
    for share in (0.1, 0.4, 0.7, 0.9):
        most = 2 ** budget.slide(1, share)
        assert most / 2 < budget.said("triangles") <= most
        errors.append(budget.error())
        drawings.add(budget.drawn())
    taken(budget.page, "widget-budget")
    assert len(drawings) == 4 and all(coarser > finer for coarser, finer in pairwise(errors))


def test_the_eye_is_dragged_and_frozen(widget):
    frozen = widget("06_selection", "frozen")
    leaves = []
    for x, y in ((40, 60), (200, 30), (128, 220)):
        frozen.drag((2 * 120, 2 * 120), (2 * x, 2 * y))
        assert json.loads(f"[{frozen.value('element.dataset.eye')}]") == pytest.approx([x, y], abs=1)
        leaves.append(frozen.said("leaves"))
    assert len(set(leaves)) == 3
    left, top, width, height = frozen.box("input[type=checkbox]")
    frozen.page.drag((left + width / 2, top + height / 2))
    before = frozen.drawn()
    frozen.drag((534 + 2 * 128, 2 * 220), (534 + 2 * 60, 2 * 70))  # over the quadtree, at the right
    taken(frozen.page, "widget-frozen")
    assert json.loads(f"[{frozen.value('element.dataset.eye')}]") == pytest.approx([60, 70], abs=1)
    assert frozen.said("leaves") == leaves[-1] and frozen.drawn() != before
    left, top, width, height = frozen.box("input[type=radio]", 1)
    frozen.page.drag((left + width / 2, top + height / 2))
    flat = frozen.drawn()
    frozen.drag((300, 200), (400, 220))
    assert frozen.drawn() != flat and frozen.said("leaves") == leaves[-1]  # the land turns, its levels stay
    assert json.loads(f"[{frozen.value('element.dataset.eye')}]") == pytest.approx([60, 70], abs=1)
    left, top, width, height = frozen.box("input[type=checkbox]")
    frozen.page.drag((left + width / 2, top + height / 2))
    assert frozen.said("leaves") != leaves[-1]


def test_both_ways_are_compared_within_one_tolerance(widget):
    """Rings get all the triangles that the tolerance takes; so do the quadtree's leaves."""
    frozen = widget("06_selection", "frozen")
    for share in (0.2, 0.5, 0.9):
        factor = 2 ** frozen.slide(0, share)
        assert f"{factor:.3f} × distance" in frozen.value("element.textContent")
        rings, tree = json.loads(f"[{frozen.value('element.dataset.worst')}]")
        assert 0.4 < rings <= 1 and 0.7 < tree <= 1
        assert f"{2 * frozen.said('rings')} triangles" in frozen.told()
        assert 2 * frozen.said("leaves") < frozen.said("rings")


def test_the_other_way_is_told_at_equal_error(widget):
    budget = widget("09_budgets", "budget")
    budget.slide(0, 0.5)
    triangles, same, error = budget.said("triangles"), budget.said("same"), budget.error()
    budget.slide(1, (np.log2(same) - 3) / 12)
    assert budget.said("triangles") == pytest.approx(same, rel=0.1) and budget.error() == pytest.approx(error, rel=0.1)
    assert budget.said("same") == pytest.approx(triangles, rel=0.2) and same < triangles


def test_every_widget_is_used_by_keys_alone(widget):
    """Tab reaches each part in turn, each has a name, and arrow keys work it."""
    for folder, name, parts in (
        ("03_summed_area_tables", "sums", 1),
        ("09_budgets", "budget", 2),
        ("06_selection", "frozen", 4),
    ):
        found = widget(folder, name)
        found.value("element.previousElementSibling.tabIndex = -1, element.previousElementSibling.focus()")
        for _ in range(parts):
            found.page.press("Tab")
            assert found.value("element.contains(document.activeElement)")
            named = (
                "const one = document.activeElement; return one.ariaLabel || one.closest('label').textContent.trim()"
            )
            assert found.value(f"(() => {{ {named} }})()")
            assert found.value("getComputedStyle(document.activeElement).outlineStyle") == "solid"
        found.page.press("Tab")
        assert not found.value("element.contains(document.activeElement)")


def test_arrow_keys_move_the_box_and_change_its_size(widget):
    sums = widget("03_summed_area_tables", "sums")
    posts = np.frombuffer(base64.b64decode(sums.value("MAP.base64")), "u1").reshape(257, 257).astype(int)
    sums.focus("canvas")
    x0, y0, x1, y1 = json.loads(f"[{sums.value('element.dataset.box')}]")
    keys = [("ArrowRight", [1, 0, 1, 0]), ("ArrowUp", [0, -1, 0, -1]), ("Shift ArrowDown", [0, 16, 0, 16])]
    keys += [("Control ArrowLeft", [0, 0, -1, 0]), ("Control ArrowDown", [0, 0, 0, 1])]
    box = np.array([x0, y0, x1, y1])
    for key, change in keys:
        sums.page.press(key)
        box += change
        assert json.loads(f"[{sums.value('element.dataset.box')}]") == box.tolist(), key
        assert sums.said("sum") == posts[box[1] : box[3], box[0] : box[2]].sum() * 257
    for _ in range(20):
        sums.page.press("Shift ArrowLeft")  # the map's rim keeps the box whole
    assert json.loads(f"[{sums.value('element.dataset.box')}]") == (box - [box[0], 0, box[0], 0]).tolist()


def test_arrow_keys_work_the_sliders_and_show_which_is_active(widget):
    budget = widget("09_budgets", "budget")
    for index, name in ((1, "budget"), (0, "tolerance")):
        budget.focus("input[type=range]", index)
        before = budget.said("triangles")
        budget.page.press("ArrowRight")
        assert budget.value("element.dataset.active") == name and budget.said("triangles") != before
        shadows = "[...element.querySelectorAll('label')].map((one) => getComputedStyle(one).boxShadow !== 'none')"
        assert budget.value(shadows) == [index == 0, index == 1]
        assert budget.value(f"element.querySelectorAll('output')[{1 - index}].textContent") == " not active"


def test_arrow_keys_move_the_eye_and_turn_the_frozen_land(widget):
    frozen = widget("06_selection", "frozen")
    frozen.focus("canvas")
    for key, eye in (("ArrowLeft", [129, 120]), ("Shift ArrowUp", [129, 104]), ("Shift ArrowRight", [145, 104])):
        frozen.page.press(key)
        assert json.loads(f"[{frozen.value('element.dataset.eye')}]") == eye
    leaves = frozen.said("leaves")
    frozen.focus("input[type=checkbox]")
    frozen.page.press(" ")
    frozen.focus("input[type=radio]")
    frozen.page.press("ArrowDown")
    frozen.focus("canvas")
    drawings = {frozen.drawn()}
    for key in ("ArrowLeft", "ArrowDown", "Shift ArrowRight"):
        frozen.page.press(key)
        drawings.add(frozen.drawn())
    taken(frozen.page, "widget-frozen-3d")
    assert len(drawings) == 4 and frozen.said("leaves") == leaves
    assert json.loads(f"[{frozen.value('element.dataset.eye')}]") == [145, 104]
