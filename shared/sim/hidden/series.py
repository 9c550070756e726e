"""A second joint behind a joint's motor, rotor, friction and encoder: for what gives there."""

import mujoco

from shared.sim.hidden.robot import Robot


def add_series(robot: Robot, place: str) -> None:
    """Put it in, free to turn; whoever asks for it holds it by a law of his own."""
    motor = robot.joint(place)
    motor.parent.add_joint(name=_name(place), type=motor.type, axis=motor.axis, pos=motor.pos)


def series_dof(model: mujoco.MjModel, place: str) -> int:
    """Return the index of its velocity."""
    return int(model.joint(_name(place)).dofadr[0])


def series_qpos(model: mujoco.MjModel, place: str) -> int:
    """Return the index of its position."""
    return int(model.joint(_name(place)).qposadr[0])


def _name(place: str) -> str:
    return f"{place} behind its transmission"
