import numpy as np
import pytest

from shared.sim.arm import load_arm
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import load_parameters
from shared.sim.torque_arm import TorqueArm, TorqueLimiter
from shared.sim.twin import Twin, command_of

REST = np.array([-0.9, 0.2, -1.6, -1.6, 0.5, -1.0, 1.4])
"""Well inside all soft limits (rad)."""


def arm_of() -> TorqueArm:
    return TorqueArm(SimConfig(), load_parameters("nominal"))


def test_it_stands_where_the_twin_stands():
    arm = arm_of()
    twin = Twin(FencingModel.build(SimConfig()), command_of(1.0, 0.0), 15.0, person=True)
    assert np.allclose(arm.position, twin.tools()[1, :3], atol=1e-12)
    assert np.allclose(arm.q, twin.joints()[0][1])


def test_its_jacobian_is_that_of_its_position():
    arm = arm_of()
    at, jacobian, home = arm.position.copy(), arm.jacobian.copy(), arm.q.copy()
    for joint in range(7):
        arm.q[:] = home
        arm.q[joint] += 1e-6
        arm.sense()
        assert np.allclose((arm.position - at) / 1e-6, jacobian[:3, joint], atol=1e-5)


def test_without_torque_it_stays_and_a_push_moves_it():
    arm = arm_of()
    at = arm.position.copy()
    for _ in range(100):
        arm.sense()
        arm.drive(np.zeros(7))
    assert np.allclose(arm.position, at)
    arm.push(np.array([0.0, 0.0, 20.0]))
    for _ in range(200):
        arm.sense()
        arm.drive(np.zeros(7))
    assert arm.position[2] > at[2] + 0.01
    arm.put_back()
    assert np.allclose(arm.position, at)


def test_a_blocked_arm_does_not_move_whatever_the_torque():
    arm = arm_of()
    arm.is_blocked = True
    at = arm.q.copy()
    for _ in range(50):
        arm.sense()
        arm.drive(np.full(7, 5.0))
    assert (arm.q == at).all()


def test_the_limiter_lets_through_at_rest_what_the_robots_does():
    # min(effort, k_velocity * velocity_limit): facts of the arm, fifth column.
    low, high = TorqueLimiter(load_arm("right")).limits(REST, np.zeros(7))
    assert high == pytest.approx([20.88, 20.82, 6.54, 9.9, 3.6, 10.0, 7.2])
    assert low == pytest.approx(-high)


def test_the_limiter_gives_nothing_more_at_full_speed_and_brakes_beyond_a_soft_limit():
    arm = load_arm("right")
    limiter = TorqueLimiter(arm)
    fast = np.array([joint.velocity_limit for joint in arm.joints])
    _, high = limiter.limits(REST, fast)
    assert high == pytest.approx(np.zeros(7), abs=1e-9)
    beyond = REST.copy()
    beyond[0] = arm.joints[0].range[1] + 0.01  # type: ignore[index]
    low, high = limiter.limits(beyond, np.zeros(7))
    assert high[0] == pytest.approx(-10.0)  # back it goes, whatever is asked
    assert low[0] < high[0]


def test_what_is_not_a_number_passes_the_limiter_as_on_the_robot():
    torques = np.full(7, np.nan)
    torques[3] = 100.0
    limited = TorqueLimiter(load_arm("right")).limit(torques, REST, np.zeros(7))
    assert np.isnan(limited[[0, 1, 2, 4, 5, 6]]).all()
    assert limited[3] == pytest.approx(9.9)
