"""Work in steps: the one convention for everything that takes longer than a frame.

A function `something_steps()` is a generator. It yields its progress, from 0 to 1, after each step, and returns its
result at the end. A caller that must not wait takes a few steps at a time; others call `drain`.
"""

from collections.abc import Callable, Generator
from typing import TypeVar

Result = TypeVar("Result")
Steps = Generator[float, None, Result]
Progress = Callable[[float], None]


def portion(steps: Steps[Result], number: int, count: int) -> Steps[Result]:
    """The same steps, with progress scaled: they are part `number` (from 0) of `count` equal parts of some work."""
    while True:
        try:
            share = next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result
        yield (number + share) / count


def drain(steps: Steps[Result], progress: Progress | None = None) -> Result:
    """Take all steps and return their result.

    Parameters
    ----------
    progress
        Called after each step with the progress, 0 to 1.
    """
    while True:
        try:
            share = next(steps)
        except StopIteration as end:
            result: Result = end.value
            return result
        if progress:
            progress(share)
