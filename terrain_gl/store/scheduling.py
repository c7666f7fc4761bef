"""Run tasks in this process, in several processes, or on a Dask cluster; each result comes when its task ends."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from typing import Any

from ..exceptions import TerrainError
from ..readers.raster import one_line

CONNECT = "20s"  # longest wait for a scheduler's answer
Run = Callable[[Callable[..., Any], Any, Iterable[Any]], Iterator[tuple[Any, Any]]]


class Here:
    """Run one task after the other, in this thread."""

    def run(self, perform: Callable[..., Any], job: Any, tasks: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        """Pairs of a task and its result."""
        for task in tasks:
            yield task, perform(job, task)

    def close(self) -> None:
        """Nothing to end."""


class Processes:
    """Several processes of this machine, each with an OpenGL context of its own."""

    def __init__(self, workers: int) -> None:
        self._pool = ProcessPoolExecutor(workers, multiprocessing.get_context("spawn"))

    def run(self, perform: Callable[..., Any], job: Any, tasks: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        """Pairs of a task and its result, as they end."""
        running = {self._pool.submit(perform, job, task): task for task in tasks}
        try:
            for done in as_completed(running):
                yield running[done], done.result()
        except BrokenProcessPool:
            raise TerrainError("a worker process ended early: run the same command again to go on") from None
        finally:
            for future in running:
                future.cancel()

    def close(self) -> None:
        """End the processes."""
        self._pool.shutdown(wait=True, cancel_futures=True)


class Cluster:
    """Workers of a Dask scheduler that see the same files. If a worker dies, only its tasks run again."""

    def __init__(self, address: str) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise TerrainError("--scheduler needs Dask: pip install 'terrain-gl[dask]'") from None
        try:
            connect: Any = Client  # distributed has no types
            self._client: Any = connect(address, timeout=CONNECT, set_as_default=False)
        except (OSError, ValueError) as error:
            raise TerrainError(f"{address}: no Dask scheduler answers there ({one_line(error)})") from None

    def run(self, perform: Callable[..., Any], job: Any, tasks: Iterable[Any]) -> Iterator[tuple[Any, Any]]:
        """Pairs of a task and its result, as they end."""
        from distributed import as_completed

        completed: Any = as_completed

        # each task carries the job: data scattered to workers are lost when these workers die
        running = {self._client.submit(perform, job, task, pure=False, retries=3): task for task in tasks}
        try:
            for done in completed(running, loop=self._client.loop):
                yield running[done], done.result()
        finally:
            self._client.cancel(list(running))

    def close(self) -> None:
        """Leave the cluster."""
        self._client.close()


def scheduler(workers: int, address: str | None = None) -> Here | Processes | Cluster:
    """The scheduler for these options."""
    if address:
        return Cluster(address)
    return Here() if workers == 1 else Processes(workers)
