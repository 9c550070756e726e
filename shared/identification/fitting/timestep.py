"""What the time step of a model file moves the arm by: an error that no cause is to blame for.

MuJoCo's step is of first order in damping: the servo of a light joint works as if the joint had
half a step times its damping more inertia. Encoders that are read to 0.01 mrad show that at 2 ms,
and a fit makes up for it with an armature that is too small, as far as there is one.
"""

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit
from shared.sim.plant.plant import stepped

_MUCH = 1.0
"""Root mean square of a joint, in noise floors, from which it is told."""
_LITTLE = 0.5
"""What a smaller step should leave of it."""


def step_error(fit: Fit) -> Float64:
    """Return float64[J], by how much joints are off for the time step, in noise floors (RMS).

    Twice what half of the step changes: the error of a method of first order.

    Args:
        fit: of a model without causes; looked at is what it was not fitted to.
    """
    return 2.0 * changed_by(fit, 0.5 * fit.space.problem.subject.plant.timestep)


def changed_by(fit: Fit, timestep: float) -> Float64:
    """Return float64[J], by how much another time step (s) moves joints, in noise floors (RMS)."""
    problem, variant = fit.space.problem, fit.variant
    test = problem.of("test")
    other = problem.with_plant(stepped(problem.subject.plant, timestep))
    joints = len(problem.subject.joints)
    before, after = (each.plain(variant, test) for each in (problem, other))
    changed = [one[:, :joints] - two[:, :joints] for one, two in zip(before, after, strict=True)]
    return np.sqrt(np.mean(np.concatenate(changed) ** 2, axis=0))


def shorter(fit: Fit, much: float = _MUCH) -> float | None:
    """Return the time step (s) by which to look again for what little is left; None if it is fine.

    A quarter: what is left over for want of it is a sixteenth of the mean square then.

    Args:
        fit: of a model without causes.
        much: root mean square of a joint, in noise floors, from which it is too long.
    """
    subject = fit.space.problem.subject
    is_coarse = subject.control != "pose" and float(step_error(fit).max()) > much
    return 0.25 * subject.plant.timestep if is_coarse else None


def coarse_step(fit: Fit) -> str:
    """Return in words that the time step is too long for what was recorded; empty if it is not.

    Args:
        fit: of a model without causes.
    """
    subject = fit.space.problem.subject
    if subject.control == "pose":  # its damping is taken in the middle of a step
        return ""
    off = step_error(fit)
    worst = int(np.argmax(off))
    if not off[worst] > _MUCH:
        return ""
    step = subject.plant.timestep
    enough = step / 2.0 ** np.ceil(np.log2(off[worst] / _LITTLE))
    return (
        f"the time step of the model file is long for these recordings: at {1e3 * step:g} ms "
        f"{subject.joints[worst]} is {off[worst]:.2g} times the noise from where it should be, "
        f"which the fit hides in armature and damping; timestep={enough:.1g} leaves {_LITTLE:g}"
    )
