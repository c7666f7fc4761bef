"""The pages have the numbers that the program of today gives: a sample of each table is measured again."""

import re
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "docs"))
import numbers_of_pages as numbers  # noqa: E402


@pytest.fixture(scope="module", autouse=True)
def released():
    """Release the last renderer."""
    yield
    numbers.release()


@pytest.mark.parametrize("table", numbers.TABLES, ids=lambda table: table.name)
def test_a_table_has_its_rows_and_says_where_they_come_from(table):
    text = (ROOT / table.page).read_text("utf-8")
    found = numbers.rows_of(text, table)
    assert tuple(found) == table.keys
    assert all(len(cells) == max(1, len(table.head) - len(key)) for key, cells in found.items())
    end = numbers.block_of(text, table.name)[3]
    assert re.search(rf"--table {table.name}, commit [0-9a-f]{{7,}}, \d+ \w+ 20\d\d, .*llvmpipe", end)


@pytest.mark.parametrize(
    ("table", "key"),
    [
        pytest.param(
            table, key, marks=[pytest.mark.slow] * (table.name in ("equal-triangles", "spread", "whole", "mean"))
        )
        for table in numbers.TABLES
        for key in table.sample
    ],
    ids=lambda each: each.name if isinstance(each, numbers.Table) else "-".join(each),
)
def test_a_sample_is_what_the_program_gives(table, key):
    row = numbers.rows_of((ROOT / table.page).read_text("utf-8"), table)[key]
    assert table.row(*key) == row, f"run python docs/numbers_of_pages.py --table {table.name}"


def test_the_horizon_finds_more_than_half_where_more_than_half_is_hidden():
    page = (ROOT / "docs/hidden.md").read_text("utf-8")
    table = next(table for table in numbers.TABLES if table.name == "hidden")
    shares = [tuple(map(float, cells[-2:])) for cells in numbers.rows_of(page, table).values()]
    hidden = [(1 - patches) / (1 - seen) for patches, seen in shares if seen < 0.5]
    assert f"In all {len(hidden)} views" in page and min(hidden) > 0.5


def test_pictures_are_drawn_by_the_commands_of_the_pages():
    pages = "".join(
        (ROOT / page).read_text("utf-8") for page in ("README.md", *(f"docs/{n}.md" for n in ("comparison", "light")))
    )
    for command in numbers.PICTURES:
        assert f"terrain-gl {command}" in pages
        assert (ROOT / "docs" / command.split()[-1]).exists()
    assert all((ROOT / "docs" / f"{script}.py").exists() for script in numbers.SCRIPTS)


def test_a_block_is_written_and_read_again():
    table = next(table for table in numbers.TABLES if table.name == "hidden")
    rows = {("a", "first"): ["1", "2", "3", "4", "5"], ("b", "ridge"): ["5", "6", "7", "8", "9"]}
    text = f"<!-- numbers: {table.name} -->\n{numbers.written(table, rows)}\n<!-- end of numbers: x -->"
    assert numbers.rows_of(text, table) == rows
    with pytest.raises(AssertionError, match="no block"):
        numbers.block_of(text, "another")


PRINTED = [
    (page.name, found["command"], found["table"], found[0])
    for page in numbers.PRINTED_IN
    for found in numbers.PRINTED.finditer(page.read_text("utf-8"))
]


@pytest.mark.parametrize(("page", "command", "table", "block"), PRINTED, ids=[f"{p}-{c[18:]}" for p, c, *_ in PRINTED])
def test_a_printed_table_names_a_benchmark_and_where_its_numbers_come_from(page, command, table, block):
    script = ROOT / command.split()[1]
    assert re.search("from table import head, row|import table", script.read_text("utf-8"))
    head, _, *rows = table.splitlines()
    assert rows and all(row.count("|") == head.count("|") for row in rows)
    assert re.search(r"<!-- end of printed: commit [0-9a-f]{7,}, \d+ \w+ 20\d\d, .*llvmpipe", block)


def test_printed_tables_are_taken_from_what_a_command_prints(folder):
    Path("try.py").write_text("print('words\\n\\n| a | b |\\n|---|---|\\n| 1 | 3 |\\n\\n| c |\\n|---|\\n| 5 |\\n')")
    command = f"{sys.executable} {folder / 'try.py'}"
    page = folder / "page.md"
    before = "<!-- printed: {} -->\n| {} |\n|---|---|\n| 1 | 2 |\n<!-- end of printed: before -->\n"
    page.write_text(before.format(command, "a | b") + before.format(command, "a | x") + before.format("no", "a | b"))
    new = numbers.reprint(page, "try.py")
    assert new == ["| 1 | 3 |", f"{command}: NO TABLE with the first line | a | x |"]
    first, second, third = page.read_text("utf-8").split("<!-- printed: ")[1:]
    assert "| 1 | 3 |" in first and "commit" in first and "| c |" not in first
    assert "| 1 | 2 |" in second and "before" in second and "| 1 | 2 |" in third


CLAIMS = (  # a page, words that claim that something is always so, the test that tries it
    ("README.md", "on any map and after any edit", "test_bound_holds_on_any_map_from_anywhere"),
    ("README.md", "on any map and after any edit", "test_bound_holds_after_an_edit"),
    ("docs/hidden.md", "Both pictures are the same, bit for bit", "test_the_picture_is_the_same_to_the_bit"),
    ("docs/flight.md", "the pictures have the same bytes for", "test_two_processes_draw_the_same_though_one_dies"),
    ("docs/flight.md", "it draws only the missing pictures", "test_the_same_command_again_draws_only_what_is_missing"),
    ("docs/flight.md", "The eye is always at least 1 %", "test_tour_keeps_above_any_map"),
    ("docs/stores.md", "bit for bit as in memory", "test_any_voids_are_filled_as_in_memory"),
    ("docs/stores.md", "are equal, bit for bit, to the records", "test_records_are_those_of_the_whole_map"),
    ("docs/stores.md", "and gives the same bytes", "test_killed_at_any_moment_it_goes_on_to_the_same_bytes"),
    ("docs/stores.md", "does not change the bytes", "test_two_processes_write_the_same_bytes"),
    ("docs/stores.md", "has the bytes of a new build", "test_damage_is_found_and_mended"),
    ("docs/stores.md", "these are equal, bit for bit", "test_with_all_pages_the_mesh_is_that_of_the_whole_map"),
)


@pytest.mark.parametrize(("page", "words", "test"), CLAIMS)
def test_a_claim_has_a_test(page, words, test):
    assert words in " ".join((ROOT / page).read_text("utf-8").split())
    assert any(f"def {test}(" in path.read_text("utf-8") for path in (ROOT / "tests").glob("test_*.py"))
