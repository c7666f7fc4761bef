"""Numbers of the last frames, also as text: times, triangles, bounds and achieved errors."""

import math
from collections import deque
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

from ..gpu import gl
from .frame_budget import FULL, Way

STAGES = ("lod", "draw", "shade")
FRAMES = 120  # frames that the graphs show


@dataclass
class FrameStats:
    """Numbers of the last frame.

    Attributes
    ----------
    name, posts
        The map's name, and its columns and rows.
    is_preview
        Whether the frame shows a coarse sample of the map. Then nothing is certified or measured.
    awaits_map
        Whether the map itself comes soon, so that the sample needs no light.
    fps
        Frames a second in motion; None at rest.
    stats
        The stats that `Renderer.draw` returns.
    measured_px
        Achieved error by metric; None until it is measured.
    height_m
        Height of the eye above the ground; NaN where there is no ground.
    speed_m_s
        Speed of the keys that move the camera.
    way
        How the picture is drawn: `frame_budget.FULL` at rest.
    is_sketch
        Whether the picture is the preview of a new split. The numbers are those of the picture before.
    """

    name: str
    posts: tuple[int, int]
    is_preview: bool = False
    awaits_map: bool = False
    fps: float | None = None
    stats: dict[str, Any] = field(default_factory=dict)
    measured_px: dict[str, float] | None = None
    height_m: float = math.nan
    speed_m_s: float = 0.0
    way: Way = FULL
    is_sketch: bool = False

    @property
    def certified_px(self) -> float | None:
        """The certified bound of the error; None if there is none."""
        return self.stats.get("certified_max_error_px")

    @property
    def achieved_px(self) -> float | None:
        """The achieved error in the metric of the bound."""
        return achieved_px(self.stats, self.measured_px)


def achieved_px(stats: dict[str, Any], measured_px: dict[str, float] | None) -> float | None:
    """The achieved error in the metric of the bound; None if it is not measured yet."""
    return measured_px[stats["certified_metric"]] if measured_px else None


def bound_words(stats: dict[str, Any], form: str) -> str:
    """The certified bound, or that there is none; and how many cracks the mesh has, in the style that shows them."""
    px = stats.get("certified_max_error_px")
    cracks = f", {stats['cracks']:,} cracks" if "cracks" in stats else ""
    return ("no bound" if px is None else f"bound {px:{form}} px") + cracks


def without_bounds(stats: dict[str, Any]) -> dict[str, Any]:
    """The stats of a preview. Because it is not the whole map, nothing is certified."""
    return stats | {"certified_max_error_px": None, "complete": False}


def in_window_px(stats: dict[str, Any], shrink: int) -> dict[str, Any]:
    """The stats of a picture that is shown `shrink` times as large: bound and tolerance in pixels of the window."""
    in_px = {key: stats[key] for key in ("certified_max_error_px", "requested_max_error_px")}
    return stats | {key: None if px is None else shrink * px for key, px in in_px.items()}


def drawing_ms(stats: dict[str, Any]) -> float:
    """Milliseconds that the GPU took for a frame."""
    return sum(stats["ms"].get(stage, 0.0) for stage in STAGES)


def clock(stats: dict[str, Any]) -> tuple[str, str]:
    """The clock that measured the milliseconds, in a word and in a phrase."""
    if stats["ms_clock"] == "cpu":
        return "CPU", "by the CPU's clock: this driver has no timer queries"
    renderer = stats["gl_renderer"].split()[0]
    if renderer in gl.SOFTWARE:
        return renderer, f"by timer queries of {renderer}, which draws on the CPU"
    return "GPU", "by the GPU's own clock (timer queries)"


def seconds(ms: float) -> str:
    """A time as text, with about three digits, in milliseconds or seconds."""
    return f"{ms:.3g} ms" if ms < 999 else f"{ms / 1000:.1f} s"


@dataclass
class Record:
    """One frame in the graphs; `bound_px` is 0 if nothing is certified.

    `point_px` is the bound if it holds for every point, not only for the mean; else None.
    """

    ms: dict[str, float]
    triangles: int
    bound_px: float | None
    measured_px: float | None = None
    point_px: float | None = None


@dataclass
class History:
    """The last frames, for the graphs."""

    records: deque[Record] = field(default_factory=lambda: deque(maxlen=FRAMES))

    def add(self, stats: dict[str, Any]) -> None:
        """Add a frame."""
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
