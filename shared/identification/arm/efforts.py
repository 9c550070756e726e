"""How hard each joint was driven while a recording was made."""

from shared.identification.arm.known_efforts import known_effort_of
from shared.identification.arm.motion import motion_of
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.signals import sampled

_SPARSE = 3
"""Of the instants of a motion, every so many say what torque it takes."""


def effort_of(subject: Subject, of: Trajectory, at: Float64) -> Float64:
    """Return float64[T, J]: torques (N m, N) at instants (s).

    As they were logged; else as they were commanded, where commands are torques; else what the
    motion takes of the nominal arm.
    """
    known = known_effort_of(subject.nominal, of, at)
    if known is not None:
        return known
    motion = motion_of(of).sparse(_SPARSE)
    torque = inverse_dynamics(subject.plant, subject.nominal.model, motion.q, motion.qd, motion.qdd)
    return sampled(motion.at, torque, at)
