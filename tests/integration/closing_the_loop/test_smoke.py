"""Every stage of the study, as small as can be: real twin, gate, recorder, finder and training."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

from shared.identification.dataset.reading import read_dataset
from shared.sim.parameters import load_parameters
from studies.closing_the_loop.protocol import CONDITIONS, SMOKE, Folders

ROOT = Path(__file__).resolve().parents[3]


def study(folder: Path, *words: str) -> "subprocess.CompletedProcess[str]":
    return subprocess.run(
        [sys.executable, "-m", "studies.closing_the_loop", "--smoke", "--out", str(folder), *words],
        cwd=ROOT, capture_output=True, text=True, timeout=3000, check=False,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(3600)
def test_the_loop_is_closed_from_the_hidden_effect_to_the_table(tmp_path: Path):
    done = study(tmp_path)
    assert done.returncode == 0, done.stderr[-4000:]
    folders = Folders(tmp_path)
    dataset = read_dataset(folders.dataset)
    assert [each.name for each in dataset.trajectories] == list(SMOKE.only)
    hidden = load_parameters(folders.truth)
    assert hidden.command.delay == SMOKE.delay
    verdict = json.loads((folders.found / "verdict.json").read_text())
    best = verdict["candidates"][0]  # one held-out recording of 4 s is too little to name it
    assert best["effect"] == "command_latency"
    assert best["value"] == pytest.approx(SMOKE.delay, rel=0.1)
    named = bool(verdict["causes"])
    assert (load_parameters(folders.model("extended")).command.delay > 0.0) == named
    assert load_parameters(folders.model("base_fit")).command.delay == 0.0
    for condition in CONDITIONS:
        assert (folders.training(condition, 1) / "play.json").exists()
    text = (tmp_path / "results.md").read_text()
    assert "| all |" in text
    assert (tmp_path / "results.png").stat().st_size > 5_000
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("verdict.json")}
    again = study(tmp_path)
    assert again.returncode == 0
    assert "training 1 of" not in again.stderr  # nothing is done twice
    assert before == {path: path.stat().st_mtime_ns for path in tmp_path.rglob("verdict.json")}


def test_a_stage_says_which_one_comes_before_it(tmp_path: Path):
    done = study(tmp_path, "--stages", "find")
    assert done.returncode == 2
    assert done.stderr.strip().endswith("run the stage 'record' first")
