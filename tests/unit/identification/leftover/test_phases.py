"""When something is left over, in words, from power and motion made by hand."""

from collections.abc import Callable

import numpy as np
import pytest

from shared.identification.dataset.types import Float64
from shared.identification.leftover.phases import Look, phase_of, push_of

AT = 0.02 * np.arange(500) + 0.01
Q = np.sin(2.0 * np.pi * 0.3 * AT)
QD = 2.0 * np.pi * 0.3 * np.cos(2.0 * np.pi * 0.3 * AT)
TURN = 1.0 / 1.2
"""The first reversal (s); then one every half period of 5 / 3 s."""


def looks(is_hot: np.ndarray, begins: float = 0.0) -> Look:
    """Return a recording of one joint in which the power is high where it says."""
    noise = np.random.default_rng(1).chisquare(5, len(AT)) / 5.0
    edges = np.flatnonzero(np.diff(np.r_[False, is_hot, False].astype(np.int8)))
    pieces = tuple(slice(int(begin), int(end)) for begin, end in edges.reshape(-1, 2))
    column = np.stack([Q], axis=1)
    speed = np.stack([QD], axis=1)
    load = np.stack([1.0 + np.cos(2.0 * np.pi * 0.45 * AT)], axis=1)
    return Look(AT, begins, np.where(is_hot, 30.0, noise), pieces, column, speed, load, load)


@pytest.mark.parametrize(
    ("words", "is_hot"),
    [
        ("after reversals", lambda: (AT - TURN) % (5.0 / 3.0) < 0.2),
        ("while fast", lambda: np.abs(QD) > 1.3),
        ("while slow", lambda: np.abs(QD) < 0.6),
        ("while loaded", lambda: 1.0 + np.cos(2.0 * np.pi * 0.45 * AT) > 1.5),
        ("near a posture", lambda: np.abs(Q - 0.4) < 0.15),
        ("once", lambda: np.abs(AT - 4.0) < 0.3),
        ("from a time on", lambda: AT > 6.0),
        ("throughout", lambda: AT > 0.0),
    ],
)
def test_a_phase_has_its_name(words: str, is_hot: Callable[[], np.ndarray]) -> None:
    assert phase_of([looks(is_hot())], [0]).words == words


def test_what_comes_back_in_the_next_recording_is_not_from_a_time_on() -> None:
    late = np.array(AT > 8.0)
    early = np.array((AT > 1.0) & (AT < 3.0))
    assert phase_of([looks(early), looks(late, 10.0)], [0]).words != "from a time on"


def test_power_that_rises_over_recordings_grows_with_time() -> None:
    def rising(begins: float) -> Look:
        power: Float64 = (0.15 * (begins + AT)) ** 2
        whole = looks(power > 3.0, begins)
        return Look(AT, begins, power, whole.pieces, whole.q, whole.qd, whole.effort, whole.load)

    assert phase_of([rising(0.0), rising(10.0), rising(20.0)], [0]).words == "grows with time"


def test_a_push_is_over_when_its_torque_is_though_the_arm_stays_off() -> None:
    torque = 0.05 * np.random.default_rng(2).standard_normal(500)
    torque[100:120] -= 1.0
    assert push_of(torque, slice(103, 500)) == slice(100, 120)


def test_a_torque_that_stays_is_no_push() -> None:
    torque = 0.05 * np.random.default_rng(2).standard_normal(500)
    torque[100:] -= 1.0
    assert push_of(torque, slice(103, 500)) is None
