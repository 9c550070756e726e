"""What the servos of a joint give together."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.identification.arm.places import moving
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.sim.plant.row import Row, drives_of

EARLIER: Final = 1.0
"""Before a part of a recording begins, from when on its set points are followed (s)."""


@dataclass(frozen=True)
class Servo:
    """``gain @ command - stiffness * q - damping * qd + rest`` at a joint (N m, N)."""

    gain: Float64
    """float64[U], by the command's columns (N m/rad, N/m)."""
    stiffness: float
    """(N m/rad, N/m)."""
    damping: float
    """(N m s/rad, N s/m)."""
    rest: float
    """(N m, N)."""


def servo_joints(subject: Subject) -> tuple[str, ...]:
    """Return the joints that move and have a servo; none where poses or torques are told."""
    if subject.control != "position":
        return ()
    plant, model = subject.plant, subject.nominal.model
    labels = (place.label for place in moving(subject))
    return tuple(label for label in labels if drives_of(plant, model, label))


def turning_servos(subject: Subject) -> tuple[str, ...]:
    """Return the place of what set points of turning joints have alike, if positions are told."""
    turns = not any(place.is_sliding for place in moving(subject))
    return ("",) if subject.control == "position" and turns else ()


def together_or_apart(labels: tuple[str, ...]) -> tuple[str, ...]:
    """Return the places of what servos may all have alike, or one of them."""
    return ("", *labels) if len(labels) > 1 else labels


def labels_at(row: Row, place: str) -> tuple[str, ...]:
    """Return the logged joints that such a place is of: one, or all that have a servo."""
    return (place,) if place else tuple(each for each in row.plant.labels if row.drives_of(each))


def servo_of(row: Row, label: str) -> Servo:
    """Return the servo of an arm's own joint, as its gains are by now."""
    gains, biases = row.current("actuator_gainprm"), row.current("actuator_biasprm")
    columns = [row.actuator(index) for index in range(len(row.plant.actuators))]
    gain = np.zeros(len(columns))
    stiffness = damping = rest = 0.0
    for drive in row.drives_of(label):
        gear = float(row.current("actuator_gear")[drive, 0])
        if drive in columns:
            gain[columns.index(drive)] = gear * gains[drive, 0]
        stiffness -= gear**2 * float(biases[drive, 1])
        damping -= gear**2 * float(biases[drive, 2])
        rest += gear * float(biases[drive, 0])
    return Servo(gain, stiffness, damping, rest)
