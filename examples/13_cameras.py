"""Example 13: a data set of cameras
=================================

Twenty poses of one calibrated camera: colour, depth, normals and kinds of each picture, all from the same samples. Each
block of the picture has these four. The last check projects the places of each picture into the next camera.

With a third argument, the data set itself is written: ``000.png``, ``000.npz``, … and ``cameras.json``.

Run: ``python 13_cameras.py [PICTURE.png [MAP [FOLDER]]]``
"""

import json
import sys
from pathlib import Path

import numpy as np

from terrain_gl import Camera, Heightmap, Renderer
from terrain_gl.files.maps import bundled
from terrain_gl.image import write_png

picture = sys.argv[1] if len(sys.argv) > 1 else "13_cameras.png"
known = bundled()[sys.argv[2] if len(sys.argv) > 2 else "alpine-30m"]
folder = Path(sys.argv[3]) if len(sys.argv) > 3 else None
terrain = Heightmap.open(known.path, known.spacing_m, known.z_scale, known.z_offset_m)
size = 160, 120
K = np.array([[150.0, 0.0, 83.0], [0.0, 150.0, 55.0], [0.0, 0.0, 1.0]])  # the principal point is not in the middle
KIND_COLOURS = np.array([[200, 220, 255], [120, 90, 60], [40, 90, 200], [90, 160, 90], [255, 0, 255]], np.uint8)


def pose(number):
    """Rotation and translation, as OpenCV has them, of one of 20 eyes on a circle that look at the map's middle."""
    middle = np.array([*terrain.extent_m, 2 * low]) / 2
    angle = 2 * np.pi * number / 20
    eye = middle + [*0.42 * np.array(terrain.extent_m) * [np.sin(angle), np.cos(angle)], 1.2 * (high - low)]
    forward = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(forward, [0, 0, 1]) / np.linalg.norm(np.cross(forward, [0, 0, 1]))
    turn = np.array([right, np.cross(forward, right), forward])  # right, down, forward
    return turn, -turn @ eye


def grey_of(depth):
    """Near is white, the sky black."""
    return np.uint8(255 * np.minimum(depth[np.isfinite(depth)].min() / depth, 1))[..., None].repeat(3, -1)


low, high = terrain.range_m
water_m = low + 0.15 * (high - low)
cameras = [Camera.from_opencv(K, *pose(number), size) for number in range(20)]
blocks, frames = [], []
with Renderer(terrain, size) as renderer:
    for camera in cameras:
        frame = renderer.render(camera, max_error_px=0.5, sun=known.sun, water_m=water_m)
        colour, normals = frame.image[..., :3], np.uint8(127.5 + 127.5 * frame.normals)
        blocks.append(np.block([[[colour], [grey_of(frame.depth)]], [[normals], [KIND_COLOURS[frame.kind]]]]))
        frames.append(frame)

wrong = []
for frame, camera, other in zip(frames, cameras[1:], frames[1:], strict=False):
    land = frame.places[frame.kind == 1]
    at = np.rint(camera.pixels(land, size))
    inside = ((at >= 0) & (at < size)).all(-1)
    col, row = at[inside].astype(int).T
    depth = (land[inside] - camera.eye) @ camera.forward
    wrong.append(np.abs(other.depth[row, col] / depth - 1))
print(f"depths in the next picture: half agree within {np.median(np.concatenate(wrong)):.2%}; others are hidden there")

if folder:
    folder.mkdir(exist_ok=True)
    for number, frame in enumerate(frames):
        write_png(folder / f"{number:03d}.png", frame.image)
        frame.facts.write(folder / f"{number:03d}.npz")
    told = [dict(zip("KRt", (matrix.tolist() for matrix in camera.to_opencv(size)), strict=True)) for camera in cameras]
    (folder / "cameras.json").write_text(json.dumps(told))

write_png(picture, np.concatenate([np.concatenate(blocks[row : row + 5], 1) for row in range(0, 20, 5)]))
print(f"wrote {picture}")
