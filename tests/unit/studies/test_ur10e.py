"""Rows of a UR10e's log become a data set: torques are currents by the drives' gains."""

from pathlib import Path

import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.real_data.ur10e import GAINS, JOINTS, convert

_ROWS = 400


def _logged(path: Path) -> np.ndarray:
    at = 700.0 + 0.01 * np.arange(_ROWS)
    swing = np.sin(at[:, None] * np.linspace(1.0, 2.0, 6))
    table = np.concatenate([at[:, None], 0.5 * swing, swing, 3.0 * swing, np.zeros((_ROWS, 12))], 1)
    np.savetxt(path, table, fmt="%.4f", delimiter=",")
    return table


def test_rows_are_what_was_asked_for_and_torques_what_the_drives_gave(tmp_path: Path):
    table = _logged(tmp_path / "log.csv")
    convert(tmp_path / "set", tmp_path, ["log.csv:0:250"], ["log.csv:250"])
    dataset = read_dataset(tmp_path / "set")
    train, test = dataset.trajectories
    assert (train.split, test.split) == ("train", "test")
    assert (len(train.joints_at), len(test.joints_at)) == (250, 150)
    assert test.q[0] == pytest.approx(table[250, 1:7], abs=1e-4)
    assert train.command[10] == pytest.approx(GAINS * table[10, 13:19], abs=0.01)
    subject = subject_of(dataset)
    assert subject.joints == JOINTS
    assert subject.nominal.model.dof_frictionloss.max() == 0.0


def test_a_log_that_is_not_there_is_said_to_be_missing(tmp_path: Path):
    with pytest.raises(IdentificationError, match=r"has no log\.csv"):
        convert(tmp_path / "set", tmp_path, ["log.csv"], ["log.csv:1"])
