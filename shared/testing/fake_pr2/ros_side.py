"""The robot's wires: what it says as ROS messages, and what it is told."""

from collections.abc import Callable, Mapping, Set
from typing import Any, Final

import numpy as np

from shared.ros import types
from shared.ros.node import Node
from shared.ros.publishing import Publication
from shared.ros.subscribing import Received, Subscription
from shared.sim.arm import Float64
from shared.testing.fake_pr2.config import ROOT
from shared.testing.fake_pr2.jt_cartesian import JtState
from shared.testing.fake_pr2.mechanism import JointStatistics
from shared.testing.fake_pr2.power import PowerState
from shared.testing.fake_pr2.robot import Joints

SERIAL: Final = 1001
"""Of the power board."""
VOLTS: Final = 18.0
COMMANDS: Final = 256
"""Remembered between two looks, to be told of; the robot's queue is 1, and the last one counts
here as there."""
HALTED: Final = 2
"""Level of a diagnostic that is an error."""

# In the order of the robot's own message, which is not that of the chain.
_ARM: Final = ("upper_arm_roll", "shoulder_pan", "shoulder_lift", "forearm_roll", "elbow_flex",
               "wrist_flex", "wrist_roll")  # fmt: skip
_GRIPPER: Final = ("joint", "l_finger_joint", "r_finger_joint", "r_finger_tip_joint",
                   "l_finger_tip_joint", "motor_screw_joint", "motor_slider_joint")  # fmt: skip
_CASTERS: Final = ("rotation", "l_wheel", "r_wheel")
ALL_JOINTS: Final = (
    *(f"{corner}_caster_{what}_joint" for corner in ("fl", "fr", "bl", "br") for what in _CASTERS),
    "torso_lift_joint", "torso_lift_motor_screw_joint",
    "head_pan_joint", "head_tilt_joint", "laser_tilt_mount_joint",
    *(f"r_{joint}_joint" for joint in _ARM), *(f"r_gripper_{joint}" for joint in _GRIPPER),
    *(f"l_{joint}_joint" for joint in _ARM), *(f"l_gripper_{joint}" for joint in _GRIPPER),
)  # fmt: skip
"""The 45 joints of ``/joint_states``."""
_PLACES: Final = {name: index for index, name in enumerate(ALL_JOINTS)}


class CartTopics:
    """The topics of one Cartesian controller."""

    def __init__(self, node: Node, name: str) -> None:
        self.state = node.publish_topic(
            f"/{name}/state", "robot_mechanism_controllers/JTCartesianControllerState", queue=10
        )
        self.desired = node.publish_topic(
            f"/{name}/state/x_desi", "geometry_msgs/PoseStamped", queue=10
        )
        self.pose: Subscription = node.subscribe(
            f"/{name}/command_pose", "geometry_msgs/PoseStamped", queue=COMMANDS
        )
        self.posture: Subscription = node.subscribe(
            f"/{name}/command_posture", "std_msgs/Float64MultiArray", queue=5
        )
        self.gains: Subscription = node.subscribe(
            f"/{name}/gains", "std_msgs/Float64MultiArray", queue=5
        )


