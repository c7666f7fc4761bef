"""Threads that read pages, check them, and prepare them for the GPU. OpenGL belongs to another thread.

Every view replaces the list of wanted pages. A page that is no longer on the list is not read, and is dropped if it has
been read. If a page cannot be read, it is tried a second time; after that it counts as missing.
"""

import threading
import time
from collections.abc import Sequence

from ..basics.exceptions import reason_of
from .map import PagedMap, PageKey
from .sums import Sums, bytes_at_work, sums_of

THREADS = 8  # several, because a remote disk answers late: some wait while others work
TRIES = 2
PATIENCE_S = 30.0  # a page without an answer for this long counts as missing
OF_WORK = 0.25  # share of `memory_bytes` for pages that are being read or wait for the pool


class Loader:
    """Reads pages, each in a thread of its own, of which at most `threads` run.

    A page that gives no answer for `patience_s` counts as missing. `failed`: why pages cannot be read.
    """

    def __init__(self, heightmap: PagedMap, threads: int = THREADS, patience_s: float = PATIENCE_S) -> None:
        self._heightmap = heightmap
        self.patience_s = patience_s
        self._most = max(1, int(OF_WORK * heightmap.memory_bytes) // bytes_at_work(heightmap.tile))
        self._threads = threads
        self._wanted: list[PageKey] = []  # not begun yet; the most wanted page is the last one
        self._wants: set[PageKey] = set()
        self._begun: dict[PageKey, float] = {}  # start times
        self._ready: dict[PageKey, Sums] = {}
        self._read_as: dict[PageKey, int] = {}  # versions of pages that were read
        self.failed: dict[PageKey, str] = {}
        self._changed = threading.Condition()
        self._has_news = False

    @property
    def is_busy(self) -> bool:
        """Whether a page is being read or waits to be read."""
        with self._changed:
            return bool(self._begun or self._ready or self._wanted)

    @property
    def has_ready(self) -> bool:
        """Whether a page has been read since the last `take`."""
        with self._changed:
            return self._has_news

    @property
    def bytes(self) -> int:
        """Approximate memory of pages in progress."""
        with self._changed:
            return bytes_at_work(self._heightmap.tile) * (len(self._ready) + len(self._begun))

    def follow(self, heightmap: PagedMap) -> None:
        """Read an edited map from now on, and forget pages that have changed since they were read.

        A page that is being read now is read again if it has changed.
        """
        with self._changed:
            self._heightmap = heightmap
            for key in [key for key in self._ready if self._read_as[key] != heightmap.version(key)]:
                del self._ready[key]

    def want(self, keys: Sequence[PageKey]) -> None:
        """Read these pages, in this order, and no others."""
        with self._changed:
            self._wants = set(keys)
            for key in self._ready.keys() - self._wants:
                del self._ready[key]
            known = self._begun.keys() | self._ready.keys() | self.failed.keys()
            self._wanted = [key for key in keys if key not in known][::-1]
            self._begin()

    def take(self) -> list[tuple[PageKey, Sums]]:
        """The pages that have been read, coarse ones first. The caller uses them or puts them back."""
        with self._changed:
            ready = self._ready
            self._ready = {}
            self._has_news = False
            self._begin()
        return sorted(ready.items(), key=lambda item: (-item[0][0], item[0]))

    def put_back(self, key: PageKey, sums: Sums, is_news: bool) -> None:
        """Give a page back for the next `take`. `is_news`: the next frame can put it into the pool at once."""
        with self._changed:
            self._ready[key] = sums
            self._has_news = self._has_news or is_news

    def wait(self, seconds: float) -> None:
        """Wait until a page has been read or has failed, at most for some seconds."""
        with self._changed:
            if not self._has_news:
                self._changed.wait(seconds)
            self._begin()

    def release(self) -> None:
        """Begin no more pages. A thread that is reading ends after that read."""
        self.want(())

    def _begin(self) -> None:
        """Begin as many pages as may be read at a time; pages without an answer count as missing."""
        late = time.monotonic() - self.patience_s
        for key in [key for key, begun in self._begun.items() if begun < late]:
            del self._begun[key]
            self.failed[key] = f"no answer for {self.patience_s:g} s"
            self._has_news = True
        room = min(self._threads - len(self._begun), self._most - len(self._begun) - len(self._ready))
        while self._wanted and room > 0:
            key = self._wanted.pop()
            self._begun[key] = time.monotonic()
            asked = key, self._heightmap.version(key)
            threading.Thread(target=self._read, args=asked, name="reading pages", daemon=True).start()
            room -= 1

    def _read(self, key: PageKey, version: int) -> None:
        sums = None
        reason = ""
        for _ in range(TRIES):
            try:
                sums = sums_of(self._heightmap, key)
                break
            except Exception as error:  # a thread must report every error
                reason = reason_of(error)
        with self._changed:
            if key not in self._begun:
                return  # too late: it counts as missing
            del self._begun[key]
            if version != self._heightmap.version(key):
                if key in self._wants:
                    self._wanted.append(key)
            elif sums is None:
                self.failed[key] = reason
            elif key in self._wants:
                self._ready[key] = sums
                self._read_as[key] = version
            self._has_news = True
            self._begin()
            self._changed.notify_all()
