"""A pendubot's log becomes recordings of two joints, of which one is driven."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.real_data.pendubot import DRIVEN, FILE, JOINTS, convert


def test_every_third_part_is_held_out_and_the_current_is_a_torque_of_the_shoulder(tmp_path: Path):
    at = 0.005 * np.arange(2000)
    q = np.stack([np.sin(at) - 1.57, 0.5 * np.sin(2.0 * at)], axis=1)
    current = 4.0 * np.sin(at)
    table = np.column_stack([1.6e9 + at, q, np.zeros_like(q), current])
    np.savetxt(tmp_path / FILE, table, delimiter=",")
    convert(tmp_path / "set", tmp_path, seconds=9.0, parts=6)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train", "train", "test"] * 2
    assert dataset.actuators == DRIVEN
    second = dataset.trajectories[1]
    assert second.q[0] == pytest.approx(q[300], abs=1e-6)
    assert second.command[0] == pytest.approx([-0.123 * current[300]], abs=1e-6)
    subject = subject_of(dataset)
    assert subject.joints == JOINTS
    model = subject.nominal.model
    assert model.body_mass.sum() == pytest.approx(1.345)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    held = [1.0953 + 0.2433, 0.2433]  # straight out, by the equations of its authors (get_n.m)
    assert data.qfrc_bias == pytest.approx(held, abs=1e-3)


def test_a_log_that_is_not_there_is_said_to_be_missing(tmp_path: Path):
    with pytest.raises(IdentificationError, match=r"has no data_06\.csv"):
        convert(tmp_path / "set", tmp_path)
