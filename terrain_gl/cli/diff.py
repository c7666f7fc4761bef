"""`terrain-gl diff`: how much two pictures differ."""

from dataclasses import dataclass

from ..basics.exceptions import UsageError
from ..comparison.difference import EXACT, Difference, Tolerance, differ_files
from . import options, report, values


@dataclass(frozen=True)
class DiffOptions:
    """What `diff` was told."""

    allowed: Tolerance
    expected: str
    seen: str
    path: str | None = None
    json: str | None = None


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "diff",
        DiffOptions,
        run,
        help="how much two pictures differ; exit status 1 if beyond a tolerance",
        description="Compare two pictures of one size. A pixel differs by the largest difference of its channels.\n"
        "Exit status: 0 equal within the tolerance, 1 beyond it, 2 wrong use.",
        example="diff golden.png picture.png -o difference.png --tolerance 2 --share 0.001",
    )
    command.add_argument("expected", metavar="A", help="picture that is expected")
    command.add_argument("seen", metavar="B", help="picture to compare")
    what = "picture of the difference, 8 times as strong, .png"
    command.add_argument("-o", "--output", metavar="OUT", dest="path", help=what)
    add_tolerance(command)
    options.add_json(command)


def add_tolerance(command: options.Options) -> None:
    """Add the options for how much two pictures may differ."""
    what = f"steps of 255 that a pixel may differ (default: {EXACT.steps:g})"
    command.add_argument(
        "--tolerance", type=values.not_negative, metavar="N", dest="steps", default=EXACT.steps, help=what
    )
    what = f"share of the pixels that may differ more (default: {EXACT.share:g})"
    command.add_argument("--share", type=values.share, metavar="P", default=EXACT.share, help=what)


def run(asked: DiffOptions) -> int:
    """Run the command."""
    check_name(asked.path)
    report.check_outputs((asked.path, asked.json), (asked.expected, asked.seen))
    found = differ_files(asked.expected, asked.seen, asked.allowed, asked.path)
    report.write_json(asked.json, {"expected": asked.expected, "seen": asked.seen} | found.record())
    report.say(asked.json, text(found))
    return 0 if found.is_within else 1


def check_name(path: str | None) -> None:
    """Refuse a name of a difference picture that does not end in .png."""
    if path is not None and not path.lower().endswith(".png"):
        raise UsageError(f"{report.shown(path)}: the name of a difference picture must end in .png")


def text(found: Difference) -> str:
    """A difference as text."""
    col, row = found.worst
    verdict = "within" if found.is_within else "beyond"
    lines = {
        "rmse": f"{found.rmse:.3g}, black 0 to white 1",
        "flip": "unknown, needs OpenImageIO 3.2" if found.flip is None else f"{found.flip:.3g}, mean of 0 to 1",
        "largest": f"{found.largest:.4g} of 255, at column {col}, row {row}",
        "share": f"{100 * found.share:.3g} % of the pixels differ by more than {found.tolerance.steps:g} of 255",
        "verdict": f"{verdict} the tolerance; {100 * found.tolerance.share:.3g} % are allowed",
    }
    return report.facts(lines)
