import signal
import subprocess
import sys

import pytest

HANGS = """
import sys, threading
from shared.runtime.serve import stop_on_signals
with stop_on_signals(deadline=float(sys.argv[1])) as stop:
    print("up", flush=True)
    stop.wait(60)
    print("asked", flush=True)
    threading.Event().wait(60)
"""


def hanging(deadline: float) -> subprocess.Popen[str]:
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", HANGS, str(deadline)],
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
