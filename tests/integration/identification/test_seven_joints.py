"""The stand-in for a seven-joint arm under torques is a data set, and has in it what it says."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.identification.dataset.reading import read_dataset
from studies.other_arms.seven_joints import JOINTS, convert


def missing(folder: Path) -> np.ndarray:
    """Return float64[T, 7]: torques of the file's arm on the logged motion without those logged."""
    dataset = read_dataset(folder)
    model = mujoco.MjModel.from_xml_path(str(folder / "model.xml"))
    data, slow = mujoco.MjData(model), dataset.trajectories[2]
    assert slow.qd is not None
    rows = []
    for q, qd, torque in zip(slow.q, slow.qd, slow.command, strict=True):
        data.qpos[:], data.qvel[:], data.qacc[:] = q, qd, 0.0  # slow: accelerations say little
        mujoco.mj_inverse(model, data)
        rows.append(data.qfrc_inverse - torque)
    return np.array(rows)


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("plain") / "set"
    convert(folder, "none", seconds=1.5, seed=4)
    return folder


def test_it_is_a_data_set_of_joints_that_move(plain: Path):
    dataset = read_dataset(plain)
    assert (dataset.control, dataset.joints) == ("torque", JOINTS)
    assert [each.split for each in dataset.trajectories].count("test") == 2
    fast = dataset.trajectories[1]
    assert fast.q.shape == fast.command.shape == (750, 7)
    assert (np.ptp(fast.q, axis=0) > 0.05).all()


def test_with_the_same_seed_only_what_is_wrong_differs(plain: Path, tmp_path: Path):
    convert(tmp_path / "bias", "bias", seconds=1.5, seed=4)
    more = (missing(tmp_path / "bias") - missing(plain)).mean(axis=0)
    at = np.argmax(np.abs(more))
    assert np.abs(more[at]) > 0.1  # N m
    assert np.abs(np.delete(more, at)).max() < 0.2 * np.abs(more[at])
