"""The fake's controller does what was measured on the real one (facts of the PR2's interface)."""

import math

import numpy as np
import pytest

from tests.integration.fake_pr2.bench import CART, Bench

WAVE = 0.7
"""Hz, of the sine that the lags were measured with."""


def lag_and_gain(times: list[float], values: list[float], size: float) -> tuple[float, float]:
    """How late (s) and how large a sine of that frequency is."""
    turn = 2.0 * math.pi * WAVE * np.array(times)
    basis = np.stack([np.sin(turn), np.cos(turn), np.ones_like(turn)], axis=1)
    sine, cosine, _ = np.linalg.lstsq(basis, np.array(values), rcond=None)[0]
    return math.atan2(-cosine, sine) / (2.0 * math.pi * WAVE), math.hypot(sine, cosine) / size


def test_a_sine_is_as_late_as_on_the_robot():
    bench, size = Bench(), 0.05
    for tick in range(800):
        # Commands and states each come 100 times a second, and never stay in step.
        bench.run(0.011 if tick % 10 == 0 else 0.01)
        at = 1e-3 * bench.heard.cycle
        bench.command(0.0, 0.0, size * math.sin(2.0 * math.pi * WAVE * at))
    rows = [(1e-3 * cycle, state) for cycle, state in bench.heard.states[CART] if cycle > 5144]
    times = [at for at, _ in rows]

    def measured(name: str) -> tuple[float, float]:
        values = [float(getattr(state, name)[2] - bench.home[2]) for _, state in rows]
        return lag_and_gain(times, values, size)

    lag, gain = measured("x_desi")
    assert lag == pytest.approx(0.0075, abs=0.001)
    assert gain == pytest.approx(1.0, abs=0.01)
    lag, gain = measured("x_desi_filtered")
    assert lag == pytest.approx(0.0998, abs=0.002)
    assert gain == pytest.approx(0.92, abs=0.01)
    lag, gain = measured("x")  # of this arm's damping, not of the one in the facts: 134 ms, 1.08
    assert lag == pytest.approx(0.134, abs=0.02)
    assert gain == pytest.approx(1.04, abs=0.06)


@pytest.mark.parametrize("axis", [0, 1, 2])
@pytest.mark.parametrize("far", [0.1, -5.0])
def test_a_blocked_arm_is_pushed_with_exactly_thirty_newtons(axis: int, far: float):
    bench = Bench()
    bench.robot.mechanism.arm.is_blocked = True
    offset = [0.0, 0.0, 0.0]
    offset[axis] = far
    bench.command(*offset)
    bench.run(1.5)
    assert np.linalg.norm(bench.state.force[:3]) == pytest.approx(30.0, abs=1e-9)
    assert np.linalg.norm(bench.state.force[3:]) == pytest.approx(0.0, abs=1e-9)


def test_half_the_saturation_is_half_the_force():
    bench = Bench(vel_saturation_trans=1.0)
    bench.robot.mechanism.arm.is_blocked = True
    bench.command(0.3)
    bench.run(1.5)
    assert np.linalg.norm(bench.state.force[:3]) == pytest.approx(15.0, abs=1e-9)


def test_a_blocked_wrist_is_turned_with_at_most_four_point_eight_newton_metres():
    bench = Bench()
    bench.robot.mechanism.arm.is_blocked = True
    turned = bench.home.copy()
    turned[3:] = [turned[4], -turned[3], turned[6], -turned[5]]  # half a turn about x
    half = 0.5 * (turned[3:] + bench.home[3:])
    turned[3:] = half / np.linalg.norm(half)  # a quarter
    bench.publish(turned)
    bench.run(1.5)
    assert np.linalg.norm(bench.state.force[3:]) == pytest.approx(4.8, abs=1e-9)


def test_a_step_of_thirty_centimetres_peaks_as_on_the_robot():
    peaks = []
    for offset in ((0.0, 0.3, 0.0), (0.0, -0.3, 0.0), (0.0, 0.0, 0.3), (0.0, 0.0, -0.3)):
        bench = Bench()
        bench.command(*offset)
        before, speed = bench.pose, 0.0
        for _ in range(60):
            bench.run(0.01)
            speed = max(speed, 100.0 * float(np.linalg.norm(bench.pose[:3] - before[:3])))
            before = bench.pose
        force = max(np.linalg.norm(state.force[:3]) for _, state in bench.heard.states[CART])
        peaks.append((speed, float(force)))
        assert force <= 15.0 * (2.0 + speed)
    speed, force = np.median(peaks, axis=0)
    assert speed == pytest.approx(0.81, abs=0.25)  # theirs had another damping
    assert force == pytest.approx(34.5, abs=6.0)


def test_without_commands_it_holds_the_last_one_for_ever():
    bench = Bench()
    bench.command(0.0, 0.0, 0.1)
    bench.run(4.0)
    assert bench.cart.is_running
    assert bench.pose[2] - bench.home[2] == pytest.approx(0.1, abs=0.002)
    bench.robot.mechanism.arm.push(np.array([0.0, 0.0, -10.0]))
    bench.run(3.0)
    assert bench.pose[2] - bench.home[2] == pytest.approx(0.1 - 10.0 / 800.0, abs=0.003)
    assert bench.state.force[2] == pytest.approx(10.0, abs=0.5)
    bench.robot.mechanism.arm.push(np.zeros(3))
    bench.run(2.0)
    assert bench.pose[2] - bench.home[2] == pytest.approx(0.1, abs=0.002)


