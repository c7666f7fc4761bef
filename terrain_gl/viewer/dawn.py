"""Light on its way: the sky and a picture of the ground in a thread, the rest in portions, for light looks far."""

from __future__ import annotations

from collections.abc import Generator
from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

from ..light.lighting import ground_seen, sky_seen
from ..shade import Look, Picture
from .pace import Pace


class Dawn:
    """The light that a picture still needs.

    Attributes
    ----------
    share
        How much of it is made, 0 to 1, while it is being made; else None.
    lit
        The look that light was last made for, if only on the land before an edit.
    """

    def __init__(self, pace: Pace) -> None:
        self.share: float | None = None
        self.lit: Look | None = None
        self._pace = pace
        self._thread = ThreadPoolExecutor(1, "sky")
        self._making: tuple[Look, Generator[float, None, None]] | None = None

    def is_due(self, look: Look) -> bool:
        """Whether light is still to be made for a look, or it is not known yet."""
        return self.share is not None or self._making is None or self._making[0] != look

    def go_on(self, picture: Picture, look: Look, hurried: bool = False) -> bool:
        """Make light for a while, at least a portion; whether it has just come, for the picture to be drawn in it."""
        if self._making is None or self._making[0] != look:
            self.stop()
            self._making = look, self._portions(picture, look)

        def tell(share: float) -> None:
            picture.ctx.finish()
            self.share = share

        if not self._pace.go_on(self._making[1], tell, hurried):
            return False
        came, self.share, self.lit = self.share is not None, None, look
        return came

    def _portions(self, picture: Picture, look: Look) -> Generator[float, None, None]:
        """First the sky and the picture of the ground, then what the land makes of them."""
        if look.is_lit:
            pictures: list[Future[Any]] = [self._thread.submit(sky_seen, look.sun, look.sky)]
            if look.material:
                pictures.append(self._thread.submit(ground_seen, look.material))
            try:
                while wait(pictures, 0.01).not_done:
                    yield 0.0
                for work in pictures:
                    work.result()
            finally:
                for work in pictures:
                    work.cancel()  # another look may be wanted before this one's turn has come
        yield from picture.lighting_up(look)

    def release(self) -> None:
        """Give everything back."""
        self.stop()
        self._thread.shutdown(cancel_futures=True)

    def stop(self) -> None:
        """Give back what is half made, and forget what is known: the land is another."""
        if self._making:
            self._making[1].close()
        self._making = self.share = None
