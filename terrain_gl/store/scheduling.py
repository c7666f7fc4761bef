"""Run tasks in this process, in several processes, or on a Dask cluster. Results come in the order of the tasks."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from itertools import islice
from typing import TYPE_CHECKING, Any

from ..basics.exceptions import TerrainError
from ..readers.raster import one_line

if TYPE_CHECKING:
    from multiprocessing.connection import Connection

CONNECT = "20s"  # longest wait for a scheduler's answer
TRIES = 4  # how often a task is tried if its worker dies
GRACE_S = 5.0  # at the end, a process has this long to finish its task
AHEAD = 2  # tasks for each worker that are begun before their results are needed
Perform = Callable[[Any, Any], Any]  # from a job and a task to a result


@dataclass
class Begun:
    """A task that has begun, and the future that will have its result."""

    task: Any
    future: Any


class Here:
    """Run one task after the other, in this thread."""

    def in_order(self, perform: Perform, job: Any, tasks: Iterable[Any]) -> Iterator[Any]:
        """Results in the order of their tasks."""
        return (perform(job, task) for task in tasks)

    def close(self) -> None:
        """Nothing to end."""


class Processes:
    """Several processes of this machine, each with an OpenGL context of its own."""

    def __init__(self, workers: int) -> None:
        self._workers = workers
        self._begin()

    def in_order(self, perform: Perform, job: Any, tasks: Iterable[Any]) -> Iterator[Any]:
        """Results in the order of their tasks. If a process dies, other processes do its tasks."""
        from concurrent.futures.process import BrokenProcessPool

        def begin(task: Any) -> Any:
            try:
                return self._pool.submit(perform, job, task)
            except BrokenProcessPool:
                self.close()
                self._begin()
                return self._pool.submit(perform, job, task)

        return _in_order(tasks, begin, lambda: self._workers, BrokenProcessPool)

    def close(self) -> None:
        """End the processes. Each has `GRACE_S` to finish its task, because a killed process may hold a lock."""
        ending = threading.Thread(target=self._pool.shutdown, kwargs={"wait": True, "cancel_futures": True})
        ending.start()
        ending.join(GRACE_S)
        self._lifeline.close()
        ending.join()

    def _begin(self) -> None:
        import multiprocessing  # slow to import, and only `workers` needs it
        from concurrent.futures import ProcessPoolExecutor

        context = multiprocessing.get_context("spawn")
        theirs, self._lifeline = context.Pipe(duplex=False)
        self._pool = ProcessPoolExecutor(self._workers, context, _begin_process, (theirs,))


class Cluster:
    """Workers of a Dask scheduler that see the same files. If a worker dies, only its tasks run again."""

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
            from distributed.comm.addressing import get_address_host_port
        except ImportError:
            raise TerrainError("--scheduler needs Dask: pip install 'terrain-gl[dask]'") from None
        connect: Any = Client  # distributed has no types
        check: Any = get_address_host_port
        try:
            check(address)  # a client with a wrong address prints errors when it is deleted
            self._client: Any = connect(address, timeout=CONNECT, set_as_default=False)
        except OSError:  # its text has the address of an object
            told = f"no Dask scheduler answers there within {CONNECT}: start one, or check the address"
            raise TerrainError(f"{address}: {told}") from None
        except ValueError as error:
            raise TerrainError(f"{address}: is no address of a Dask scheduler ({one_line(error)})") from None

    def in_order(self, perform: Perform, job: Any, tasks: Iterable[Any]) -> Iterator[Any]:
        """Results in the order of their tasks."""
        from distributed import KilledWorker

        def begin(task: Any) -> Any:
            # each task carries the job: data scattered to workers are lost when these workers die
            return self._client.submit(perform, job, task, pure=False, retries=TRIES - 1)

        return _in_order(tasks, begin, lambda: sum(self._client.nthreads().values()), KilledWorker)

    def close(self) -> None:
        """Leave the cluster."""
        self._client.close()


def scheduler(workers: int, address: str | None = None) -> Here | Processes | Cluster:
    """The scheduler for these options."""
    if address:
        return Cluster(address)
    return Here() if workers == 1 else Processes(workers)


def _in_order(
    tasks: Iterable[Any], begin: Callable[[Any], Any], count_workers: Callable[[], int], died: type[Exception]
) -> Iterator[Any]:
    """Results in the order of their tasks. Only a few tasks are begun ahead, so results need little memory."""
    waiting = iter(tasks)
    begun = deque[Begun]()
    try:
        while True:
            room = max(0, AHEAD * max(1, count_workers()) - len(begun))  # 0 if workers have left
            begun.extend(Begun(task, begin(task)) for task in islice(waiting, room))
            if not begun:
                return
            result = _first_result(begun, begin, died)
            begun.popleft()
            yield result
    finally:
        for each in begun:
            each.future.cancel()


def _first_result(begun: deque[Begun], begin: Callable[[Any], Any], died: type[Exception]) -> Any:
    """The result of the first task. A task whose worker has died begins again."""
    for _ in range(TRIES):
        try:
            return begun[0].future.result()
        except died:
            for each in begun:
                if each is begun[0] or (each.future.done() and isinstance(each.future.exception(), died)):
                    each.future = begin(each.task)
    raise TerrainError(f"{TRIES} workers in a row ended early: run the same command again to go on")


def _begin_process(lifeline: Connection) -> None:
    """Prepare a new process: it ignores Ctrl-C, and ends when its parent closes the other end of a pipe."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    with contextlib.suppress(EOFError, OSError):
        lifeline.recv_bytes()
    os._exit(1)
