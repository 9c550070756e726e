"""Our nodes and Debian's rospy, both ways, over a real master."""

from collections.abc import Callable
from typing import Any

import pytest

from shared.ros import types
from shared.ros.node import Node
from tests.integration.ros.conftest import Rospy, eventually

POSE = "geometry_msgs/PoseStamped"
Nodes = Callable[..., Node]

# The master's workers leave their connections to rospy to the garbage collector.
pytestmark = pytest.mark.filterwarnings(
    "ignore:Exception ignored in. <socket.socket:pytest.PytestUnraisableExceptionWarning"
)


def pose(seq: int, x: float) -> Any:
    message = types.new(POSE)
    message.header.seq = seq
    message.pose.position.x = x
    return message


def test_rospy_reads_what_we_publish(nodes: Nodes, rospy: Rospy) -> None:
    writer = nodes("/ours").publish_topic("/poses", POSE, queue=10)
    rospy.ask(do="subscribe", topic="/poses")
    eventually(lambda: writer.subscribers == ("/rospy_peer",))
    for count in range(5):
        assert writer.publish(pose(count, 0.5 * count)) == 1
    found = eventually(lambda: len(rospy.ask(do="received", topic="/poses")) == 5)
    assert found
    # rospy keeps the sequence number that it finds
    assert [x for _, x in rospy.ask(do="received", topic="/poses")] == [0.0, 0.5, 1.0, 1.5, 2.0]


def test_we_read_what_rospy_publishes(nodes: Nodes, rospy: Rospy) -> None:
    reader = nodes("/ours").subscribe("/poses", POSE, queue=10)
    rospy.ask(do="advertise", topic="/poses")
    eventually(lambda: rospy.ask(do="listeners", topic="/poses") == 1)
    rospy.ask(do="publish", topic="/poses", value=2.5)
    assert reader.wait(5.0)
    found = reader.take()
    assert found is not None
    assert found.message.pose.position.x == 2.5
    assert found.message.header.frame_id == "torso_lift_link"
    assert reader.take() is None


def test_latched_values_reach_who_comes_later_both_ways(nodes: Nodes, rospy: Rospy) -> None:
    node = nodes("/ours")
    rospy.ask(do="advertise", topic="/halted", latch=True)
    rospy.ask(do="publish", topic="/halted", value=True)
    reader = node.subscribe("/halted", "std_msgs/Bool")
    assert reader.wait(5.0)
    found = reader.take()
    assert found is not None
    assert found.message.data is True
    node.publish_topic("/poses", POSE, latch=True).publish(pose(0, 7.0))
    rospy.ask(do="subscribe", topic="/poses")
    eventually(lambda: rospy.ask(do="received", topic="/poses"))
    assert rospy.ask(do="received", topic="/poses")[0][1] == 7.0


def test_services_both_ways_once_and_persistent(nodes: Nodes, rospy: Rospy) -> None:
    node = nodes("/ours")

    def answer(request: Any) -> Any:
        return types.new("std_srvs/SetBoolResponse", success=request.data, message="from us")

    served = node.serve("/ours/set", "std_srvs/SetBool", answer)
    node.wait_registered(5.0)
    assert rospy.ask(do="call", topic="/ours/set", value=True) == [True, "from us"]
    assert rospy.ask(do="call_twice", topic="/ours/set") == [True, False]
    assert served.calls == 3
    rospy.ask(do="serve", topic="/theirs/set")
    request = types.new("std_srvs/SetBoolRequest", data=False)
    found = node.call("/theirs/set", "std_srvs/SetBool", request, 5.0)
    assert (found.success, found.message) == (True, "from rospy")
