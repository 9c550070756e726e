"""The page: a bout in a browser, and the mouse as a person's bat.

Reads ``play/bats``, ``play/arms``, ``play/gate``, ``play/referee``, ``play/heart_rate`` and
``status/robot-io/*``; asks ``play/bout``, ``play/arm`` and ``play/<agent>/player``; writes
``play/tracker`` and ``status/page/<name>``, and in the run's folder ``page.json``. It decides
nothing: robot_io judges its poses and guards the robot, the referee scores.
"""
