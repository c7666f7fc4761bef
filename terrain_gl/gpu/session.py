"""A session: one OpenGL context, everything that was made in it, and its unfinished work.

Several renderers may exist at the same time, each with its own context. OpenGL calls go to the current context. So
every public method makes its own context current first (`in_session`), and every generator does so before each step
(`steps_in_session`).
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager
from functools import wraps
from types import GeneratorType
from typing import Any, Protocol, TypeVar, cast

import moderngl

from ..basics.exceptions import TerrainError


class Resource(Protocol):
    """Anything that holds GPU memory."""

    def release(self) -> None:
        """Release GPU resources."""


Made = TypeVar("Made", bound=Resource)
Method = TypeVar("Method", bound=Callable[..., Any])


class Session:
    """An OpenGL context, and the resources that are released with it.

    Parameters
    ----------
    ctx
        The context.
    owned
        Whether the session makes the context current before use, and releases it at the end. A context that belongs to
        the caller must be current already.

    Attributes
    ----------
    kept
        The resources given to `keep`, in the order of creation.
    """

    def __init__(self, ctx: moderngl.Context, owned: bool) -> None:
        self.ctx = ctx
        self._owned = owned
        self.kept: list[Resource] = []
        self._unfinished: list[GeneratorType[Any, None, Any]] = []
        self._released = False

    def keep(self, made: Made) -> Made:
        """Release `made` with the session; returns it."""
        self.kept.append(made)
        return made

    def enter(self) -> None:
        """Make the context current.

        Raises
        ------
        TerrainError
            The session has been released.
        """
        if self._released:
            raise TerrainError("this renderer has been released: make another one")
        if self._owned:
            self.ctx.__enter__()  # type: ignore[no-untyped-call]

    def run(self, steps: GeneratorType[Any, None, Any]) -> Generator[Any, None, Any]:
        """Take the steps of a generator, each in this session's context. Other sessions may draw in between."""
        self._unfinished.append(steps)
        try:
            while True:
                self.enter()
                try:
                    share = next(steps)
                except StopIteration as end:
                    return end.value
                yield share
        finally:  # abandoned work must release its memory in the right context
            self._unfinished.remove(steps)
            if not self._released:
                self.enter()
                steps.close()

    @contextmanager
    def needs_memory(self, what: str, needed: int, advice: str) -> Iterator[None]:
        """Report a lack of GPU memory in one line: the object, the bytes that it needs, and what to do.

        Raises
        ------
        TerrainError
            The GPU has too little memory for the objects that the block makes.
        """
        message = f"{what} about {max(1, needed >> 20)} MiB of GPU memory, more than is free: {advice}"
        try:
            yield
        except (moderngl.Error, MemoryError) as error:
            raise TerrainError(f"{message} ({error})") from None
        if self.ctx.error == "GL_OUT_OF_MEMORY":
            raise TerrainError(message)

    def release(self) -> None:
        """Release GPU resources, the newest first, and end unfinished work."""
        if self._released:
            return
        self._released = True
        if self._owned:
            self.ctx.__enter__()  # type: ignore[no-untyped-call]
        for steps in self._unfinished:
            if not steps.gi_running:  # a running generator has failed, and calls this method itself
                steps.close()
        while self.kept:
            self.kept.pop().release()
        if self._owned:
            self.ctx.release()


def in_session(method: Method) -> Method:
    """Decorate a method of an object that has a `session`: its context is made current first."""

    @wraps(method)
    def entered(self: Any, *args: Any, **settings: Any) -> Any:
        self.session.enter()
        return method(self, *args, **settings)

    return cast(Method, entered)


def steps_in_session(method: Method) -> Method:
    """Decorate a generator method of an object that has a `session`: the context is made current before each step."""

    @wraps(method)
    def entered(self: Any, *args: Any, **settings: Any) -> Any:
        return (yield from self.session.run(method(self, *args, **settings)))

    return cast(Method, entered)
