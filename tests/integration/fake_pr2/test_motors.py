"""Run stops, halts and resets of the fake, in the order in which the robot tells of them."""

import numpy as np
import pytest

from shared.testing.fake_pr2.config import FakePr2Config
from shared.testing.fake_pr2.power import ENABLED, STANDBY
from tests.integration.fake_pr2.bench import CART, Bench


def test_a_halt_is_told_late_and_the_old_value_comes_first():
    bench = Bench()
    bench.run(1.4)
    bench.heard.halted.clear()
    bench.robot.halt_motors()
    bench.run(1.0)
    (first, was), (second, is_now) = bench.heard.halted
    assert (was, is_now) == (False, True)
    assert first <= 1401
    assert second == 2000  # with the next of one a second
    assert bench.heard.faults[-1][1] == "service request"


def test_the_run_stop_takes_the_power_and_the_arm_goes_limp():
    bench = Bench()
    bench.command(0.0, 0.0, 0.2)
    bench.run(0.3)
    bench.robot.power.is_pressed = True
    bench.run(0.2)
    assert (bench.heard.joints[-1][1].efforts == 0.0).all()
    state = bench.heard.power[-1][1]
    assert not state.run_stop
    assert state.wireless_stop
    assert state.circuits == (STANDBY,) * 3
    moving = np.abs(bench.heard.joints[-1][1].velocities).max()
    bench.run(3.0)
    assert np.abs(bench.heard.joints[-1][1].velocities).max() < 0.5 * moving  # it only coasts
    assert bench.cart.is_running  # the controller does not know
    assert bench.state.x_desi[2] == pytest.approx(bench.home[2] + 0.2)  # and wants what it wanted


def test_two_seconds_after_the_release_the_controllers_start_anew_where_the_arm_is():
    bench = Bench()
    bench.command(0.0, 0.0, 0.05)
    bench.run(0.1)
    bench.robot.power.is_pressed = True
    bench.run(1.0)
    bench.robot.power.is_pressed = False
    bench.run(1.95)
    assert bench.robot.power.is_halted
    while bench.robot.power.is_halted:
        bench.run(0.001)
    assert 3180 <= bench.heard.cycle <= 3290
    assert bench.heard.power[-1][1].circuits == (ENABLED,) * 3
    at = bench.pose
    bench.run(0.02)
    assert np.allclose(bench.state.x_desi, at, atol=0.001)  # what it held before is forgotten
    bench.run(1.0)
    assert np.linalg.norm(bench.pose[:3] - at[:3]) < 0.005
    assert bench.heard.halted[-1][1] is False


def test_a_stream_that_goes_on_moves_the_arm_again_by_itself():
    # The hazard that robot_io's latch is for.
    bench = Bench()
    bench.robot.power.is_pressed = True
    bench.run(0.5)
    bench.robot.power.is_pressed = False
    for _ in range(300):
        bench.command(0.0, 0.0, 0.1)
        bench.run(0.01)
    assert bench.moved() > 0.08


def test_the_wireless_stop_hides_the_run_stop_and_also_resets_by_itself():
    bench = Bench()
    bench.robot.power.is_wireless_pressed = True
    bench.run(0.2)
    state = bench.heard.power[-1][1]
    assert (state.run_stop, state.wireless_stop) == (False, False)
    assert bench.robot.power.is_halted
    bench.robot.power.is_wireless_pressed = False
    bench.run(2.5)
    assert not bench.robot.power.is_halted


def test_without_the_restarting_node_only_a_person_brings_the_motors_back():
    bench = Bench(FakePr2Config(auto_restart=False))
    bench.robot.power.is_pressed = True
    bench.run(0.2)
    bench.robot.power.is_pressed = False
    bench.run(3.0)
    assert bench.robot.power.is_halted
    bench.robot.reset_motors()
    bench.run(0.5)
    assert bench.robot.power.is_halted  # the circuits have no power yet
    for circuit in range(3):
        assert bench.robot.power.start_circuit(circuit, bench.robot.mechanism.now)
    bench.run(0.5)
    bench.robot.reset_motors()
    bench.run(0.2)
    assert not bench.robot.power.is_halted


def test_pressed_again_within_the_two_seconds_nothing_comes_back():
    bench = Bench()
    bench.robot.power.is_pressed = True
    bench.run(0.5)
    bench.robot.power.is_pressed = False
    bench.run(1.0)
    bench.robot.power.is_pressed = True
    bench.run(1.5)
    assert bench.robot.power.is_halted
    assert not bench.robot.power.start_circuit(1, bench.robot.mechanism.now)


def test_everything_is_said_as_often_as_the_robot_says_it():
    bench = Bench()
    bench.run(3.0)
    heard = bench.heard
    assert len(heard.states[CART]) == 300
    assert len(heard.joints) == 300
    assert len(heard.power) == 30
    assert len(heard.halted) == 3
    assert len(heard.faults) == 3
    assert heard.running[-1][1] == {
        "r_arm_controller": False,
        "l_arm_controller": True,
        "r_gripper_controller": True,
        "head_traj_controller": True,
        CART: True,
    }


def test_the_controller_a_robot_starts_with_holds_the_arm_stiffly():
    bench = Bench()
    assert bench.robot.switch(("r_arm_controller",), (CART,))
    bench.robot.mechanism.arm.push(np.array([0.0, 0.0, -10.0]))
    bench.run(1.5)
    assert bench.moved() < 0.01
