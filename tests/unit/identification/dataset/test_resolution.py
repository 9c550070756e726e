"""The steps of encoders, and of readings that have none."""

import numpy as np
import pytest

from shared.identification.dataset.resolution import step_of, steps_of

AT = 0.02 * np.arange(600.0)
SWING = 0.4 * np.sin(0.7 * AT) + 0.05 * np.sin(5.0 * AT)


@pytest.mark.parametrize("step", [2.0 * np.pi / 4096.0, 0.01])
@pytest.mark.parametrize("decimals", [4, 12])
def test_an_encoders_step_is_found_also_where_its_readings_were_rounded(step, decimals):
    q = np.round(np.round(SWING / step) * step + 0.0003, decimals)
    assert step_of(q) == pytest.approx(step, rel=0.06)


def test_a_step_far_finer_than_the_motion_is_none():
    assert step_of(np.round(SWING, 6)) == 0.0


def test_readings_without_steps_have_none():
    rng = np.random.default_rng(1)
    assert step_of(SWING) == 0.0
    assert step_of(rng.standard_normal(600)) == 0.0
    assert step_of(np.zeros(600)) == 0.0


def test_an_even_speed_is_no_step():
    ramp = 1.05 * 0.015 * np.arange(200.0)
    rng = np.random.default_rng(2)
    assert step_of(ramp) == 0.0
    assert step_of(ramp + 1e-3 * rng.standard_normal(200)) == 0.0
    fine = np.round((ramp + 2e-5 * rng.standard_normal(200)) / 6e-6) * 6e-6
    assert step_of(fine) == 0.0
    assert step_of(np.r_[np.zeros(50), fine, np.full(50, fine[-1])]) == 0.0


def test_of_several_recordings_the_widest_counts():
    coarse = np.round(SWING / 0.01) * 0.01
    found = steps_of([np.c_[SWING, coarse], np.c_[coarse, np.zeros(600)]])
    assert found == pytest.approx([0.01, 0.01])


def test_a_joint_that_never_moves_is_read_like_the_others():
    still, coarse = np.zeros(600), np.round(SWING / 0.01) * 0.01
    assert steps_of([np.c_[SWING, coarse, still]]) == pytest.approx([0.0, 0.01, 0.01])
    assert steps_of([np.c_[SWING, still]]) == pytest.approx([0.0, 0.0])
