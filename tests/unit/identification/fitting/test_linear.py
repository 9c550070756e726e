"""Linear least squares against a literal search."""

import itertools

import numpy as np

from shared.identification.fitting.linear import bounded, least_squares


def test_shares_within_bounds_are_those_of_trying_every_set_of_bounds():
    rng = np.random.default_rng(0)
    for _ in range(20):
        columns, wanted = rng.standard_normal((12, 3)), 3.0 * rng.standard_normal(12)
        low, high = np.array([-0.5, 0.0, -2.0]), np.array([0.5, 1.0, 0.1])
        best = np.inf
        for ends in itertools.product((None, 0, 1), repeat=3):
            x = np.array(
                [0.0 if end is None else (low, high)[end][k] for k, end in enumerate(ends)]
            )
            free = [k for k, end in enumerate(ends) if end is None]
            x[free] = np.linalg.lstsq(columns[:, free], wanted - columns @ x, rcond=None)[0]
            if np.all((x >= low - 1e-12) & (x <= high + 1e-12)):
                best = min(best, float(np.sum((columns @ x - wanted) ** 2)))
        found = bounded(columns, wanted, low, high)
        assert np.all((found >= low) & (found <= high))
        assert np.sum((columns @ found - wanted) ** 2) <= best * (1 + 1e-6) + 1e-9


def test_a_column_that_is_there_twice_is_shared():
    column = np.array([1.0, 2.0, 3.0])
    found = least_squares(np.stack([column, column], axis=1), 4.0 * column)
    assert np.allclose(found, [2.0, 2.0])
