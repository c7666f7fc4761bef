"""What must be seen at each station of the lecture, measured in pixels.

    python tests/viewer/stations.py FOLDER [MAP [WIDTHxHEIGHT ... [NUMBER ...]]]     alpine 1280x720 1920x1080, all

draws stations into FOLDER, as the window shows them, and prints the table of docs/viewer.md.
"""

import sys
from pathlib import Path

import numpy as np
from viewers import listen, seen, settle

from terrain_gl.viewer.legend import VIRIDIS

MEAN = {}  # the mean level of the land at stations 2, 7 and 13
RED, CYAN, PICKED, FRUSTUM, WHITE = (255, 0, 0), (0, 230, 255), (255, 120, 90), (255, 205, 120), (255, 255, 255)


def near(picture, colour, by=40):
    """Which pixels have about a colour."""
    return np.abs(picture - np.array(colour)).max(-1) <= by


def sides(picture):
    """The left half and the right half, without the divider."""
    middle = picture.shape[1] // 2
    return picture[:, : middle - 4], picture[:, middle + 4 :]


def lines_across(picture, by=3):
    """Bright lines that a row of pixels crosses, in the mean: pixels that are so much brighter than both neighbours."""
    grey = picture.mean(-1)
    before, here, after = grey[:, :-2], grey[:, 1:-1], grey[:, 2:]
    return float(((here > before + by) & (here > after + by)).sum(1).mean())


def in_glass(app):
    """The square in the middle of the magnifying glass, a magnified pixel as one pixel."""
    picture, step = seen(app), int(app.viewer.settings.lens)
    x, y = (round(each) for each in app.viewer.pointer.over_land)
    side = int(70 * app.viewer.window.scale)
    return picture[y - side : y + side : step, x - side : x + side : step]


def levels(app):
    """The share of the land of each colour of style "lod", from every post on."""
    picture = app.viewer.painter.canvas  # the picture alone, without lines over it
    picture.show(app.viewer.target)
    picture = seen(app)
    posts = max(app.viewer.painter.frame.posts)
    most = (posts - 2).bit_length() - 4
    at = np.clip(np.arange(most + 1) / most, 0, 1) * 4
    colours = 0.82 * np.stack([np.interp(at, range(5), channel) for channel in np.transpose(VIRIDIS)], -1) + 0.18
    land = picture[np.ptp(picture, -1) > 12]
    nearest = (land @ (colours / np.linalg.norm(colours, axis=-1, keepdims=True)).T).argmax(-1)
    return np.bincount(nearest, minlength=most + 1) / len(land)


def box_of(marks):
    """Width and height of the box around the marked pixels, relative to the picture."""
    rows, cols = np.nonzero(marks)
    return np.ptp(cols) / marks.shape[1], np.ptp(rows) / marks.shape[0]


def measured(number, app):
    """Numbers by name, and whether the claim of a station is visible."""
    app.viewer.draw()
    picture, (left, right) = seen(app), sides(seen(app))
    stats, explainer = app.viewer.painter.side_stats, app.viewer.explainer
    if number in (2, 7, 13):
        shares = levels(app)
        mean = MEAN[number] = float(shares @ np.arange(len(shares)))
        found = {"share of each colour, %": [round(100 * float(share), 1) for share in shares[:4]]}
        several = (shares > 0.03).sum() >= (3 if number == 2 else 2)
        return found, several and {2: True, 7: mean < MEAN.get(2, 9) - 0.3, 13: 0.01 < shares[0] < 0.7}[number]
    if number == 1:
        across = lines_across(in_glass(app), 10)
        return {"mesh lines across the glass": round(across, 1)}, across > 2
    if number == 3:
        a, b = lines_across(left), lines_across(right)
        return {"mesh lines in a row, left and right": [round(a), round(b)]}, b > 1.2 * a > 10
    if number == 4:
        over, ring = near(picture, CYAN).sum(), near(picture, WHITE, 25).sum()
        return {"cyan pixels": int(over), "pixels of the ring": int(ring)}, over == 0 and ring > 60
    if number == 5:
        tiles, marked = explainer.error_box.lookup.count, near(picture, PICKED).sum()
        return {"tiles": tiles, "pixels of the outline": int(marked)}, tiles >= 16 and marked > 40
    if number == 6:
        a, b = (100 * float(near(side, RED).mean()) for side in (left, right))
        few, many = sorted(each["triangles"] for each in stats)
        shown = {"red, %, left and right": [round(a, 2), round(b, 2)], "triangles": round(many / few, 2)}
        return shown, a == 0 and b > 0.2 and many < 1.2 * few
    if number == 8:
        a, b = (int(near(side, CYAN).sum()) for side in (left, right))
        jumps = app.viewer.lecture.jumps.sides
        within = all(each.largest_px <= each.bound_px for each in jumps)
        largest = [round(each.largest_px, 2) for each in jumps]
        return {"cyan pixels": [a, b], "largest jumps, px": largest}, within and a > 100 and b == 0
    if number == 9:
        lines, marked = near(picture, FRUSTUM).sum(), near(picture, PICKED).sum()
        shown = {"pixels of the frustum": int(lines), "of sight line and patch": int(marked)}
        return shown, lines > 800 and marked > 100 and bool(explainer.explanation.hidden_by)
    if number == 10:
        a, b = (int(near(side, CYAN).sum()) for side in (left, right))
        few, many = sorted(each["triangles"] for each in stats)
        return {"cyan pixels, left and right": [a, b]}, a == 0 and b > 10 and many < 1.05 * few
    if number == 11:
        width = min(left.shape[1], right.shape[1])
        differ = float(np.median(np.abs(left[:, -width:] - right[:, -width:]).max(-1)))
        fewer = stats[0]["triangles"] / stats[1]["triangles"]
        return {"median difference of 255": round(differ, 1), "triangles": round(fewer, 1)}, differ < 8 and fewer > 8
    across, down = box_of(near(picture, WHITE, 12)[picture.shape[0] // 2 :])
    return {"width and height of the ring": [round(float(across), 2), round(float(down), 2)]}, 0.02 < across < 0.5


def main(folder, name="alpine", *asked):
    """Draw all stations, or those whose numbers are given, and print the table."""
    sys.path.insert(0, str(Path(__file__).parents[2] / "benchmarks"))
    from windowless import open_app, opened

    from terrain_gl.image import write_image
    from terrain_gl.renderer import Renderer

    sizes = [tuple(map(int, each.split("x"))) for each in asked if "x" in each]
    only = [int(each) for each in asked if "x" not in each]
    for size in sizes or ((1280, 720), (1920, 1080)):
        app = open_app(size)
        viewer, land = app.viewer, opened(name)
        viewer.show(Renderer(land.heightmap, size, ctx=viewer.ctx), land)
        viewer.give_lecture()
        for number, station in enumerate(viewer.lecture.stations, 1):
            if only and number not in only:
                continue
            viewer.lecture.go_to(number - 1)
            settle(app)
            shown, is_seen = measured(number, app)
            listen(app)
            listen(app)
            write_image(Path(folder) / f"station-{number:02d}-{size[0]}.png", seen(app).astype(np.uint8))
            words = ", ".join(f"{what} {value}" for what, value in shown.items())
            print(f"| {number} | {station.sees} | {words} |{'' if is_seen else ' NOT SEEN'}", flush=True)
        app.close()


if __name__ == "__main__":
    main(*sys.argv[1:])
