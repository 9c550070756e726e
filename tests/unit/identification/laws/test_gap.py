import numpy as np
import pytest

from shared.identification.laws.gap import seen

HALF = 0.02
AT = (np.arange(12) - 6.0) / 90.0 + 0.003


def cut(turns):
    return np.clip(turns, -HALF, HALF)


def test_a_link_that_falls_through_the_gap_is_where_its_parabola_is():
    found = seen(AT, 0.004 + 0.1 * AT + 2.0 * AT**2, HALF)
    assert found.place == pytest.approx(0.004, abs=1e-6)
    assert found.speed == pytest.approx(0.1, abs=1e-4)


def test_a_link_that_hits_the_flank_soon_after_is_where_it_flew_before():
    flown = 0.008 + 0.6 * AT
    assert np.count_nonzero(flown > HALF) > 2
    found = seen(AT, cut(flown), HALF)
    assert found.place == pytest.approx(0.008, abs=1e-3)
    assert found.speed == pytest.approx(0.6, rel=0.1)


def test_a_link_that_leaves_its_flank_later_lies_at_it():
    found = seen(AT, cut(HALF - 30.0 * np.maximum(AT - 0.02, 0.0) ** 2), HALF)
    assert found.place == pytest.approx(HALF, abs=1e-3)
    assert abs(found.speed) < 0.1


def test_readings_of_a_link_at_its_flank_say_no_speed():
    rng = np.random.default_rng(0)
    found = seen(AT, -1.05 * HALF + 1e-4 * rng.standard_normal(len(AT)), HALF)
    assert found == (-HALF, 0.0)


def test_what_begins_with_its_recording_begins_at_rest():
    later = AT[AT >= 0.0]
    found = seen(later, 0.003 + 0.0 * later, HALF)
    assert found == (pytest.approx(0.003), 0.0)
