"""Light on its way: made in portions between frames, for it looks far over the map."""

from __future__ import annotations

from collections.abc import Generator

from ..shade import Look, Picture
from .pace import Pace


class Dawn:
    """The light that a picture still needs.

    Attributes
    ----------
    share
        How much of it is made, 0 to 1, while it is being made; else None.
    """

    def __init__(self, pace: Pace) -> None:
        self.share: float | None = None
        self._pace = pace
        self._making: tuple[Look, Generator[float, None, None]] | None = None

    def is_due(self, look: Look) -> bool:
        """Whether light is still to be made for a look, or it is not known yet."""
        return self.share is not None or self._making is None or self._making[0] != look

    def go_on(self, picture: Picture, look: Look) -> bool:
        """Make light for a while, at least a portion; whether it has just come, for the picture to be drawn in it."""
        if self._making is None or self._making[0] != look:
            self.stop()
            self._making = look, picture.lighting_up(look)

        def tell(share: float) -> None:
            picture.ctx.finish()
            self.share = share

        if not self._pace.go_on(self._making[1], tell):
            return False
        came, self.share = self.share is not None, None
        return came

    def stop(self) -> None:
        """Give back what is half made, and forget what is known: the land is another."""
        if self._making:
            self._making[1].close()
        self._making = self.share = None
