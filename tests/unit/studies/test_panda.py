"""A Panda's log, one number a line, becomes recordings of which every third is held out."""

from pathlib import Path

import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.real_data.panda import FILES, JOINTS, convert


def test_every_third_part_is_held_out_and_torques_are_what_the_sensors_say(tmp_path: Path):
    at = 0.001 * np.arange(6000)
    q = 0.2 * np.sin(at[:, None] * np.linspace(1.0, 2.0, 7)) - 0.5
    for name, values in (("time", at), ("positions", q.ravel()), ("torques", 10.0 * q.ravel())):
        np.savetxt(tmp_path / FILES[name], values, fmt="%.6g")
    convert(tmp_path / "set", tmp_path, seconds=5.7, every=5, parts=6)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train", "train", "test"] * 2
    second = dataset.trajectories[1]
    assert np.diff(second.joints_at).mean() == pytest.approx(0.005)
    assert second.q[0] == pytest.approx(q[1200], abs=1e-5)
    assert second.command[0] == pytest.approx(10.0 * q[1200], abs=1e-4)
    subject = subject_of(dataset)
    assert subject.joints == JOINTS
    assert subject.nominal.model.body_mass.sum() == pytest.approx(16.06, abs=0.01)


def test_a_log_that_is_not_there_is_said_to_be_missing(tmp_path: Path):
    with pytest.raises(IdentificationError, match=r"has no exciting_traj_time\.txt"):
        convert(tmp_path / "set", tmp_path)
