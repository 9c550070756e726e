"""Numbers of messages, and the bat in the world."""

import math
from typing import Any

import numpy as np
import pytest

from services.robot_io.pr2.state import BatFrame, JointReader, cart_state
from services.robot_io.scene import torso_of
from shared.errors import MessageError
from shared.ros import types
from shared.sim.build import bat_quaternion
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.twin import Twin, command_of

FRAME = "torso_lift_link"
JT = "robot_mechanism_controllers/JTCartesianControllerState"


def message(**changed: float) -> Any:
    found = types.new(JT)
    found.x.header.frame_id = FRAME
    found.x.pose.position.x = 0.6
    found.x.pose.orientation.w = 2.0
    found.x_desi_filtered.pose.orientation.w = 1.0
    found.xd.linear.y = 0.5
    found.F.force.x, found.F.force.y = 3.0, 4.0
    found.header.stamp = types.stamp_of(2_500_000_000)
    return found


def test_a_state_is_read() -> None:
    cart = cart_state(message(), 7.0, FRAME)
    assert cart.tool.position == (0.6, 0.0, 0.0)
    assert cart.tool.orientation == (1.0, 0.0, 0.0, 0.0)
    assert (cart.at, cart.stamp, cart.force, cart.velocity[1]) == (7.0, 2.5, 5.0, 0.5)
    assert cart.is_target_finite


def test_a_state_that_is_no_state_is_refused() -> None:
    for break_it, said in (
        (lambda found: setattr(found.x.header, "frame_id", "/base_link"), "in base_link, expected"),
        (lambda found: setattr(found.x.pose.position, "z", math.nan), "not a number"),
        (lambda found: setattr(found.x.pose.orientation, "w", 0.0), "not a number"),
        (lambda found: setattr(found.xd.angular, "z", math.inf), "not a number"),
    ):
        bad = message()
        break_it(bad)
        with pytest.raises(MessageError, match=said):
            cart_state(bad, 0.0, FRAME)
    poisoned = message()
    poisoned.x_desi_filtered.pose.position.x = math.nan
    assert not cart_state(poisoned, 0.0, FRAME).is_target_finite


def joints_message(names: list[str]) -> Any:
    count = len(names)
    return types.new(
        "sensor_msgs/JointState", name=names, position=np.arange(float(count)),
        velocity=np.arange(float(count)) + 10.0, effort=np.arange(float(count)) + 20.0,
    )  # fmt: skip


def test_the_arm_is_found_among_the_joints_whatever_their_order() -> None:
    reader = JointReader(["a", "b"])
    found = reader.read(joints_message(["x", "b", "a"]), 1.0)
    assert found.positions.tolist() == [2.0, 1.0]
    assert found.velocities.tolist() == [12.0, 11.0]
    assert found.efforts.tolist() == [22.0, 21.0]
    assert reader.read(joints_message(["a", "b"]), 1.0).positions.tolist() == [0.0, 1.0]


def test_joints_that_are_missing_or_no_numbers_are_refused() -> None:
    reader = JointReader(["a", "b"])
    with pytest.raises(MessageError, match="has no b"):
        reader.read(joints_message(["a"]), 0.0)
    short = joints_message(["a", "b"])
    short.effort = np.zeros(1)
    with pytest.raises(MessageError, match="lacks"):
        reader.read(short, 0.0)
    nonsense = joints_message(["a", "b"])
    nonsense.position[0] = math.nan
    with pytest.raises(MessageError, match="not finite"):
        reader.read(nonsense, 0.0)


def test_the_bat_is_where_the_simulator_has_it() -> None:
    model = FencingModel.build(SimConfig())
    twin = Twin(model, command_of(1.0, 0.0), 15.0, person=True)
    target = twin.tools()[1]
    target[:3] += (0.03, 0.02, -0.02)
    twin.command(1, target)
    for _ in range(20):
        twin.step()
    tool, bat = twin.tools()[1], twin.bat(1)
    state = types.new(JT)
    place, turn = state.x.pose.position, state.x.pose.orientation
    place.x, place.y, place.z = (float(number) for number in tool[:3])
    turn.w, turn.x, turn.y, turn.z = (float(number) for number in tool[3:])
    # the protagonist looks along the world's x: its torso frame is not turned
    for part, numbers in ((state.xd.linear, bat[7:10]), (state.xd.angular, bat[10:])):
        part.x, part.y, part.z = (float(number) for number in numbers)
    frame = BatFrame(torso_of(model), tuple(bat_quaternion(model.parameters.bat)))
    found = frame.state(cart_state(state, 0.0, FRAME))
    assert np.linalg.norm(bat[7:10]) > 0.05
    assert np.abs(found[:3] - bat[:3]).max() < 1e-9
    assert np.abs(found[7:] - bat[7:]).max() < 1e-9
    assert abs(abs(found[3:7] @ bat[3:7]) - 1.0) < 1e-9
