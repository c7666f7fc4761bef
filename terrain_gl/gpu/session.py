"""A session: one OpenGL context, everything that was made in it, and its unfinished work.

Several renderers may exist at the same time, each with its own context, beside contexts of other libraries. OpenGL
calls go to the context that is current in the thread. So every public method enters its session first and leaves it at
the end (`in_session`), and every generator does so in each step (`steps_in_session`). Methods that take all steps of a
generator have one `turn` for them, so that no other thread draws between the steps. Whatever was current before, and
all state in a context of the caller, is then as it was, also after an exception.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Generator, Iterator
from contextlib import contextmanager, suppress
from functools import wraps
from types import GeneratorType
from typing import Any, Protocol, TypeVar, cast
from weakref import WeakKeyDictionary

import moderngl

from ..basics.exceptions import TerrainError
from .current import Current, current, handle_of, switch
from .state import Found, state_of


class Resource(Protocol):
    """Anything that holds GPU memory."""

    def release(self) -> None:
        """Release GPU resources."""


Made = TypeVar("Made", bound=Resource)
Method = TypeVar("Method", bound=Callable[..., Any])


class _Door:
    """The way into one context and out of it, for all sessions that share it.

    Attributes
    ----------
    lock
        Held from entering to leaving, so other threads wait.
    entries
        One for each time that the context was entered and not yet left: what was current before, if it was another
        context. The first entry alone saves state.
    found
        The state of the context, if it belongs to the caller.
    """

    def __init__(self, ctx: moderngl.Context) -> None:
        self.handle = handle_of(ctx)
        self.lock = threading.RLock()
        self.entries: list[tuple[Current | None] | None] = []
        self.found: Found = []


_doors: WeakKeyDictionary[moderngl.Context, _Door] = WeakKeyDictionary()


class Session:
    """An OpenGL context, and the resources that are released with it. In `with session:`, its context is current.

    Parameters
    ----------
    ctx
        The context.
    owned
        Whether the session releases the context at the end. A context that belongs to the caller gets back all state
        of OpenGL that was found in it.

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
        self._process = os.getpid()
        if ctx not in _doors:
            _doors[ctx] = _Door(ctx)
        self._door = _doors[ctx]

    def keep(self, made: Made) -> Made:
        """Release `made` with the session; returns it."""
        self.kept.append(made)
        return made

    def enter(self) -> None:
        """Make the context current. Other threads wait until `leave`.

        Raises
        ------
        TerrainError
            The session has been released, belongs to another process, or its context cannot be current in this thread.
        """
        self._check()
        door = self._door
        door.lock.acquire()
        try:
            door.entries.append(self._make_current(door))
            if len(door.entries) == 1 and not self._owned:
                door.found = state_of(self.ctx).found()
                state_of(self.ctx).make_plain()
        except BaseException:
            door.lock.release()
            raise

    @contextmanager
    def turn(self) -> Iterator[None]:
        """Keep other threads out of the context during several steps. Each step enters and leaves by itself."""
        self._check()  # first: after a fork, the lock may be held by a thread that is not there
        with self._door.lock:
            yield

    def _check(self) -> None:
        if self._process != os.getpid():
            raise TerrainError("this renderer was made before a fork; start processes with spawn")
        if self._released:
            raise TerrainError("this renderer has been released: make another one")

    def _make_current(self, door: _Door) -> tuple[Current | None] | None:
        """Make the context current; returns what was current before, or None if nothing changes."""
        if door.handle is None or door.handle.is_current():
            return None
        before = current()
        switch(before, door.handle)
        if not door.handle.is_current():
            switch(None, before)
            thread = threading.current_thread().name
            raise TerrainError(f"no OpenGL context in thread {thread}: it is current in another thread, or gone")
        return (before,)

    def leave(self) -> None:
        """Give back the state that was found, and the context that was current before."""
        door = self._door
        entry = door.entries.pop()
        if not door.entries and not self._owned:
            state_of(self.ctx).give_back(door.found)
        if entry:
            switch(current(), entry[0])
        door.lock.release()

    def __enter__(self) -> Session:
        self.enter()
        return self

    def __exit__(self, *_: object) -> None:
        self.leave()

    def run(self, steps: GeneratorType[Any, None, Any]) -> Generator[Any, None, Any]:
        """Take the steps of a generator, each in this session's context. Other sessions may draw in between."""
        self._unfinished.append(steps)
        try:
            while True:
                with self:
                    try:
                        share = next(steps)
                    except StopIteration as end:
                        return end.value
                yield share
        finally:  # abandoned work must release its memory in the right context
            self._unfinished.remove(steps)
            if not self._released:
                with self:
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
        self.enter()
        self._released = True
        for steps in self._unfinished:
            if not steps.gi_running:  # a running generator has failed, and calls this method itself
                steps.close()
        while self.kept:
            self.kept.pop().release()
        if self._owned:
            self._let_go()
        self.leave()

    def _let_go(self) -> None:
        """Release the context itself."""
        if self._door.handle:
            self._door.handle.let_go()
        self.ctx.release()

    def release_if_dropped(self) -> None:
        """Release GPU resources of a renderer that nobody holds any more, if its context still exists."""
        with suppress(TerrainError):
            self.release()


def in_session(method: Method) -> Method:
    """Decorate a method of an object that has a `session`: its context is current during the call."""

    @wraps(method)
    def entered(self: Any, *args: Any, **settings: Any) -> Any:
        with self.session:
            return method(self, *args, **settings)

    return cast(Method, entered)


def steps_in_session(method: Method) -> Method:
    """Decorate a generator method of an object that has a `session`: the context is current in each step."""

    @wraps(method)
    def entered(self: Any, *args: Any, **settings: Any) -> Any:
        return (yield from self.session.run(method(self, *args, **settings)))

    return cast(Method, entered)
