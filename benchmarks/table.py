"""Tables that benchmarks print, as the pages have them: `python docs/numbers_of_pages.py --benchmarks` copies them."""


def head(*names: str) -> None:
    """Print the first lines of a table."""
    print()
    row(*names)
    print("|---" * len(names) + "|", flush=True)


def row(*cells: object) -> None:
    """Print a row."""
    print("|" + "".join(f" {cell} |" if str(cell) else " |" for cell in cells), flush=True)
