"""The short form of benchmarks/robustness.py: damaged files and commands that are ended."""

import os
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "benchmarks"))
from robustness import FINE, _whole, end_commands, read_damaged, tally


def test_damaged_files_are_read_or_refused_in_one_line(tmp_path):
    seen, wrong = tally(read_damaged(300, 3, tmp_path), 300)
    assert not wrong
    assert set(seen) == {"read", "refused"} and min(seen.values()) > 30  # of each there are some


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals are Unix's")
def test_ended_commands_leave_nothing_half_written(tmp_path):
    seen, wrong = tally(end_commands(8, 3, tmp_path), 8)
    assert not wrong and set(seen) <= set(FINE) and seen["ended"]


def test_a_half_written_file_would_be_seen(tmp_path):
    (tmp_path / "out.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(50))
    (tmp_path / "out.gif").write_bytes(b"GIF89a")
    (tmp_path / "out.ply").write_bytes(b"ply\nelement vertex 3\nelement face 1\nend_header\n" + bytes(84))
    assert not any(_whole(path, False) for path in tmp_path.iterdir())
