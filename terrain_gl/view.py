"""The view: the camera in one uniform block, which every shader reads (glsl/blocks/view.glsl)."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from .camera import Camera, clip_from_eye
from .gpu import layout
from .gpu.bindings import bind
from .pieces import Piece
from .terrain import Terrain


class View:
    """The `View` block of glsl/blocks/view.glsl, in a buffer."""

    def __init__(self, ctx: moderngl.Context) -> None:
        self.block = ctx.buffer(reserve=layout.VIEW.itemsize)
        self._written = np.zeros((), layout.VIEW)
        self._clip_from_eye = np.eye(4)
        self._piece: Piece | None = None  # what the buffer holds

    def write(self, terrain: Terrain, camera: Camera, size: tuple[int, int], near_m: float, **settings: Any) -> None:
        """Write a camera to the block; `settings` are its fields tolerance_px, metric and cull."""
        spacing = np.asarray(terrain.heightmap.spacing_m)
        row_zero_north = (terrain.heightmap.rows - 1) * spacing[1]
        eye_post = np.round([camera.eye[0], row_zero_north - camera.eye[1]] / spacing)
        eye_post = np.clip(eye_post, -(2**30), 2**30)
        block = np.zeros((), layout.VIEW)
        for name, axis in zip(("right", "up", "forward"), camera.axes, strict=True):
            block[name][:3] = axis
        block["eye_post"] = eye_post
        block["eye_offset_m"] = camera.eye[:2] - eye_post * spacing * [1, -1] - [0, row_zero_north]
        block["half_extent"] = camera.half_extent(size)
        block["eye_z_m"] = eye_z_m = camera.eye[2] - terrain.base_m
        block["eye_z_rest_m"] = eye_z_m - float(block["eye_z_m"])
        block["focal_px"] = camera.focal_px(size[1])
        block["bend_per_m"] = camera.bend_per_m
        block["bulge_m"] = camera.bend_per_m * spacing**2
        block["sag_m"] = camera.bend_per_m * np.square(spacing).sum() / 4 * (1 + 1e-6)
        for name, value in settings.items():
            block[name] = value
        self._written, self._clip_from_eye, self._piece = block, clip_from_eye(camera, size, near_m), None
        self.crop(Piece.whole(size))

    @property
    def eye(self) -> tuple[np.ndarray, np.ndarray, float]:
        """Column and row of a post near the eye; metres east and north from there; its height above the base."""
        return self._written["eye_post"], self._written["eye_offset_m"], float(self._written["eye_z_m"])

    @property
    def focal_px(self) -> float:
        """Pixels per unit of x/z."""
        return float(self._written["focal_px"])

    def move(self, terrain: Terrain, camera: Camera, size: tuple[int, int], near_m: float) -> None:
        """Look from another camera at the mesh that was chosen for the last one."""
        settings = {name: self._written[name] for name in ("tolerance_px", "metric", "cull")}
        self.write(terrain, camera, size, near_m, **settings)

    def crop(self, piece: Piece) -> None:
        """Select the piece of the picture to draw next, with the mesh of the whole picture."""
        if piece == self._piece:
            return
        block, fine = self._written, piece.fine
        block["clip_from_eye"] = (piece.clip_from_picture @ self._clip_from_eye).T.ravel()
        block["size_px"] = piece.picture[0] * fine, piece.picture[1] * fine
        block["first_px"] = piece.corner[0] * fine, piece.corner[1] * fine
        self.block.write(block.tobytes())
        self._piece = piece

    def bind(self) -> None:
        """Bind the view for all shaders."""
        bind("blocks/view.glsl", View=self.block)

    def release(self) -> None:
        """Release GPU resources."""
        self.block.release()
