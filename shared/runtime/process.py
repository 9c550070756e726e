"""What a process knows of itself and of its parent: Linux only, no dependency."""

import ctypes
import dataclasses
import os
import resource
import signal
from pathlib import Path

PR_SET_PDEATHSIG = 1
PR_SET_NAME = 15

THREAD_LIMITS = {
    "OMP_NUM_THREADS": "1",
    "OPENBLAS_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "VECLIB_MAXIMUM_THREADS": "1",
    "NUMEXPR_NUM_THREADS": "1",
}
"""Environment of every process that computes: the libraries read it when they are loaded, and two
spinning thread pools on two cores are slower than one thread."""


@dataclasses.dataclass(frozen=True)
class Usage:
    """What a process has used."""

    cpu_seconds: float
    """User and system time of all its threads since it started."""
    rss_bytes: int
    """Memory resident now."""


def usage() -> Usage:
    """Return what this process has used."""
    spent = resource.getrusage(resource.RUSAGE_SELF)
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return Usage(spent.ru_utime + spent.ru_stime, pages * resource.getpagesize())


def die_with_parent(sig: signal.Signals = signal.SIGTERM, parent: int | None = None) -> None:
    """Have the kernel send ``sig`` to this process when its parent dies.

    Args:
        sig: the signal to be sent.
        parent: the parent it was started by; where that one is gone already, the signal is sent
            at once, for the kernel would never send it.
    """
    _prctl(PR_SET_PDEATHSIG, int(sig))
    if parent is not None and os.getppid() != parent:
        os.kill(os.getpid(), sig)


def set_process_name(name: str) -> None:
    """Set the name that ``ps`` and ``top`` show: at most 15 bytes of ``name``."""
    buffer = ctypes.create_string_buffer(name.encode()[:15])
    _prctl(PR_SET_NAME, ctypes.addressof(buffer))


def _prctl(option: int, argument: int) -> None:
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.prctl(option, ctypes.c_ulong(argument), 0, 0, 0) != 0:
        raise OSError(ctypes.get_errno(), f"prctl option {option} failed")
