"""All that moves an arm, and all that resists, larger together: what an arm under servos hides.

With every mass, gain, friction and torque larger by the same share an arm that is sent to positions
moves as before, and what its motors exert is not fitted to. So only what is known of links says how
large all of it is. A derivative by one number after another has an error in each, of stick and slip
and of what is no straight line; along this way, where they should cancel, the errors add up to more
than what is known of links, and sizes seem sure that are not. One more simulation says what the
derivative along it is.
"""

import re

import numpy as np

from shared.identification.dataset.types import Float64
from shared.identification.fitting.fit import Fit, mended
from shared.identification.fitting.space import Space

_STEP = 0.02
"""Of the share by which all of it is larger."""
_FORCE = re.compile(r"\b(N|kg)\b")


def with_all_together(fit: Fit, segments: tuple[int, ...]) -> Fit:
    """Return a fit whose derivative is right where all is larger together.

    Args:
        fit: with a derivative by one number after another.
        segments: of the fit.
    """
    if fit.space.problem.subject.control != "position":
        return fit
    moved = fit.space.clip(larger(fit.space, fit.z, _STEP))
    way = moved - fit.z
    came = fit.space.residual([moved], segments)[0] - fit.residual
    return Fit.of(fit.space, fit.z, fit.residual, mended(fit.jacobian, way, came))


def larger(space: Space, z: Float64, share: float) -> Float64:
    """Return a vector, float64[n], of an arm of which all that has a force in it is larger.

    Args:
        space: of the vector.
        z: float64[n], where it begins.
        share: by which, of the logarithm.
    """
    found = z.copy()
    base = space.problem.parameters
    for index, each in enumerate(base):
        if each.is_factor:
            found[index] += share
        else:
            grown = np.expm1(share * power_of_force(each.unit))
            found[index] += grown * each.value(float(z[index])) / each.scale
    powers = [power_of_force(each.unit) for each in space.quantities]
    found[len(base) :] *= np.exp(share * np.array(powers, np.float64))
    return found


def power_of_force(unit: str) -> float:
    """Return how a number of a unit grows with masses and torques: 1 as they do, 0 not at all."""
    above, _, below = unit.partition("/")
    if "sqrt" in above:
        return 0.5
    return float(bool(_FORCE.search(above))) - float(bool(_FORCE.search(below)))
