"""GPU times of the stages of a frame, measured without waiting for the GPU.

The GPU records the time when it reaches a mark (ARB_timer_query, OpenGL 3.3). A frame's marks are read when they are
ready, a frame or more later. Until then the reported times are those of an earlier frame.

    draw  n:      |lod  |draw      |shade  |
    draw  n+1:                              |lod ...       the marks of frame n are read here, if they are ready
"""

import time
from collections import deque
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from ctypes import POINTER, byref, c_int, c_uint, c_uint64
from typing import NamedTuple

import moderngl

from . import gl

FRAME_STAGES = ("lod", "draw", "shade")  # in one frame, each may run in many steps
_TIMESTAMP = 0x8E28
_COUNTER_BITS = 0x8864
_RESULT = 0x8866
_RESULT_AVAILABLE = 0x8867


class _Stage(NamedTuple):
    name: str
    begin: int  # queries
    end: int


class Stopwatch:
    """GPU times of named stages.

    Parameters
    ----------
    depth
        The most frames in flight. If the GPU is further behind, new frames are not timed.
    """

    def __init__(self, ctx: moderngl.Context, depth: int = 4) -> None:
        self.depth = depth
        self._make = gl.function(ctx, "glGenQueries", None, c_int, POINTER(c_uint))
        self._mark = gl.function(ctx, "glQueryCounter", None, c_uint, c_uint)
        self._flush = gl.function(ctx, "glFlush", None)
        self._is_software = gl.is_software(ctx)
        self._is_there = gl.function(ctx, "glGetQueryObjectiv", None, c_uint, c_uint, POINTER(c_int))
        self._value = gl.function(ctx, "glGetQueryObjectui64v", None, c_uint, c_uint, POINTER(c_uint64))
        self._delete = gl.function(ctx, "glDeleteQueries", None, c_int, POINTER(c_uint))
        self._spare: list[int] = []
        self._stages: list[_Stage] = []  # of the frame that is being issued
        self._frames: deque[list[_Stage]] = deque()

    @staticmethod
    def works(ctx: moderngl.Context) -> bool:
        """Whether the driver has a timer; some report a timer of zero bits."""
        bits = c_int()
        gl.function(ctx, "glGetQueryiv", None, c_uint, c_uint, POINTER(c_int))(_TIMESTAMP, _COUNTER_BITS, byref(bits))
        return bits.value > 0

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the commands that the block issues. Stages of the same name in a frame are added up."""
        begin = self._now()
        try:
            yield
        finally:
            self._stages.append(_Stage(name, begin, self._now()))

    def frame(self) -> dict[str, float] | None:
        """End a frame; returns the milliseconds by stage of the newest finished frame, None if there is no new one."""
        if len(self._frames) < self.depth:
            self._frames.append(self._stages)
        else:
            self._give_back(self._stages)
        self._stages = []
        times = None
        while self._frames and self._finished(self._frames[0]):
            times = self._read(self._frames.popleft())
        return times

    def drop(self) -> None:
        """Forget the frame that was begun but not ended."""
        self._give_back(self._stages)
        self._stages = []

    def release(self) -> None:
        """Release GPU resources."""
        for stages in (*self._frames, self._stages):
            self._give_back(stages)
        self._frames.clear()
        self._stages = []
        self._delete(len(self._spare), (c_uint * len(self._spare))(*self._spare))
        self._spare = []

    def _now(self) -> int:
        """Let the GPU record the time; returns the query that will hold it."""
        if not self._spare:
            made = (c_uint * 16)()
            self._make(len(made), made)
            self._spare += made
        query = self._spare.pop()
        self._mark(query, _TIMESTAMP)
        if self._is_software:  # Mesa queues marks with triangles; compute shaders would overtake them
            self._flush()
        return query

    def _finished(self, stages: list[_Stage]) -> bool:
        there = c_int()
        for stage in stages[-1:]:  # marks are reached in order
            self._is_there(stage.end, _RESULT_AVAILABLE, byref(there))
            return bool(there.value)
        return True

    def _read(self, stages: list[_Stage]) -> dict[str, float]:
        times: dict[str, float] = {}
        for stage in stages:
            begin, end = c_uint64(), c_uint64()
            self._value(stage.begin, _RESULT, byref(begin))
            self._value(stage.end, _RESULT, byref(end))
            times[stage.name] = times.get(stage.name, 0.0) + 1e-6 * (end.value - begin.value)
        self._give_back(stages)
        return times

    def _give_back(self, stages: list[_Stage]) -> None:
        self._spare += [query for stage in stages for query in (stage.begin, stage.end)]


class StageTimer:
    """Milliseconds of each stage, by the CPU's or the GPU's clock.

    Attributes
    ----------
    ms
        Milliseconds by stage: of the last frame, and of work that is done once, such as building tables.
    waits
        Whether to wait for the GPU after each stage and time it on the CPU. If not, `ms` are the GPU's own times, a
        frame or more late.
    queries
        Whether to use the GPU's clock even with `waits`. Then `ms` are times of the GPU alone, without Python and the
        driver. Needs a driver for which `Stopwatch.works`.
    """

    waits = True
    queries = False

    def __init__(self, ctx: moderngl.Context) -> None:
        self.ctx = ctx
        self.ms: dict[str, float] = {}
        self.stopwatch: Stopwatch | None = None

    @property
    def clock(self) -> str:
        """The clock that `ms` come from: "cpu" or "gpu"."""
        return "cpu" if self.waits and not self.queries else "gpu"

    @contextmanager
    def frame(self, gradual: bool = False) -> Iterator[None]:
        """Time a frame, the sum of its stages. The times of an abandoned frame are dropped.

        A `gradual` frame is drawn in steps with other work in between, which does not count.
        """
        started = time.perf_counter()
        if self.waits:
            self.ms |= dict.fromkeys(FRAME_STAGES, 0.0)
        try:
            yield
        except BaseException:
            if self.stopwatch:
                self.stopwatch.drop()
            raise
        stages_ms = sum(self.ms.get(stage, 0.0) for stage in FRAME_STAGES)
        self.ms["frame"] = stages_ms if gradual else 1e3 * (time.perf_counter() - started)
        if self.stopwatch:
            self.ms |= self.stopwatch.frame() or {}

    @contextmanager
    def stage(self, name: str) -> Iterator[None]:
        """Time the block. Inside a frame, stages of the same name are added up."""
        started = time.perf_counter()
        with self._query(name):
            yield
        if self.waits:
            self.ctx.finish()
            before = self.ms.get(name, 0.0) if name in FRAME_STAGES else 0.0
            self.ms[name] = before + 1e3 * (time.perf_counter() - started)

    def steps(self, name: str, steps: Iterator[float]) -> Iterator[float]:
        """Take steps, and time each as a part of a stage. Work between the steps does not count."""
        while True:
            with self.stage(name):
                share = next(steps, None)
            if share is None:
                return
            yield share

    def release(self) -> None:
        """Release GPU resources."""
        if self.stopwatch:
            self.stopwatch.release()

    def _query(self, name: str) -> AbstractContextManager[None]:
        if self.clock == "cpu":
            return nullcontext()
        self.stopwatch = self.stopwatch or Stopwatch(self.ctx)
        return self.stopwatch.stage(name)
