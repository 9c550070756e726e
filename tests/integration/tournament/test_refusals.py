"""Bad input of `riposte tournament` and `riposte ratings`: one clear line each."""

from pathlib import Path

import pytest

from services import cli
from tests.integration.tournament.playing import a_run
from tests.unit.policy.making import snapshot


def refusal(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    assert cli.main([str(word) for word in words]) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1, lines
    return lines[0]


def test_a_folder_without_a_run(tmp_path: Path, capsys):
    assert "holds no run" in refusal(capsys, "tournament", tmp_path)
    assert not (tmp_path / "tournament").exists()
    assert "riposte tournament RUN" in refusal(capsys, "ratings", tmp_path)


def test_a_run_without_enough_policies(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run", stages=1)
    text = refusal(capsys, "tournament", run)
    assert "no protagonist that came out of a stage yet" in text
    assert "--players" in text
    assert not (run / "tournament" / "league.sqlite").exists()


def test_a_missing_snapshot(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run")
    for path in (run / "snapshots").iterdir():
        path.unlink()
    assert "was never reported here" in refusal(capsys, "tournament", run)


def test_a_damaged_snapshot(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run")
    for path in (run / "snapshots").iterdir():
        path.write_bytes(path.read_bytes()[:-1] + b"x")
    assert "is damaged" in refusal(capsys, "tournament", run)


def test_a_foreign_snapshot(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run")
    path = tmp_path / "foreign.safetensors"
    path.write_bytes(snapshot(1, model="f" * 64).payload)
    text = refusal(capsys, "tournament", run, "--players", path)
    assert "does not fit here: its model is" in text
    path.write_bytes(b"no snapshot at all")
    assert "snapshot is unreadable" in refusal(capsys, "tournament", run, "--players", path)


def test_players_that_are_not_there(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run")
    assert "no player 'scripted:nobody'" in refusal(
        capsys, "tournament", run, "--players", "scripted:nobody"
    )
    assert "snapshot file" in refusal(capsys, "tournament", run, "--players", "nowhere")
    wrong = "sha256:" + "0" * 64
    assert "never reported here" in refusal(capsys, "tournament", run, "--players", wrong)


@pytest.mark.parametrize("option", ["--bouts", "--actors"])
def test_numbers_out_of_range(tmp_path: Path, capsys, option: str):
    run = a_run(tmp_path / "run", stages=0)
    assert f"{option} is 0; allowed are 1 to" in refusal(capsys, "tournament", run, option, 0)


def test_ratings_of_a_run_without_a_tournament(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run")
    assert "has no tournament yet" in refusal(capsys, "ratings", run)


def test_a_damaged_table(tmp_path: Path, capsys):
    path = tmp_path / "bouts.parquet"
    path.write_bytes(b"PAR1 and nothing more")
    assert "no table of bouts, or damaged" in refusal(capsys, "ratings", path)


def test_a_damaged_ledger(tmp_path: Path, capsys):
    run = a_run(tmp_path / "run")
    (run / "tournament").mkdir()
    (run / "tournament" / "league.sqlite").write_bytes(b"x" * 5000)
    assert "is damaged" in refusal(capsys, "tournament", run)
    assert "is damaged" in refusal(capsys, "ratings", run)
