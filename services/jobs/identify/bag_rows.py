"""Messages of a bag as rows: poses, joints and commands, at the time they are of."""

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from shared.errors import IdentificationError
from shared.identification.dataset.logs import Int64, Rows, rising
from shared.identification.dataset.types import Float64
from shared.ros.bags import Topic

ONE_CLOCK: Final = 1.0
"""A header's stamp that is further from the time of receipt is of another clock (s)."""
POSES: Final = {
    "geometry_msgs/Pose": (),
    "geometry_msgs/PoseStamped": ("pose",),
    "geometry_msgs/PoseWithCovarianceStamped": ("pose", "pose"),
    "geometry_msgs/Transform": (),
    "geometry_msgs/TransformStamped": ("transform",),
    "nav_msgs/Odometry": ("pose", "pose"),
}
"""Where in a message its pose is."""
NUMBERS: Final = ("std_msgs/Float64MultiArray", "std_msgs/Float32MultiArray")
JOINTS: Final = "sensor_msgs/JointState"


def pose_rows(topic: Topic, clock: str) -> tuple[Rows, str]:
    """Return the poses of a topic, and whose frame they are in (empty where it is not said).

    Args:
        topic: of a type of ``POSES``.
        clock: ``header`` or ``receipt``, as ``clock_of`` says.

    Raises:
        IdentificationError: it is of another type, or its frame changes.
    """
    if topic.type not in POSES:
        raise IdentificationError(
            f"topic {topic.name} is of type {topic.type}, expected a pose: {', '.join(POSES)}"
        )
    rows: list[tuple[float, ...]] = []
    frames: set[str] = set()
    for message in topic.messages:
        frames.add(message.header.frame_id.lstrip("/") if hasattr(message, "header") else "")
        found = message
        for part in POSES[topic.type]:
            found = getattr(found, part)
        is_pose = hasattr(found, "position")
        place = found.position if is_pose else found.translation
        turn = found.orientation if is_pose else found.rotation
        rows.append((place.x, place.y, place.z, turn.w, turn.x, turn.y, turn.z))
    if len(frames) > 1:
        raise IdentificationError(
            f"the poses of topic {topic.name} are in several frames ({', '.join(sorted(frames))}): "
            "write each into its own bag"
        )
    values = np.array(rows, np.float64).reshape(-1, 7)
    return rising(times_of(topic, clock), values), "".join(frames)


def joint_rows(topic: Topic, joints: Sequence[str], clock: str) -> Rows:
    """Return float64[T, 3, J], positions, velocities and efforts; NaN for what is not said.

    Messages that lack one of the joints are left out: a gripper's on the same topic.

    Raises:
        IdentificationError: it is no ``sensor_msgs/JointState``, or never has all the joints.
    """
    if topic.type != JOINTS:
        raise IdentificationError(f"topic {topic.name} is of type {topic.type}, expected {JOINTS}")
    times = times_of(topic, clock)
    kept: list[int] = []
    rows: list[Float64] = []
    for row, message in enumerate(topic.messages):
        place = {name: index for index, name in enumerate(message.name)}
        if not all(joint in place for joint in joints) or len(message.position) < len(place):
            continue
        order = [place[joint] for joint in joints]
        kept.append(row)
        rows.append(np.stack([
            values[order] if len(values) == len(place) else np.full(len(order), np.nan)
            for values in (message.position, message.velocity, message.effort)
        ]))  # fmt: skip
    if not rows:
        raise IdentificationError(
            f"no message of topic {topic.name} has all of {', '.join(joints)}; it has "
            f"{', '.join(joint_names(topic)) or 'no joints'}"
        )
    return rising(times[kept], np.stack(rows).astype(np.float64))


def joint_names(topic: Topic) -> list[str]:
    """Return all names of joints in a topic, in the order they came."""
    return list(dict.fromkeys(name for message in topic.messages for name in message.name))


def motor_rows(topic: Topic, actuators: Sequence[str], control: str, clock: str) -> Rows:
    """Return float64[C, U], commands of positions or torques.

    Args:
        topic: ``JointState`` (its positions, or its efforts for torques) or an array of numbers
            in the order of the actuators.
        actuators: their names.
        control: ``position`` or ``torque``.
        clock: ``header`` or ``receipt``.

    Raises:
        IdentificationError: it is of another type or length, or has no such numbers.
    """
    if topic.type == JOINTS:
        rows = joint_rows(topic, actuators, clock)
        values = rows.values[:, 0 if control == "position" else 2]
        if not np.isfinite(values).all():
            raise IdentificationError(
                f"the messages of topic {topic.name} have no {control} for every joint"
            )
        return Rows(rows.t_ns, values)
    if topic.type not in NUMBERS:
        raise IdentificationError(
            f"topic {topic.name} is of type {topic.type}, expected {JOINTS} or {NUMBERS[0]}"
        )
    lengths = {len(message.data) for message in topic.messages}
    if lengths != {len(actuators)}:
        raise IdentificationError(
            f"the messages of topic {topic.name} have {sorted(lengths)} numbers, expected "
            f"{len(actuators)}, one for each of {', '.join(actuators)}"
        )
    values = np.array([message.data for message in topic.messages], np.float64)
    return rising(times_of(topic, clock), values)


def times_of(topic: Topic, clock: str) -> Int64:
    """Return int64[N] (ns), the times of a topic's messages."""
    return _stamps(topic) if clock == "header" else topic.received_ns


def clock_of(topic: Topic, is_own: bool) -> tuple[str, str]:
    """Return ``header`` where the stamps of a topic are sane, else ``receipt`` and why.

    Stamps are sane that are there, rise, and, unless the topic may have a clock of its own, are
    near the times of receipt.
    """
    if not topic.messages or not hasattr(topic.messages[0], "header"):
        return "receipt", "its messages have no header"
    stamps = _stamps(topic)
    if not np.all(stamps > 0):
        return "receipt", "stamps of its headers are zero"
    if float(np.mean(np.diff(stamps) < 0)) > 0.01 or len(set(stamps.tolist())) * 2 < len(stamps):
        return "receipt", "stamps of its headers do not rise"
    apart = float(np.median(np.abs(topic.received_ns - stamps))) / 1e9
    if apart > ONE_CLOCK and not is_own:
        return "receipt", f"stamps of its headers are {apart:.3g} s from the time of receipt"
    return "header", ""


def _stamps(topic: Topic) -> Int64:
    def stamp(message: Any) -> int:
        return int(message.header.stamp.sec) * 1_000_000_000 + int(message.header.stamp.nanosec)

    return np.array([stamp(message) for message in topic.messages], np.int64)
