"""Residuals of an arm that torques push which nobody knows: what its motion takes and did not get.

What a joint is off by after a while is such a torque twice integrated, and what holds a joint still
hides it: an arm that rubs too much stands, and lacks nothing but what would move its links. Torques
say at each instant what is missing (Atkeson, An and Hollerbach 1986), whatever came before. They
show nothing of where readings are wrong, nor of what gives between a drive and its link.
"""

from dataclasses import dataclass, field

import numpy as np

from shared.identification.arm.motion import Motion, motion_of, smooth_motion
from shared.identification.arm.parts import part_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Dataset, Float64
from shared.identification.effect import Candidate
from shared.sim.plant.missing import missing_beside_laws
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Entry, as_it_is
from shared.sim.plant.row import Row
from shared.sim.plant.signals import sampled

_STRONG = 2.0
"""Times what drives a joint at most: what a drive is told to see whether it gives that."""
_LITTLE = 1e-6
"""Of that, which is nothing."""


@dataclass(frozen=True)
class Lacking:
    """What torques recordings lack, by recording."""

    subject: Subject
    dataset: Dataset
    _known: dict[int, tuple[Recorded, Motion]] = field(
        default_factory=dict[int, tuple[Recorded, Motion]], repr=False
    )

    def torque(self, entry: Entry, trajectory: int) -> Float64:
        """Return float64[T, J]: what was missing at each reading (N m, N).

        Motion and commands are smooth alike.

        Args:
            entry: of a variant, which adds no joints.
            trajectory: index of the recording.
        """
        recorded, motion = self._of(trajectory)
        row = self.subject.nominal.entered(entry, recorded)
        at = recorded.joints_at
        command = smooth_motion(at, row.command.held(at)).q
        missing = missing_beside_laws(row, motion.at, motion.q, motion.qd, motion.qdd, command)
        return sampled(motion.at, missing, at)

    def _of(self, trajectory: int) -> tuple[Recorded, Motion]:
        if trajectory not in self._known:
            of = self.dataset.trajectories[trajectory]
            state = (of.initial_q, of.initial_qd)
            self._known[trajectory] = part_of(of, 0.0, np.inf, state)[0], motion_of(of)
        return self._known[trajectory]


def shows(subject: Subject, candidate: Candidate, recorded: Recorded) -> bool:
    """Return whether torques that are missing tell of a cause.

    Not of what gives, of wrong readings, of what drives remember, and of what happened once: all
    that is left is taken for such. Nor of a drive that gives less than it is told: what it is told
    is noisy, and of half of that only half is missing.

    Args:
        subject: the arm.
        candidate: the cause.
        recorded: of any recording.
    """
    effect, place = candidate.effect, candidate.place
    is_seen = effect.side in ("plant", "command") and candidate.recording is None
    if not is_seen or effect.structure(subject, place):
        return False
    values = np.array([each.probe for each in effect.quantities(subject, place)])
    row = subject.nominal.entered(lambda row: effect.enter(row, place, values), recorded)
    if any(law.memory for law, _ in row.laws):
        return False
    plain = subject.nominal.entered(as_it_is, recorded)
    strong = _STRONG * float(np.max(subject.drive))
    weak, other = (_at_rest(row, told) - _at_rest(plain, told) for told in (0.0, strong))
    return bool(np.allclose(weak, other, atol=_LITTLE * strong))


def _at_rest(row: Row, told: float) -> Float64:
    """Return float64[J], what is missing of an arm at rest whose drives are told so much (N m)."""
    at, still = np.array([0.0, 0.01]), np.zeros((2, len(row.plant.labels)))
    command = np.full((2, len(row.plant.actuators)), told)
    return missing_beside_laws(row, at, still, still, still, command)[0]
