"""Messages: their sums are those of the real packages, and their bytes read back."""

import numpy as np
import pytest

from shared.errors import MessageError
from shared.ros import types

JT = "robot_mechanism_controllers/JTCartesianControllerState"


@pytest.mark.parametrize(
    ("name", "md5"),
    [
        # as the generated sources of the packages have them
        (JT, "6ecdaa599ea0d27643819ae4cd4c43d0"),
        ("pr2_msgs/PowerBoardState", "08899b671e6a1a449e7ce0000da8ae7b"),
        ("pr2_mechanism_msgs/MechanismStatistics", "b4a99069393681672c01f8c823458e04"),
        ("sensor_msgs/JointState", "3066dcd76a6cfaef579bd0f34173e9fd"),
        ("geometry_msgs/PoseStamped", "d3812c3cbc69362b77dc0b19b345f8f5"),
        ("diagnostic_msgs/DiagnosticArray", "60810da900de1dd6ddd437c3503511da"),
        ("std_msgs/Bool", "8b94c1b53db61fb6aed406028ad6332a"),
    ],
)
def test_message_sums_are_those_of_the_real_packages(name: str, md5: str) -> None:
    assert types.md5_of(name) == md5


@pytest.mark.parametrize(
    ("name", "md5"),
    [
        ("std_srvs/Empty", "d41d8cd98f00b204e9800998ecf8427e"),
        ("std_srvs/SetBool", "09fb03525b03e7ea1fd3992bafd87e16"),
        ("std_srvs/Trigger", "937c9679a518e3a18d831e57125ea522"),
        ("pr2_mechanism_msgs/ListControllers", "39c8d39516aed5c7d76284ac06c220e5"),
        ("pr2_power_board/PowerBoardCommand", "d9e38de783aa7edc3146446518e85af2"),
        # controller_manager_msgs has these two under its own name, field for field
        ("pr2_mechanism_msgs/LoadController", "647e5c54b8d6468952d8d31f1efe96c0"),
        ("pr2_mechanism_msgs/SwitchController", "5e857dedf71d6f337975e15a1e7cfdd8"),
    ],
)
def test_service_sums_are_those_of_the_real_packages(name: str, md5: str) -> None:
    assert types.service_md5_of(name) == md5


def test_a_message_reads_back() -> None:
    message = types.new(JT, tau=np.arange(7.0))
    message.x.pose.position.x = 0.7
    message.F.force.z = -3.0
    found = types.read(JT, types.write(message))
    assert found.x.pose.position.x == 0.7
    assert found.F.force.z == -3.0
    assert found.tau.tolist() == list(range(7))


def test_fields_that_are_not_given_are_zero_or_empty() -> None:
    message = types.new("pr2_msgs/PowerBoardState")
    assert message.circuit_state.tolist() == [0, 0, 0]
    assert message.run_stop is False
    assert message.name == ""
    assert types.new("diagnostic_msgs/DiagnosticArray").status == []


def test_damaged_bytes_are_refused() -> None:
    data = types.write(types.new(JT, tau=np.zeros(7)))
    for bad in (b"", data[:-1], data + b"\0", b"\xff" * len(data)):
        with pytest.raises(MessageError, match="JTCartesianControllerState"):
            types.read(JT, bad)


def test_mistakes_of_a_caller_are_said() -> None:
    with pytest.raises(ValueError, match="no field 'speed'"):
        types.new("geometry_msgs/Twist", speed=1.0)
    with pytest.raises(ValueError, match="no message type"):
        types.new("nowhere/Nothing")
    with pytest.raises(ValueError, match="no valid"):
        types.write(types.new("std_msgs/Int8", data=1000))
    with pytest.raises(ValueError, match="no type"):
        types.service_md5_of("std_msgs/Bool")


def test_times_are_seconds_and_nanoseconds() -> None:
    stamp = types.stamp_of(1_700_000_000_250_000_000)
    assert (stamp.sec, stamp.nanosec) == (1_700_000_000, 250_000_000)
    assert types.seconds_of(stamp) == 1_700_000_000.25
