"""Sculpting: the brush taken and laid down, strokes under the cursor, undone and done again, the land saved."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

import moderngl
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
        self._taking = False  # whether the brush is to be taken when there is room
        self._saved = 0  # edits that are in a file
        self._warned = -1  # edits when it was said that they are not

    def new_land(self, editing: Editing | None, factor: float | None = None) -> None:
        """There is another land to be sculpted; with a factor, the same one so many times as high."""
        self.cancel()
        before, self.editing = self.editing, editing
        if not factor:
            self._saved, self._warned = 0, -1
        elif before and editing:
            editing.take_over(before, factor)
            if before.strokes[0]:
                self._flight.say("strokes on the land as high as it was cannot be undone any more")

    @property
    def unsaved(self) -> bool:
        """Whether somebody has sculpted the land since it was written to a file."""
        return self.editing is not None and (self.editing.edits != self._saved or bool(self.editing.due))

    def may_be_left(self) -> bool:
        """Whether nothing sculpted is lost with the land; else that is said, and who asks again may leave it."""
        if not self.unsaved or not self.editing or self._warned == self.editing.edits:
            return True
        self._warned = self.editing.edits
        self._flight.say(
            "what you sculpted is not saved: Ctrl S saves it; the same once more leaves without it", TOLD_S
        )
        return False

    # --- The brush ----------------------------------------------------------------------------------------------------

    def toggle(self) -> None:
        """Take the brush, or lay it down."""
        if self.brushing or self.room or not self.editing:
            self.brushing = False
            self.cancel()
            return
        self._taking = True
        self.room = self.editing.making_room()  # no stroke is to wait for it
        self._make_room()

    def cancel(self) -> None:
        """Give up the room that is being made, and the rest of the stroke that waits for it."""
        self._end_room()
        if self.at_work:
            self._flight.mouse.drag = ""
            if self.editing:
                self.editing.due.clear()
                self._finish()

    def _end_room(self) -> None:
        if self.room:
            self.room.close()
        self.room, self.share, self._taking = None, 0.0, False

    def _make_room(self) -> None:
        """Go on with it; a brush that was asked for is taken when there is room."""
        if not self.room or not self.editing:
            return
        told = "drag on the land to sculpt it; the right button looks around; B lays the brush down"
        try:
            if not self._flight.pace.go_on(self.room, self._tell) and self.share < 1.0:
                return
        except (TerrainError, moderngl.Error, MemoryError) as error:
            self.editing.waits_for_room = False
            told = f"no room for far higher or deeper land, strokes may have to wait: {error or 'not enough memory'}"
        if self._taking:
            self.brushing = True
            self._flight.say(told)
        self._end_room()

    def _tell(self, share: float) -> None:
        self.share = share
        if share == 1.0:  # the tables have been exchanged
            self._land_changed(settled=True)
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

    def begin(self, place: np.ndarray) -> bool:
        """The button goes down on the land; whether a stroke begins."""
        if not self.editing or self._land_is_changing():
            return False
        self.editing.begin(place, self._flight.now_s)
        self._land_changed(settled=False)
        return True

    def go_on(self) -> None:
        """Follow the cursor while the button is down, for a while; where tables must hold more, wait until they do."""
        flight, editing = self._flight, self.editing
        if not editing or self.room:
            return
        held = flight.mouse.drag == "brush"
        if held:
            self._follow()
        if not editing.has_room:
            self.room = editing.making_room()
            return
        flight.pace.go_on(editing.dabbing(), hurried=True)
        self._land_changed(settled=False)
        if not held and not editing.due:
            self._finish()

    def end(self) -> None:
        """The button comes up."""
        self._follow()
        if self.editing and not self.editing.due:
            self._finish()

    @property
    def at_work(self) -> bool:
        """Whether the brush is on the land, or has more to do there."""
        return self._flight.mouse.drag == "brush" or bool(self.editing and self.editing.due)

    def _follow(self) -> None:
        """Have dabs up to where the cursor is now."""
        place = self._flight.mouse.place if self._flight.is_seen else None
        if self.editing and place is not None:
            self.editing.move(place, self._flight.now_s)

    def _finish(self) -> None:
        """The stroke is done: the light follows."""
        assert self.editing
        self.editing.end()
        self._land_changed(settled=True)

    def undo(self) -> None:
        """Take the last stroke back."""
        self._step_back(lambda editing: editing.undo(), "nothing to undo")

    def redo(self) -> None:
        """Do it again."""
        self._step_back(lambda editing: editing.redo(), "nothing to do again")

    def _step_back(self, step: Callable[[Editing], bool], nothing: str) -> None:
        if self._land_is_changing():
            return
        self._end_room()
        if self.editing and step(self.editing):
            self._land_changed(settled=True)
        else:
            self._flight.say(nothing)

    def _land_is_changing(self) -> bool:
        """Whether what is sculpted now would be lost; that is said."""
        changing = self._flight.land.is_changing
        if changing:
            self._flight.say("the land is being made higher or lower: sculpt when it is there")
        return changing

    def _land_changed(self, settled: bool) -> None:
        """The land is another: what is known of it is no longer so."""
        flight = self._flight
        flight.controller.heightmap = flight.renderer.heightmap
        flight.painter.forget(at_once=True)
        flight.keeping.land_changed()
        flight.insight.explanation = None
        if self.unsaved:
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
        flight, editing = self._flight, self.editing
        if self.saving or self.at_work or not editing:
            flight.say(f"{self.saving.path} is still being written" if self.saving else "the brush is still at work")
            return
        try:
            self.saving = Saving(path, flight.renderer.heightmap, flight.land.exaggeration, editing.edits)
        except TerrainError as error:
            flight.say(str(error))

    def step(self) -> None:
        """Make room for strokes, and tell how the saving went, once it is done."""
        self._make_room()
        if self.saving and self.saving.message:
            self._flight.say(self.saving.message, TOLD_S)
            self._saved = self.saving.edits if self.saving.done else self._saved
            self.saving = None

    def join(self) -> None:
        """Wait until the land is saved."""
        if self.saving:
            self.saving.join()
