"""How fast the cores are just now: neighbours on the same machine halve it, and give it back."""

import contextlib
import threading
import time
from collections.abc import Iterator

PIECE = 50_000
"""Additions and multiplications in one piece of work: a few milliseconds."""
PERIOD_SECONDS = 0.5


def piece_seconds() -> float:
    """Return the CPU seconds that this thread needs for a piece of work of always the same size."""
    begin, total = time.thread_time(), 0
    for number in range(PIECE):
        total += number * number
    return time.thread_time() - begin


@contextlib.contextmanager
def pieces_timed() -> Iterator[list[float]]:
    """Do a piece of work every half a second until the block ends, and list how long each took.

    There is one at least. It takes about one hundredth of a core.
    """
    over = threading.Event()
    found = [piece_seconds()]

    def work() -> None:
        while not over.wait(PERIOD_SECONDS):
            found.append(piece_seconds())

    worker = threading.Thread(target=work, daemon=True)
    worker.start()
    try:
        yield found
    finally:
        over.set()
        worker.join()
