"""The tour of the window on a small map: every step a user takes, and no panels that overlap at 1000 x 600."""

import shutil

import numpy as np
import pytest
from tour import take
from viewers import hills


@pytest.mark.slow
def test_the_tour(tmp_path):
    pytest.importorskip("imgui_bundle", reason="the extra [gui] is not installed")
    for program in ("Xvfb", "xdotool"):
        if not shutil.which(program):
            pytest.skip(f"no {program} here; apt install {program.lower()}")
    np.save(tmp_path / "hills.npy", hills().heights)
    take(tmp_path / "hills.npy", (1000, 600), tmp_path / "shots", style="lambert")
    assert len(list((tmp_path / "shots").glob("*.png"))) == 19
