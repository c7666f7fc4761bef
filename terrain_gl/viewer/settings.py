"""The user's choices: how the picture is drawn, and what is shown over it."""

from dataclasses import dataclass, field

from ..renderer.methods import EVERY_POST
from ..renderer.options import CHOICES, FrameOptions

STEP = 2**0.5  # factor of one step of the tolerance
TOLERANCES_PX = (2.0**-5, 2.0**8)
BUDGETS = (100, 10_000_000)  # fewest and most triangles
UI_STEP = 2**0.25  # factor of one step of the sizes of type and panels
UI_SCALES = (0.5, 4.0)
COMPARED = 100_000  # most triangles on each side of a new split picture: few enough that errors are visible
SCALE_PX = 20.0  # the error at the end of the colour scale, on both sides of a new split picture
LEAST_SIDE = 0.02  # least width of a side, relative to the split picture


@dataclass
class Settings:
    """The user's choices."""

    sides: list[FrameOptions] = field(default_factory=lambda: [FrameOptions()])  # one, or two: left and right
    active: int = 0  # the side that keys and controls change
    divider: float = 0.5  # where the picture is split, from 0 at its left edge to 1
    swapped: bool = False  # whether the first side is on the right
    centred: bool = False  # whether both sides show the same land: each the middle of its picture
    lens: float = 0.0  # magnification of the glass under the cursor; 0 without a glass
    sums: bool = False  # whether the summed-area table is shown
    box: int = 64  # posts along a side of the box that is read from this table
    panel: bool = True
    help: bool = False  # whether the help page is shown
    ui_scale: float = 1.0  # factor of the sizes of type and panels

    @property
    def options(self) -> FrameOptions:
        """Render options of the active side."""
        return self.sides[self.active]

    @property
    def split(self) -> bool:
        """Whether there are two sides."""
        return len(self.sides) > 1

    def change(self, **changes: object) -> None:
        """Change options of the active side. A tolerance replaces a number of triangles, and the other way round."""
        self.sides[self.active] = self.options.otherwise(**changes)

    def change_all(self, **changes: object) -> None:
        """Change options of all sides."""
        self.sides = [side.otherwise(**changes) for side in self.sides]

    def split_at(self, share: float) -> None:
        """Move the divider; both sides keep a part of the picture, also where the panel is wider than the window."""
        self.divider = min(max(share, LEAST_SIDE), 1 - LEAST_SIDE)

    def forget_map(self) -> None:
        """Draw without exaggeration and within a tolerance again: a number of triangles suits only one map."""
        self.change_all(exaggeration=1.0)
        self.sides = [side.otherwise(max_error_px=1.0) if side.triangles else side for side in self.sides]

    def toggle(self, choice: str) -> None:
        """Show or hide the panel ("panel") or the help page ("help"); or the same land on both sides ("centred")."""
        setattr(self, choice, not getattr(self, choice))

    def toggle_contours(self) -> None:
        """Draw contour lines at an interval that suits the map, or none."""
        self.change_all(contour_m=0.0 if self.options.contour_m is None else None)

    def enlarge(self, steps: int) -> None:
        """Make type and panels larger by some steps, or smaller if negative, within their range."""
        least, most = UI_SCALES
        self.ui_scale = min(max(self.ui_scale * UI_STEP**steps, least), most)

    def cycle(self, option: str, step: int = 1) -> str:
        """Take the next choice of an option of `FrameOptions`, and return it."""
        choices = [choice for choice in CHOICES[option] if choice not in EVERY_POST or not self.options.triangles]
        chosen = choices[(choices.index(getattr(self.options, option)) + step) % len(choices)]
        self.change(**{option: chosen})
        return chosen

    def loosen(self, steps: float) -> None:
        """Multiply the tolerance by √2 for each step; a budget of triangles is divided instead."""
        least, most = TOLERANCES_PX
        if now_px := self.options.max_error_px:
            looser = now_px * STEP**steps if steps > 0 else now_px / STEP**-steps  # so a step back undoes it
            self.change(max_error_px=min(max(looser, least), most))
        elif self.options.triangles:
            least, most = BUDGETS
            self.change(triangles=round(min(max(self.options.triangles / STEP**steps, least), most)))
