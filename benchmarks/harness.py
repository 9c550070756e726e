"""What the benchmarks share: interleaved rounds, medians, CPU seconds of several processes."""

import contextlib
import os
import statistics
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import psutil

ROOT = Path(__file__).resolve().parents[1]
T = TypeVar("T")


def interleaved(rounds: int, sides: Sequence[Callable[[], T]]) -> list[tuple[T, ...]]:
    """Return what each side gave in each round; A B A B, so that drift hits both alike."""
    return [tuple(side() for side in sides) for _ in range(rounds)]


def median(runs: Iterable[dict[str, Any]], name: str) -> float:
    """Return the median of one figure over the rounds."""
    return float(statistics.median(run[name] for run in runs))


def cpu_of(call: Callable[[], object]) -> float:
    """Return the CPU seconds of this process that a call takes."""
    begin = time.process_time()
    call()
    return time.process_time() - begin


def cpu_seconds(pids: Iterable[int]) -> float:
    """Return the CPU seconds used so far by these processes, all threads."""
    return sum(sum(psutil.Process(pid).cpu_times()[:2]) for pid in pids)


@contextlib.contextmanager
def process(*args: str) -> Iterator[subprocess.Popen[str]]:
    """Run this interpreter with these arguments until the block ends; its output is a pipe."""
    started = subprocess.Popen(
        [sys.executable, *args],
        cwd=ROOT,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
    )
    try:
        yield started
    finally:
        started.kill()
        started.wait()
        if started.stdout:
            started.stdout.close()


@contextlib.contextmanager
def on_cores(*cores: int) -> Iterator[None]:
    """Let what is started in the block run on these cores only."""
    before = os.sched_getaffinity(0)
    os.sched_setaffinity(0, set(cores))
    try:
        yield
    finally:
        os.sched_setaffinity(0, before)


def on_first_cores(count: int) -> contextlib.AbstractContextManager[None]:
    """Return :func:`on_cores` of the first ones that this process may use."""
    return on_cores(*sorted(os.sched_getaffinity(0))[:count])
