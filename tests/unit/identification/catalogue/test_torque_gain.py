import numpy as np
import pytest

from shared.identification.catalogue.torque_gain import EFFECT
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import mjcf, pr2
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from tests.arms import JOINTS, make_plant, make_subject, recorded, replay, still, write_arm

REST = (-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46)


def test_half_as_much_torque_again_is_what_half_as_much_again_would_do(tmp_path):
    subject = make_subject(make_plant(tmp_path, "torque"))
    asked = recorded((2.0, -3.0, 1.0), seconds=0.4)
    more = recorded((2.0, -4.5, 1.0), seconds=0.4)
    found = replay(subject, asked, EFFECT, "lift", [0.5])
    np.testing.assert_allclose(found.q, replay(subject, more).q, atol=1e-9)
    assert np.abs(found.q - replay(subject, asked).q).max() > 0.01


def test_the_limit_grows_with_the_torque(tmp_path):
    """30 N m asked of a drive of 20 N m: with 10 % more it gives 22, not 33."""
    subject = make_subject(make_plant(tmp_path, "torque", has_gravity=False))
    found = replay(subject, recorded((30.0, 0.0, 0.0), 0.1), EFFECT, "pan", [0.1])

    def enter(row: Row) -> None:
        row.field("jnt_actfrcrange")[row.mj_joint("pan")] = [-22.0, 22.0]

    limited = Rollouts(subject.plant, (), 1).run([(enter, recorded((30.0, 0.0, 0.0), 0.1))])[0]
    np.testing.assert_allclose(found.q, limited.q, atol=1e-9)


def test_a_stronger_servo_sags_less(tmp_path):
    """4.66 N m of weight on 200 N m/rad, less what friction holds; with 100 % more, half of it."""
    subject = make_subject(make_plant(tmp_path))
    out = recorded((0.0, 0.0, 0.0), seconds=4.0)
    plain, found = replay(subject, out), replay(subject, out, EFFECT, "lift", [1.0])
    assert found.q[-1, 1] / plain.q[-1, 1] == pytest.approx(0.5, abs=0.02)


def test_all_joints_of_a_pose_servo_stronger_is_a_stronger_servo():
    """Found as a law at each joint, made as gains of the tool's servo."""
    subject = make_subject(pr2("right", None))
    home = tool_poses(subject.plant, subject.nominal.model, np.array([REST]))[0]
    home[:3] += [0.004, -0.002, 0.003]  # so near that no torque limit is reached
    reach = recorded(home.tolist(), seconds=1.0, initial_q=REST)

    def gains(row: Row) -> None:
        row.field("actuator_gainprm")[:] *= 1.2
        row.field("actuator_biasprm")[:] *= 1.2

    def laws(row: Row) -> None:
        for joint in subject.joints:
            EFFECT.enter(row, joint, np.array([0.2]))

    rollouts = Rollouts(subject.plant, (), 3)
    servo, law, plain = rollouts.run([(gains, reach), (laws, reach), (lambda row: None, reach)])
    moved = float(np.abs(servo.q - plain.q).max())
    assert moved > 1e-3
    assert float(np.abs(servo.q - law.q).max()) < 0.05 * moved  # the law is a step late


def test_a_gain_sits_where_a_joint_moves_and_has_a_drive(tmp_path):
    subject = make_subject(make_plant(tmp_path, "torque"))
    assert EFFECT.places(subject) == JOINTS
    assert EFFECT.places(still(subject, "lift")) == ("lift",)
    path = write_arm(tmp_path, "torque")
    path.write_text(path.read_text().replace('<motor name="elbow" joint="elbow"/>', ""))
    loose = make_subject(mjcf(path, "torque", JOINTS, ("pan", "lift"), "tool"))
    assert EFFECT.places(loose) == ("pan", "lift")
    assert EFFECT.places(make_subject(pr2("left", None)))[0] == "shoulder_pan"
