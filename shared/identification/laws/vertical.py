"""Which way is down."""

import numpy as np

from shared.identification.dataset.types import Float64


def horizontal_axes(gravity: Float64) -> tuple[str, str]:
    """Return the two world axes that are most nearly horizontal, as letters.

    Args:
        gravity: float64[3] (m/s^2); z is vertical where there is none.
    """
    vertical = int(np.argmax(np.abs(gravity))) if np.any(gravity) else 2
    first, second = (axis for index, axis in enumerate("xyz") if index != vertical)
    return first, second
