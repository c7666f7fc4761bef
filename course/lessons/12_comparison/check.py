"""Check of lesson 12: known curves, comparisons with planted faults, and a referee for those that students plant."""

import csv
import io

import numpy as np

from course.checking import compare, holds, task
from course.truths import private, referee

TITLE = "Honest comparison, and history"


def curve(rng, power, scale, count=7):
    """A falling curve: errors follow a power of the triangles, with bends."""
    triangles = np.sort(np.rint(np.exp(rng.uniform(np.log(1000), np.log(300_000), count)))).astype(int)
    triangles += np.arange(count)
    bends = np.cumsum(rng.uniform(0.6, 1.4, count) * np.append(0, np.diff(np.log(triangles))))
    return [(int(n), float(e)) for n, e in zip(triangles, scale * np.exp(-power * bends), strict=True)]


@private
def between(x, xs, ys):
    """A line between two known places, by logarithms; NaN outside."""
    for (x0, x1), (y0, y1) in zip(zip(xs, xs[1:], strict=False), zip(ys, ys[1:], strict=False), strict=True):
        if min(x0, x1) <= x <= max(x0, x1):
            return float(y0 * (y1 / y0) ** (np.log(x / x0) / np.log(x1 / x0)))
    return float("nan")


@task("12.1 the error at a number of triangles", points=2)
def error_at(student, rng):
    """Tested inside the curve, at its ends, and outside."""
    points = curve(rng, 0.6, 4.0)
    n, e = zip(*points, strict=True)
    asked = [*np.exp(rng.uniform(np.log(n[0]), np.log(n[-1]), 30)), n[0], n[3], n[-1], n[0] / 2, n[-1] * 2]
    want = [between(at, n, e) for at in asked]
    got = [student.error_at(points, float(at)) for at in asked]
    yield compare("35 budgets", got, want, axes=("budget",))


@task("12.2 triangles for an error", points=2)
def triangles_for(student, rng):
    """The same curve, read at an error."""
    points = curve(rng, 0.6, 4.0)
    n, e = zip(*points, strict=True)
    asked = [*np.exp(rng.uniform(np.log(e[-1]), np.log(e[0]), 30)), e[0], e[3], e[-1], e[0] * 2, e[-1] / 2]
    want = [between(at, e, n) for at in asked]
    got = [student.triangles_for(points, float(at)) for at in asked]
    yield compare("35 errors", got, want, axes=("error",))


@private
def true_summary(ours, theirs):
    """Smallest, median and largest ratio of the triangles, over the errors that both curves have."""
    (n, e), (m, f) = zip(*ours, strict=True), zip(*theirs, strict=True)
    high, low = min(e[0], f[0]), max(e[-1], f[-1])
    errors = np.clip(high * (low / high) ** (np.arange(33) / 32), low, high)
    ratios = [between(at, f, m) / between(at, e, n) for at in errors]
    return [min(ratios), float(np.median(ratios)), max(ratios)]


@task("12.3 the summary of two curves", points=3)
def summary(student, rng):
    """Tested on two curves that cross, and on two without a common error."""
    for name, (ours, theirs) in {
        "one is better": (curve(rng, 0.7, 2.0, 12), curve(rng, 0.7, 6.0, 12)),
        "they cross": (curve(rng, 0.9, 5.0, 12), curve(rng, 0.4, 3.0, 12)),
        "they cross the other way": (curve(rng, 0.4, 3.0, 12), curve(rng, 0.9, 5.0, 12)),
    }.items():
        want = true_summary(ours, theirs)
        yield compare(name, student.summary(ours, theirs), want, axes=("number",))
    far = [(n, 1e-6 * e) for n, e in curve(rng, 0.7, 2.0)]
    yield compare("no common error", student.summary(far, curve(rng, 0.1, 2.0)), [np.nan] * 3, axes=("number",))


FAULTS = ("inputs", "metric", "own metric", "triangles", "budgets", "tuning")


