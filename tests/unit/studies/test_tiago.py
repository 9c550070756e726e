"""A robot's URDF and log become a data set of its arm alone."""

from pathlib import Path

import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from studies.real_data.tiago import FILES, JOINTS, convert

_LINK = """<link name="{0}"><inertial><mass value="{1}"/><origin xyz="0.1 0 0"/>
<inertia ixx="0.01" ixy="0" ixz="0" iyy="0.01" iyz="0" izz="0.01"/></inertial></link>"""
_JOINT = """<joint name="{0}" type="{1}"><parent link="{2}"/><child link="{3}"/>
<origin xyz="0 0 0.2"/><axis xyz="0 1 0"/><dynamics damping="1" friction="1"/></joint>"""


def _raw(folder: Path) -> np.ndarray:
    """Write a robot with a wheel, an arm of seven links of 1 kg, and a finger of half of that."""
    arm = [f"arm_{number}_link" for number in range(1, 8)]
    links = [_LINK.format(name, 1.0) for name in ("base", "wheel", "torso", *arm)]
    links.append(_LINK.format("finger", 0.5))
    joints = [
        _JOINT.format("wheel_joint", "continuous", "base", "wheel"),
        _JOINT.format("torso_joint", "prismatic", "base", "torso"),
        _JOINT.format("finger_joint", "revolute", arm[-1], "finger"),
        *(
            _JOINT.format(joint, "revolute", above, link)
            for joint, above, link in zip(JOINTS, ("torso", *arm), arm, strict=False)
        ),
    ]
    (folder / "urdf").mkdir()
    text = f'<robot name="all">{"".join((*links, *joints))}</robot>'
    (folder / "urdf" / "tiago_48_hey5.urdf").write_text(text)
    at = 0.01 * np.arange(8000)
    swing = np.sin(at[:, None] * np.linspace(0.5, 1.0, 8))
    table = np.concatenate([at[:, None], swing], axis=1)
    for name in FILES:
        np.savetxt(folder / name, table, delimiter=",", header="t,torso,and,so,on")
    return table


def test_the_arm_is_taken_with_what_hangs_on_it_and_efforts_become_torques(tmp_path: Path):
    table = _raw(tmp_path)
    convert(tmp_path / "set", tmp_path)
    dataset = read_dataset(tmp_path / "set")
    assert [each.split for each in dataset.trajectories] == ["train", "train", "test"] * 2
    one = dataset.trajectories[0]
    assert one.q[0] == pytest.approx(table[921, 2:], abs=1e-6)
    assert one.command[0, [0, 2, 6]] == pytest.approx([13.6, -8.7, -20.6] * table[921, [2, 4, 8]])
    subject = subject_of(dataset)
    model = subject.nominal.model
    assert subject.joints == JOINTS
    assert model.nv == len(JOINTS)
    assert model.dof_frictionloss.max() == 0.0
    moved = model.body_subtreemass[model.body("arm_1_link").id]
    assert moved == pytest.approx(7.5)


def test_a_folder_without_recordings_is_told(tmp_path: Path):
    with pytest.raises(IdentificationError, match=r"has no tiago_position\.csv"):
        convert(tmp_path / "set", tmp_path)
