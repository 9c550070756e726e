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

    A thread that the C handler tells does all of it. A handler in Python would run on the main
    thread alone: not while a library holds it, not before the end of a wait that it had just begun
    when the signal came, and never where it waits for the lock of an event that it is setting.

    Past the deadline the tracebacks of all threads go to stderr and the exit code is 1. The
    interpreter's own end after that has as long again; SIGALRM ends it, for it can hang on a
    library's threads. Must be entered on the main thread.
    """
    stop = threading.Event()
    reading, writing = os.pipe()
    os.set_blocking(writing, False)

    def listen() -> None:
        while told := os.read(reading, 1):
            number = told[0]
            if number in STOPS and not stop.is_set():
                faulthandler.dump_traceback_later(
                    deadline, exit=True, file=sys.__stderr__ or sys.stderr
                )
                atexit.register(signal.alarm, math.ceil(deadline))
                stop.set()
            elif number == signal.SIGINT:
                os._exit(128 + number)

    thread = threading.Thread(target=listen, name="stop-on-signals", daemon=True)
    thread.start()
    told_before = signal.set_wakeup_fd(writing, warn_on_full_buffer=False)
    before = {sig: signal.signal(sig, _leave_to_thread) for sig in STOPS}
    try:
        yield stop
    finally:
        for sig, handler in before.items():
            signal.signal(sig, handler)
        signal.set_wakeup_fd(told_before)
        os.close(writing)
        thread.join()
        faulthandler.cancel_dump_traceback_later()
        os.close(reading)


def _leave_to_thread(number: int, frame: FrameType | None) -> None:
    """Handle a signal of which the thread is told: without a handler in Python it would not be."""
