"""Projector pages: a lesson's prediction, figure, one derivation and widget, cut out of the lesson's page.

The derivation stands in the page between two comments, <!-- projector --> and <!-- end -->.
"""

import re
from pathlib import Path

_PART = re.compile(r"^## ([^\n]+)\n\n(.*?)(?=^## |\Z)", re.MULTILINE | re.DOTALL)
_DERIVATION = re.compile(r"^<!-- projector -->\n\n?(.*?)^<!-- end -->\n", re.MULTILINE | re.DOTALL)
# A figure or a widget, and the line in italics below it.
_BLOCK = r"^{}\n(?:\n\*[^*]+\*\n)?"
_FIGURE = re.compile(_BLOCK.format(r"!\[[^\]]*\]\(figure\.png\)"), re.MULTILINE)
_WIDGET = re.compile(_BLOCK.format(r'<div class="widget"[^\n]*</div>'), re.MULTILINE)


def projector_page(page: str) -> str:
    """Text of the projector page of a lesson's page; each heading of the second rank begins a slide."""
    title = page.splitlines()[0]
    prediction = _WIDGET.sub("", dict(_PART.findall(page))["A prediction"])
    (figure,), (derivation,) = _FIGURE.findall(page), _DERIVATION.findall(page)
    slides = ["---\norphan: true\n---", title, f"## A prediction\n\n{prediction}"]
    if figure not in prediction:
        slides.append(f"## The figure\n\n{figure}")
    slides.append(re.sub("^### ", "## ", _FIGURE.sub("", derivation), flags=re.MULTILINE))
    slides += [f"## Try it\n\n{widget}" for widget in _WIDGET.findall(page)]
    return "\n\n".join(slide.strip() for slide in slides) + "\n"


def write_projector_pages(lessons: Path) -> None:
    """Write `projector.md` beside the page of every lesson."""
    for page in sorted(lessons.glob("*/page.md")):
        (page.parent / "projector.md").write_text(projector_page(page.read_text(encoding="utf-8")), encoding="utf-8")


def with_link(page: str) -> str:
    """A lesson's page with a link to its projector page, after the line of minutes and needs."""
    return re.sub(r"(?<=\*)\n\n## Goal", "\n\n[Projector page](projector.md)\n\n## Goal", page, count=1)
