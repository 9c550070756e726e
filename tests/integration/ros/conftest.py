"""A ROS master, nodes of our own on it, and Debian's rospy in a process of its own."""

import contextlib
import json
import os
import subprocess
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from shared.ros.node import Node
from shared.testing.ros_master import DEBIAN, RosMaster, has_ros_master

PEER = Path(__file__).with_name("rospy_peer.py")
SECONDS = 10.0


class Master:
    """A ROS master that can go and come back, knowing nothing."""

    def __init__(self) -> None:
        self._master = RosMaster()
        self.uri = self._master.uri

    def stop(self) -> None:
        self._master.close()

    def start(self) -> None:
        self._master = RosMaster(port=int(self.uri.rsplit(":", 1)[1]))


@pytest.fixture
def master() -> Iterator[Master]:
    if not has_ros_master():
        pytest.skip("no ROS master: apt install python3-rosmaster (Debian 12)")
    found = Master()
    yield found
    found.stop()


@pytest.fixture
def nodes(master: Master) -> Iterator[Callable[[str], Node]]:
    """Return a maker of nodes, which are closed at the end."""
    with contextlib.ExitStack() as stack:

        def make(name: str, **options: Any) -> Node:
            return stack.enter_context(Node(name, master.uri, host="127.0.0.1", **options))

        yield make


class Rospy:
    """A rospy node: told what to do in lines of JSON, says what it sees the same way."""

    def __init__(self, master: Master, folder: Path) -> None:
        environment = {
            "ROS_MASTER_URI": master.uri, "ROS_IP": "127.0.0.1", "ROS_LOG_DIR": str(folder),
            "PATH": os.environ["PATH"], "HOME": str(folder),
        }  # fmt: skip
        with (folder / "rospy.err").open("wb") as errors:
            self._process = subprocess.Popen(
                ["/usr/bin/python3", str(PEER)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                stderr=errors, text=True, env=environment,
            )  # fmt: skip

    def ask(self, **what: Any) -> Any:
        """Have one thing done and return what it answers."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(json.dumps(what) + "\n")
        self._process.stdin.flush()
        return json.loads(self._process.stdout.readline())

    def close(self) -> None:
        self._process.kill()
        self._process.wait()
        for pipe in (self._process.stdin, self._process.stdout):
            assert pipe is not None
            pipe.close()


@pytest.fixture
def rospy(master: Master, tmp_path: Path) -> Iterator[Rospy]:
    if not Path(DEBIAN, "rospy").exists() or not Path(DEBIAN, "geometry_msgs").exists():
        pytest.skip("no rospy: apt install python3-rospy python3-geometry-msgs (Debian 12)")
    peer = Rospy(master, tmp_path)
    with contextlib.closing(peer):
        assert peer.ask(do="start") == "ready"
        yield peer


def eventually(what: Callable[[], Any], seconds: float = SECONDS) -> Any:
    """Return what holds at last."""
    deadline = time.monotonic() + seconds
    while not (found := what()):
        assert time.monotonic() < deadline, f"not within {seconds} s"
        time.sleep(0.0005)
    return found
