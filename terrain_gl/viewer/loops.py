"""Flights for short films: a turn around the land in the middle of the picture, and the sun of a day."""

import math
from datetime import datetime

import numpy as np

from ..basics.exceptions import TerrainError
from ..camera import Camera
from ..film.path import CameraPath, Keyframe
from ..heightmap import Heightmap, ground_m
from ..light.sun import sun_position
from .pose import vector
from .scene import Scene

TURN_S = 12.0  # duration of a turn
DAY_S = 12.0  # duration of a day
LOW = 0.05  # least height of the turning eye above ground, relative to its distance from the middle
_VIEWS = 24  # keyframes
_LOWEST_DEG = 1.0  # the film of a day begins and ends with the sun at this elevation
_OF_ALPS_DEG = 46.0  # latitude for the time of day, if the map does not give its place
_DAY = datetime(2025, 8, 1)


def turn(scene: Scene) -> CameraPath | None:
    """Once around the land in the middle of the picture, clockwise; None if there is sky."""
    controller = scene.controller
    pivot = controller.ground_at(0.0, 0.0)
    if pivot is None:
        return None
    angles = 2 * math.pi * np.arange(_VIEWS) / _VIEWS
    east, north, up = controller.eye - pivot
    around = [east * np.cos(angles) + north * np.sin(angles), north * np.cos(angles) - east * np.sin(angles)]
    eyes = pivot + np.stack([*around, np.full(_VIEWS, up)], -1)
    if controller.above_ground:
        ground = controller.exaggeration * ground_m(controller.heightmap, eyes[:, :2])
        eyes[:, 2] = np.fmax(eyes[:, 2], np.nanmax(ground, initial=-np.inf) + LOW * math.hypot(east, north))
    cameras = (Camera(vector(eye), vector(pivot), controller.fov_deg) for eye in eyes)
    return CameraPath([Keyframe(scene.for_renderer(camera)) for camera in cameras], closed=True, seconds=TURN_S)


def day(scene: Scene) -> CameraPath | None:
    """The present view from sunrise to sunset of a day of August; None if the sun does not rise there."""
    camera = scene.for_renderer(scene.controller.camera)
    north_deg = latitude_deg(scene.heightmap)
    suns = [sun_at(float(hour), north_deg) for hour in np.linspace(0, 24, 4 * _VIEWS, endpoint=False)]
    suns = [sun for sun in suns if sun[1] >= _LOWEST_DEG]
    if len(suns) < 2:
        return None
    times = np.linspace(0, DAY_S, len(suns))
    return CameraPath([Keyframe(camera, float(at_s), sun) for at_s, sun in zip(times, suns, strict=True)])


def latitude_deg(heightmap: Heightmap) -> float:
    """Latitude for the time of day."""
    try:
        known = heightmap.place and heightmap.place.crs and heightmap.place.middle
    except TerrainError:  # pyproj is missing
        known = None
    return known[1] if known else _OF_ALPS_DEG


def sun_at(hour: float, latitude_deg: float) -> tuple[float, float]:
    """Azimuth and elevation of the sun in degrees, at a time of that day."""
    return sun_position(_DAY.replace(hour=int(hour), minute=int(60 * (hour % 1))), latitude_deg)
