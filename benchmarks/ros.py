"""How long a command takes to a ROS subscriber, from our client and from rospy, at 100 Hz.

The subscriber is Debian's rospy in a process of its own, over the loopback and a real master; its
ages are read off one monotonic clock that all processes share.
"""

import contextlib
import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from benchmarks.harness import interleaved, median
from services.jobs.bench import Check, Measurement
from shared.errors import ConfigError
from shared.ros import types
from shared.ros.node import Node
from shared.testing.ros_master import DEBIAN, RosMaster, has_ros_master

QUESTION = "how old is a command when a ROS subscriber has it, beside one that rospy sent"
HERTZ = 100.0
PEER = Path(__file__).with_name("ros_peer.py")
POSE = "geometry_msgs/PoseStamped"
GOAL = 1.5


def measure(smoke: bool) -> Measurement:
    """Return the median age of our commands and of rospy's.

    Raises:
        ConfigError: Debian's rosmaster or rospy is not installed.
    """
    if not has_ros_master() or not Path(DEBIAN, "rospy").is_dir():
        raise ConfigError("needs apt install python3-rosmaster python3-rospy (Debian 12)")
    count, rounds = (50, 1) if smoke else (1000, 5)
    master = RosMaster()
    try:
        with Node("/bench", master.uri) as node:
            sides = (lambda: ours(node, master.uri, count), lambda: rospys(master.uri, count))
            pairs = interleaved(rounds, sides)
    finally:
        master.close()
    runs = tuple(
        {**{f"our_{name}": value for name, value in our.items()},
         **{f"rospy_{name}": value for name, value in theirs.items()}}
        for our, theirs in pairs
    )  # fmt: skip
    value, limit = median(runs, "our_p50_ms"), median(runs, "rospy_p50_ms")
    return Measurement(
        value=value,
        unit="ms",
        limit=limit,
        ratio=Check(
            name="age of our command / of rospy's, p50",
            value=value / limit,
            goal=GOAL,
            goal_is="at most",
        ),
        runs=runs,
        checks=(
            Check(name="ours, p99", value=median(runs, "our_p99_ms"), unit="ms"),
            Check(name="rospy's, p99", value=median(runs, "rospy_p99_ms"), unit="ms"),
            Check(name="our CPU share", value=median(runs, "our_cpu"), unit=""),
            Check(name="rospy's CPU share", value=median(runs, "rospy_cpu"), unit=""),
            Check(name="publish(), p99", value=median(runs, "our_call_p99_ms"), unit="ms"),
            Check(name="lost of ours", value=median(runs, "our_lost"), unit="messages"),
        ),
    )


def ours(node: Node, uri: str, count: int) -> dict[str, float]:
    """Return the figures of our publisher in this process."""
    topic = f"/bench/ours_{time.monotonic_ns()}"
    writer = node.publish_topic(topic, POSE, queue=1)
    message = types.new(POSE)
    message.header.frame_id = "torso_lift_link"
    calls: list[float] = []
    with peer(uri, "listen", topic, str(count)) as listener:
        wait_for(lambda: bool(writer.subscribers))
        time.sleep(0.3)
        due, began = time.monotonic(), time.process_time()
        for index in range(count):
            message.pose.position.y = 1.0 if index == count - 1 else 0.0
            message.pose.position.x = time.monotonic()
            writer.publish(message)
            calls.append(time.monotonic() - message.pose.position.x)
            due += 1.0 / HERTZ
            time.sleep(max(due - time.monotonic(), 0.0))
        cpu = (time.process_time() - began) * HERTZ / count
        return {**ages_of(listener, count), "cpu": cpu, "call_p99_ms": share(calls, 0.99)}


def rospys(uri: str, count: int) -> dict[str, float]:
    """Return the figures of a rospy publisher in a process of its own."""
    topic = f"/bench/rospys_{time.monotonic_ns()}"
    with (
        peer(uri, "listen", topic, str(count)) as listener,
        peer(uri, "speak", topic, str(count), str(HERTZ)) as speaker,
    ):
        found = ages_of(listener, count)
        assert speaker.stdout is not None
        cpu = json.loads(speaker.stdout.readline())["cpu_s"] * HERTZ / count
        return {**found, "cpu": cpu}


@contextlib.contextmanager
def peer(uri: str, *args: str) -> Iterator[subprocess.Popen[str]]:
    """Run a rospy process until the block ends."""
    with tempfile.TemporaryDirectory() as folder:
        started = subprocess.Popen(
            ["/usr/bin/python3", str(PEER), *args],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={"ROS_MASTER_URI": uri, "ROS_IP": "127.0.0.1", "HOME": folder,
                 "ROS_LOG_DIR": folder, "PATH": os.environ["PATH"]},
        )  # fmt: skip
        try:
            yield started
        finally:
            started.kill()
            started.wait()
            if started.stdout is not None:
                started.stdout.close()


def ages_of(listener: subprocess.Popen[str], count: int) -> dict[str, float]:
    """Return what a listener found, once it has ended."""
    assert listener.stdout is not None
    found: dict[str, Any] = json.loads(listener.stdout.readline())
    ages: list[float] = found["ages"]
    return {
        "p50_ms": share(ages, 0.5),
        "p99_ms": share(ages, 0.99),
        "lost": float(count - len(ages)),
    }


def share(seconds: list[float], part: float) -> float:
    """Return a percentile in milliseconds."""
    return 1e3 * sorted(seconds)[min(int(part * len(seconds)), len(seconds) - 1)]


def wait_for(condition: Callable[[], bool]) -> None:
    """Wait, for 20 s at most.

    Raises:
        ConfigError: it was in vain.
    """
    deadline = time.monotonic() + 20.0
    while not condition():
        if time.monotonic() > deadline:
            raise ConfigError("rospy did not come within 20 s")
        time.sleep(0.01)
