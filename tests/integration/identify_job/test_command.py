"""`riposte identify` as it is typed."""

import html
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from services.cli import main
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Dataset
from shared.identification.dataset.writing import write_dataset
from tests.integration.identify_job.arms import pendulum_dataset


def dataset_at(folder: Path) -> Path:
    """Write a data set that can be read; nobody has simulated it."""
    made: Dataset = pendulum_dataset(folder)
    moved = tuple(
        replace(each, q=each.q + 0.1 * number * np.sin(3.0 * each.joints_at)[:, None])
        for number, each in enumerate(made.trajectories)
    )
    write_dataset(replace(made, trajectories=moved), folder / "friday", {})
    return folder / "friday"


def complaint(capsys: pytest.CaptureFixture[str], *words: object) -> str:
    """Return the one line that a command line gets for an answer."""
    assert main(["identify", *map(str, words)]) == 2
    said = capsys.readouterr()
    assert not said.out
    lines = [line for line in said.err.splitlines() if line.startswith("riposte: ")]
    assert len(lines) == 1
    return lines[0]


def test_a_folder_that_is_no_data_set_gets_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "dataset.toml" in complaint(capsys, tmp_path / "nothing")
    assert not (tmp_path / "identify-nothing").exists()


def test_a_model_that_does_not_fit_leaves_no_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = dataset_at(tmp_path)
    other = tmp_path / "other.xml"
    other.write_text(
        "<mujoco><worldbody><body><joint name='waist'/><geom size='1'/></body></worldbody></mujoco>"
    )
    assert "has no joint 'shoulder'" in complaint(capsys, folder, "--model", other)
    assert not (tmp_path / "identify-friday").exists()


def test_bad_options_get_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = dataset_at(tmp_path)
    assert "--seed is -1" in complaint(capsys, folder, "--seed", -1)
    assert "--threads is 0" in complaint(capsys, folder, "--threads", 0)
    assert "is the data set itself" in complaint(capsys, folder, "--out", folder)
    assert "no such MJCF file" in complaint(capsys, folder, "--model", tmp_path / "no.xml")
    (tmp_path / "file").write_text("")
    assert "is a file" in complaint(capsys, folder, "--out", tmp_path / "file")
    gremlins = complaint(capsys, folder, "--without", "gremlins")
    assert "gremlins" in gremlins


def test_a_subcommand_is_told_from_a_folder_of_its_name(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit) as left:
        main(["identify", "import-bag", "--help"])
    assert left.value.code == 0
    assert "usage: riposte identify import-bag" in capsys.readouterr().out
    assert "dataset.toml" in complaint(capsys, "./import-bag")


def test_motion_can_be_kept_near_one_posture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "set"
    words = ["identify", "simulate", str(folder), "--arm", "arm3", "--null", "--seconds", "3"]
    assert main([*words, "--trajectories", "1+1", "--reach", "0.08"]) == 0
    capsys.readouterr()
    for each in read_dataset(folder).trajectories:
        assert np.ptp(each.q, axis=0).max() < 0.3
    assert "reach must be between 0.01 and 1, got 2" in complaint(
        capsys, "simulate", str(tmp_path / "other"), "--reach", "2"
    )


@pytest.mark.slow
@pytest.mark.timeout(600)
def test_a_hidden_effect_is_found_and_everything_is_left_behind(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["identify", "simulate", str(tmp_path / "set"), "--arm", "torque2", "--seed", "3"]
    assert main([*words, "--effect", "coulomb_friction"]) == 0
    capsys.readouterr()
    assert main(["identify", str(tmp_path / "set"), "--json"]) == 0
    said = capsys.readouterr()
    verdict = json.loads(said.out)
    out = tmp_path / "identify-set"
    assert verdict == json.loads((out / "verdict.json").read_text())
    assert {"report.html", "recording.rrd", "verdict.json"} <= {e.name for e in out.iterdir()}
    assert verdict["sentence"] in html.unescape((out / "report.html").read_text())
    assert "base fit" in said.err
