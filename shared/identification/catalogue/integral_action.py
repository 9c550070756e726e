"""The controller integrates its error, so that no weight holds a joint off its command for long.

A PID controller's third part, where the model's servo is proportional and derivative. It is told by
how fast its torque grows, in shares of what the proportional part gives: the inverse of a
controller's reset time. Where a drive is at its limit the integral goes on by what the limit leaves
of the proportional part.
"""

import functools

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.servo import (
    Servo,
    labels_at,
    servo_joints,
    servo_of,
    together_or_apart,
)
from shared.identification.laws.taken import Taken, taken
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure

_HELD = 20.0
"""For which a robot was on before a recording began: what is wound up by then (s)."""
_NEAR = 0.2
"""One over the time about a part's begin that tells what is wound up there, at least (1/s)."""
_SCALES = (1.0, 5.0)
"""Integrals of 1 and 5 per second, in probes: over what a slow recording shows, and under it."""
_SLOWER = 10.0
"""By so much one joint's may be slower than that of all (1/s)."""
_SLOWEST = 0.3
"""What is slower is no controller's: next to a recording's length it is a constant torque (1/s)."""


class _Law:
    """Values are each joint's rate, damping and torque at the start; memory is the integral."""

    def __init__(self, joints: int) -> None:
        self.memory = joints

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        rate, damping, start = np.split(values, 3, axis=1)
        memory += step.timestep * rate * (step.drive + damping * step.qd)
        return start + memory


@functools.cache
def _law(joints: int) -> _Law:
    return _Law(joints)


class IntegralAction:
    """A torque that grows by a share of the proportional part's, each second.

    Servos may all be set alike, or one be set apart. What is wound up where a part of a recording
    begins is what the motion took there beyond what the servo gave by itself.
    """

    name = "integral_action"
    title = "the controller integrates its error"
    signature = "Joints sag after they stop, and then come to their commands whatever they carry."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move and have a servo, and all of them together."""
        return together_or_apart(servo_joints(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return how fast it grows; at one joint it may be slower than at the others."""
        least = -_SLOWER if place else 0.0
        return (Quantity("rate", "1/s", least, 50.0, probe=1.0, scales=_SCALES, least=_SLOWEST),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the servos integrate, beside what they do so already."""
        labels = row.plant.labels
        law = _law(len(labels))
        told = np.zeros((3, len(labels)))
        for each, before in row.laws:
            if each is law:
                told[0] = before[: len(labels)]
        own = [labels.index(label) for label in labels_at(row, place)]
        told[0, own] += float(values[0])
        row.laws = [one for one in row.laws if one[0] is not law]
        if not told.any():
            return
        done = taken(row)
        for joint in np.flatnonzero(told[0]).tolist():
            servo = servo_of(row, labels[joint])
            wound = 0.0 if done is None else _wound_up(row, joint, servo, done, told[0, joint])
            told[1:, joint] = servo.damping, wound
        row.torque(law, told.ravel())


def _wound_up(row: Row, joint: int, servo: Servo, done: Taken, rate: float) -> float:
    """Return what the integral is at time 0 (N m, N), by what the motion took around it."""
    motion = done.motion
    given = row.command.held(motion.at) @ servo.gain + servo.rest
    given -= servo.stiffness * motion.q[:, joint]
    wound = done.of(row, joint) - given + servo.damping * motion.qd[:, joint]
    middles = 0.5 * (given[1:] + given[:-1])
    grown: Float64 = np.zeros_like(given)
    grown[1:] = rate * np.cumsum(middles * np.diff(motion.at))
    grown -= np.interp(0.0, motion.at, grown)
    share = np.exp(-np.abs(motion.at) * (rate + _NEAR))
    # A controller that integrates next to nothing has wound up next to nothing.
    before = _HELD - float(motion.at[0])
    return -np.expm1(-rate * before) * float(share @ (wound - grown) / share.sum())


EFFECT = IntegralAction()
