"""A joint's drive weakens as it works.

A warm winding has more resistance, and what a voltage makes of torque falls in proportion (MuJoCo's
``dcmotor`` has the same form): torque / (1 + loss * heat), where heat is the drive's torque squared
over time, forgotten with ``MEMORY``. A part of a recording begins as warm as what came before in it
made the drive.
"""

import functools
import math

import numpy as np

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.passive import at_joint
from shared.identification.laws.taken import taken
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure

MEMORY = 120.0
"""Time in which most of the warmth is gone (s), of a motor's winding in its housing."""
_SHORTEST = 2.0
"""Recordings with less in one piece show no history (s)."""
_MOST = 10.0
"""Times what it gives, that a drive is asked for at most."""


class _Law:
    """Values are each joint's loss, then each joint's heat at the start; memory is the heat."""

    def __init__(self, joints: int) -> None:
        self.memory = joints

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        loss, before = np.split(values, 2, axis=1)
        memory += step.timestep * (np.square(step.drive) - memory / MEMORY)
        heat = memory + before * np.exp(-step.time / MEMORY)
        return step.drive * (1.0 / (1.0 + loss * heat) - 1.0)


@functools.cache
def _law(joints: int) -> _Law:
    return _Law(joints)


class ThermalDerating:
    """A loss of torque that grows with what the drive has done."""

    name = "thermal_derating"
    title = "the joint's drive weakens as it warms up"
    signature = "The torque constant seems too high, the more so the longer the arm has worked."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move, if the recordings are long enough for a history."""
        if subject.duration < _SHORTEST:
            return ()
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the loss of torque per heat, in units of what the joint's drive does in a run."""
        joint = place_of(subject, place)
        heat = 0.5 * joint.drive**2 * min(subject.duration, MEMORY)
        return (Quantity("loss", f"1/(({joint.torque})^2 s)", 0.0, 10.0 / heat, probe=0.1 / heat),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Take off what is lost."""
        if not values[0]:
            return
        law = _law(len(row.plant.labels))
        loss = float(values[0])
        row.torque(law, at_joint(row, place, loss, _heat_before(row, place, loss)))


def _heat_before(row: Row, place: str, loss: float) -> float:
    """Return the heat of what was asked of the drive before the arm's time 0.

    That is what was commanded or, of a servo, what the motion took and was lost on the way.
    """
    if row.plant.control != "torque":
        return _heat_of_motion(row, row.plant.labels.index(place), loss)
    before = row.command.at < 0.0
    if not before.any():
        return 0.0
    at = row.command.at[before]
    spans = np.diff(np.append(at, 0.0))
    drives = [row.actuator(index) for index in range(len(row.plant.actuators))]
    gears = [
        row.model.actuator_gear[drive, 0] if drive in row.drives_of(place) else 0.0
        for drive in drives
    ]
    return _heat(at, spans, row.command.values[before] @ np.asarray(gears))


def _heat_of_motion(row: Row, joint: int, loss: float) -> float:
    """Return the heat of what a drive was asked for to give what the motion took before time 0."""
    begin = float(row.logged_q.at[0])
    if begin >= 0.0 or (done := taken(row)) is None:
        return 0.0
    at = done.motion.at
    before = at < 0.0
    edges = np.r_[begin, 0.5 * (at[1:] + at[:-1])[: np.count_nonzero(before) - 1], 0.0]
    given = done.of(row, joint)[before]
    heat = 0.0
    for torque, span in zip(given.tolist(), np.diff(edges).tolist(), strict=True):
        asked = torque * min(1.0 + loss * heat, _MOST)
        heat = heat * math.exp(-span / MEMORY) + asked**2 * span
    return heat


def _heat(at: Float64, spans: Float64, torque: Float64) -> float:
    """Return what is left at time 0 of the heat of torques that each lasted for a span."""
    return float(np.sum(np.square(torque) * spans * np.exp(at / MEMORY)))


EFFECT = ThermalDerating()
