"""rospy on either side of a topic; runs under Debian's own Python, told by its command line.

``listen TOPIC COUNT`` writes the ages of so many messages (s); ``speak TOPIC COUNT HZ`` sends them.
"""

import json
import sys
import threading
import time

import rospy
from geometry_msgs.msg import PoseStamped


def listen(topic: str, count: int) -> None:
    """Write how old each message was when its callback ran."""
    ages: list = []
    done = threading.Event()

    def take(message: PoseStamped) -> None:
        ages.append(time.monotonic() - message.pose.position.x)
        if message.pose.position.y > 0.0:
            done.set()

    rospy.init_node("bench_listener", anonymous=True, disable_signals=True)
    rospy.Subscriber(topic, PoseStamped, take, tcp_nodelay=True, queue_size=100)
    began = time.process_time()
    done.wait(30.0 + count / 50.0)
    used = time.process_time() - began
    sys.stdout.write(json.dumps({"ages": ages, "cpu_s": used}) + "\n")


def speak(topic: str, count: int, hertz: float) -> None:
    """Send messages that say when they were sent; the last says that it is the last."""
    rospy.init_node("bench_speaker", anonymous=True, disable_signals=True)
    publisher = rospy.Publisher(topic, PoseStamped, queue_size=1, tcp_nodelay=True)
    while not publisher.get_num_connections():
        time.sleep(0.01)
    time.sleep(0.3)
    message = PoseStamped()
    message.header.frame_id = "torso_lift_link"
    due, began = time.monotonic(), time.process_time()
    for index in range(count):
        message.pose.position.y = 1.0 if index == count - 1 else 0.0
        message.pose.position.x = time.monotonic()
        publisher.publish(message)
        due += 1.0 / hertz
        time.sleep(max(due - time.monotonic(), 0.0))
    sys.stdout.write(json.dumps({"cpu_s": time.process_time() - began}) + "\n")
    sys.stdout.flush()
    time.sleep(0.5)


if __name__ == "__main__":
    what, where, number, *rate = sys.argv[1:]
    if what == "listen":
        listen(where, int(number))
    else:
        speak(where, int(number), float(rate[0]))
