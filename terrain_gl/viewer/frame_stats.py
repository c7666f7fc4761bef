"""Numbers of the last frames, also as text: times, triangles, bounds and achieved errors."""

import math
from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise

from ..gpu import gl
from ..renderer.frame import Stats
from .frame_budget import FULL, Way

STAGES = ("lod", "draw", "shade")
FRAMES = 120  # number of frames in the graphs


@dataclass
class FrameStats:
    """Numbers of the last frame."""

    name: str  # of the map
    posts: tuple[int, int]  # columns and rows of the map
    is_preview: bool = False  # whether a coarse sample of the map is shown; nothing is certified or measured
    awaits_map: bool = False  # whether the map itself comes soon, so that the sample needs no light
    fps: float | None = None  # frames a second in motion; None at rest
    stats: Stats = field(default_factory=Stats)  # as `Renderer.draw` returns them
    measured_px: dict[str, float] | None = None  # achieved error by metric, as far as it is measured
    way: Way = FULL  # how the picture is drawn
    is_sketch: bool = False  # whether this is the preview of a new split; the numbers are those of the picture before

    @property
    def certified_px(self) -> float | None:
        """The certified bound of the error; None if there is none."""
        return self.stats.get("certified_max_error_px")

    @property
    def achieved_px(self) -> float | None:
        """The achieved error in the metric of the bound."""
        return achieved_px(self.stats, self.measured_px)


def achieved_px(stats: Stats, measured_px: dict[str, float] | None) -> float | None:
    """The achieved error in the metric of the bound; None if it is not measured yet."""
    return measured_px.get(stats["certified_metric"]) if measured_px else None


def error_name(measured_px: dict[str, float] | None) -> str:
    """What an error is called before and after all places are measured."""
    return "so far" if measured_px and "rms" not in measured_px else "achieved"


def bound_words(stats: Stats, form: str) -> str:
    """The certified bound, or that there is none; and how many cracks the mesh has, in the style that shows them."""
    px = stats.get("certified_max_error_px")
    cracks = f", {stats['cracks']:,} cracks" if "cracks" in stats else ""
    return ("no bound" if px is None else f"bound {px:{form}} px") + cracks


def without_bounds(stats: Stats) -> Stats:
    """The stats of a preview. Because it is not the whole map, nothing is certified."""
    return stats | {"certified_max_error_px": None, "complete": False}


def in_window_px(stats: Stats, shrink: int) -> Stats:
    """The stats of a picture that is shown `shrink` times as large: bound and tolerance in pixels of the window."""
    bound_px, asked_px = stats["certified_max_error_px"], stats["requested_max_error_px"]
    return stats | {
        "certified_max_error_px": bound_px and shrink * bound_px,
        "requested_max_error_px": asked_px and shrink * asked_px,
    }


def drawing_ms(stats: Stats) -> float:
    """Milliseconds that the GPU took for a frame."""
    return sum(stats["ms"].get(stage, 0.0) for stage in STAGES)


def clock(stats: Stats) -> str:
    """The clock that measured the milliseconds."""
    if stats["ms_clock"] == "cpu":
        return "by the CPU's clock: this driver has no timer queries"
    renderer = stats["gl_renderer"].split()[0]
    if renderer in gl.SOFTWARE:
        return f"by timer queries of {renderer}, which draws on the CPU"
    return "by the GPU's own clock (timer queries)"


def seconds(ms: float) -> str:
    """A time as text, with about three digits, in milliseconds or seconds."""
    return f"{ms:.3g} ms" if ms < 999 else f"{ms / 1000:.1f} s"


@dataclass
class Record:
    """One frame in the graphs."""

    ms: dict[str, float]
    triangles: int
    bound_px: float | None  # 0 if no finite bound is certified
    measured_px: float | None = None
    point_px: float | None = None  # the bound, if it holds for every point and not only for the root mean square


@dataclass
class History:
    """The last frames, for the graphs."""

    records: deque[Record] = field(default_factory=lambda: deque(maxlen=FRAMES))

    def add(self, stats: Stats) -> None:
        ms = {stage: stats["ms"].get(stage, 0.0) for stage in STAGES}
        bound_px = stats["certified_max_error_px"]
        drawable = bound_px is not None and math.isfinite(bound_px)  # a budget may have no finite bound
        point_px = bound_px if drawable and stats["certified_metric"] == "max" else None
        self.records.append(Record(ms, stats["triangles"], bound_px if drawable else 0.0, point_px=point_px))

    @property
    def largest_jump_px(self) -> float | None:
        """The largest possible jump of a point between two frames in the graphs: docs/guarantee.md; None if unknown."""
        bounds = [(before.point_px, after.point_px) for before, after in pairwise(self.records)]
        return max((a + b for a, b in bounds if a is not None and b is not None), default=None)

    def add_measured(self, px: float) -> None:
        """Add the achieved error of the last frame."""
        if self.records:
            self.records[-1].measured_px = px
