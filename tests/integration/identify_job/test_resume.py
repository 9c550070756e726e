"""An identification whose process was killed goes on, and ends as one that was not."""

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import pytest

WORDS = (sys.executable, "-m", "services.cli", "identify")
COST = ("cpu_s", "seconds")
"""Of a verdict: what differs from run to run."""


def verdict_of(found: subprocess.CompletedProcess[str]) -> dict[str, Any]:
    """Return the verdict that a process printed, without what it cost."""
    assert found.returncode == 0, found.stderr
    verdict: dict[str, Any] = json.loads(found.stdout)
    return {key: value for key, value in verdict.items() if key not in COST}


def run(*words: object, timeout: float = 900.0) -> subprocess.CompletedProcess[str]:
    line = [*WORDS, *map(str, words)]
    return subprocess.run(line, capture_output=True, text=True, timeout=timeout, check=False)


@pytest.mark.slow
@pytest.mark.timeout(3600)
def test_a_killed_identification_goes_on_with_its_base_fit_and_ends_the_same(
    tmp_path: Path,
) -> None:
    made = tmp_path / "set"
    simulated = run(
        "simulate", made, "--arm", "arm3", "--seed", 9009, "--effect", "torque_bias@elbow=0.5",
        "--seconds", 3, "--trajectories", "2+2",
    )  # fmt: skip
    assert simulated.returncode == 0, simulated.stderr
    killed, whole = tmp_path / "killed", tmp_path / "whole"
    kept = killed / "steps" / "base_fit.json"
    line = [*WORDS, str(made), "--json", "--out", str(killed)]
    with subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL) as process:
        until = time.monotonic() + 900.0
        while not kept.exists() and process.poll() is None and time.monotonic() < until:
            time.sleep(0.05)
        process.send_signal(signal.SIGKILL)
        assert process.wait(timeout=10.0) == -signal.SIGKILL  # it had not ended
    assert kept.exists()
    assert not (killed / "verdict.json").exists()

    resumed = run(made, "--json", "--out", killed, "--resume")
    at_once = run(made, "--json", "--out", whole)
    assert "parameters, kept" in resumed.stderr  # the base fit was not done again
    assert "parameters, kept" not in at_once.stderr
    verdict = verdict_of(resumed)
    assert verdict == verdict_of(at_once)
    assert verdict == {
        key: value
        for key, value in json.loads((killed / "verdict.json").read_text()).items()
        if key not in COST
    }
    assert verdict["verdict"] == "named"
    assert [(cause["effect"], cause["where"]) for cause in verdict["causes"]] == [
        ("torque_bias", "elbow")
    ]
