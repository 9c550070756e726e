"""`riposte identify import-bag`: ROS 1 and ROS 2 bags as a data set, a recording a bag.

Times are those of the messages' headers where these are sane, else those of receipt; which it was
is printed. The last quarter of the bags is held out unless --test names others; of a single bag,
the last quarter of its time.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from services.jobs.identify.bag_rows import (
    clock_of,
    joint_names,
    joint_rows,
    motor_rows,
    pose_rows,
)
from services.jobs.identify.from_bouts import report
from services.robot_io.poses import pose_of
from services.robot_io.vive.frames import composed
from shared.errors import IdentificationError
from shared.identification.dataset.logs import Log, Rows, data_set
from shared.identification.dataset.types import POSE, Control, Float64, ModelSource
from shared.identification.dataset.writing import write_dataset
from shared.ros.bags import Topic, read_topics, topics_of
from shared.sim.parameters import JOINT_NAMES

TORSO: Final = "torso_lift_link"
"""The frame of a PR2's data."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument(
        "bags", type=Path, nargs="+", metavar="BAG", help=".bag files, or folders of ROS 2 bags"
    )
    parser.add_argument("out", type=Path, metavar="OUT", help="the data set's new folder")
    parser.add_argument(
        "--command-topic", default="/r_cart/command_pose", metavar="TOPIC",
        help="what was commanded (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--joints-topic", default="/joint_states", metavar="TOPIC",
        help="sensor_msgs/JointState (%(default)s)",
    )  # fmt: skip
    parser.add_argument("--tracker-topic", metavar="TOPIC", help="poses of a tracker (none)")
    parser.add_argument(
        "--arm", choices=("right", "left"), default="right", help="of a PR2 (%(default)s)"
    )
    parser.add_argument(
        "--model", type=Path, metavar="M",
        help="a PR2's model.toml, or the MJCF file of another robot (the nominal PR2)",
    )  # fmt: skip
    parser.add_argument(
        "--tracked", default="", metavar="NAME", help="site or body of an MJCF that is tracked"
    )
    parser.add_argument(
        "--encoders",
        choices=("motor", "link"),
        help="side of an MJCF's gears that was logged (not said: both are tried)",
    )
    parser.add_argument(
        "--control", choices=("pose", "position", "torque"), default="pose",
        help="what a command is (%(default)s)",
    )  # fmt: skip
    parser.add_argument(
        "--joints", nargs="+", default=[], metavar="JOINT",
        help="of an MJCF model (all of the joints topic)",
    )  # fmt: skip
    parser.add_argument(
        "--actuators", nargs="+", default=[], metavar="NAME",
        help="of an MJCF model, in the order of the commands (the joints)",
    )  # fmt: skip
    for what in ("command", "tracker"):
        parser.add_argument(
            f"--{what}-frame", nargs=7, type=float, metavar=("X", "Y", "Z", "QW", "QX", "QY", "QZ"),
            help=f"where the frame of the {what}'s poses is in the robot's base frame",
        )  # fmt: skip
    parser.add_argument(
        "--test", nargs="+", default=[], metavar="NAME", help="bags to hold out, by name"
    )
    parser.add_argument(
        "--repeats", nargs="+", default=[], metavar="NAME=NAME",
        help="bags that repeat the commands of another",
    )  # fmt: skip


def run(found: argparse.Namespace) -> int:
    """Write the data set, and say what is in it."""
    is_mjcf = found.model is not None and found.model.suffix == ".xml"
    if is_mjcf:
        source = ModelSource("mjcf", found.model, tracked=found.tracked, encoders=found.encoders)
    else:
        source = ModelSource("pr2", arm=found.arm, parameters=found.model)
    logs: list[Log] = []
    joints: Sequence[str] = found.joints
    if not is_mjcf:
        joints = [f"{found.arm[0]}_{name}_joint" for name in JOINT_NAMES]
    names = _names(found.bags)
    for path, name in zip(found.bags, names, strict=True):
        topics = _topics(path, found)
        joints = joints or joint_names(topics[found.joints_topic])
        log, said = _log(name, topics, found, joints, is_mjcf)
        for line in said:
            print(f"{path.name}: {line}")
        logs.append(log)
    test, repeats = _splits(found.test, found.repeats, names)
    if len(logs) == 1:
        logs = list(logs[0].cut(_late(logs[0].readings)))
        test, repeats = [logs[1].name], {}
        print(f"a single bag: its last quarter is held out as {logs[1].name}")
    written: Sequence[str] = joints if is_mjcf else JOINT_NAMES
    control: Control = found.control
    actuators = POSE if control == "pose" else (found.actuators or written)
    dataset = data_set(source, control, written, actuators, logs, test, repeats)
    bags = [path.name for path in found.bags]
    write_dataset(dataset, found.out, {"by": "riposte identify import-bag", "bags": bags})
    report(found.out)
    return 0


