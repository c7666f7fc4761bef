"""The sandbox of a student's code: limits; on Linux also no writing outside its folder, no network, no processes.

    limits       memory, processor time, size of files (POSIX)
    namespaces   no network, processes of its own, the file system read-only (unshare, Linux)
    Landlock     reads Python and the folder, writes the folder, signals nobody (Linux 5.13, all of it 6.12)
    seccomp      no further process or thread (Linux on x86-64 and ARM)

Each of the four is used if the system has it. `probe.py` tries to break out, and tells the grader what succeeded.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import shutil
import sys
import sysconfig
from functools import cache
from pathlib import Path

MEMORY, FILE, SECONDS = 2 << 30, 16 << 20, 60

# Before Python starts: the folder stays writable, every other mount becomes read-only.
_ENTER = """
mount --bind "$1" "$1" 2>/dev/null
while read -r _ target _; do
    case "$target" in "$1"|/proc*|/dev*|/sys*) ;; *) mount -o remount,bind,ro "$target" 2>/dev/null ;; esac
done < /proc/self/mounts
cd "$1" && shift && exec "$@"
"""
_UNSHARE = ["unshare", "--user", "--map-root-user", "--mount", "--net", "--pid", "--fork", "--kill-child"]


@cache
def namespaces() -> bool:
    """Whether this machine lets a user make namespaces."""
    import subprocess

    if not sys.platform.startswith("linux") or shutil.which("unshare") is None:
        return False
    try:
        return subprocess.run([*_UNSHARE, "true"], capture_output=True, timeout=10).returncode == 0
    except (OSError, subprocess.TimeoutExpired):
        return False


def command(words: list[str], folder: Path) -> list[str]:
    """The command that runs `words` with the walls that are set up before Python starts."""
    return [*_UNSHARE, "sh", "-c", _ENTER, "sh", str(folder), *words] if namespaces() else words


def limit(walled: bool, seconds: int = SECONDS) -> None:
    """Limit memory, processor time and the size of files of this process."""
    try:
        import resource
    except ImportError:  # Windows: only the time limit of the parent applies
        return
    wanted = {resource.RLIMIT_CPU: seconds, resource.RLIMIT_FSIZE: FILE, resource.RLIMIT_CORE: 0}
    limit_memory(MEMORY)
    if walled:  # no other processes; the kernel exempts the system's root from this limit
        wanted[resource.RLIMIT_NPROC] = 0
    for kind, most in wanted.items():
        _set_limit(kind, most)


def limit_memory(most: int) -> None:
    """Limit the memory of this process, in bytes, where the system can."""
    if sys.platform.startswith("linux"):  # macOS refuses such a limit
        import resource

        _set_limit(resource.RLIMIT_AS, most)


def _set_limit(kind: int, most: int) -> None:
    import resource

    hard = resource.getrlimit(kind)[1]
    most = most if hard == resource.RLIM_INFINITY else min(most, hard)
    resource.setrlimit(kind, (most, most))


# Landlock: access rights, by the first version of the interface that has these rights (linux/landlock.h)
_READ, _ALL = 0b1101, {1: (1 << 13) - 1, 2: 1 << 13, 3: 1 << 14, 5: 1 << 15}
_CREATE, _ADD, _RESTRICT = 444, 445, 446


class _Rules(ctypes.Structure):
    _fields_ = [(name, ctypes.c_uint64) for name in ("files", "network", "scope")]


class _Beneath(ctypes.Structure):
    _pack_, _layout_ = 1, "ms"
    _fields_ = [("access", ctypes.c_uint64), ("folder", ctypes.c_int32)]


def landlock(folder: Path) -> bool:
    """Allow this process only to write below a folder, to read that folder and Python, and to signal itself."""
    if not sys.platform.startswith("linux"):
        return False
    libc = ctypes.CDLL(None, use_errno=True)
    version = libc.syscall(_CREATE, None, 0, 1)
    if version < 1:
        return False
    everything = sum(bits for since, bits in _ALL.items() if since <= version)
    rules = _Rules(everything, 0b11 if version >= 4 else 0, 0b11 if version >= 6 else 0)
    size = 24 if version >= 6 else 16 if version >= 4 else 8
    handle = libc.syscall(_CREATE, ctypes.byref(rules), size, 0)
    for path, access in [(str(folder), everything), *((path, _READ) for path in _readable())]:
        try:
            at = os.open(path, os.O_PATH | os.O_CLOEXEC)
        except OSError:
            continue
        kept = access if os.path.isdir(path) else access & 0b110000000000111
        libc.syscall(_ADD, handle, 1, ctypes.byref(_Beneath(kept, at)), 0)
        os.close(at)
    no_new_privileges = libc.prctl(38, 1, 0, 0, 0)
    held = no_new_privileges == 0 and libc.syscall(_RESTRICT, handle, 0) == 0
    os.close(handle)
    return held


# Seccomp, for each machine: its number (linux/audit.h), and the numbers of the calls clone, fork, vfork and clone3
_FORKS = {"x86_64": (0xC000003E, (56, 57, 58, 435)), "aarch64": (0xC00000B7, (220, 435))}
_LOAD, _IF_EQUAL, _IF_ABOVE, _ANSWER = 0x20, 0x15, 0x35, 0x06  # linux/bpf_common.h
_ALLOW, _REFUSE, _KILL = 0x7FFF0000, 0x00050000 | 11, 0x80000000  # 11: EAGAIN


class _Step(ctypes.Structure):
    _fields_ = [("code", ctypes.c_uint16), ("yes", ctypes.c_uint8), ("no", ctypes.c_uint8), ("k", ctypes.c_uint32)]


class _Program(ctypes.Structure):
    _fields_ = [("length", ctypes.c_uint16), ("steps", ctypes.POINTER(_Step))]


def seccomp() -> bool:
    """Forbid this process to start processes and threads. For root, RLIMIT_NPROC has no effect."""
    if not sys.platform.startswith("linux") or os.uname().machine not in _FORKS:
        return False
    machine, calls = _FORKS[os.uname().machine]
    steps = [(_LOAD, 0, 0, 4), (_IF_EQUAL, 1, 0, machine), (_ANSWER, 0, 0, _KILL)]  # calls for another kind of machine
    steps += [(_LOAD, 0, 0, 0), (_IF_ABOVE, 0, 1, 0x40000000), (_ANSWER, 0, 0, _KILL)]  # numbers of x32
    steps += [(_IF_EQUAL, len(calls) - i, 0, call) for i, call in enumerate(calls)]
    steps += [(_ANSWER, 0, 0, _ALLOW), (_ANSWER, 0, 0, _REFUSE)]
    program = _Program(len(steps), (_Step * len(steps))(*(_Step(*step) for step in steps)))
    libc = ctypes.CDLL(None, use_errno=True)
    return libc.prctl(38, 1, 0, 0, 0) == 0 and libc.prctl(22, 2, ctypes.byref(program), 0, 0) == 0


def _readable() -> list[str]:
    """Python's own library, numpy and the system's libraries: no other package, so neither answers nor this project."""
    library = {sysconfig.get_path(name) for name in ("stdlib", "platstdlib")}
    own = [str(path) for folder in library for path in Path(folder).iterdir() if not path.name.endswith("-packages")]
    found = importlib.util.find_spec("numpy")  # it may stand in the packages of the Python below this environment
    packages = Path(found.origin).parents[1] if found and found.origin else Path()
    numpy = [str(packages / name) for name in ("numpy", "numpy.libs")]
    system = [Path(name) for name in ("/usr/lib", "/usr/lib64", "/lib", "/lib64") if os.path.isdir(name)]
    linked = [str(path) for each in system for path in each.iterdir() if not path.name.startswith("python")]
    shared = [str(path) for path in Path(sys.base_prefix, "lib").glob("*.so*")]
    files = ["/etc/ld.so.cache", "/dev/urandom", "/proc/cpuinfo"]
    return [*own, *numpy, *shared, *linked, *files, str(Path(__file__).parent)]
