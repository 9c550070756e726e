"""What `riposte train` refuses: one line on stderr, exit code 2, and nothing started."""

import contextlib
import os
import socket
from collections.abc import Iterator
from pathlib import Path

import pytest

from services import cli
from services.jobs.settings import Settings
from services.league.ledger import Ledger
from shared.runtime.files import RunLock
from shared.runtime.logging import configure_logging
from tests.integration.training.training import one_line


@pytest.fixture(autouse=True)
def _own_log() -> Iterator[None]:
    """Leave the log as it was: a command line sets up its own."""
    yield
    configure_logging(None)


def refused(capsys: pytest.CaptureFixture[str], *words: str) -> str:
    """Return the one line with which a command line is refused."""
    assert cli.main(["train", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    return one_line(err)


@pytest.mark.parametrize(
    ("override", "expected"),
    [
        ("learner.batch_sample=640", "batch_samples"),
        ("lerner.batch_samples=640", "learner"),
        ("learner.learning_rate=-1.0", "learning_rate"),
        ("actor.num_envs=0", "num_envs"),
        ("actor.rollout_steps=33", "must divide"),
        ('actor.num_envs="many"', "num_envs"),
        ("sim.physics_timestep=0.003", "physics_timestep"),
        ("league.iterations=0", "iterations"),
        ("train.seed=-1", "seed"),
    ],
)
def test_a_wrong_value_is_named_with_what_is_right(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], override: str, expected: str
) -> None:
    folder = tmp_path / "run"
    assert expected in refused(capsys, "--out", str(folder), "--set", override)
    assert not folder.exists()


def test_a_key_that_a_site_file_misspells_is_named_with_the_nearest(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site.toml"
    site.write_text("[league]\niteration = 3\n")
    line = refused(capsys, str(site), "--out", str(tmp_path / "run"))
    assert "iteration" in line
    assert "iterations" in line
    assert "site.toml" in line


def test_a_site_file_that_is_no_toml_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site.toml"
    site.write_text("[league\n")
    assert "site.toml" in refused(capsys, str(site), "--out", str(tmp_path / "run"))


def test_a_folder_in_use_is_refused_with_the_process(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with RunLock(tmp_path):
        line = refused(capsys, "--out", str(tmp_path))
    assert f"in use by process {os.getpid()}" in line


def test_a_folder_with_a_run_needs_resume(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    Ledger(tmp_path / "league.sqlite").close()
    line = refused(capsys, "--out", str(tmp_path))
    assert "holds a run already" in line
    assert "--resume" in line


@pytest.mark.parametrize(
    ("override", "what"),
    [
        ("sim.physics_timestep=0.001", "sim"),
        ("game.bout_steps=400", "game"),
        ("action.offset_bound_m=0.01", "action"),
        ("learner.hidden_dims=[8,8]", "learner.hidden_dims"),
    ],
)
def test_a_run_does_not_go_on_in_another_game_or_with_other_networks(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], override: str, what: str
) -> None:
    Ledger(tmp_path / "league.sqlite").close()
    (tmp_path / "config.toml").write_text(Settings.load(None).to_toml())
    line = refused(capsys, "--out", str(tmp_path), "--resume", "--set", override)
    assert f"{what} cannot change when a run goes on" in line


def test_resume_needs_a_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "run"
    assert "no run to resume" in refused(capsys, "--out", str(folder), "--resume")


def test_a_port_in_use_is_refused_before_anything_starts(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with contextlib.closing(socket.create_server(("127.0.0.1", 0))) as other:
        endpoint = f"tcp/127.0.0.1:{other.getsockname()[1]}"
        line = refused(
            capsys, "--out", str(tmp_path / "run"), "--set", f'bus.listen=["{endpoint}"]'
        )
    assert f"{endpoint} is in use by another program" in line
    assert not (tmp_path / "run" / "league.sqlite").exists()


def test_a_folder_nobody_may_write_in_is_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    assert "file/run" in refused(capsys, "--out", str(tmp_path / "file" / "run"))
