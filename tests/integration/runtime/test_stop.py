import signal
import subprocess
import sys

import pytest

HANGS = """
import sys, threading
from shared.runtime.stop import stop_on_signals
with stop_on_signals(deadline=float(sys.argv[1])) as stop:
    print("up", flush=True)
    stop.wait(60)
    print("asked", flush=True)
    threading.Event().wait(60)
"""

STUCK = """
import ctypes
mutex = ctypes.create_string_buffer(64)
def never_returns():
    while True:  # a library that waits for a lock of its own; no signal gets it out
        ctypes.CDLL(None).pthread_mutex_lock(mutex)
"""
HANGS_IN_A_LIBRARY = f"""{STUCK}
import sys, threading
from shared.runtime.stop import stop_on_signals
with stop_on_signals(deadline=float(sys.argv[1])) as stop:
    def tell():
        stop.wait(60)
        print("asked", flush=True)
    threading.Thread(target=tell, daemon=True).start()
    print("up", flush=True)
    never_returns()
"""
HANGS_AT_ITS_END = f"""{STUCK}
import atexit, sys
from shared.runtime.stop import stop_on_signals
atexit.register(never_returns)
with stop_on_signals(deadline=float(sys.argv[1])) as stop:
    print("up", flush=True)
    stop.wait(60)
print("stopped", flush=True)
"""


def hanging(deadline: float, program: str = HANGS) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", program, str(deadline)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "up\n"
    return process


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_process_that_does_not_stop_is_ended_at_its_deadline_and_says_where(number):
    with hanging(0.2) as process:
        process.send_signal(number)
        output, errors = process.communicate(timeout=30)
    assert process.returncode == 1
    assert output == "asked\n"
    assert "Timeout" in errors
    assert 'File "<string>", line 8' in errors


def test_a_second_interrupt_ends_a_process_at_once():
    with hanging(50) as process:
        process.send_signal(signal.SIGINT)
        assert process.stdout is not None
        assert process.stdout.readline() == "asked\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 128 + signal.SIGINT


def test_a_second_interrupt_ends_a_process_whose_main_thread_is_stuck_in_a_library():
    with hanging(50, HANGS_IN_A_LIBRARY) as process:
        process.send_signal(signal.SIGINT)
        assert process.stdout is not None
        assert process.stdout.readline() == "asked\n"
        process.send_signal(signal.SIGINT)
        assert process.wait(30) == 128 + signal.SIGINT


def test_a_process_whose_main_thread_is_stuck_in_a_library_is_ended_and_says_where():
    with hanging(0.2, HANGS_IN_A_LIBRARY) as process:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=30)
    assert process.returncode == 1
    assert "in never_returns" in errors


def test_an_interpreter_that_does_not_come_to_its_end_is_ended():
    with hanging(0.2, HANGS_AT_ITS_END) as process:
        process.send_signal(signal.SIGTERM)
        output, _ = process.communicate(timeout=30)
    assert process.returncode == -signal.SIGALRM
    assert output == "stopped\n"


def test_another_signal_with_a_handler_is_no_call_to_stop():
    program = """
import signal, sys, time
from shared.runtime.stop import stop_on_signals
signal.signal(signal.SIGUSR1, lambda *_: print("heard", flush=True))
with stop_on_signals(deadline=float(sys.argv[1])) as stop:
    print("up", flush=True)
    assert not stop.wait(1.0)
"""
    with hanging(0.1, program) as process:
        process.send_signal(signal.SIGUSR1)
        output, errors = process.communicate(timeout=30)
    assert process.returncode == 0, errors
    assert output == "heard\n"