class Wires:
    """Publishes what a robot says; an ``Outlet`` of it."""

    def __init__(self, node: Node, wall_ns: Callable[[], int], torso_lift: float) -> None:
        """Announce the topics that are there whatever runs.

        Args:
            node: the robot's.
            wall_ns: returns the wall clock at the robot's cycle, for the stamps.
            torso_lift: where the torso stands (m).
        """
        self._node = node
        self._wall_ns = wall_ns
        self._torso_lift = torso_lift
        self.carts: dict[str, CartTopics] = {}
        self.muted: Set[str] = frozenset()
        """Topics on which nothing is published, as if their node had died."""
        publish = node.publish_topic
        self._joints = publish("/joint_states", "sensor_msgs/JointState")
        self._statistics = publish(
            "/mechanism_statistics", "pr2_mechanism_msgs/MechanismStatistics"
        )
        self._halted = publish("/pr2_ethercat/motors_halted", "std_msgs/Bool", latch=True)
        self._power = publish("/power_board/state", "pr2_msgs/PowerBoardState", latch=True)
        self._diagnostics = publish("/diagnostics", "diagnostic_msgs/DiagnosticArray", queue=2)

    def add_cart(self, name: str) -> None:
        """Open the topics of a controller that was loaded; they stay."""
        if name not in self.carts:
            self.carts[name] = CartTopics(self._node, name)

    def joint_states(self, joints: Joints) -> None:
        """Publish the joints, 100 times a second."""
        positions, velocities, efforts = np.zeros((3, len(ALL_JOINTS)))
        positions[_PLACES["torso_lift_joint"]] = self._torso_lift
        at = [_PLACES[name] for name in joints.names]
        positions[at], velocities[at] = joints.positions, joints.velocities
        efforts[at] = joints.efforts
        self._say(
            self._joints,
            header=self._header(""),
            name=list(ALL_JOINTS),
            position=positions,
            velocity=velocities,
            effort=efforts,
        )

    def controller_state(self, name: str, state: JtState) -> None:
        """Publish a Cartesian controller, 100 times a second."""
        topics, head = self.carts[name], self._header(ROOT)
        self._say(topics.desired, header=head, pose=_pose(state.x_desi))
        if f"/{name}/state" in self.muted:  # the larger one is worth not making
            return
        self._say(
            topics.state,
            header=head,
            x=_stamped(head, state.x),
            x_desi=_stamped(head, state.x_desi),
            x_desi_filtered=_stamped(head, state.x_desi_filtered),
            x_err=_twist(state.x_err),
            xd=_twist(state.xd),
            xd_desi=_twist(state.xd_desi),
            F=types.new(
                "geometry_msgs/Wrench", force=_vector(state.force), torque=_vector(state.force[3:])
            ),
            tau_pose=state.tau_pose,
            tau_posture=state.tau_posture,
            tau=state.tau,
            J=_matrix(state.jacobian),
            N=_matrix(state.nullspace),
        )

    def power_board(self, state: PowerState) -> None:
        """Publish the power board, 10 times a second."""
        circuits = np.array(state.circuits, np.int8)
        self._say(
            self._power,
            header=self._header(""),
            name=f"Power board {SERIAL}",
            serial_num=SERIAL,
            input_voltage=VOLTS,
            master_state=2,
            circuit_state=circuits,
            circuit_voltage=np.where(circuits == 3, VOLTS, 0.0),
            run_stop=state.run_stop,
            wireless_stop=state.wireless_stop,
        )

    def motors_halted(self, is_halted: bool) -> None:
        """Publish whether the motors are halted."""
        self._say(self._halted, data=is_halted)

    def diagnostics(self, halted: str) -> None:
        """Publish the state of the motors, once a second."""
        status = types.new(
            "diagnostic_msgs/DiagnosticStatus",
            level=HALTED if halted else 0,
            name="EtherCAT Master",
            message=f"Motors halted ({halted})" if halted else "OK",
            hardware_id="EtherCAT Master",
        )
        self._say(self._diagnostics, header=self._header(""), status=[status])

    def statistics(
        self, joints: Joints, kept: JointStatistics, running: Mapping[str, bool], is_halted: bool
    ) -> None:  # fmt: skip
        """Publish the mechanism, once a second."""
        now = types.stamp_of(self._wall_ns())
        each = [
            types.new(
                "pr2_mechanism_msgs/JointStatistics",
                name=name,
                timestamp=now,
                position=float(joints.positions[index]),
                velocity=float(joints.velocities[index]),
                measured_effort=float(joints.efforts[index]),
                commanded_effort=float(joints.commanded[index]),
                is_calibrated=True,
                violated_limits=bool(kept.violated[index]),
                max_abs_velocity=float(kept.fastest[index]),
                max_abs_effort=float(kept.strongest[index]),
            )
            for index, name in enumerate(joints.names)
        ]
        actuators = [
            types.new(
                "pr2_mechanism_msgs/ActuatorStatistics",
                name=name.replace("_joint", "_motor"),
                timestamp=now,
                is_enabled=not is_halted,
                halted=is_halted,
            )
            for name in joints.names
        ]
        controllers = [
            types.new(
                "pr2_mechanism_msgs/ControllerStatistics", name=name, timestamp=now, running=runs
            )
            for name, runs in running.items()
        ]
        self._say(
            self._statistics,
            header=self._header(""),
            actuator_statistics=actuators,
            joint_statistics=each,
            controller_statistics=controllers,
        )

    def _header(self, frame: str) -> Any:
        stamp = types.stamp_of(self._wall_ns())
        return types.new("std_msgs/Header", stamp=stamp, frame_id=frame)

    def _say(self, topic: Publication, **fields: Any) -> None:
        if topic.topic not in self.muted:
            topic.publish(types.new(topic.type_name, **fields))


def pose_in(received: Received) -> tuple[str, Float64]:
    """Return frame and float64[7], position and quaternion (w, x, y, z), of a PoseStamped."""
    message = received.message
    place, turn = message.pose.position, message.pose.orientation
    pose = np.array([place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z], np.float64)
    return str(message.header.frame_id), pose


def _pose(numbers: Float64) -> Any:
    w, x, y, z = (float(number) for number in numbers[3:])
    return types.new(
        "geometry_msgs/Pose",
        position=types.new("geometry_msgs/Point", **_xyz(numbers)),
        orientation=types.new("geometry_msgs/Quaternion", w=w, x=x, y=y, z=z),
    )


def _stamped(head: Any, numbers: Float64) -> Any:
    return types.new("geometry_msgs/PoseStamped", header=head, pose=_pose(numbers))


def _twist(numbers: Float64) -> Any:
    return types.new("geometry_msgs/Twist", linear=_vector(numbers), angular=_vector(numbers[3:]))


def _vector(numbers: Float64) -> Any:
    return types.new("geometry_msgs/Vector3", **_xyz(numbers))


def _xyz(numbers: Float64) -> dict[str, float]:
    return dict(zip("xyz", (float(number) for number in numbers[:3]), strict=True))


def _matrix(numbers: Float64) -> Any:
    rows, columns = numbers.shape
    sizes = [
        types.new("std_msgs/MultiArrayDimension", size=rows, stride=numbers.size),
        types.new("std_msgs/MultiArrayDimension", size=columns, stride=columns),
    ]
    layout = types.new("std_msgs/MultiArrayLayout", dim=sizes)
    return types.new("std_msgs/Float64MultiArray", layout=layout, data=numbers.ravel())
