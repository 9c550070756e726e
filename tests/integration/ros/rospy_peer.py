"""A rospy node that is told what to do on its standard input; runs under Debian's Python."""

import json
import sys
import threading
import time

import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool
from std_srvs.srv import SetBool, SetBoolResponse

publishers: dict = {}
received: dict = {}
arrived = threading.Event()


def on_pose(message, topic: str) -> None:
    received.setdefault(topic, []).append((message.header.seq, message.pose.position.x))
    arrived.set()


def on_timed(message) -> None:
    """Take a message whose stamp is the sender's monotonic clock."""
    received.setdefault("timed", []).append(time.monotonic() - message.header.stamp.to_sec())


def do(asked: dict) -> object:
    what = asked["do"]
    topic = asked.get("topic", "")
    if what == "start":
        rospy.init_node("rospy_peer", disable_signals=True)
        return "ready"
    if what == "subscribe":
        rospy.Subscriber(topic, PoseStamped, on_pose, callback_args=topic, tcp_nodelay=True)
        return "done"
    if what == "subscribe_timed":
        rospy.Subscriber(topic, PoseStamped, on_timed, tcp_nodelay=True, queue_size=1)
        return "done"
    if what == "advertise":
        kind = Bool if asked.get("latch") else PoseStamped
        publishers[topic] = rospy.Publisher(
            topic, kind, queue_size=10, latch=bool(asked.get("latch")), tcp_nodelay=True
        )
        return "done"
    if what == "publish":
        publisher = publishers[topic]
        if publisher.data_class is Bool:
            publisher.publish(Bool(data=asked["value"]))
        else:
            message = PoseStamped()
            message.pose.position.x = asked["value"]
            message.header.frame_id = "torso_lift_link"
            publisher.publish(message)
        return "done"
    if what == "listeners":
        return publishers[topic].get_num_connections()
    if what == "received":
        return received.get(topic, [])
    if what == "serve":
        rospy.Service(topic, SetBool, lambda asked: SetBoolResponse(not asked.data, "from rospy"))
        return "done"
    if what == "call":
        rospy.wait_for_service(topic, timeout=5.0)
        answer = rospy.ServiceProxy(topic, SetBool)(asked["value"])
        return [answer.success, answer.message]
    if what == "call_twice":
        proxy = rospy.ServiceProxy(topic, SetBool, persistent=True)
        return [proxy(True).success, proxy(False).success]
    raise ValueError(what)


for line in sys.stdin:
    try:
        answer = do(json.loads(line))
    except Exception as error:  # the test reads it
        answer = f"error: {error}"
    sys.stdout.write(json.dumps(answer) + "\n")
    sys.stdout.flush()
