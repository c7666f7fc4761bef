"""Sampled tests: which cases run without `--all`."""

from types import SimpleNamespace

import pytest
from conftest import not_sampled

CASES = list(range(10))


class Case:
    """A case of a test with the parameters `number` and `name`."""

    def __init__(self, every, cover, number, name):
        self.mark = pytest.mark.sampled(every, cover).mark
        self.callspec = SimpleNamespace(params={"number": number, "name": name})

    def get_closest_marker(self, _):
        return self.mark


@pytest.mark.parametrize(
    ("every", "cover", "kept"), [(4, "", [0, 4, 8]), (4, "number", [0, 1, 3, 4, 8]), (4, "name", CASES), (1, "", CASES)]
)
def test_one_case_in_n_runs_and_one_for_each_value(every, cover, kept):
    cases = [Case(every, cover, number, i) for i, number in enumerate([7, 8, 8, 9, 9, 9, 9, 9, 9, 7])]
    left_out = not_sampled(cases)
    assert [i for i in CASES if cases[i] not in left_out] == kept


@pytest.mark.parametrize("part", range(3))
def test_the_cases_of_a_test_share_the_sample(request, sample, part):
    assert sample(CASES, 3) == (CASES if request.config.getoption("--all") else CASES[part::3])
