"""Logs of an SO-101 become recordings of five joints that are told positions."""

import json
from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.real_data.so101 import JOINTS, TEST, TRAIN, convert


def log(path: Path, kind: str, at: np.ndarray, q: np.ndarray) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    rows = [f'{kind},{1e6 * t},"{json.dumps(list(row))}"' for t, row in zip(at, q, strict=True)]
    path.write_text("\n".join(["type,timestamp,positions", *rows]) + "\n", encoding="utf-8")


def logs(folder: Path) -> None:
    at = 0.02 * np.arange(300)
    for number, name in enumerate((*TRAIN, *TEST)):
        told = (0.1 + 0.05 * number) * np.sin(np.outer(at, np.arange(1, 7)))
        log(folder / name / "control.csv", "CONTROL", at, told)
        log(folder / name / "state_motor.csv", "STATE_MOTOR", at + 0.004, 0.9 * told)


def test_each_motion_becomes_a_recording_of_the_joints_but_the_jaw(tmp_path: Path):
    logs(tmp_path / "raw")
    convert(tmp_path / "set", tmp_path / "raw", seconds=4.0)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train"] * len(TRAIN) + ["test"] * len(
        TEST
    )
    first = dataset.trajectories[0]
    assert first.duration == pytest.approx(4.0, abs=0.021)
    assert first.q.shape[1] == first.command.shape[1] == len(JOINTS)
    assert first.joints_at[0] == pytest.approx(0.004)  # after the first command
    assert subject_of(dataset).joints == JOINTS


def test_the_arm_is_as_heavy_and_as_long_as_its_maker_says(tmp_path: Path):
    logs(tmp_path / "raw")
    convert(tmp_path / "set", tmp_path / "raw", seconds=4.0)
    model = mujoco.MjModel.from_xml_path(str(tmp_path / "set" / "model.xml"))
    assert model.body_mass.sum() == pytest.approx(0.485, abs=1e-3)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    upper, lower, wrist = (data.body(name).xpos for name in ("upper_arm", "lower_arm", "wrist"))
    assert np.linalg.norm(lower - upper) == pytest.approx(0.116, abs=1e-3)
    assert np.linalg.norm(wrist - lower) == pytest.approx(0.135, abs=1e-3)


def test_a_log_that_is_not_there_is_said_to_be_missing(tmp_path: Path):
    with pytest.raises(IdentificationError, match=r"has no control\.csv"):
        convert(tmp_path / "set", tmp_path)
