"""A PR2 that is not there: its topics, services and parameters on a real ROS 1 master.

The right arm is a simulated one that torques drive (``shared/sim/torque_arm.py``), and between a
command and the torques stands the law of the robot's own controller, with what was measured of
it: ``jt_cartesian.py`` is that law, ``mechanism.py`` the 1 kHz loop with the controllers that run
in it, ``power.py`` the run stops and the motors' power, ``robot.py`` real time, ``ros_side.py``
the wires. ``python -m shared.testing.fake_pr2`` runs one by hand.

What it does not have: the other arm, head and base stand still; tf knows no frame but the torso's;
a machine that is too slow loses cycles instead of halting the motors.
"""
