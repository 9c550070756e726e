"""What a training run starts on this machine."""

import subprocess
import sys
from pathlib import Path

from services.jobs.settings import Settings
from services.jobs.train.command import LATER, processes


def test_the_recorder_alone_yields_the_cores_to_what_a_run_waits_for(tmp_path: Path):
    made = processes(Settings.load(None), tmp_path, "run", "tcp/127.0.0.1:1")
    yielding = [spec.name for spec in made if spec.argv[: len(LATER)] == LATER]
    assert yielding == ["recorder-0"]
    asked = [*LATER, sys.executable, "-c", "import os; print(os.nice(0))"]
    assert int(subprocess.run(asked, capture_output=True, check=True, timeout=60).stdout) == 5


def test_a_run_that_is_not_recorded_starts_no_recorder(tmp_path: Path):
    settings = Settings.load(None, ["train.record=false"])
    names = [spec.name for spec in processes(settings, tmp_path, "run", "tcp/127.0.0.1:1")]
    assert names == [
        "router-0", "league-0", "learner-antagonist", "learner-protagonist", "actor-0",
    ]  # fmt: skip
