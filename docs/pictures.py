"""Helpers for the gallery of examples: a name for each picture, and a scraper that collects it."""

import shutil
from pathlib import Path

from sphinx_gallery.scrapers import figure_rst

PICTURE = "picture.png"  # in the folder of the examples, until the scraper takes it


class Arguments:
    """Command line of an example: where to write its picture."""

    def __repr__(self):
        return "Arguments"  # part of the configuration: the same in every build

    def __call__(self, gallery_conf, script_vars):
        """The arguments after the script's name."""
        return [PICTURE]


class Scraper:
    """Takes the picture that an example has written."""

    def __repr__(self):
        return "Scraper"

    def __call__(self, block, block_vars, gallery_conf):
        """Move the picture into the gallery; return the text that shows it."""
        drawn = Path(block_vars["src_file"]).with_name(PICTURE)
        if not drawn.exists():
            return ""
        target = Path(next(block_vars["image_path_iterator"]))
        shutil.move(drawn, target)
        return figure_rst([str(target)], gallery_conf["src_dir"])
