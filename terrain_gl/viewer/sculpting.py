"""Sculpting: takes the brush and puts it away, follows strokes, undoes them, and saves the map."""

import math
from collections.abc import Callable

import numpy as np

from ..basics.exceptions import TerrainError
from .brush_tool import BrushTool
from .frame_budget import FrameBudget
from .map_writer import MapWriter, suggested_path
from .pointer import Pointer
from .recovery import Recovery
from .scene import Scene

MESSAGE_S = 10.0
_RING = 0.25  # largest radius of a new ring, relative to half of the picture's height
RESCUE_S = 3.0  # the recovery file is written this many seconds after the last stroke
_NO_LAND = object()


class Sculpting:
    """Sculpts the map of the scene.

    `on_edit` is called after each change of the land; its argument is True if the stroke is done: then light is made.
    """

    def __init__(self, scene: Scene, pointer: Pointer, budget: FrameBudget, on_edit: Callable[[bool], None]) -> None:
        self._scene = scene
        self._pointer = pointer
        self._budget = budget
        self._on_edit = on_edit
        self._window = scene.window
        self.tool: BrushTool | None = None  # the brush; None while the tables are being built
        self.brushing = False  # whether the left button sculpts
        self.held = False  # whether the button of a stroke is down
        self.writer: MapWriter | None = None  # writes the map to a file
        self.save_as: str | None = None  # the path in the dialog that asks where to save; None without a dialog
        self.recovery = Recovery()  # keeps unsaved land in a file
        self._edited_s = float("-inf")
        self._saved: object = None  # the land that is in a file
        self._warned: object = _NO_LAND  # the land about which the user was warned that it is not in a file

    def new_map(self, tool: BrushTool | None) -> None:
        """Sculpt another map from now on."""
        self.cancel()
        self.tool = tool
        self.recovery.remove()
        self._saved = None
        self._warned = _NO_LAND

    @property
    def unsaved(self) -> bool:
        """Whether the land differs from the land in its file. Undoing all strokes since then makes it equal."""
        return self.tool is not None and (self.tool.land is not self._saved or bool(self.tool.due))

    def may_leave(self) -> bool:
        """Whether the map may be left: all edits are saved, or the user was warned before. If not, warn."""
        if not self.tool or not self.unsaved or self._warned is self.tool.land:
            return True
        self._warned = self.tool.land
        self._window.say("the sculpted map is not saved: Ctrl S saves it; repeat to leave without saving", MESSAGE_S)
        return False

    @property
    def at_work(self) -> bool:
        """Whether a stroke is being drawn, or dabs are still to do."""
        return self.held or bool(self.tool and self.tool.due)

    # --- The brush ----------------------------------------------------------------------------------------------------

    def toggle(self) -> None:
        if self.brushing:
            self.brushing = False
            self.cancel()
        elif self.tool:
            self.brushing = True
            self._fit_ring(self.tool)
            self._window.say("drag on the land to sculpt; the right button turns the camera; B puts the brush away")

    def _fit_ring(self, tool: BrushTool) -> None:
        """Make a ring smaller that would be larger than the picture."""
        controller = self._scene.controller
        at = controller.ground_at(0.0, 0.0) if self._pointer.place is None else self._pointer.place
        if at is not None:
            seen_m = float(np.linalg.norm(at - controller.eye)) * math.tan(math.radians(0.5 * controller.fov_deg))
            tool.radius_m = max(min(tool.radius_m, _RING * seen_m), min(self._scene.heightmap.spacing_m))

    def cancel(self) -> None:
        """End the stroke, without its dabs that are still due."""
        if self.tool and self.at_work:
            self.held = False
            self.tool.due.clear()
            self._finish()

    def next_tool(self) -> None:
        if self.tool:
            self._window.say(f"tool: {self.tool.next_tool()}")

    def widen(self, steps: float) -> None:
        if self.tool:
            self.tool.widen(steps)

    def strengthen(self, steps: float) -> None:
        if self.tool:
            self.tool.strengthen(steps)

    # --- Strokes ------------------------------------------------------------------------------------------------------

    def begin(self, place: np.ndarray) -> bool:
        """Begin a stroke at a place of the land; returns whether one begins."""
        if not self.tool:
            return False
        self.held = True
        self.tool.begin(place, self._window.now_s)
        self._edited(settled=False)
        return True

    def work(self) -> None:
        """Follow the cursor and do dabs for a while."""
        tool = self.tool
        if not tool:
            return
        if self.held:
            self._follow()
        try:
            self._budget.run(tool.dab_steps(), hurried=True)
        except TerrainError as error:  # a tile of a store cannot be read, or the store's edits need too much memory
            tool.due.clear()
            self._window.say(str(error), MESSAGE_S)
        self._edited(settled=False)
        if not self.held and not tool.due:
            self._finish()

    def end(self) -> None:
        """End the stroke: the button comes up."""
        if not self.held:
            return
        self._follow()
        self.held = False
        if self.tool and not self.tool.due:
            self._finish()

    def _follow(self) -> None:
        if self.tool and self._scene.is_visible and (place := self._pointer.place) is not None:
            self.tool.move(place, self._window.now_s)

    def _finish(self) -> None:
        assert self.tool
        self.tool.end()
        self._edited(settled=True)

    def _edited(self, settled: bool) -> None:
        self._edited_s = self._window.now_s
        self._scene.controller.heightmap = self._scene.heightmap
        self._on_edit(settled)

    def undo(self) -> None:
        self._step_back(BrushTool.undo, "nothing to undo")

    def redo(self) -> None:
        self._step_back(BrushTool.redo, "nothing to redo")

    def _step_back(self, step: Callable[[BrushTool], bool], nothing: str) -> None:
        try:
            if self.tool and step(self.tool):
                self._edited(settled=True)
            else:
                self._window.say(nothing)
        except TerrainError as error:
            self._window.say(str(error), MESSAGE_S)

    # --- The map as a file --------------------------------------------------------------------------------------------

    def ask_to_save(self) -> None:
        self.save_as = suggested_path(self._scene.heightmap)

    def save(self, path: str) -> None:
        self.save_as = None
        if self.writer:
            self._window.say(f"{self.writer.path} is still being written")
        elif self.at_work or not self.tool:
            self._window.say("the brush is still at work" if self.tool else "the map is still being loaded")
        else:
            try:
                self.writer = MapWriter(path, self._scene.heightmap, self.tool.land)
            except TerrainError as error:
                self._window.say(str(error))

    def step(self) -> None:
        """Report the outcome of writing, and keep the recovery file up to date."""
        if not self.unsaved:
            self.recovery.remove()
        elif not self.at_work and self._window.now_s - self._edited_s >= RESCUE_S:
            self.rescue()
        if self.writer and self.writer.message:
            self._window.say(self.writer.message, MESSAGE_S)
            self._saved = self.writer.land if self.writer.done else self._saved
            self.writer = None

    def rescue(self) -> str:
        """Begin to write unsaved land to the recovery file; returns its path, or "" if all land is saved."""
        if not self.tool or not self.unsaved:
            return ""
        self.recovery.write(self._scene.heightmap, self.tool.land)
        return str(self.recovery.path or "")

    def join(self) -> None:
        if self.writer:
            self.writer.join()
        self.recovery.join()
