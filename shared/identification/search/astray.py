"""How far off a model is of an arm that torques push which nobody knows.

Sensors beyond the gears see an arm so light that a torque that is off by a hundredth leads it far
astray, and a motor's current tells torques to a tenth. The harder such an arm is to move, or the
more it rubs, the better a replay fits. So it is judged by the torques that its motion takes and did
not get (ADR 0021).
"""

from dataclasses import replace

import numpy as np

from shared.identification.fitting.base import floor_at
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import Problem, Variant
from shared.identification.fitting.space import Space
from shared.identification.fitting.torques import by_torques
from shared.identification.gate.held_out import stretches
from shared.identification.noise.floor import Noise

_AT_MOST = 2.0
"""Noise floors, in those of a base with drives where the torques lead, not yet at its best."""
_FAR = 3.0
"""Times the torques (mean square) that are missing where these lead, that a replay's are astray.
Of arms that they tell right it was 0.7 to 2.2 times as much, of a TIAGo's 61 times."""
_LEAST_TORQUE = 1e-9
"""That is told from none (N m, N)."""


def no_more(noise: Noise, space: Space) -> Noise:
    """Return a noise floor that is not much more than what is left once the drives are there.

    An arm without its rotors spins off: what is left of that says nothing of noise.

    Args:
        noise: from what the base leaves without them.
        space: with them.
    """
    at_most = _AT_MOST * floor_at(space, by_torques(space)).joints
    return replace(noise, joints=np.minimum(noise.joints, at_most))


def astray(space: Space) -> Noise:
    """Return noise as of an arm that is pushed at random by torques, as far as drives leave it.

    Args:
        space: with drives, and a noise that repeats have not measured.
    """
    return _of_missing(space.problem, space.variant(by_torques(space)))


def _of_missing(problem: Problem, led: Variant) -> Noise:
    """Return noise that is the torques which a model lacks."""
    noise, joints = problem.noise, len(problem.noise.joints)
    noise = replace(
        noise, tracker=None, correlation=noise.correlation[:joints], start_doubt=None,
        memory=None, torque=np.ones(joints),
    )  # fmt: skip
    problem = replace(problem, noise=noise)
    left = problem.plain(led, problem.of("train"))
    size = np.maximum(np.sqrt(np.mean(np.concatenate(left) ** 2, axis=0)), _LEAST_TORQUE)
    return replace(noise, torque=size)


def counted_by_torque(noise: Noise) -> str:
    """Return in words that residuals are what :func:`astray` says; empty where they are not."""
    if not noise.is_torque:
        return ""
    return (
        "what was logged is not all that moved this arm, so that a simulation of it goes astray in "
        "a moment: how far off a model is was judged by the torques that the motion takes and did "
        "not get, which show no wrong reading and nothing that gives; pictures show angles"
    )


def leads_astray(together: Fit) -> bool:
    """Return whether replays make of a file's drives what the arm's torques speak against.

    Of an arm that unknown torques push, a replay is the less off the harder the arm is to move, so
    it has rotors at every joint, whatever rubs. Torques that its motion takes and did not get tell.

    Args:
        together: with all drives there may be, of a noise that repeats have not measured.
    """
    space = together.space
    led = space.variant(by_torques(space))
    problem = replace(space.problem, noise=_of_missing(space.problem, led))
    found, least = (
        float(stretches(problem, each, problem.of("test")).mean())
        for each in (together.variant, led)
    )
    return found > _FAR * least
