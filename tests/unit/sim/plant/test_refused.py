"""MJCF files that are no arm as it was logged, and what is said of them."""

from collections.abc import Sequence
from pathlib import Path

import pytest

from shared.errors import IdentificationError
from shared.sim.plant.plant import Control, mjcf
from tests.arms import JOINTS, write_arm

_TABLE = '<body name="table" pos="1 0 0"><freejoint name="loose"/><geom size="0.1"/></body>'


def _refusal(path: Path, joints: Sequence[str], control: Control = "position") -> str:
    with pytest.raises(IdentificationError) as caught:
        mjcf(path, control, tuple(joints), tuple(joints), "tool")
    return str(caught.value)


def test_a_joint_that_was_not_logged_is_named_with_its_column(tmp_path: Path) -> None:
    said = _refusal(write_arm(tmp_path), JOINTS[:1])
    assert "joints of which the log has no column (q_lift, q_elbow): log every joint" in said


def test_a_joint_that_the_model_has_not_is_named_with_those_that_it_has(tmp_path: Path) -> None:
    said = _refusal(write_arm(tmp_path), (*JOINTS, "wrist"))
    assert "has no joint 'wrist', which the log has; it has: pan, lift, elbow" in said


def test_what_is_loose_is_to_be_taken_out_and_not_to_be_logged(tmp_path: Path) -> None:
    path = write_arm(tmp_path)
    path.write_text(path.read_text().replace("<worldbody>", f"<worldbody>{_TABLE}"))
    said = _refusal(path, JOINTS)
    assert "joint 'loose' is no hinge or slide" in said
    assert "take it out of the MJCF" in said


def test_a_servo_among_motors_is_named_where_commands_are_torques(tmp_path: Path) -> None:
    path = write_arm(tmp_path, "torque")
    text = path.read_text()
    motor = text[text.index("<motor") :].split(">")[0]
    assert JOINTS[0] in motor
    path.write_text(text.replace(motor, motor.replace("<motor", '<position kp="100"')))
    said = _refusal(path, JOINTS, "torque")
    assert f"servos ({JOINTS[0]}), which are told no torque: give these joints motors" in said
