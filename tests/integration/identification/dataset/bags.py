"""Small real bags of a PR2's arm that moves, of ROS 1 and ROS 2."""

from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_typestore

START_NS = 1_700_000_000_000_000_000
ARM = tuple(f"r_{name}_joint" for name in (
    "shoulder_pan", "shoulder_lift", "upper_arm_roll", "elbow_flex", "forearm_roll", "wrist_flex",
    "wrist_roll",
))  # fmt: skip
HALF = float(np.sqrt(0.5))
Messages = list[tuple[str, int, Any]]
"""Topic, time of receipt (ns), message."""


class Made:
    """Messages of one version of ROS."""

    def __init__(self, version: int) -> None:
        self.version = version
        self.store = get_typestore(Stores.ROS1_NOETIC if version == 1 else Stores.ROS2_HUMBLE)

    def new(self, kind: str, /, **fields: Any) -> Any:
        return self.store.types[kind](**fields)

    def header(self, t_ns: int, frame: str = "") -> Any:
        stamp = self.new("builtin_interfaces/msg/Time", sec=t_ns // 10**9, nanosec=t_ns % 10**9)
        extra = {"seq": 0} if self.version == 1 else {}
        return self.new("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **extra)

    def joints(self, t_ns: int, q: np.ndarray, qd: np.ndarray, names=ARM, efforts=True) -> Any:
        return self.new(
            "sensor_msgs/msg/JointState", header=self.header(t_ns), name=list(names),
            position=q, velocity=qd, effort=2.0 * q if efforts else np.zeros(0),
        )  # fmt: skip

    def pose(self, t_ns: int, place, turn, frame: str) -> Any:
        point = self.new("geometry_msgs/msg/Point", x=place[0], y=place[1], z=place[2])
        w, x, y, z = turn
        turned = self.new("geometry_msgs/msg/Quaternion", x=x, y=y, z=z, w=w)
        pose = self.new("geometry_msgs/msg/Pose", position=point, orientation=turned)
        return self.new("geometry_msgs/msg/PoseStamped", header=self.header(t_ns, frame), pose=pose)


def angles(seed: int, at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    speed = np.arange(1, 8) * (1.0 + 0.3 * seed)
    return 0.3 * np.sin(speed * at[:, None]), 0.3 * speed * np.cos(speed * at[:, None])


def moving(
    made: Made, seed: int, frame: str = "torso_lift_link", seconds: float = 3.0,
    stamps: bool = True, own_ns: int = 0,
) -> Messages:  # fmt: skip
    """Return a recording; messages arrive 2 ms after they were made, a gripper's among them."""
    start = START_NS + seed * 60 * 10**9
    at = np.arange(int(seconds * 100)) / 100
    q, qd = angles(seed, at)
    found: Messages = []
    for row, second in enumerate(at):
        t_ns = start + round(second * 1e9)
        stamp = t_ns if stamps else 0
        heard = t_ns + 2_000_000
        found.append(("/joint_states", heard, made.joints(stamp, q[row], qd[row])))
        grip = made.joints(stamp + 1, np.zeros(1), np.zeros(1), ("r_gripper_joint",))
        found.append(("/joint_states", heard + 1, grip))
        place = (0.6 + 0.1 * q[row, 0], 0.1 * q[row, 1], 0.0)
        found.append(("/r_cart/command_pose", heard, made.pose(stamp, place, (1, 0, 0, 0), frame)))
        seen = made.pose(t_ns - own_ns, place, (HALF, 0, 0, HALF), "lighthouse")
        found.append(("/vive", heard + 2, seen))
    return found


def write(path: Path, made: Made, messages: Messages, plugin=StoragePlugin.SQLITE3) -> Path:
    """Write a bag; ROS 1 as ``path.bag``, ROS 2 as a folder."""
    if made.version == 1:
        path = path.with_suffix(".bag")
        writer: Any = Writer1(path)
    else:
        writer = Writer2(path, version=9, storage_plugin=plugin)
    with writer:
        connections: dict[str, Any] = {}
        for topic, t_ns, message in sorted(messages, key=lambda each: each[1]):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=made.store)
            data = (
                made.store.serialize_ros1(message, kind) if made.version == 1
                else made.store.serialize_cdr(message, kind)
            )  # fmt: skip
            writer.write(connections[topic], t_ns, data)
    return path
