"""Huber's loss as residuals."""

import numpy as np
import pytest

from shared.identification.huber import FAR_OFF, restored, tempered


def test_within_the_noise_nothing_is_changed():
    x = np.linspace(-FAR_OFF, FAR_OFF, 9)
    assert np.array_equal(tempered(x), x)


def test_far_off_the_loss_is_linear_and_goes_on_where_the_parabola_ends():
    loss = 0.5 * tempered(np.array([-10.0, 5.0, 6.0, 7.0])) ** 2
    assert loss[0] == pytest.approx(FAR_OFF * 10.0 - 0.5 * FAR_OFF**2)
    assert np.diff(loss[1:]) == pytest.approx(FAR_OFF)
    beside = 0.5 * tempered(FAR_OFF + np.array([-1e-6, 1e-6])) ** 2
    assert np.diff(beside) == pytest.approx(FAR_OFF * 2e-6, rel=1e-3)


def test_what_was_tempered_can_be_had_again_with_its_derivative():
    x = np.array([-300.0, -4.5, -1.0, 0.0, 3.9, 4.1, 50.0])
    slopes = np.array([[2.0, -1.0]]) * np.arange(1.0, 8.0)[:, None]
    step = 1e-6
    jacobian = np.stack(
        [(tempered(x + step * slopes[:, i]) - tempered(x)) / step for i in range(2)], axis=1
    )
    plain, found = restored(tempered(x), jacobian)
    assert plain == pytest.approx(x)
    assert found == pytest.approx(slopes, rel=1e-4)
