"""A router that says nothing for longer than a process waits for one."""

import os
import signal
import time
from pathlib import Path

import pytest

from tests.integration.training.killing import assert_nothing_lost_nor_counted_twice, pid_of
from tests.integration.training.test_kill import ENDURING
from tests.integration.training.training import (
    finish,
    log_of,
    processes_of,
    training,
    wait_until,
)

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(400)]

WAITS = ("bus.watchdog_seconds=1.0", "bus.give_up_seconds=3.0")
SILENCE = 8.0


def test_the_run_outlives_a_router_that_says_nothing_for_long(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    with training(folder, overrides=(*ENDURING, *WAITS)) as process:
        router = wait_until(lambda: pid_of(folder, "router-0"), process)
        wait_until(lambda: (folder / "learner").is_dir() and log_of(folder, "actor-0"), process)
        os.kill(router, signal.SIGSTOP)
        time.sleep(SILENCE)
        os.kill(router, signal.SIGCONT)
        code, out, err = finish(process, 300)
    assert code == 0, out + err
    assert "session_reopened" in err  # by the run itself, which was not ended by it
    assert any(event["event"] == "bus_lost" for event in log_of(folder, "actor-0")), "no silence"
    assert processes_of(folder) == []
    assert_nothing_lost_nor_counted_twice(folder)