def test_not_a_number_is_believed_and_stays():
    bench = Bench()
    bench.command(float("nan"))
    bench.run(0.05)
    assert bench.robot.refused == 0
    joints = bench.heard.joints[-1][1]
    assert np.isnan(joints.commanded).all()
    assert (joints.efforts == 0.0).all()  # limp
    bench.command(0.0, 0.0, 0.05)
    bench.run(1.0)
    assert np.isfinite(bench.state.x_desi).all()
    assert np.isnan(bench.state.x_desi_filtered[:3]).any()
    assert bench.moved() < 0.001

    # The one way out: stop and start it.
    assert bench.robot.switch((), (CART,))
    assert bench.robot.switch((CART,), ())
    bench.run(0.1)
    assert np.isfinite(bench.state.x_desi_filtered).all()
    bench.command(0.0, 0.0, 0.05)
    bench.run(1.5)
    assert bench.pose[2] - bench.home[2] == pytest.approx(0.05, abs=0.002)


@pytest.mark.parametrize(
    "quaternion", [(math.nan, 0, 0, 0), (0, 0, 0, 0), (1.2, 0, 0, 0), (0.5, 0.5, 0.5, 0.1)]
)
def test_tf_refuses_what_is_no_rotation_and_says_nothing(quaternion: tuple[float, ...]):
    bench = Bench()
    pose = bench.home.copy()
    pose[2] += 0.1
    pose[3:] = quaternion
    bench.publish(pose)
    bench.run(0.5)
    assert bench.robot.refused == 1
    assert bench.moved() < 1e-6


def test_tf_refuses_a_frame_that_it_does_not_know():
    bench = Bench()
    bench.command(0.0, 0.0, 0.1, frame="map")
    bench.run(0.5)
    assert bench.robot.refused == 1
    assert bench.moved() < 1e-6
    bench.command(0.0, 0.0, 0.1, frame="/torso_lift_link")
    bench.run(0.5)
    assert bench.moved() > 0.05


def test_starting_it_while_it_runs_makes_it_stay_where_it_is():
    bench = Bench()
    bench.command(0.0, 0.0, 0.2)
    bench.run(0.25)
    assert bench.robot.switch((CART,), ())
    at = bench.pose
    assert np.allclose(bench.cart.state.x_desi[:3], [*bench.home[:2], bench.home[2] + 0.2])
    bench.run(0.01)
    assert np.allclose(bench.state.x_desi, at, atol=1e-9)
    assert np.allclose(bench.state.x_desi_filtered, at, atol=1e-9)
    bench.run(1.5)
    assert np.linalg.norm(bench.pose[:3] - at[:3]) < 0.002


def test_two_controllers_on_an_arm_fight():
    bench = Bench()
    bench.parameters["r_cart_too"] = dict(bench.parameters[CART])
    assert bench.load("r_cart_too")
    assert bench.robot.switch(("r_cart_too",), ())  # nobody objects
    bench.command(0.0, 0.0, 0.1)
    bench.run(3.0)
    # At 0.0375 m from home the second gives all of its 30 N, at 0.0625 the first does no more.
    assert bench.pose[2] - bench.home[2] == pytest.approx(0.061, abs=0.003)


def test_loading_twice_and_unloading_what_runs_is_refused():
    bench = Bench()
    assert not bench.load(CART)
    assert not bench.load("nobody")
    assert not bench.robot.mechanism.unload(CART)
    assert bench.robot.switch((), (CART,))
    assert bench.robot.mechanism.unload(CART)
    assert not bench.robot.mechanism.unload(CART)


def test_a_strict_switch_with_an_unknown_name_changes_nothing():
    bench = Bench()
    assert not bench.robot.switch(("nobody",), (CART,), 2)
    assert bench.cart.is_running
    assert bench.robot.switch(("nobody",), (CART,), 1)
    assert not bench.cart.is_running


def test_what_the_launch_file_calls_a_limit_is_none_but_saturation_is():
    plain = Bench()
    limited = Bench(saturation={"r_shoulder_lift_joint": 2.0})
    for bench in (plain, limited):
        bench.command(0.0, 0.0, -0.3)
        bench.run(0.5)
    most = [
        max(abs(joints.commanded[1]) for _, joints in bench.heard.joints)
        for bench in (plain, limited)
    ]
    assert most[0] > 4.0
    assert most[1] <= 2.0 + 1e-9


def test_a_posture_moves_the_elbow_and_not_the_tool():
    bench = Bench()
    wanted = np.full(7, 9999.0)
    wanted[2] = bench.robot.mechanism.arm.q[2] + 0.5
    bench.cart.command_posture(wanted)
    before = bench.robot.mechanism.arm.q.copy()
    bench.run(2.0)
    assert bench.robot.mechanism.arm.q[2] - before[2] > 0.02
    assert bench.moved() < 0.02
    bench.cart.command_posture(np.zeros(3))  # of no size that counts
    bench.cart.command_posture(np.zeros(0))
    bench.run(0.02)
    assert (bench.state.tau_posture == 0.0).all()


def test_joints_are_braked_before_their_limits_whatever_is_asked():
    bench = Bench()
    bench.command(-0.5, 0.3, -0.5)
    bench.run(3.0)
    arm = bench.robot.mechanism.arm
    for joint, position in zip(arm.arm.joints, arm.q, strict=True):
        if joint.range is not None:
            assert joint.range[0] - 0.02 <= position <= joint.range[1] + 0.02
    for _, joints in bench.heard.joints:
        limits = [joint.velocity_limit for joint in arm.arm.joints]
        assert (np.abs(joints.velocities) <= 1.1 * np.array(limits)).all()
