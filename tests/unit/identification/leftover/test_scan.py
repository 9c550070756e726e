"""What is far over the noise is found, and noise alone is not."""

import numpy as np
import pytest

from shared.identification.dataset.types import Float64
from shared.identification.leftover.scan import Width, merged, scan, stretches, width_of

CORRELATION = np.array([0.0, 0.5, 0.9])


def noise(rng: np.random.Generator, blocks: int) -> Float64:
    """Return float64[B, 3] of unit variance, of three correlations."""
    out = rng.standard_normal((blocks, 3))
    for row in range(1, blocks):
        out[row] = CORRELATION * out[row - 1] + np.sqrt(1.0 - CORRELATION**2) * out[row]
    return out


def width(rng: np.random.Generator) -> Width:
    return width_of([noise(rng, 500)], CORRELATION, is_measured=True)


def test_noise_alone_shows_nothing_in_95_of_100_seeds() -> None:
    alarms = 0
    for seed in range(100):
        rng = np.random.default_rng(seed)
        found = scan([noise(rng, 500), noise(rng, 500)], width(rng))
        alarms += any(each.any() for each in found)
    assert alarms <= 5


@pytest.mark.parametrize("channel", [0, 1, 2])
def test_a_short_event_is_found_where_it_is(channel: int) -> None:
    rng = np.random.default_rng(7)
    part = noise(rng, 500)
    part[200:215, channel] += 6.0
    of = width(rng)
    hot = scan([part], of)[0]
    found = stretches(part[:, channel], hot[:, channel], 1.1, float(CORRELATION[channel]))
    assert len(found) == 1
    assert found[0].start == pytest.approx(200, abs=3)
    assert found[0].stop == pytest.approx(215, abs=3)
    assert not hot[:, [each for each in range(3) if each != channel]].any()


def test_a_small_offset_that_lasts_is_found_by_its_mean() -> None:
    rng = np.random.default_rng(3)
    part = noise(rng, 500)
    part[:, 0] += 1.0
    assert scan([part], width(rng))[0][:, 0].mean() > 0.95


def test_noise_that_repeats_show_to_drift_raises_no_alarm() -> None:
    rng = np.random.default_rng(5)
    drift = 2.0 * np.sin(np.linspace(0.0, 20.0, 1000))[:, None]
    white = np.zeros(3)
    of = width_of([rng.standard_normal((1000, 3)) + drift], white, is_measured=True)
    fresh = rng.standard_normal((500, 3)) + 2.0 * np.cos(np.linspace(0.0, 10.0, 500))[:, None]
    assert not scan([fresh], of)[0].any()
    blind = width_of([], white, is_measured=True)
    assert scan([fresh], blind)[0].any()


def test_neighbours_become_one() -> None:
    pieces = [slice(30, 40), slice(0, 10), slice(12, 20)]
    assert merged(pieces, 5) == [slice(0, 20), slice(30, 40)]
