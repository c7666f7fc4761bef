"""Cameras, and the projection of the map to their pictures.

camera      eye, target and field of view; positions and errors on the screen
lens        what its picture shows, if that is no symmetric field of view
pieces      a large picture is drawn part by part
rounding    how far float32 moves the mesh on the screen
view        the camera of a frame on the GPU
"""

from .camera import (
    UP,
    Camera,
    Vector,
    boxes_in_picture,
    clip_from_eye,
    in_picture,
    picture_planes,
    screen_shift_px,
    shift_px,
)
from .lens import Lens

__all__ = [
    "UP",
    "Camera",
    "Lens",
    "Vector",
    "boxes_in_picture",
    "clip_from_eye",
    "in_picture",
    "picture_planes",
    "screen_shift_px",
    "shift_px",
]
