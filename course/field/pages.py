"""Virtual textures: the pages that a flight needs, and how late they are.

Run: python -m course.field.pages
"""

import numpy as np

from course.field import own

two = own(2)
PAGE, SIDE, FRAMES, FOCAL_PX, ABOVE_M = 128, 16384, 120, 900.0, 400.0  # texels of a page and of the map, one a metre


def needed(eye):
    """Pages (level, row, column) that a picture needs, with their pixels: a texel is a pixel or less."""
    across, ahead = np.meshgrid(np.linspace(-0.7, 0.7, 160), np.geomspace(300, 8000, 90))
    x, y = eye[0] + across * ahead, eye[1] + ahead
    p = np.stack([across * ahead, np.full(x.shape, -ABOVE_M), ahead])
    texel_px = two.shift_px(p, np.array([1.0, 0.0, 0.0]), FOCAL_PX, 1.0)  # a metre to the east, in pixels
    level = np.maximum(np.floor(-np.log2(texel_px)), 0).astype(int)
    inside = (x >= 0) & (x < SIDE) & (y >= 0) & (y < SIDE)
    size = PAGE << level
    pages, pixels = np.unique(
        np.stack([level, y // size, x // size], -1)[inside].astype(int), axis=0, return_counts=True
    )
    return dict(zip(map(tuple, pages.tolist()), pixels, strict=True))


def main():
    """Fly at 100 metres a frame; a page is there some frames after it was asked for."""
    wanted = [needed((8000.0 + 1000 * np.sin(i / 20), 100.0 * i)) for i in range(FRAMES)]
    everything = sum((SIDE // PAGE >> level) ** 2 for level in range(8))
    print(f"{np.mean([len(each) for each in wanted]):.0f} pages a frame, of {everything}")
    for late in (0, 2, 8):
        asked, coarse = {}, []
        for i, each in enumerate(wanted):
            for page in each:
                asked.setdefault(page, i)
            missing = sum(pixels for page, pixels in each.items() if i - asked[page] < late)
            coarse.append(missing / sum(each.values()))
        print(f"{late} frames late: {100 * np.mean(coarse[20:]):.1f} % of the pixels wait for a page")


if __name__ == "__main__":
    main()
