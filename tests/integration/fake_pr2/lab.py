"""A fake PR2 on its master, and somebody else's node beside it.

Where a test does not look at the wall's time, the robot's is moved by the test, much faster.
"""

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from shared.clock import ManualClock
from shared.ros import types
from shared.ros.node import Node
from shared.ros.subscribing import Subscription
from shared.sim.arm import Float64
from shared.testing.fake_pr2.config import FakePr2Config
from shared.testing.fake_pr2.fake import FakePr2
from shared.testing.ros_master import has_ros_master

needs_ros = pytest.mark.skipif(
    not has_ros_master(), reason="needs Debian's ROS master: apt install python3-rosmaster"
)

TYPES = {
    "/joint_states": "sensor_msgs/JointState",
    "/r_cart/state": "robot_mechanism_controllers/JTCartesianControllerState",
    "/r_cart/state/x_desi": "geometry_msgs/PoseStamped",
    "/power_board/state": "pr2_msgs/PowerBoardState",
    "/pr2_ethercat/motors_halted": "std_msgs/Bool",
    "/diagnostics": "diagnostic_msgs/DiagnosticArray",
    "/mechanism_statistics": "pr2_mechanism_msgs/MechanismStatistics",
}


class Lab:
    """A robot with ``r_cart`` alone on its arm, and a node that knows nothing but ROS."""

    def __init__(self, cfg: FakePr2Config | None = None, *, is_live: bool = False) -> None:
        self._clock = None if is_live else ManualClock(100.0)
        self.fake = FakePr2(cfg, self._clock, is_driven=not is_live)
        self.node = Node("/somebody", self.fake.master_uri)
        self.subscriptions: dict[str, Subscription] = {}
        self._pose = self.node.publish_topic("/r_cart/command_pose", TYPES["/r_cart/state/x_desi"])

    def start_cart(self) -> None:
        assert self.manager("load_controller", "LoadController", name="r_cart").ok
        assert self.switch(["r_cart"], ["r_arm_controller"])
        self.until(lambda: bool(self._pose.subscribers))

    def manager(self, service: str, type_name: str, **fields: Any) -> Any:
        return self.call(f"/pr2_controller_manager/{service}", f"pr2_mechanism_msgs/{type_name}",
                         **fields)  # fmt: skip

    def call(self, service: str, type_name: str, **fields: Any) -> Any:
        return self.node.call(service, type_name, types.new(f"{type_name}Request", **fields), 5.0)

    def switch(self, start: list[str], stop: list[str], strictness: int = 2) -> bool:
        answer = self.manager(
            "switch_controller", "SwitchController",
            start_controllers=start, stop_controllers=stop, strictness=strictness,
        )  # fmt: skip
        return bool(answer.ok)

    def listen(self, *topics: str) -> None:
        for topic in topics:
            self.subscriptions[topic] = self.node.subscribe(topic, TYPES[topic], queue=2000)
        self.until(lambda: all(found.received for found in self.subscriptions.values()))

    def heard(self, topic: str) -> list[Any]:
        """Take all that has come, oldest first."""
        out = []
        while (received := self.subscriptions[topic].take()) is not None:
            out.append(received)
        return out

    def publish(self, pose: Float64, frame: str = "torso_lift_link") -> None:
        x, y, z, *turn = (float(number) for number in pose)
        message = types.new("geometry_msgs/PoseStamped")
        message.header.frame_id = frame
        place, rotation = message.pose.position, message.pose.orientation
        place.x, place.y, place.z = x, y, z
        rotation.w, rotation.x, rotation.y, rotation.z = turn
        self._pose.publish(message)

    def until(self, condition: Callable[[], bool], seconds: float = 60.0) -> None:
        deadline = time.monotonic() + seconds
        while not condition():
            assert time.monotonic() < deadline, "not in time"
            self._pass()

    def rest(self, seconds: float) -> None:
        """Let so much of the robot's time pass."""
        if self._clock is not None:
            for _ in range(round(100 * seconds)):
                self._pass()
            self.settle()
            return
        count = len(self.fake.moments()) + round(100 * seconds)
        self.until(lambda: len(self.fake.moments()) >= count, 10.0 + 5.0 * seconds)

    def settle(self) -> None:
        """Wait until what was said has come: of a robot whose time stands still, or is frozen."""
        counts: list[int] = []
        deadline = time.monotonic() + 10.0
        while len(counts) < 3 or len(set(counts[-3:])) > 1:
            assert time.monotonic() < deadline, "it goes on saying something"
            time.sleep(0.03)
            counts.append(sum(found.received for found in self.subscriptions.values()))

    def _pass(self) -> None:
        if self._clock is None:
            time.sleep(0.005)
            return
        self._clock.advance(0.01)
        self.fake.catch_up()
        time.sleep(0.0005)

    def close(self) -> None:
        self.node.close()
        self.fake.close()


def off(pose: Float64, *offset: float) -> Float64:
    """A pose that is so far from another."""
    out = pose.copy()
    out[: len(offset)] += np.array(offset)
    return out
