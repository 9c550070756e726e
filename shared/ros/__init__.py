"""A small ROS 1 client in pure Python: master API, topics, services and parameters over TCPROS.

Not rospy: no callbacks, no globals, no environment variables, no log topics. A subscriber is a
short queue that is polled, a publisher never blocks, every wait has a deadline, and what comes
from the network is checked before it is used. ``node.Node`` is the whole interface; messages are
made and read with ``types``, bags with ``bags``. The only door to ``rosbags``.

Protocols: http://wiki.ros.org/ROS/Master_Slave_APIs and http://wiki.ros.org/ROS/TCPROS.
"""
