"""Over what way a joint's dry friction turns round, as a number of a friction effect.

Surfaces bend before they slide (Dahl 1968): gears by some 0.1 to 1 mrad. Where friction that is
said to turn round at once is fitted to such a joint, it comes out some 5 % low, and what it
leaves at each reversal looks like another law.
"""

from shared.identification.arm.places import Place
from shared.identification.effect import Quantity

_BEGIN = 1e-4
"""Of the joint's travel: where the search starts."""
_LEAST = 1e-5
"""The same: as good as at once."""
_MOST = 0.03
"""The same: what gives over more than that is a spring."""


def bend_of(joint: Place) -> Quantity:
    """Return the way (rad, m)."""
    begin = _BEGIN * joint.travel
    low, high = _LEAST * joint.travel, _MOST * joint.travel
    return Quantity(
        "bend", joint.angle, low, high, begin, grid=(begin,), ends=(False, True), is_detail=True
    )
