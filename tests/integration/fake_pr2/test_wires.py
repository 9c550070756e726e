"""The fake PR2 over real sockets: names, types, rates, latches and services."""

import math
import time
from collections.abc import Iterator

import numpy as np
import pytest

from shared.errors import RobotFault
from shared.ros import types
from shared.ros.node import Node
from shared.testing.fake_pr2.__main__ import main
from shared.testing.fake_pr2.config import FakePr2Config
from shared.testing.fake_pr2.fake import FakePr2
from tests.integration.fake_pr2.lab import TYPES, Lab, needs_ros, off

pytestmark = needs_ros


@pytest.fixture
def lab() -> Iterator[Lab]:
    lab = Lab()
    yield lab
    lab.close()


@pytest.fixture
def live() -> Iterator[Lab]:
    lab = Lab(is_live=True)
    yield lab
    lab.close()


def test_everything_is_published_as_often_as_on_the_robot(live: Lab):
    lab = live
    lab.start_cart()
    lab.listen(*TYPES)
    for topic in TYPES:
        lab.heard(topic)
    lost = lab.fake.cycles_lost
    lab.rest(1.5)
    lab.fake.freeze()
    lab.settle()
    count = {topic: len(lab.heard(topic)) for topic in TYPES}
    for topic in ("/joint_states", "/r_cart/state", "/r_cart/state/x_desi"):
        assert 140 <= count[topic] <= 180 + lab.fake.cycles_lost - lost
    assert 14 <= count["/power_board/state"] <= 18
    for topic in ("/pr2_ethercat/motors_halted", "/diagnostics", "/mechanism_statistics"):
        assert 1 <= count[topic] <= 3


def test_the_messages_say_what_the_arm_does(lab: Lab):
    lab.start_cart()
    home = lab.fake.tool()
    lab.publish(off(home, 0.0, 0.0, 0.1))
    lab.rest(2.0)
    lab.listen(*TYPES)
    lab.rest(1.2)
    joints = lab.heard("/joint_states")[-1].message
    assert len(joints.name) == 45
    # The arm's joints are not in the order of the chain.
    assert joints.name.index("r_upper_arm_roll_joint") < joints.name.index("r_shoulder_pan_joint")
    assert joints.position[joints.name.index("r_elbow_flex_joint")] < -1.0
    assert joints.position[joints.name.index("torso_lift_joint")] == pytest.approx(0.2)
    state = lab.heard("/r_cart/state")[-1].message
    assert state.header.frame_id == state.x.header.frame_id == "torso_lift_link"
    assert state.x_desi.pose.position.z == pytest.approx(home[2] + 0.1)
    assert state.x.pose.position.z == pytest.approx(home[2] + 0.1, abs=0.003)
    assert np.allclose(np.array(state.tau_pose) + state.tau_posture, state.tau)
    jacobian = np.array(state.J.data).reshape(6, 7)
    wrench = [state.F.force.x, state.F.force.y, state.F.force.z,
              state.F.torque.x, state.F.torque.y, state.F.torque.z]  # fmt: skip
    assert np.allclose(jacobian.T @ wrench, state.tau_pose, atol=1e-9)
    assert np.allclose(jacobian @ np.array(state.N.data).reshape(7, 7), 0.0, atol=0.2)
    statistics = lab.heard("/mechanism_statistics")[-1].message
    running = {found.name: found.running for found in statistics.controller_statistics}
    assert running["r_cart"]
    assert not running["r_arm_controller"]
    assert all(found.is_calibrated for found in statistics.joint_statistics)
    assert not any(found.halted for found in statistics.actuator_statistics)


def test_the_type_of_the_state_is_the_one_of_the_robot():
    # As the robot's own packages have it.
    assert types.md5_of(TYPES["/r_cart/state"]) == "6ecdaa599ea0d27643819ae4cd4c43d0"


