"""robot_io: the only process that moves a robot, and the gate every command passes.

Reads ``play/<agent>/offset``, ``play/referee`` and ``play/tracker``; answers ``play/arm``; writes
``play/bats``, ``play/arms``, ``play/robot``, ``play/gate``, ``play/heart_rate`` and
``status/robot-io/<name>``.
"""
