"""The light of a picture, made in steps: images are read in a thread, then the light of the land is computed."""

from concurrent.futures import Future, ThreadPoolExecutor, wait
from typing import Any

from ..basics.steps import Steps
from ..light.lighting import ground_seen, sky_seen
from ..shade.picture import Look, Picture
from .frame_budget import FrameBudget


class LightBuilder:
    """Makes the light that a picture still needs."""

    def __init__(self, budget: FrameBudget) -> None:
        self.share: float | None = None  # progress, 0 to 1; None while no light is being made
        self.lit: Look | None = None  # the look for which light was last made; the land may have been edited since
        self._budget = budget
        self._thread = ThreadPoolExecutor(1, "sky")
        self._making: tuple[Look, Steps[None]] | None = None

    def is_due(self, look: Look) -> bool:
        """Whether light for a look must be made; True also if this is not yet known. An unlit style needs none."""
        if not look.is_lit:
            return False
        return self.share is not None or self._making is None or self._making[0] != look

    def step(self, picture: Picture, look: Look, hurried: bool = False) -> bool:
        """Make light for a while, at least one step; returns whether this call has completed it."""
        if self._making is None or self._making[0] != look:
            self.stop()
            self._making = look, self._steps(picture, look)

        def tell(share: float) -> None:
            picture.ctx.finish()
            self.share = share

        if not self._budget.run(self._making[1], tell, hurried):
            return False
        completed = self.share is not None
        self.share = None
        self.lit = look
        return completed

    def _steps(self, picture: Picture, look: Look) -> Steps[None]:
        """First read the sky and ground images, then light the land; yields progress from 0 to 1."""
        if look.is_lit:
            lighting = picture.lighting
            asked = look.sun, look.sky, lighting.has_air, lighting.north_deg
            images: list[Future[Any]] = [self._thread.submit(sky_seen, *asked)]
            if look.material:
                images.append(self._thread.submit(ground_seen, look.material, picture.terrain.heightmap.georeference))
            try:
                while wait(images, 0.01).not_done:
                    yield 0.0
                for image in images:
                    image.result()
            finally:
                for image in images:
                    image.cancel()  # the user may choose another look before the thread reads this image
        yield from picture.light_steps(look)

    def release(self) -> None:
        self.stop()
        self._thread.shutdown(cancel_futures=True)

    def stop(self) -> None:
        """Drop unfinished light, because the land has changed."""
        if self._making:
            self._making[1].close()
        self._making = self.share = None
