"""Tasks in the real code: a changed line breaks exactly the tests that the course says."""

import pytest
from courses import NUMBERS, checking

real = pytest.importorskip("course.real")
CHANGED = [number for number in NUMBERS if number >= 3]


@pytest.mark.slow
@pytest.mark.parametrize("number", CHANGED)
def test_a_changed_line_breaks_the_tests_that_are_named_and_no_other_of_them(tmp_path, number):
    """Each runs in a process of its own, with a copy of what students get: that is why it takes more than a second."""
    each = real.change(checking.lesson(number).folder)
    real.changed_tree(each, tmp_path / "tree")
    found = real.outcomes(tmp_path / "tree", [*each.fails, *each.passes])
    if "skipped" in found.values():
        pytest.skip("no OpenGL here")
    assert found == dict.fromkeys(each.fails, "failed") | dict.fromkeys(each.passes, "passed")


@pytest.mark.parametrize("number", CHANGED)
def test_the_page_has_the_task_and_not_its_answer(number):
    folder = checking.lesson(number).folder
    each, page = real.change(folder), (folder / "page.md").read_text(encoding="utf-8")
    assert real.task_text(each) in page and each.fails and each.passes and len(each.why) > 100
    assert each.why.split(".")[0] not in page


def test_a_change_that_finds_no_line_is_noticed(tmp_path):
    with pytest.raises(ValueError, match="0 times"):
        real.changed_tree(real.Change("glsl/sat/scan.comp", "no such line", "", "", [], []), tmp_path / "tree")
