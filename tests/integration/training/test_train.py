"""Whole runs of real processes: to the end, interrupted and resumed, on a full disk."""

import json
import os
import shutil
import signal
import subprocess
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.integration.disks import fill, small_disk
from tests.integration.training.training import (
    ROOT,
    SMALL,
    command,
    finish,
    log_of,
    one_line,
    processes_of,
    state_of,
    train,
    training,
    updates_of,
    wait_until,
)

pytestmark = [pytest.mark.zenoh, pytest.mark.timeout(300)]

LONGER = (*SMALL, "league.antagonist_updates=40", "train.record=false")
"""Long enough to be caught in the middle."""


@pytest.fixture
def disk(tmp_path: Path) -> Iterator[Path]:
    """Just the room that a run asks for."""
    with small_disk(tmp_path, 320) as disk:
        yield disk


@pytest.fixture
def late_recorder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What gives way to the rest of a run comes up after its schedule is done."""
    nice = tmp_path / "bin" / "nice"
    nice.parent.mkdir()
    nice.write_text(f'#!/bin/sh\nsleep 8; exec {shutil.which("nice")} "$@"\n')
    nice.chmod(0o755)
    monkeypatch.setenv("PATH", str(nice.parent), prepend=os.pathsep)


@pytest.mark.usefixtures("late_recorder")
def test_a_run_ends_with_a_report_and_leaves_no_process(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    code, out, err = train(folder, seconds=240)
    assert code == 0, err
    assert err == ""
    assert "report" in out
    names = {path.name for path in folder.iterdir()}
    assert names >= {
        "config.toml",
        "league.sqlite",
        "report.html",
        "recording.rrd",
        "summary.json",
        "snapshots",
        "learner",
        "logs",
    }
    assert "endpoint.json" not in names
    assert processes_of(folder) == []
    state = state_of(folder)
    assert state.finished
    assert not state.serial
    assert [record.updates for record in state.stages] == [3, 3]
    assert state.evaluation_done == 16
    assert state.repeated_rollouts == 0
    assert state.incidents == []
    stored = {path.stem for path in (folder / "snapshots").iterdir()}
    assert stored == {
        version.snapshot for versions in state.versions.values() for version in versions.values()
    }
    assert (folder / "recording.rrd").stat().st_size > 0
    summary = json.loads((folder / "summary.json").read_bytes())
    assert summary["repeated_rollouts"] == 0


@pytest.mark.slow
def test_an_interrupted_run_is_resumed_though_its_newest_checkpoint_is_damaged(
    tmp_path: Path,
) -> None:
    folder = tmp_path / "run"
    with training(folder, overrides=LONGER) as process:
        wait_until(lambda: updates_of(folder) >= 2, process, 200)
        second = subprocess.run(
            command(folder, "--resume"), cwd=ROOT, capture_output=True, text=True
        )
        assert (second.returncode, second.stdout) == (2, "")
        assert f"in use by process {process.pid}" in one_line(second.stderr)
        process.send_signal(signal.SIGINT)
        code, out, err = finish(process, 120)
    assert (code, err) == (130, "")
    assert out.splitlines()[-1] == (
        f"stopped; continue with: riposte train --resume --out {folder}"
    )
    assert processes_of(folder) == []
    before = state_of(folder)
    assert 2 <= before.stages[0].updates < 40
    assert not before.finished

    code, out, err = train(folder, overrides=())
    assert (code, out) == (2, "")
    assert "holds a run already" in one_line(err)
    assert "--resume" in err

    newest = max((folder / "learner" / "antagonist").glob("checkpoint-*"))
    newest.write_bytes(newest.read_bytes()[:-100])
    code, out, err = train(folder, "--resume", overrides=(), seconds=240)
    assert (code, err) == (0, "")
    after = state_of(folder)
    assert after.finished
    assert [record.updates for record in after.stages] == [40, 3]
    assert after.repeated_rollouts == 0
    assert "checkpoint_corrupt" in {incident.what for incident in after.incidents}
    assert newest.name in " ".join(incident.detail for incident in after.incidents)
    assert newest.name in (folder / "report.html").read_text()


@pytest.mark.slow
def test_a_full_disk_ends_the_run_and_costs_nothing(disk: Path) -> None:
    folder, filler = disk / "run", disk / "filler"
    with training(folder, overrides=LONGER) as process:
        wait_until(lambda: updates_of(folder) >= 2, process, 200)
        fill(filler)
        code, _, err = finish(process, 60)
    assert code == 2, err
    assert "no space left" in one_line(err)
    assert "--resume" in err
    assert processes_of(folder) == []
    filler.unlink()
    before = state_of(folder)
    acknowledged = _acknowledged(folder)
    assert acknowledged <= set(before.rollout_names)

    code, _, err = train(folder, "--resume", overrides=(), seconds=240)
    assert (code, err) == (0, "")
    after = state_of(folder)
    assert [record.updates for record in after.stages] == [40, 3]
    assert after.repeated_rollouts == 0
    assert _acknowledged(folder) <= set(after.rollout_names)


def _acknowledged(folder: Path) -> set[str]:
    return {
        event["name"]
        for event in log_of(folder, "actor-0")
        if event["event"] == "rollout_acknowledged"
    }