def comparison(rng, planted):
    """Rows of a comparison with these faults and no others, each just beyond its limit; fair rows just within it."""
    count = 5 if rng.random() < 0.5 else 6
    budgets = np.rint(np.geomspace(2000, 100_000, count)).astype(int)
    tuned, metric = bool(rng.random() < 0.7), str(rng.choice(["rms", "max"]))
    rows = []
    for i, method in enumerate(("sat", "clipmap", "tessellated")):
        counts = [int(n) + (int(n) // 50 if i == 1 else 0) for n in budgets]
        rows.append(
            {
                "method": method,
                "map": "canyon",
                "view": "ridge",
                "size": (640, 360),
                "metric": metric,
                "measured": "achieved",
                "tuned": tuned,
                "points": [(n, float(5 * n**-0.5)) for n in counts],
            }
        )
    k = int(rng.integers(0, 3))
    if "inputs" in planted:
        key, value = [("map", "alpine"), ("view", "first"), ("size", (640, 400))][int(rng.integers(0, 3))]
        rows[k][key] = value
    if "metric" in planted:
        rows[k]["metric"] = "max" if metric == "rms" else "rms"
    if "own metric" in planted:
        rows[k]["measured"] = "certified"
    if "triangles" in planted:
        j, share = (3, 1.0201) if rng.random() < 0.5 else (int(rng.integers(0, 4)), 0.978)
        n, e = rows[2]["points"][j]
        rows[2]["points"][j] = (int(n * share), e)
    if "budgets" in planted:
        rows[k]["points"] = rows[k]["points"][:4]
    if "tuning" in planted:
        rows[k]["tuned"] = not tuned
    return rows


@task("12.4 what is unfair", points=4)
def faults(student, rng):
    """Tested on a fair comparison, and on comparisons with one fault and with several."""
    cases = [
        (),
        *((name,) for name in FAULTS),
        *[("triangles",)] * 4,
        *(tuple(rng.choice(FAULTS, 3, replace=False)) for _ in range(6)),
    ]
    for i, planted in enumerate(cases):
        got = student.faults(comparison(rng, planted))
        said = sorted(str(name) for name in got) if isinstance(got, list | tuple) else got
        yield holds(
            f"comparison {i}", said == sorted(planted), f"you found {said}, there are {sorted(map(str, planted))}"
        )


@private
def history():
    """Years of the papers, of what each method is made, and what decides."""
    return {
        "ROAM": ((1997,), "bintree", "error"),
        "geometry clipmaps": ((2004,), "rings", "distance"),
        "CDLOD": ((2009, 2010), "quadtree", "distance"),
        "CBT": ((2020,), "bintree", "edge length"),
    }


@task("12.5 history", points=1)
def places(student, rng):
    """The four methods of the page."""
    got = student.places()
    for name, (years, made, decides) in history().items():
        said = got.get(name) if isinstance(got, dict) else None
        fits = isinstance(said, tuple | list) and len(said) == 3
        yield holds(f"{name}: year", fits and said[0] in years, "look into its paper")
        yield holds(f"{name}: made of", fits and said[1] == made, "what is cut, and how?")
        yield holds(f"{name}: decided by", fits and said[2] == decides, "what does the program ask before it splits?")


LABELS = ("method", "map", "view", "size", "metric", "measured", "tuned")
CONDITIONS = (  # what differs from the fair rows, and how many times as large errors are
    ({"tuned": False}, (1.4, 1.7)),
    ({"metric": "max"}, (5.0, 7.0)),
    ({"measured": "certified"}, (1.4, 1.6)),
    ({"map": "alpine"}, (0.5, 0.65)),
    ({"view": "high"}, (0.55, 0.7)),
)


def measured(rng):
    """Rows of two methods: the fair pair first, then each method under every condition."""
    budgets = np.rint(np.geomspace(2000, 128_000, 13)).astype(int)
    rows = {}
    for method, scale in (("ours", 5.0), ("theirs", 5.0 * rng.uniform(1.1, 1.4))):
        errors = scale * budgets ** -rng.uniform(0.5, 0.6) * rng.uniform(0.97, 1.03, len(budgets))
        for change, (low, high) in (({}, (1.0, 1.0)), *CONDITIONS):
            row = {"map": "canyon", "view": "ridge", "size": (640, 360), "metric": "rms", "measured": "achieved"}
            row |= {"method": method, "tuned": True} | change
            row["points"] = [
                (int(n), float(f"{e:.4g}")) for n, e in zip(budgets, errors * rng.uniform(low, high), strict=True)
            ]
            rows.setdefault(method, []).append(row)
    return [row for pair in zip(*rows.values(), strict=True) for row in pair]


@referee("faults")
def found_in(student, rows):
    """The faults of a comparison."""
    counts = list(zip(*([n for n, _ in row["points"]] for row in rows), strict=False))
    labels = {key: {str(row[key]) for row in rows} for key in LABELS}
    held = {
        "inputs": max(len(labels[key]) for key in ("map", "view", "size")) > 1,
        "metric": len(labels["metric"]) > 1,
        "own metric": labels["measured"] != {"achieved"},
        "triangles": any(max(n) > 1.02 * min(n) for n in counts),
        "budgets": min(len(row["points"]) for row in rows) < 5,
        "tuning": len(labels["tuned"]) > 1,
    }
    return [name for name, is_there in held.items() if is_there]


def advantage(rows):
    """The median, over the points, of the second row's error divided by the first row's error."""
    pairs = zip(rows[0]["points"], rows[1]["points"], strict=False)
    return float(np.median([theirs / ours for (_, ours), (_, theirs) in pairs]))


def is_measured(row, known):
    """Whether all labels and points of a row belong to one row that was measured."""
    points = [tuple(point) for point in row["points"]]
    return bool(points) and any(
        all(row[key] == each[key] for key in LABELS)
        and [point for point in each["points"] if point in points] == points
        for each in known
    )


@task("12.6 break the fairness", points=3)
def doctored(student, rng):
    """Numbers must be true, with one fault, and mislead the reader by enough."""
    for name in ("one comparison", "another one"):
        known = measured(rng)
        got = student.doctored([dict(row) for row in known])
        rows = [{**row, "size": tuple(row["size"])} for row in got]
        methods = [row["method"] for row in rows]
        yield holds(f"{name}: rows", methods == ["ours", "theirs"], f"expected rows of ours and theirs, got {methods}")
        if methods != ["ours", "theirs"]:
            continue
        for row in rows:
            true = is_measured(row, known)
            yield holds(
                f"{name}: {row['method']}", true, "a label or a point is not as it was measured: that is forgery"
            )
            if not true:
                return
        found = found_in(student, rows)
        yield holds(f"{name}: faults", len(found) == 1, f"expected one fault, there are {found}")
        gain = advantage(rows) / advantage(known[:2])
        yield holds(
            f"{name}: the reader", gain >= 1.3, f"ours looks {gain:.2f} times as good as in the fair pair, not 1.3"
        )


def read_table(text):
    """The rows of a table that a fellow student has handed over."""
    rows = {}
    for line in list(csv.DictReader(io.StringIO(text.strip())))[:200]:
        row = rows.setdefault(tuple(line[key] for key in LABELS), {**{key: line[key] for key in LABELS}, "points": []})
        row["points"].append((int(line["triangles"]), float(line["error"])))
    return list(rows.values())


def as_table(rows):
    """The rows of a comparison as a table: the inverse of `read_table`."""
    out = io.StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow([*LABELS, "triangles", "error"])
    for row in rows:
        labels = {**row, "size": "x".join(map(str, row["size"]))}
        table.writerows([*(labels[key] for key in LABELS), *point] for point in row["points"])
    return out.getvalue()


@task("12.7 find the fault", points=1)
def verdict(student, rng):
    """The named fault must be the one that the table has."""
    table, fault = student.verdict()
    try:
        rows = read_table(str(table))
    except (KeyError, TypeError, ValueError, csv.Error):
        rows = []
    yield holds("the table", len(rows) == 2, "expected a fellow student's table, with its first line and two methods")
    if len(rows) == 2:
        found = found_in(student, rows)
        yield holds("the table: faults", len(found) == 1, "it has no fault, or several: hand it back")
        yield holds("your verdict", found == [fault], f"{fault!r} is not what is wrong with it: look again")
