"""How a process is told to stop, and made to."""

import atexit
import contextlib
import faulthandler
import math
import os
import signal
import sys
import threading
from collections.abc import Generator
from types import FrameType

CLOSE_SECONDS = 15.0
"""From the signal to stop to the end of the process, whatever it is doing."""
STOPS = (signal.SIGTERM, signal.SIGINT)


@contextlib.contextmanager
def stop_on_signals(deadline: float = CLOSE_SECONDS) -> Generator[threading.Event]:
    """Turn SIGTERM and SIGINT into an event; a second SIGINT, or the deadline, ends the process.

    Past the deadline the tracebacks of all threads go to stderr and the exit code is 1, even when
    a library holds the main thread, which then never comes to handle the signal. The interpreter's
    own end after that has as long again; SIGALRM ends it, for it can hang on a library's threads.
    Must be entered on the main thread.
    """
    stop = threading.Event()

    def handle(number: int, _frame: FrameType | None) -> None:
        if not stop.is_set():
            stop.set()
            atexit.register(signal.alarm, math.ceil(deadline))
        elif number == signal.SIGINT:
            os._exit(128 + number)

    with _deadline_from_signal(deadline):
        before = {sig: signal.signal(sig, handle) for sig in STOPS}
        try:
            yield stop
        finally:
            for sig, handler in before.items():
                signal.signal(sig, handler)


@contextlib.contextmanager
def _deadline_from_signal(seconds: float) -> Generator[None]:
    """Give the block so long from the first signal on, told by the C handler, not by Python's."""
    reading, writing = os.pipe()
    os.set_blocking(writing, False)

    def arm() -> None:
        while (told := os.read(reading, 1)) and told[0] not in STOPS:
            pass
        if told:
            faulthandler.dump_traceback_later(seconds, exit=True, file=sys.__stderr__ or sys.stderr)

    thread = threading.Thread(target=arm, name="stop-deadline", daemon=True)
    thread.start()
    before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    try:
        yield
    finally:
        signal.set_wakeup_fd(before)
        os.close(writing)
        thread.join()
        faulthandler.cancel_dump_traceback_later()
        os.close(reading)
