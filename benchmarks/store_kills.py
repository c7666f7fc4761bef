"""A build that is killed at random moments and resumed: whether the store has the bytes of an undisturbed one.

    python benchmarks/store_kills.py [KILLS [POSTS]]      50 kills, 700 x 700 posts

Each run of the build is killed by SIGKILL after a random time; from time to time a run has two processes. If a run
ends before it is killed, the store is compared, removed, and built anew, until there were enough kills. Exit status 1
if any byte differs. The map has voids. The short form is in tests/test_store.py.
"""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from terrain_gl.store import build

RUN = """
import sys
from terrain_gl.store import build
print("begins", flush=True)
build("dem.npy", "s", tile=16, shard=64, workers=int(sys.argv[1]))
"""


def main() -> int:
    """Kill, resume and compare."""
    kills, posts = (int(word) for word in (*sys.argv[1:], *("50", "700")[len(sys.argv) - 1 :]))
    rng, done, stores = random.Random(5), 0, 0
    with tempfile.TemporaryDirectory() as folder:
        os.chdir(folder)
        np.save("dem.npy", _heights(posts))
        started = time.monotonic()
        build("dem.npy", "undisturbed", tile=16, shard=64)
        longest, expected = time.monotonic() - started, digest("undisturbed")
        while done < kills:
            killed = run(1 + (done % 5 == 4), rng.uniform(0, 0.3 * longest))
            done += killed
            if not killed:
                stores += 1
                if digest("s") != expected:
                    print(f"after {done} kills: the bytes differ")
                    return 1
                shutil.rmtree("s")
        while run(1, 1e9):
            pass
        same = digest("s") == expected
        print(f"{done} kills, {stores + 1} stores: " + ("all bytes are the same" if same else "the bytes differ"))
        return 0 if same else 1


def run(workers: int, seconds: float) -> bool:
    """Build for some seconds from the moment at which the build begins; returns whether it was killed."""
    process = subprocess.Popen(
        [sys.executable, "-c", RUN, str(workers)], stdout=subprocess.PIPE, start_new_session=True
    )
    assert process.stdout
    process.stdout.readline()
    try:
        if process.wait(seconds):
            raise SystemExit("a build failed")
        return False
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()
        return True


def digest(path: str) -> dict[str, str]:
    """Names and hashes of all files of a store."""
    files = sorted(file for file in Path(path).rglob("*") if file.is_file())
    return {str(file.relative_to(path)): hashlib.sha256(file.read_bytes()).hexdigest() for file in files}


def _heights(posts: int) -> np.ndarray:
    t = np.linspace(0, 40, posts)
    noise = np.random.default_rng(3).normal(size=(posts, posts))
    heights = (80 * np.outer(np.sin(t), np.cos(0.7 * t)) + noise).astype(np.float32)
    heights[posts // 7 : posts // 4, posts // 5 : posts // 2] = np.nan  # tasks that fill voids are killed, too
    heights[-3:, ::9] = np.nan
    return heights


if __name__ == "__main__":
    sys.exit(main())