def test_a_command_takes_its_way_and_then_the_filters(live: Lab):
    lab = live
    lab.start_cart()
    lab.listen("/r_cart/state")
    home, took = lab.fake.tool(), []
    for number in range(8):
        height = home[2] + 0.002 * (number + 1)
        began = time.monotonic()
        lab.publish(off(home, 0.0, 0.0, 0.002 * (number + 1)))
        seen: list[float] = []

        def arrived(height: float = height, seen: list[float] = seen) -> bool:
            seen += [
                found.at
                for found in lab.heard("/r_cart/state")
                if found.message.x_desi.pose.position.z == pytest.approx(height, abs=1e-9)
            ]
            return bool(seen)

        lab.until(arrived)
        took.append(seen[0] - began)
    # At best the delay alone; the next state may be 10 ms away, and a busy machine adds its own.
    assert 0.003 <= min(took) <= 0.013
    lab.rest(1.0)
    state = lab.heard("/r_cart/state")[-1].message
    assert state.x_desi_filtered.pose.position.z == pytest.approx(home[2] + 0.016, abs=1e-4)


def test_what_is_latched_comes_to_whoever_comes_late(lab: Lab):
    lab.rest(1.2)
    late = Node("/late", lab.fake.master_uri)
    lab.fake.freeze()  # nothing new is said
    try:
        halted = late.subscribe("/pr2_ethercat/motors_halted", "std_msgs/Bool")
        power = late.subscribe("/power_board/state", TYPES["/power_board/state"])
        joints = late.subscribe("/joint_states", TYPES["/joint_states"])
        lab.until(lambda: bool(halted.received and power.received))
        lab.until(lambda: bool(lab.node.publishers_of("/joint_states")))
        time.sleep(0.1)
        assert joints.received == 0
    finally:
        late.close()


def test_the_controller_manager_answers_as_the_robots(lab: Lab):
    def states() -> dict[str, str]:
        answer = lab.manager("list_controllers", "ListControllers")
        return dict(zip(answer.controllers, answer.state, strict=True))

    assert states()["r_arm_controller"] == "running"
    assert lab.manager("load_controller", "LoadController", name="r_cart").ok
    assert not lab.manager("load_controller", "LoadController", name="r_cart").ok
    assert not lab.manager("load_controller", "LoadController", name="no_parameters").ok
    assert states()["r_cart"] == "stopped"
    assert lab.switch(["r_cart"], ["r_arm_controller"])
    assert (states()["r_cart"], states()["r_arm_controller"]) == ("running", "stopped")
    assert not lab.manager("unload_controller", "UnloadController", name="r_cart").ok
    assert not lab.switch(["nobody"], [])
    assert lab.switch([], ["r_cart"])
    assert lab.manager("unload_controller", "UnloadController", name="r_cart").ok
    assert "r_cart" not in states()


def test_starting_a_running_controller_is_quick_and_makes_it_stay(lab: Lab):
    lab.start_cart()
    lab.publish(off(lab.fake.tool(), 0.0, 0.0, 0.25))
    lab.rest(0.3)
    took = []
    for _ in range(5):
        began = time.monotonic()
        assert lab.switch(["r_cart"], [])
        took.append(time.monotonic() - began)
    assert min(took) < 0.01
    at = lab.fake.tool()
    lab.rest(1.0)
    assert np.linalg.norm(lab.fake.tool()[:3] - at[:3]) < 0.005


def test_parameters_are_the_shipped_ones_and_count_when_it_is_loaded(lab: Lab):
    assert lab.node.param("/r_cart/type") == "robot_mechanism_controllers/JTCartesianController"
    assert lab.node.param("/r_cart/pose_command_filter") == 0.01
    assert lab.node.param("/r_cart/saturation") is None
    lab.node.set_param("/r_cart/vel_saturation_trans", 1.0)
    lab.start_cart()
    lab.fake.block(True)
    lab.publish(off(lab.fake.tool(), 0.3))
    lab.rest(1.5)
    lab.listen("/r_cart/state")
    force = lab.heard("/r_cart/state")[-1].message.F.force
    assert math.hypot(force.x, force.y, force.z) == pytest.approx(15.0, abs=1e-6)


