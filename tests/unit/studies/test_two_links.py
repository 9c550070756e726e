"""Two links' logs become recordings of a shoulder and of an elbow between them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.real_data.two_links import FILES, JOINTS, convert


def test_what_turns_the_outer_link_against_the_stand_turns_both_joints(tmp_path: Path):
    at = 0.01 * np.arange(1500)
    upper, fore = np.sin(at) - 1.57, 0.5 * np.sin(2.0 * at) - 1.2
    first, second = 400.0 * np.sin(at), 60.0 * np.cos(at)
    still = np.zeros_like(at)
    for name in FILES:
        np.savetxt(tmp_path / name, np.column_stack([at, upper, still, fore, still, first, second]))
    convert(tmp_path / "set", tmp_path)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train", "train", "test"] * 2
    assert [each.name for each in dataset.trajectories][::3] == ["norm_part_1", "fast_part_1"]
    begun = dataset.trajectories[0]
    assert begun.q[0] == pytest.approx([upper[1130], fore[1130] - upper[1130]], abs=1e-6)
    turned = np.array([first[1130] + second[1130], second[1130]]) / 400.0
    assert begun.command[0] == pytest.approx(turned, abs=1e-6)
    subject = subject_of(dataset)
    assert subject.joints == JOINTS
    model = subject.nominal.model
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    fore_alone = 9.81 * 0.19 * 0.1
    whole = 9.81 * (0.91 * 0.144 + 0.19 * 0.327) + fore_alone
    assert data.qfrc_bias == pytest.approx([whole, fore_alone], rel=1e-6)


def test_a_log_that_is_not_there_is_said_to_be_missing(tmp_path: Path):
    with pytest.raises(IdentificationError, match=r"has no two_link_observer_05_norm\.csv"):
        convert(tmp_path / "set", tmp_path)
