"""Child processes end in order, the deaf ones too; what nobody waits for gives way."""

import signal
import subprocess
import sys

from shared.runtime.process import end

DEAF = "import signal; signal.signal(signal.SIGTERM, signal.SIG_IGN)"
WAITS = "print(flush=True); import time; time.sleep(100)"


def started(program: str) -> "subprocess.Popen[bytes]":
    child = subprocess.Popen([sys.executable, "-c", program], stdout=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.readline()  # what it does about signals is settled, or it has ended
    child.stdout.close()
    return child


def test_children_are_told_to_end_and_the_deaf_one_is_killed() -> None:
    polite, deaf, over = started(WAITS), started(f"{DEAF}; {WAITS}"), started("pass")
    over.wait()
    end([polite, deaf, over], 0.5)
    codes = [child.returncode for child in (polite, deaf, over)]
    assert codes == [-signal.SIGTERM, -signal.SIGKILL, 0]


def test_what_gives_way_does_so_in_the_threads_that_it_begins_too() -> None:
    program = """
import os, threading
from shared.runtime.process import give_way
def say(): print(os.sched_getscheduler(0) == os.SCHED_BATCH)
os.sched_setscheduler(0, os.SCHED_OTHER, os.sched_param(0))
say()
give_way()
begun = threading.Thread(target=say)
begun.start()
begun.join()
say()
"""
    run = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, check=True
    )
    assert run.stdout.split() == ["False", "True", "True"]
