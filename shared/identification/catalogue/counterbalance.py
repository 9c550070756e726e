"""The springs or weights that carry an arm carry too much or too little."""

from dataclasses import dataclass

import numpy as np

from shared.identification.arm.places import place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.counterbalance import FLEX, LIFT, effort_per_turn
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.row import Row
from shared.sim.plant.step import Step
from shared.sim.plant.structure import Structure

_POSTURES = 9
_CARRIED = 0.05
"""Share of a joint's own scale of torque from which weight counts."""


@dataclass(frozen=True)
class _Adjusters:
    """The two screws of a PR2's arm; values: turns of spring and bar."""

    lift: int
    flex: int
    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        torque = np.zeros_like(step.q)
        per_turn = effort_per_turn(step.q[:, self.lift], step.q[:, self.flex])
        # What the drive has to hold more is what the counterbalance holds less.
        torque[:, [self.lift, self.flex]] = -np.einsum("kja,ka->kj", per_turn, values)
        return torque


class _Share:
    """A share of the weight on one joint; values: a share per joint."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        return values * step.gravity


_SHARE = _Share()


class Counterbalance:
    """Turns of a PR2's two adjusters; for other arms a share of the weight on one joint.

    The share is of what the drive has to hold: at speed centrifugal and Coriolis torques are in it,
    which are small against an arm's weight.
    """

    name = "counterbalance"
    title = "the counterbalance is out of adjustment"
    signature = "A load that depends on posture alone, on the joints that carry weight."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return a PR2's whole arm; else the joints that carry weight."""
        if _is_pr2(subject):
            return ("",)
        if not subject.has_gravity:
            return ()
        weight = _weight(subject)
        return tuple(
            label
            for index, label in enumerate(subject.joints)
            if weight[index] > _CARRIED * place_of(subject, label).drive
        )

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return turns clockwise, or what the joint carries by itself of its weight."""
        if not place:
            return (
                Quantity("spring", "turns", -15.0, 15.0, probe=3.0),
                Quantity("bar", "turns", -6.0, 6.0, probe=1.0),
            )
        return (Quantity("share", "1", -1.0, 1.0, probe=0.1),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: it is a torque."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let the adjusters, or the share, act."""
        labels = row.plant.labels
        if not place:
            row.torque(_Adjusters(labels.index(LIFT), labels.index(FLEX)), values)
            return
        shares = np.zeros(len(labels))
        shares[labels.index(place)] = float(values[0])
        row.torque(_SHARE, shares)


def _is_pr2(subject: Subject) -> bool:
    return subject.control == "pose" and {LIFT, FLEX} <= set(subject.joints)


def _weight(subject: Subject) -> Float64:
    """Return float64[J], the largest torque that weight puts on each joint where it was (N m)."""
    shares: Float64 = np.linspace(0.0, 1.0, _POSTURES)
    steps = np.stack([np.roll(shares, 2 * joint) for joint in range(len(subject.joints))], axis=1)
    q = subject.lowest + steps * subject.travel
    still = np.zeros_like(q)
    return np.abs(inverse_dynamics(subject.plant, subject.nominal.model, q, still, still)).max(
        axis=0
    )


EFFECT = Counterbalance()
