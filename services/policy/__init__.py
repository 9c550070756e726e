"""A policy: plays one side of a live bout, one answer to each tick of the bat states.

Reads ``play/bats`` and ``play/referee``, answers ``play/<agent>/player`` (who plays next) and
writes ``play/<agent>/offset`` and ``status/policy/<name>``. It uses the same observation encoder
and action decoder as the actors, and neither MuJoCo nor torch. It never touches the robot: what it
asks for passes the safety gate of robot_io.
"""
