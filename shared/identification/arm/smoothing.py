"""Local polynomials through readings (Savitzky and Golay 1964)."""

# pyright: basic
# (scipy's types are partial)

import numpy as np
from numpy.typing import NDArray
from scipy.signal import savgol_filter

from shared.identification.dataset.types import Float64

_USUAL, _MORE = 3, 5
"""Degrees of the polynomials."""
_BENT = 60.0
"""Variances of the readings by which two more terms of a polynomial leave less, that speak for
them. Noise has 15 in one window of two thousand (chi-square with two degrees of freedom), but where
a joint begins to slide its speed has a kink, which a higher degree follows worse."""


def smooth(values: Float64, width: int, period: float | None = None) -> Float64:
    """Return float64[T, D]: readings, or their rates of change, on local cubics.

    Args:
        values: float64[T, D], evenly spaced.
        width: readings that a cubic is taken through; odd.
        period: their distance (s) where rates are wanted; None for the readings themselves.
    """
    return _filtered(values, width, _USUAL, period)


def smooth_states(values: Float64, width: int, period: float) -> tuple[Float64, Float64]:
    """Return float64[T, D] each: readings and their rates of change, on local polynomials.

    On cubics, which noise moves least; where readings surely bend more than a cubic does, as in a
    motion to and fro that takes hardly longer than a window, on polynomials of the fifth degree.

    Args:
        values: float64[T, D], evenly spaced.
        width: readings that a polynomial is taken through; odd, at least 7.
        period: their distance (s).
    """
    is_bent = _is_bent(values, width)
    position, speed = (
        np.where(is_bent, _filtered(values, width, _MORE, per), smooth(values, width, per))
        for per in (None, period)
    )
    return position, speed


def _is_bent(values: Float64, width: int) -> NDArray[np.bool_]:
    """Return bool[T, D], where two more terms leave surely less of the readings around."""
    usual, more = (_left(values, width, degree) for degree in (_USUAL, _MORE))
    noise = more.mean(axis=0) / (width - _MORE - 1)
    out = np.zeros(values.shape, np.bool_)
    half = width // 2
    out[half : half + len(more)] = usual - more > _BENT * noise
    return out


def _left(values: Float64, width: int, degree: int) -> Float64:
    """Return float64[T - width + 1, D], sums of squares that a polynomial leaves in each window."""
    basis, _ = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, width), degree + 1))
    windows = np.lib.stride_tricks.sliding_window_view(values - values.mean(axis=0), width, axis=0)
    return np.sum((windows - windows @ basis @ basis.T) ** 2, axis=-1)


def _filtered(values: Float64, width: int, degree: int, period: float | None) -> Float64:
    if period is None:
        return np.asarray(savgol_filter(values, width, degree, axis=0))
    return np.asarray(savgol_filter(values, width, degree, deriv=1, delta=period, axis=0))
