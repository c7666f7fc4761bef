"""The site: lessons, documents, gallery and API, built offline from the repository.

Build: python -m sphinx -W --keep-going -c docs . build/site
"""

import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parent.parent
sys.path.insert(0, str(ROOT))

project, author = "terrain-gl", "The terrain-gl authors"
root_doc = "docs/index"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx-mathjax-offline"]
include_patterns = ["docs/**", "course/**", "*.md", "examples/README.md", "glsl/README.md", "heightmaps/README.md"]
exclude_patterns = ["course/solutions/**", "**/__pycache__/**"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
html_theme = "furo"
html_title = "terrain-gl"
html_static_path, html_css_files = ["_static"], ["course.css"]
html_copy_source = False
autodoc_typehints = "description"
autodoc_member_order = "bysource"
napoleon_google_docstring = False
napoleon_use_rtype = False


def draw_figures(app):
    """Draw every lesson's figure by its own code."""
    environment = os.environ | {"MPLBACKEND": "Agg"}
    subprocess.run([sys.executable, "-m", "course", "figures"], cwd=ROOT, env=environment, check=True)


def setup(app):
    """Figures come before the pages that show them."""
    app.connect("builder-inited", draw_figures)
