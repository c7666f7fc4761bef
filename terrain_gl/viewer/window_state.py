"""The state that the window and the parts share: size, time, the message line, and whether to draw again."""

from collections import deque
from collections.abc import Callable

Size = tuple[int, int]
Frame = tuple[int, int, int, int]  # left, bottom, width and height in pixels, from the lower left
MESSAGE_S = 5.0
SAID = 50  # messages that reports repeat


class WindowState:
    """The data about the window that all parts share, and their requests to it."""

    def __init__(self, size: Size) -> None:
        self.size = size  # in pixels; 0 while the window is minimised
        self.scale = 1.0  # pixels per unit of length: more than 1 on fine screens
        self.panel_px = 0.0  # columns of pixels at the left that the panel takes while it is shown
        self.now_s = 0.0  # time of the present frame
        self.message = ""  # one line that the window shows for a while
        self.said: deque[str] = deque(maxlen=SAID)  # the last messages
        self.stale = True  # whether the window must be drawn again
        self.closing = False  # whether the window is to close
        self.capture_mouse: Callable[[], bool] = lambda: False  # or frees it; returns whether it is captured now
        self._seconds: float | None = None  # duration of a new message; it begins with the next frame
        self._until_s = 0.0

    @property
    def is_visible(self) -> bool:
        return min(self.size) > 0

    def say(self, text: str, seconds: float = MESSAGE_S) -> None:
        """Show a message for some seconds."""
        self.message = text
        self.said.append(text)
        self._seconds = seconds
        self.refresh()

    def refresh(self) -> None:
        self.stale = True

    def resize(self, size: Size) -> None:
        self.size = size
        self.refresh()

    def end_message(self) -> None:
        """Remove the message when its time is over."""
        if self._seconds is not None:
            self._until_s = self.now_s + self._seconds
            self._seconds = None
        if self.message and self.now_s > self._until_s:
            self.message = ""
            self.refresh()
