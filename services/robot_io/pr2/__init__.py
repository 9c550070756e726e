"""The link to a PR2: its ``r_cart`` Cartesian controller over ROS 1.

``link.py`` is what the loop talks to, ``state.py`` makes numbers of messages, ``watch.py`` asks
the controller manager and the parameter server on threads of its own; ``restarts.py``,
``controllers.py``, ``parameters.py``, ``power.py`` and ``offset.py`` are the judgements, without
wires. What the robot must have been set up with is in docs/robot.md.
"""
