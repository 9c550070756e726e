"""What a PR2 says, from one thread, each word to be changed by a test; nothing in it moves."""

import threading
import time
from typing import Any

import numpy as np

from shared.ros import types
from shared.ros.node import Node
from shared.sim.arm import load_arm
from shared.testing.ros_master import RosMaster

PERIOD = 0.01
JOINTS = [f"r_{joint.name}_joint" for joint in load_arm("right").joints]
JT = "robot_mechanism_controllers/JTCartesianControllerState"
MANAGER = "pr2_mechanism_msgs"


class SmallRobot:
    """Publishers and services under the PR2's names."""

    def __init__(self) -> None:
        self.master = RosMaster()
        self.node = Node("/robot", self.master.uri)
        publish = self.node.publish_topic
        self._states = publish("/r_cart/state", JT, queue=5)
        self._joints = publish("/joint_states", "sensor_msgs/JointState", queue=5)
        self._boards = publish("/power_board/state", "pr2_msgs/PowerBoardState", latch=True)
        self._motors = publish("/pr2_ethercat/motors_halted", "std_msgs/Bool", latch=True)
        self._diagnostics = publish("/diagnostics", "diagnostic_msgs/DiagnosticArray", queue=5)
        self.commands = self.node.subscribe("/r_cart/command_pose", "geometry_msgs/PoseStamped",
                                            queue=1000)  # fmt: skip
        self.state = types.new(JT)
        self.state.x.header.frame_id = "torso_lift_link"
        self.state.x.pose.position.x = 0.6
        for pose in (self.state.x, self.state.x_desi, self.state.x_desi_filtered):
            pose.pose.orientation.w = 1.0
        self.joints = types.new(
            "sensor_msgs/JointState", name=["l_elbow_flex_joint", *JOINTS],
            position=np.arange(8.0), velocity=np.zeros(8), effort=np.zeros(8),
        )  # fmt: skip
        self.board = types.new("pr2_msgs/PowerBoardState", run_stop=True, wireless_stop=True)
        self.board.circuit_state[:] = 3
        self.halted = types.new("std_msgs/Bool")
        self.status = types.new("diagnostic_msgs/DiagnosticStatus", name="EtherCAT Master")
        self.offset_ns = 0
        """Of the robot's clock."""
        self.muted: set[str] = set()
        self.running = {"r_cart": True, "l_arm_controller": True, "r_arm_controller": False}
        self.switched: list[Any] = []
        """Requests to the controller manager."""
        self.delay = 0.0
        """Of its answers (s)."""
        self.is_refusing = False
        for name in self.running:
            self.node.set_param(f"/{name}", {"joints": [f"{name[0]}_elbow_flex_joint"]})
        self.node.set_param("/r_cart", expected())
        serve = self.node.serve
        manager = "/pr2_controller_manager"
        serve(f"{manager}/list_controllers", f"{MANAGER}/ListControllers", self._list)
        serve(f"{manager}/switch_controller", f"{MANAGER}/SwitchController", self._switch)
        self.node.wait_registered(5.0)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def relatch(self) -> None:
        """Do to the target what a restart does: it becomes where the arm is."""
        here = self.state.x.pose.position
        self.state.x_desi.pose.position = type(here)(x=here.x + 1e-3, y=here.y, z=here.z)

    def close(self) -> None:
        self._stop.set()
        self._thread.join()
        self.node.close()
        self.master.close()

    def _list(self, _: Any) -> Any:
        time.sleep(self.delay)
        if self.is_refusing:
            raise RuntimeError("the manager is out of order")
        return types.new(
            f"{MANAGER}/ListControllersResponse", controllers=list(self.running),
            state=["running" if runs else "stopped" for runs in self.running.values()],
        )  # fmt: skip

    def _switch(self, request: Any) -> Any:
        self.switched.append(request)
        self.relatch()
        return types.new(f"{MANAGER}/SwitchControllerResponse", ok=True)

    def _run(self) -> None:
        due, count = time.monotonic(), 0
        while not self._stop.is_set():
            self._say(count)
            count += 1
            due = max(due + PERIOD, time.monotonic() - PERIOD)
            time.sleep(max(due - time.monotonic(), 0.0))

    def _say(self, count: int) -> None:
        stamp = types.stamp_of(time.time_ns() + self.offset_ns)
        self.state.header.stamp = self.joints.header.stamp = stamp
        for name, every, publisher, message in (
            ("state", 1, self._states, self.state),
            ("joints", 1, self._joints, self.joints),
            ("board", 10, self._boards, self.board),
            ("motors", 100, self._motors, self.halted),
            ("diagnostics", 20, self._diagnostics,
             types.new("diagnostic_msgs/DiagnosticArray", status=[self.status])),
        ):  # fmt: skip
            if count % every == 0 and name not in self.muted:
                publisher.publish(message)


def expected() -> dict[str, Any]:
    """Parameters of a controller that was set up well."""
    return {
        "cart_gains": {"trans": {"p": 800.0, "d": 15.0}, "rot": {"p": 80.0, "d": 1.2}},
        "pose_command_filter": 0.01, "vel_saturation_trans": 1.0, "vel_saturation_rot": 4.0,
        "root_name": "torso_lift_link", "tip_name": "r_gripper_tool_frame",
        "saturation": dict.fromkeys(JOINTS, 5.0),
    }  # fmt: skip
