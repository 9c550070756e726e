"""Intervals of fitted numbers, where residuals correlate and stretches are few."""

from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import pytest

from shared.identification.certainty import half_widths
from shared.identification.fit import Fit


@dataclass
class Line:
    """Stands in for a space and its problem, of one recording."""

    shape: tuple[int, int]
    """Blocks, channels."""

    @property
    def problem(self) -> "Line":
        return self

    def shape_of(self, segment: int) -> tuple[int, int]:
        return self.shape


@pytest.mark.parametrize(("stretches", "numbers"), [(8, 2), (16, 8), (16, 14)])
def test_intervals_cover_though_residuals_correlate(stretches: int, numbers: int):
    rng = np.random.default_rng(2)
    rows, channels, covered = 25 * stretches, 3, []
    for _ in range(80):
        columns = rng.standard_normal((rows, channels, numbers)).cumsum(axis=0)
        columns /= columns.std(axis=0)
        noise = rng.standard_normal((rows, channels))
        for index in range(1, rows):
            noise[index] = 0.6 * noise[index - 1] + 0.8 * noise[index]
        jacobian = columns.reshape(-1, numbers)
        z = -np.linalg.lstsq(jacobian, noise.ravel(), rcond=None)[0]
        residual = noise.ravel() + jacobian @ z
        padding = np.zeros((numbers, numbers))
        fit = Fit(cast(Any, Line((rows, channels))), z, np.r_[residual, np.zeros(numbers)],
                  np.concatenate([jacobian, padding]), 0.0)  # fmt: skip
        covered.append(np.mean(np.abs(z) <= half_widths(fit, (0,))))
    assert 0.91 <= np.mean(covered) <= 0.99
