"""Child processes end in order, the deaf ones too."""

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
