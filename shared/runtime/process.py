"""What a process knows of itself and does with its children; Linux."""

import contextlib
import ctypes
import dataclasses
import os
import resource
import subprocess
from collections.abc import Iterable
from pathlib import Path
from typing import Any

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

SERVICE_ENVIRONMENT = THREAD_LIMITS | {"MUJOCO_GL": "disabled"}
"""Environment of services: they draw nothing, and without windows MuJoCo loads 2 MB less."""


def limit_threads() -> None:
    """Compute on one thread in this process and its children, unless its user chose otherwise.

    Before numpy or torch is imported: their thread pools begin then, and spin beside the work.
    """
    for name, threads in THREAD_LIMITS.items():
        os.environ.setdefault(name, threads)


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


def release_memory() -> None:
    """Give free pages back to the system; glibc keeps what a burst took, others know no such call.

    Milliseconds: for the end of a piece of work, not for a loop.
    """
    trim = getattr(ctypes.CDLL(None), "malloc_trim", None)
    if trim is not None:
        trim(0)


def give_way() -> None:
    """Let this process, and the threads it begins from now on, wake behind what runs (sched(7)).

    For what nobody waits for, beside what somebody does: its share of a busy machine stays.
    """
    with contextlib.suppress(OSError):  # where that is not allowed, it does its work all the same
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def end(children: Iterable["subprocess.Popen[Any]"], seconds: float) -> None:
    """Terminate child processes, in their order, and kill what has not ended after a while.

    Args:
        children: some may have ended already.
        seconds: that each has, and then the kernel (s).

    Raises:
        subprocess.TimeoutExpired: the kernel does not let go of one that was killed.
    """
    ended = list(children)
    for process in ended:
        process.terminate()
    for process in ended:
        try:
            process.wait(seconds)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait(seconds)


def set_process_name(name: str) -> None:
    """Set the name that ``ps`` and ``top`` show: at most 15 bytes of it."""
    buffer = ctypes.create_string_buffer(name.encode()[:15])
    ctypes.CDLL(None).prctl(PR_SET_NAME, buffer, 0, 0, 0)
