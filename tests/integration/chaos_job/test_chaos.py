"""`riposte chaos` on real runs."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from services import cli
from services.jobs.chaos.clock import environment, step
from services.jobs.chaos.job import Job
from services.jobs.chaos.signals import kill
from services.jobs.chaos.sites import FAULTS, SITES
from shared.clock import SystemClock
from tests.integration.training.training import processes_of

pytestmark = [pytest.mark.zenoh, pytest.mark.timeout(300)]


def test_a_killed_actor_is_seen_to_die_to_come_back_and_to_cost_nothing(tmp_path: Path):
    folder = tmp_path / "run"
    job = Job(folder, SystemClock(), seed=1, stage_updates=2, overrides=("train.record=false",))
    try:
        job.start()
        assert job.until(lambda: job.is_up("actor-0"), 200.0)
        before = job.pid("actor-0")
        blow = kill(job, "actor-0")
        assert blow.back_at is not None
        assert job.pid("actor-0") != before
        assert job.finish() == 0
    finally:
        job.close()
    assert job.finished
    assert job.updates_left == 0
    assert job.books.toll.is_none
    assert job.books.size > 8
    assert processes_of(folder) == []


@pytest.mark.chaos
@pytest.mark.timeout(900)  # a whole run, which goes to its end after the faults
@pytest.mark.parametrize(
    "names",
    [
        ("kill-league", "corrupt-checkpoint", "unreliable-messages", "lying-actor", "clock-jump"),
        ("disk-full",),
        ("network-cut", "network-slow"),
        ("robot-kill-robot-io", "robot-kill-router", "robot-clock-jump"),
        ("robot-corrupt-snapshot", "robot-lying-policy", "robot-unreliable-messages"),
        ("robot-disk-full", "robot-kill-recorder"),
        ("robot-network-cut",),
    ],
)
def test_faults_of_every_kind_of_run_cost_nothing(
    tmp_path: Path, names: tuple[str, ...], capsys: pytest.CaptureFixture[str]
):
    site = next(site for site in SITES if FAULTS[names[0]] in site.faults)
    if why := site.why_not():
        pytest.skip(why)
    words = ["chaos", *names, "--times", "1", "--seed", "3", "--out", str(tmp_path / "out")]
    code = cli.main([*words, "--json"])
    found = json.loads(capsys.readouterr().out)
    assert code == 0, found
    assert {row["kind"]["name"] for row in found["rows"]} == set(names)


def test_a_wall_clock_is_stepped_for_one_process_and_its_monotonic_clock_is_not(tmp_path: Path):
    variables = environment(tmp_path)
    if not variables:
        pytest.skip("needs a C compiler: apt install gcc")
    program = "import time\nwhile input():\n    print(time.time(), time.monotonic(), flush=True)"
    with subprocess.Popen(
        [sys.executable, "-S", "-c", program], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
        text=True, env=os.environ | variables,
    ) as process:  # fmt: skip

        def read() -> tuple[float, float]:
            assert process.stdin is not None
            assert process.stdout is not None
            print("go", file=process.stdin, flush=True)
            wall, monotonic = process.stdout.readline().split()
            return float(wall), float(monotonic)

        before = read()
        assert step(tmp_path, process.pid, 3600.0)
        after = read()
        process.kill()
    passed = after[1] - before[1]
    assert passed < 60.0
    assert after[0] - before[0] - passed == pytest.approx(3600.0, abs=0.5)
    assert not step(tmp_path, 1, 1.0)


def test_an_unknown_fault_is_named_with_the_nearest(capsys: pytest.CaptureFixture[str]):
    assert cli.main(["chaos", "kill-leage"]) == 2
    assert "kill-league" in capsys.readouterr().err
