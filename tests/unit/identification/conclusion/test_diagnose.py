"""How a residual looks: profiles, lag and spectrum of signals made by hand."""

import numpy as np
import pytest

from shared.identification.conclusion.diagnose import diagnose
from shared.identification.conclusion.evidence import Replay

AT = np.arange(0.0, 20.0, 0.005)
JOINTS, UNITS = ("shoulder", "elbow"), ("rad", "rad")


def replay(residual: np.ndarray, late: float = 0.0) -> Replay:
    """Return two joints that swing; ``late`` (s) shifts what was measured."""
    phase = 2.0 * np.pi * 0.5 * (AT - late)
    q = np.stack([np.sin(phase), 0.5 * np.cos(phase)], axis=1)
    predicted = np.stack([np.sin(np.pi * AT), 0.5 * np.cos(np.pi * AT)], axis=1)
    return Replay(
        name="swing", split="train", at=AT, q=q + residual, predicted={"base_fit": predicted},
        loss={},
    )  # fmt: skip


def test_a_late_arm_shows_its_lag() -> None:
    found = diagnose([replay(np.zeros((len(AT), 2)), late=0.013)], JOINTS, UNITS)
    assert found.lag == {
        "shoulder": pytest.approx(0.013, abs=2e-4),
        "elbow": pytest.approx(0.013, abs=2e-4),
    }


def test_a_lag_that_is_long_for_the_motion_is_no_shorter_in_the_numbers() -> None:
    found = diagnose([replay(np.zeros((len(AT), 2)), late=0.1537)], JOINTS, UNITS)
    assert found.lag["shoulder"] == pytest.approx(0.1537, abs=2e-4)


def test_a_residual_that_follows_the_direction_shows_as_two_means() -> None:
    velocity = np.pi * np.cos(np.pi * AT)
    residual = np.stack([-0.01 * np.sign(velocity), np.zeros(len(AT))], axis=1)
    found = diagnose([replay(residual)], JOINTS, UNITS)
    assert found.forward[0] == pytest.approx(-0.01, rel=0.05)
    assert found.backward[0] == pytest.approx(0.01, rel=0.05)
    assert found.forward[1] == pytest.approx(0.0, abs=1e-4)


def test_a_residual_in_proportion_to_position_is_a_straight_profile() -> None:
    residual = np.stack([0.02 * np.sin(np.pi * AT), np.zeros(len(AT))], axis=1)
    found = diagnose([replay(residual)], JOINTS, UNITS)
    position = next(profile for profile in found.profiles if profile.over == "position")
    slope = np.polyfit(position.centres[0], position.mean[0], 1)[0]
    assert slope == pytest.approx(0.02, rel=0.05)
    assert [profile.over for profile in found.profiles] == ["velocity", "position", "time"]


def test_a_ringing_residual_shows_in_its_band_alone() -> None:
    ringing = np.stack([0.003 * np.sqrt(2.0) * np.sin(2 * np.pi * 10.0 * AT), 0.0 * AT], axis=1)
    found = diagnose([replay(ringing)], JOINTS, UNITS)
    loudest = int(np.argmax(found.spectrum[0]))
    assert 8.0 < found.frequency[loudest] < 13.0
    assert found.spectrum[0, loudest] == pytest.approx(0.003, rel=0.05)
    assert found.spectrum[1].max() < 1e-6


def test_a_prediction_that_diverged_is_left_out() -> None:
    whole = replay(np.zeros((len(AT), 2)))
    whole.predicted["base_fit"][2000:] = np.nan
    found = diagnose([whole], JOINTS, UNITS)
    velocity = next(profile for profile in found.profiles if profile.over == "velocity")
    assert np.nanmax(np.abs(velocity.mean)) < 1e-9
    assert np.isfinite(found.forward).all()
