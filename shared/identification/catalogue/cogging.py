"""A joint's torque ripples with its position, as magnets and gear teeth make it."""

import math

import numpy as np

from shared.identification.arm.places import moving, place_of, slides
from shared.identification.arm.ripples import FEWEST, MOST
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.passive import at_joint
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure


class _Law:
    """Values are each joint's cosine, sine and wave number (1/rad, 1/m)."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        cosine, sine, wave = np.split(values, 3, axis=1)
        phase = wave * step.q
        return cosine * np.cos(phase) + sine * np.sin(phase)


_LAW = _Law()


class Cogging:
    """A torque of one spatial frequency; cosine and sine say amplitude and phase."""

    name = "cogging"
    title = "the joint's torque ripples with its position"
    signature = "A torque that is periodic in the joint's position, whatever its speed."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return amplitudes and the number of ripples per turn (per metre).

        The data say where to look for the number.
        """
        joint = place_of(subject, place)
        most = joint.drive
        turn = 1.0 if joint.is_sliding else 2.0 * math.pi
        unit = "1/m" if joint.is_sliding else "1/turn"
        once = turn / joint.travel
        known = subject.ripples[subject.joints.index(place)] if subject.recordings else ()
        return (
            Quantity("cosine", joint.torque, -most, most, probe=0.1 * joint.drive),
            Quantity("sine", joint.torque, -most, most, probe=0.1 * joint.drive),
            Quantity(
                "ripples",
                unit,
                FEWEST * once,
                MOST * once,
                probe=0.5 * once,
                grid=tuple(turn * each for each in known) or (3.0 * once, 5.0 * once, 8.0 * once),
            ),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the torque act."""
        cosine, sine, ripples = (float(value) for value in values)
        if not cosine and not sine:
            return
        wave = ripples * (2.0 * math.pi if slides(row, place) else 1.0)
        row.torque(_LAW, at_joint(row, place, cosine, sine, wave))


EFFECT = Cogging()