def _names(paths: Sequence[Path]) -> list[str]:
    """Return a name for every bag, its file's where these differ."""
    stems = ["".join(c if c.isalnum() or c in "_-" else "_" for c in path.stem) for path in paths]
    return [
        stem if stems.count(stem) == 1 and stem[:1].isalnum() and stem.isascii() else f"bag-{index}"
        for index, stem in enumerate(stems)
    ]


def _topics(path: Path, found: argparse.Namespace) -> dict[str, Topic]:
    """Return the topics asked for.

    Raises:
        IdentificationError: one is not in the bag, or has no messages; names those that are.
    """
    wanted = {"--command-topic": found.command_topic, "--joints-topic": found.joints_topic}
    if found.tracker_topic:
        wanted["--tracker-topic"] = found.tracker_topic
    topics = read_topics(path, list(wanted.values()))
    for flag, name in wanted.items():
        if name not in topics or not topics[name].messages:
            what = "has no messages of" if name in topics else "has no"
            there = ", ".join(f"{each} ({kind})" for each, kind in sorted(topics_of(path).items()))
            raise IdentificationError(
                f"{path} {what} topic {name}; name another with {flag}. It has: {there or 'none'}"
            )
    return topics


def _log(
    name: str, topics: dict[str, Topic], found: argparse.Namespace, joints: Sequence[str],
    is_mjcf: bool,
) -> tuple[Log, list[str]]:  # fmt: skip
    """Return a bag as a recording, and what is to be said of it."""
    command, readings = topics[found.command_topic], topics[found.joints_topic]
    said: list[str] = []

    def clock(topic: Topic, is_own: bool = False) -> str:
        kind, why = clock_of(topic, is_own)
        said.extend([f"{topic.name} by time of receipt: {why}"] if why else [])
        return kind

    if found.control == "pose":
        poses, frame = pose_rows(command, clock(command))
        sent = _in_base(poses, found.command_frame, frame, "command", is_mjcf)
    else:
        actuators = found.actuators or joints
        sent = motor_rows(command, actuators, found.control, clock(command))
    rows = joint_rows(readings, joints, clock(readings))
    tracker = None
    if found.tracker_topic:
        topic = topics[found.tracker_topic]
        poses, frame = pose_rows(topic, clock(topic, is_own=True))
        tracker = _in_base(poses, found.tracker_frame, frame, "tracker", is_mjcf)
    return Log(name, sent, rows, tracker), said


def _in_base(
    poses: Rows, base_from_frame: Sequence[float] | None, frame: str, what: str, is_mjcf: bool
) -> Rows:
    """Return poses in the robot's base frame.

    Raises:
        IdentificationError: they are in another frame than a PR2's torso, and nobody said where.
    """
    if base_from_frame is None:
        if not is_mjcf and frame not in ("", TORSO):
            raise IdentificationError(
                f"the poses of --{what}-topic are in frame {frame!r}, expected {TORSO!r}: say "
                f"where {frame!r} is in {TORSO!r} with --{what}-frame X Y Z QW QX QY QZ"
            )
        return poses
    numbers = np.array(base_from_frame)
    if abs(float(np.linalg.norm(numbers[3:])) - 1.0) > 0.01:
        raise IdentificationError(
            f"--{what}-frame: QW QX QY QZ = {base_from_frame[3:]} is of length "
            f"{np.linalg.norm(numbers[3:]):.4g}, expected 1"
        )
    outer = pose_of(numbers)
    rows: list[list[float]] = []
    for row in poses.values:
        made = composed(outer, pose_of(row))
        rows.append([*made.position, *made.orientation])
    values: Float64 = np.array(rows, np.float64).reshape(-1, 7)
    return Rows(poses.t_ns, values)


def _late(readings: Rows) -> int:
    begin, end = int(readings.t_ns[0]), int(readings.t_ns[-1])
    return end - (end - begin) // 4


def _splits(
    test: Sequence[str], repeats: Sequence[str], names: Sequence[str]
) -> tuple[list[str], dict[str, str]]:
    pairs = [each.partition("=") for each in repeats]
    for name in (*test, *(word for one, _, other in pairs for word in (one, other))):
        if name not in names:
            raise IdentificationError(
                f"no bag is called {name!r}; --test and --repeats know {', '.join(names)}"
            )
    return list(test), {one: other for one, _, other in pairs}
