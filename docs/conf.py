"""The site: lessons, documents, gallery and API, built offline from the repository.

Build: python -m sphinx -W --keep-going -c docs . build/site
"""

import base64
import os
import re
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path[:0] = [str(ROOT), str(ROOT / "docs")]

from pictures import Arguments, Scraper  # noqa: E402
from projector import with_link, write_projector_pages  # noqa: E402

project, author = "terrain-gl", "The terrain-gl authors"
root_doc = "docs/index"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx-mathjax-offline"]
extensions += ["sphinx_gallery.gen_gallery"]
include_patterns = ["docs/**", "course/**", "*.md", "examples/README.md", "glsl/README.md", "heightmaps/README.md"]
exclude_patterns = ["course/solutions/**", "course/LECTURERS.md", "course/FACTS.md", "**/__pycache__/**"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "terrain-gl"
html_static_path, html_css_files = ["_static"], ["course.css"]
templates_path = ["_templates"]
html_copy_source = False
html_show_copyright = False
autodoc_typehints = "description"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False
sphinx_gallery_conf = {  # an example is drawn again if it has changed, or if docs/examples is missing
    "examples_dirs": "examples",
    "gallery_dirs": "docs/examples",
    "filename_pattern": r"/\d\d_",
    "within_subsection_order": "FileNameSortKey",
    "image_scrapers": (Scraper(),),
    "reset_argv": Arguments(),
    "abort_on_example_error": True,
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
}


def draw_figures(app):
    """Draw every lesson's figure by its own code, and the chapters' figures."""
    environment = os.environ | {"MPLBACKEND": "Agg"}
    for command in (["-m", "course", "figures"], ["docs/figures.py"]):
        subprocess.run([sys.executable, *command], cwd=ROOT, env=environment, check=True)


def write_map(app):
    """The widgets' map: 257 × 257 heights of a bundled one, a byte each."""
    from matplotlib import pyplot as plt

    h = plt.imread(ROOT / "heightmaps" / "alpine-30m.png")[500:757, 600:857]
    data = base64.b64encode((255 * (h - h.min()) / (h.max() - h.min())).round().astype("u1").tobytes()).decode()
    (ROOT / "docs" / "_static" / "map.js").write_text(
        f'const MAP = {{ n: 257, base64: "{data}" }};\n', encoding="utf-8"
    )


def cut_projector_pages(app):
    """Cut each lesson's projector page out of its page."""
    write_projector_pages(ROOT / "course" / "lessons")


def link_projector_page(app, docname, source):
    """Lead from a lesson's page to its projector page, which is there on the site alone."""
    if re.fullmatch(r"course/lessons/\w+/page", docname):
        source[0] = with_link(source[0])


def show_on_projector(app, pagename, templatename, context, doctree):
    """A projector page has no side bars, and keys that turn its slides."""
    if not pagename.endswith("/projector"):
        return None
    app.add_js_file("projector.js", loading_method="defer")
    return "projector.html"


def add_widgets(app, pagename, templatename, context, doctree):
    """Pages with a widget load its code."""
    if 'class="widget"' in context.get("body", ""):
        for name in ("map.js", "widgets.js"):
            app.add_js_file(name, loading_method="defer")


def leave_out_the_lecturers_part(app, docname, source):
    """What is between these two comments is for lecturers; the site is for everybody."""
    source[0] = re.sub(r"^<!-- lecturers -->\n.*?^<!-- end -->\n", "", source[0], flags=re.MULTILINE | re.DOTALL)


def setup(app):
    """Make figures and the map before the pages that show them."""
    app.connect("source-read", leave_out_the_lecturers_part)
    app.connect("source-read", link_projector_page)
    app.connect("builder-inited", draw_figures)
    app.connect("builder-inited", write_map)
    app.connect("builder-inited", cut_projector_pages)
    app.connect("html-page-context", add_widgets)
    app.connect("html-page-context", show_on_projector)
