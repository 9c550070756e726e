"""Local polynomials through readings (Savitzky and Golay 1964)."""

# pyright: basic
# (scipy's types are partial)

import numpy as np
from scipy.signal import savgol_filter

from shared.identification.dataset.types import Float64


def smooth(values: Float64, width: int, period: float | None = None) -> Float64:
    """Return float64[T, D]: readings, or their rates of change, on local cubics.

    Args:
        values: float64[T, D], evenly spaced.
        width: readings that a cubic is taken through; odd.
        period: their distance (s) where rates are wanted; None for the readings themselves.
    """
    if period is None:
        return np.asarray(savgol_filter(values, width, 3, axis=0))
    return np.asarray(savgol_filter(values, width, 3, deriv=1, delta=period, axis=0))
