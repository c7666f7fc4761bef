"""Draw README's film: a flight around a real mountain, its mesh over the right half, the errors as text.

Run: TERRAIN_GL_DEM=FOLDER python docs/first_film.py [FILM.webp]

The folder has mt_rainier_90m.tif; docs/maps.md has its source. The numbers of all frames are in first-film.json.
"""

import json
import math
import os
import sys
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import terrain_gl as tg

MAP = "mt_rainier_90m.tif"
SUMMIT = (46.8529, -121.7604)  # latitude, longitude
FRAMES = 60
FRAME_MS = 110
SIZE = (640, 360)
AWAY_M = 17e3
TOLERANCE_PX = 1.0
SUN = (250, 16)


def cameras(land):
    """A circle around the summit, lower in the south than in the north."""
    latitude, longitude = SUMMIT
    x, y = land.place.from_lonlat(longitude, latitude)
    for turn in 2 * math.pi * np.arange(FRAMES) / FRAMES:
        eye_m = 3300 - 700 * math.cos(turn)
        eye = (x + AWAY_M * math.sin(turn), y - AWAY_M * math.cos(turn), eye_m)
        yield tg.Camera(eye, (x, y, 2500), 40)


def framed(picture, meshed, numbers, font):
    """The picture, its right half with the mesh, and the numbers below."""
    picture = picture.copy()
    half = SIZE[0] // 2
    picture[:, half:] = meshed[:, half:]
    picture[:, half - 1 : half + 1] = 255
    frame = Image.fromarray(picture)
    text = (
        f"{numbers['triangles']:,} triangles   error: promised {TOLERANCE_PX:g} px, "
        f"achieved {numbers['max_error_px']:.2f} px"
    )
    draw = ImageDraw.Draw(frame)
    draw.rectangle((0, SIZE[1] - 26, *SIZE), fill=(20, 24, 28))
    draw.text((SIZE[0] // 2, SIZE[1] - 13), text, (255, 255, 255), font, "mm")
    return frame


def main(film=Path(__file__).parent / "first-film.webp"):
    """Draw all frames; write the film and their numbers."""
    land = tg.Heightmap.open(Path(os.environ["TERRAIN_GL_DEM"]) / MAP)
    font = ImageFont.load_default(15)
    frames, table = [], []
    with tg.Renderer(land, SIZE) as renderer:
        for number, camera in enumerate(cameras(land)):
            look = {"max_error_px": TOLERANCE_PX, "sun": SUN}
            picture = renderer.render(camera, **look).image
            numbers = renderer.measure()
            meshed = renderer.render(camera, wires=True, **look).image
            table.append({key: numbers[key] for key in ("triangles", "certified_max_error_px", "max_error_px")})
            frames.append(framed(picture[..., :3], meshed[..., :3], numbers, font))
            print(number, table[-1], flush=True)
    frames[0].save(film, save_all=True, append_images=frames[1:], duration=FRAME_MS, loop=0, quality=75, method=6)
    Path(film).with_suffix(".json").write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:]))
