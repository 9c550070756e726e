import json
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

from services import cli
from services.jobs.export import find_snapshot
from services.league.config import LeagueConfig
from services.league.events import RunStarted, VersionEntered
from services.league.ledger import Ledger
from shared.errors import ConfigError, SnapshotError
from shared.messages.training import AGENTS
from shared.policy.mlp import GaussianPolicy
from tests.unit.policy.making import snapshot


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """Return a run of three versions of each agent."""
    folder = tmp_path / "run"
    (folder / "snapshots").mkdir(parents=True)
    ledger = Ledger(folder / "league.sqlite")
    ledger.append([RunStarted(run="run", seed=1, serial=False, config=LeagueConfig())], 1)
    for number, agent in enumerate(AGENTS):
        for version in range(3):
            made = snapshot(seed=10 * number + version, agent=agent, policy_version=version)
            (folder / "snapshots" / f"{made.digest}.safetensors").write_bytes(made.payload)
            entered = VersionEntered(
                agent=agent, version=version, stage=-1, snapshot=made.digest, rollouts=(),
                metrics=None,
            )  # fmt: skip
            ledger.append([entered], 2 + version)
    ledger.close()
    return folder


@pytest.mark.parametrize("agent", AGENTS)
def test_the_newest_version_of_an_agent_is_exported(run: Path, agent: str, capsys):
    file = run / "policy.onnx"
    assert cli.main(["export", f"{run}:{agent}", "--onnx", str(file), "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    expected = snapshot(seed=10 * AGENTS.index(agent) + 2, agent=agent, policy_version=2)
    assert said["snapshot"] == expected.reference
    assert (said["agent"], said["policy_version"]) == (agent, 2)
    assert said["bytes"] == file.stat().st_size
    assert said["round_trip_error"] <= 1e-6
    obs = np.random.default_rng(0).standard_normal((9, 27)).astype(np.float32)
    (found,) = onnxruntime.InferenceSession(str(file)).run(None, {"obs": obs})
    np.testing.assert_allclose(found, GaussianPolicy(expected.weights).mean(obs), atol=1e-6)


def test_a_file_is_exported_and_what_was_written_is_said(run: Path, tmp_path: Path, capsys):
    file = next((run / "snapshots").iterdir())
    assert cli.main(["export", str(file), "--onnx", str(tmp_path / "p.onnx")]) == 0
    said = capsys.readouterr().out
    assert said.startswith(f"wrote {tmp_path / 'p.onnx'}: ")
    assert find_snapshot(str(file)).digest == file.stem


def test_what_is_no_snapshot_is_answered_in_one_line(run: Path, tmp_path: Path, capsys):
    (tmp_path / "text.safetensors").write_text("nothing of the kind")
    onnx = ["--onnx", str(tmp_path / "p.onnx")]
    for text, complaint in (
        (str(tmp_path / "none.safetensors"), "cannot be read (No such file or directory)"),
        (str(tmp_path / "text.safetensors"), "not a safetensors file, or cut short"),
        (str(run), f"is a folder; say whose policy with {run}:antagonist"),
        (f"{tmp_path}:protagonist", "holds no run (no league.sqlite)"),
        (f"{run}:referee", "cannot be read"),
    ):
        assert cli.main(["export", text, *onnx]) == 2
        said = capsys.readouterr().err
        assert complaint in said
        assert said.count("\n") == 1
    assert not (tmp_path / "p.onnx").exists()


def test_a_folder_that_is_not_there_is_named(run: Path, tmp_path: Path, capsys):
    where = tmp_path / "no" / "p.onnx"
    assert cli.main(["export", f"{run}:antagonist", "--onnx", str(where)]) == 2
    assert f"there is no folder {where.parent}; make it" in capsys.readouterr().err


def test_a_run_whose_snapshot_is_lost_or_damaged_is_refused(run: Path):
    newest = snapshot(seed=2, agent="antagonist", policy_version=2)
    path = run / "snapshots" / f"{newest.digest}.safetensors"
    path.write_bytes(path.read_bytes()[:-4])
    with pytest.raises(SnapshotError, match="is damaged"):
        find_snapshot(f"{run}:antagonist")
    path.unlink()
    with pytest.raises(SnapshotError, match="never reported here"):
        find_snapshot(f"{run}:antagonist")


def test_a_run_before_its_first_version_has_nothing_to_export(tmp_path: Path):
    Ledger(tmp_path / "league.sqlite").close()
    with pytest.raises((SnapshotError, ConfigError), match="no version of the antagonist yet"):
        find_snapshot(f"{tmp_path}:antagonist")
