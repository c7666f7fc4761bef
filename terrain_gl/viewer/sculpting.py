"""Sculpting: the brush taken and laid down, strokes under the cursor, undone and done again, the land saved."""

from __future__ import annotations

from collections.abc import Generator
from typing import TYPE_CHECKING

import numpy as np

from ..brush import TOOLS
from ..exceptions import TerrainError
from .editing import Editing, Saving, suggested_path

if TYPE_CHECKING:
    from .flight import Flight

TOLD_S = 10.0


class Sculpting:
    """The brush and the land under it.

    Attributes
    ----------
    editing
        Changes the map that is seen; None while its tables are being built.
    brushing
        Whether the left button sculpts.
    room, share
        Tables that hold higher and deeper land, on their way, and how much of them is made.
    saving
        The land on its way to a file.
    save_as
        The path that is being asked for.
    """

    def __init__(self, flight: Flight) -> None:
        self._flight = flight
        self.editing: Editing | None = None
        self.brushing = False
        self.room: Generator[float, None, None] | None = None
        self.share = 0.0
        self.saving: Saving | None = None
        self.save_as: str | None = None

    # --- The brush ----------------------------------------------------------------------------------------------------

    def toggle(self) -> None:
        """Take the brush, or lay it down."""
        if self.brushing or self.room or not self.editing:
            self.brushing = False
            self.cancel()
            return
        self.room = self.editing.making_room()  # no stroke is to wait for it
        self._make_room()

    def cancel(self) -> None:
        """Make no room for strokes."""
        if self.room:
            self.room.close()
        self.room, self.share = None, 0.0

    def _make_room(self) -> None:
        """Go on with it; the brush is taken when there is room."""
        if not self.room or not self._flight.pace.go_on(self.room, self._tell):
            return
        changed = self.share == 1.0
        self.cancel()
        if changed:
            self._land_changed(settled=True)
        self._flight.controller.heightmap = self._flight.renderer.heightmap
        if not self.brushing:
            self._flight.say("drag on the land to sculpt it; the right button looks around; B lays the brush down")
        self.brushing = True

    def _tell(self, share: float) -> None:
        self.share = share
        self._flight.refresh()

    def next_tool(self) -> None:
        """Take another tool."""
        if self.editing:
            self.editing.tool = TOOLS[(TOOLS.index(self.editing.tool) + 1) % len(TOOLS)]
            self._flight.say(f"tool: {self.editing.tool}")

    def widen(self, steps: float) -> None:
        """Change the brush's radius."""
        if self.editing:
            self.editing.widen(steps)

    def strengthen(self, steps: float) -> None:
        """Change the brush's strength."""
        if self.editing:
            self.editing.strengthen(steps)

    # --- Strokes ------------------------------------------------------------------------------------------------------

    @property
    def at_work(self) -> bool:
        """Whether the brush is on the land, or has more to do there."""
        return self._flight.mouse.drag == "brush" or bool(self.editing and self.editing.due)

    def begin(self, place: np.ndarray) -> None:
        """The button goes down on the land."""
        if self.editing:
            self.cancel()
            self.editing.begin(place, self._flight.now_s)
            self._land_changed(settled=False)

    def go_on(self) -> None:
        """Follow the cursor while the button is down, for a while; where tables must hold more, wait until they do."""
        flight, editing = self._flight, self.editing
        if not editing or self.room:
            return
        held = flight.mouse.drag == "brush"
        if held and self.brushing and flight.mouse.place is not None:
            editing.move(flight.mouse.place, flight.now_s)
        if editing.due and not editing.has_room:
            self.room = editing.making_room()
            return
        done = flight.pace.go_on(editing.dabbing(), hurried=True)
        self._land_changed(settled=False)
        if done and not held and not editing.due:
            self._finish()

    def end(self) -> None:
        """The button comes up."""
        if self.editing and not self.editing.due:
            self._finish()

    def _finish(self) -> None:
        """The stroke is done: the light follows."""
        assert self.editing
        self.editing.end()
        self._land_changed(settled=True)

    def undo(self) -> None:
        """Take the last stroke back."""
        self.cancel()
        if self.editing and self.editing.undo():
            self._land_changed(settled=True)
        else:
            self._flight.say("nothing to undo")

    def redo(self) -> None:
        """Do it again."""
        self.cancel()
        if self.editing and self.editing.redo():
            self._land_changed(settled=True)
        else:
            self._flight.say("nothing to do again")

    def _land_changed(self, settled: bool) -> None:
        """The land is another: what is known of it is no longer so."""
        flight = self._flight
        flight.controller.heightmap = flight.renderer.heightmap
        flight.painter.forget(at_once=True)
        flight.keeping.land_changed()
        flight.insight.explanation = None
        if self.editing and self.editing.edited:
            flight.land.changed()
        if settled:
            flight.painter.dawn.stop()

    # --- The land as a file -------------------------------------------------------------------------------------------

    def ask_to_save(self) -> None:
        """Ask for a path; without panels, take one that is free."""
        path = suggested_path(self._flight.renderer.heightmap.name)
        if self._flight.gui:
            self.save_as = path
        else:
            self.save(path)

    def save(self, path: str) -> None:
        """Write the land to a file, in a thread."""
        self.save_as = None
        if self.saving:
            self._flight.say(f"{self.saving.path} is still being written")
            return
        try:
            self.saving = Saving(path, self._flight.renderer.heightmap, self._flight.land.exaggeration)
        except TerrainError as error:
            self._flight.say(str(error))

    def step(self) -> None:
        """Make room for strokes, and tell how the saving went, once it is done."""
        self._make_room()
        if self.saving and self.saving.message:
            self._flight.say(self.saving.message, TOLD_S)
            self.saving = None

    def join(self) -> None:
        """Wait until the land is saved."""
        if self.saving:
            self.saving.join()
