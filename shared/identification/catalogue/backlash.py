"""A joint's gear has play between motor and link."""

from dataclasses import dataclass

import numpy as np

from shared.identification.arm.places import moving, place_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.gap import seen_by_tracker
from shared.identification.laws.series import link_inertia, series
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure, series_name

_PART = "gap"
_LIGHT = 0.02
"""Of the link's inertia: armature of the gap, which keeps its contacts solvable."""
_BRAKE = 0.1
"""Damping in the gap over the link's inertia (1/s): its bearing's, which stops no link in a gap."""


class Backlash:
    """A gap between motor and link; its flanks do not bounce. MuJoCo's manual builds it so, too."""

    name = "backlash"
    title = "the joint's gear has play"
    signature = "The link lags the encoder by half the gap and crosses it when the load reverses."
    side: Side = "plant"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the joints that move."""
        return tuple(place.label for place in moving(subject))

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the whole width of the gap."""
        joint = place_of(subject, place)
        widest, usual = (0.02, 0.0005) if joint.is_sliding else (0.2, 0.01)
        return (Quantity("gap", joint.angle, 0.0, widest, probe=usual),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return the second joint."""
        return series(subject, place, _PART)

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Open the gap; the link starts as a tracker sees it, or else on the loaded flank."""
        half = 0.5 * float(values[0])
        if half <= 0.0:
            return
        name = series_name(row.plant, place, _PART)
        joint = row.mj_joint(name)
        dof = int(row.model.jnt_dofadr[joint])
        inertia = link_inertia(row, joint)
        row.field("jnt_stiffness")[joint] = 0.0
        row.field("dof_damping")[dof] = _BRAKE * inertia
        row.field("dof_armature")[dof] = _LIGHT * inertia
        row.field("jnt_limited")[joint] = 1.0
        row.field("jnt_range")[joint] = -half, half
        row.field("jnt_solref")[joint] = 2.0 * row.plant.timestep, 1.0
        row.field("jnt_solimp")[joint, :2] = 0.999, 0.9999
        row.trust_encoders()
        seen = seen_by_tracker(row, place, half)
        if seen is None:
            row.rest(name, _Flank(half))
        else:  # where the load is near zero, it does not say on which flank the link lies
            row.start(name, seen.place, seen.speed)


@dataclass(frozen=True)
class _Flank:
    """The one that bears the load."""

    half: float
    """Of the gap (rad, m)."""

    def __call__(self, load: float) -> float:
        """Return the position (rad, m)."""
        return -self.half * float(np.sign(load))


EFFECT = Backlash()