def test_a_run_stop_is_seen_on_every_topic_and_the_power_comes_back(lab: Lab):
    lab.start_cart()
    lab.listen("/power_board/state", "/pr2_ethercat/motors_halted", "/diagnostics")
    lab.fake.press_run_stop()
    lab.rest(1.5)
    assert not lab.heard("/power_board/state")[-1].message.run_stop
    assert lab.heard("/pr2_ethercat/motors_halted")[-1].message.data
    fault = lab.heard("/diagnostics")[-1].message.status[0]
    assert fault.level == 2
    assert "halted" in fault.message
    lab.fake.release_run_stop()
    lab.until(lambda: not lab.fake.is_halted)
    lab.rest(1.1)
    state = lab.heard("/power_board/state")[-1].message
    assert state.run_stop
    assert list(state.circuit_state) == [3, 3, 3]
    assert not lab.heard("/pr2_ethercat/motors_halted")[-1].message.data
    assert "r_cart" in lab.fake.running()


def test_services_halt_and_reset_the_motors(lab: Lab):
    lab.call("/pr2_ethercat/halt_motors", "std_srvs/Empty")
    lab.until(lambda: lab.fake.is_halted)
    lab.call("/pr2_ethercat/reset_motors", "std_srvs/Empty")
    lab.until(lambda: not lab.fake.is_halted)
    asked = {"serial_number": 1001, "breaker_number": 1, "command": "disable"}
    assert (
        lab.call("/power_board/control", "pr2_power_board/PowerBoardCommand", **asked).retval == 0
    )
    lab.until(lambda: lab.fake.is_halted)


def test_what_is_not_published_any_more_stays_away(lab: Lab):
    lab.start_cart()
    lab.listen("/joint_states", "/r_cart/state")
    lab.fake.mute("/r_cart/state")
    lab.settle()  # what was said before may be on the wires
    lab.heard("/r_cart/state")
    lab.heard("/joint_states")
    lab.rest(0.3)
    assert len(lab.heard("/r_cart/state")) <= 1
    assert len(lab.heard("/joint_states")) > 20
    lab.fake.mute()
    lab.rest(0.2)
    assert lab.heard("/r_cart/state")


def test_by_hand_it_says_where_its_master_is(capsys: pytest.CaptureFixture[str]):
    assert main(["--port", "0", "--set-up"], ["status\n", "dance\n", "quit\n"]) == 0
    out = capsys.readouterr().out
    assert "ROS_MASTER_URI=http://127.0.0.1:" in out
    assert "motors on, running: l_arm_controller" in out
    assert "r_cart" in out
    assert "dance is not known" in out


def test_a_port_that_is_taken_is_one_line(capsys: pytest.CaptureFixture[str]):
    with FakePr2(FakePr2Config()) as fake:
        port = fake.master_uri.rpartition(":")[2]
        assert main(["--port", port], []) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    assert f"port {port} is taken" in err


@pytest.mark.parametrize("bad", [{"port": -1}, {"command_delay": float("nan")}])
def test_settings_out_of_range_are_refused(bad: dict[str, float]):
    with pytest.raises(ValueError, match="allowed are"):
        FakePr2Config(**bad)  # type: ignore[arg-type]


def test_a_robot_is_set_up_once(lab: Lab):
    lab.fake.set_up()
    assert "r_cart" in lab.fake.running()
    assert "r_arm_controller" not in lab.fake.running()
    assert lab.node.param("/r_cart/saturation/r_wrist_flex_joint") == 5.568
    with pytest.raises(RobotFault, match="loaded already"):
        lab.fake.set_up()
