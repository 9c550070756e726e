"""An interval that comes again and again is found from afar, to a small part of itself."""

import copy
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from shared.identification.catalogue.command_latency import EFFECT as LATENCY
from shared.identification.catalogue.sample_and_hold import EFFECT as HOLD
from shared.identification.effect import Candidate
from shared.identification.fitting.turns import (
    LIKELY,
    NEAR,
    Turning,
    _around,  # pyright: ignore[reportPrivateUsage]
    _best,  # pyright: ignore[reportPrivateUsage]
    aligned,
    turning_of,
)

PROBES = (0.02, 0.25)
SECONDS = 6


def wanted(at: Any) -> Any:
    return np.sin(4.3 * at) + 0.5 * np.sin(11.0 * at + 1.0)


def held(at: Any, interval: float, phase: float, every: float = 0.0) -> Any:
    turn = np.floor(at / interval - phase)
    taken = np.maximum(interval * (turn + phase), 0.0)
    return wanted(every * np.floor(taken / every) if every else taken)


class Latched:
    """Recordings of a command that is taken at turns, in parts of 1 s; three base numbers first.

    ``every`` so many seconds there is a new command; always if 0.
    """

    def __init__(self, interval: float, phase: float, every: float = 0.0) -> None:
        step = 0.002 if every else 0.01
        self.at = [begin + np.arange(0.0, 1.0, step) for begin in range(SECONDS)]
        self.every = every
        self.logged = [held(at, interval, phase, every) for at in self.at]
        command = SimpleNamespace(at=[0.0, every] if every else [0.0])
        parts = [
            SimpleNamespace(begin=float(b), joints_at=[0.0, 0.99], command=command)
            for b in range(SECONDS)
        ]
        segments = [SimpleNamespace(recorded=part) for part in parts]
        subject = SimpleNamespace(plant=SimpleNamespace(timestep=0.002))
        self.problem = SimpleNamespace(segments=segments, subject=subject)
        self.looks = 0

        self.candidates = (Candidate(HOLD, ""),)
        self.size = 5

    def smooth(self) -> "Latched":
        same = copy.copy(self)
        same.every = 0.0
        return same

    def clip(self, z: Any) -> Any:
        return np.clip(z, 0.0, 10.0)

    def residual(self, zs: Any, segments: tuple[int, ...]) -> Any:
        self.looks += len(zs) * len(segments)
        return np.stack(
            [
                np.concatenate(
                    [
                        self.logged[s] - held(self.at[s], *(z[3:] * PROBES), self.every)
                        for s in segments
                    ]
                )
                for z in zs
            ]
        )


@pytest.mark.parametrize(
    ("interval", "phase"), [(0.128, 0.364), (0.06, 0.9), (0.19, 0.05), (0.034, 0.35)]
)
@pytest.mark.parametrize("expected", [0.8, 1.25])
def test_it_is_found_from_a_rough_size(interval: float, phase: float, expected: float):
    space: Any = Latched(interval, phase)
    begun = np.array([0.1, 0.2, 0.3, expected * interval / PROBES[0], 0.0])
    z = aligned(space, begun, tuple(range(SECONDS)))
    assert z[:3] == pytest.approx(begun[:3])
    assert z[3] * PROBES[0] == pytest.approx(interval, rel=0.004)
    assert space.looks < 8000


@pytest.mark.parametrize(
    ("interval", "phase", "expected"),
    [(0.0571, 0.718, 1.2), (0.039, 0.718, 0.91), (0.032, 0.35, 1.08)],
)
def test_it_is_found_though_which_command_a_turn_takes_jumps_and_motion_begins_slowly(
    monkeypatch: pytest.MonkeyPatch, interval: float, phase: float, expected: float
):
    quick = wanted
    monkeypatch.setattr(f"{__name__}.wanted", lambda at: np.minimum(at / 3.0, 1.0) ** 2 * quick(at))
    space: Any = Latched(interval, phase, every=0.01)
    parts = tuple(range(SECONDS))
    begun = np.array([0.1, 0.2, 0.3, expected * interval / PROBES[0], 0.0])
    z = aligned(space, begun, parts, LIKELY)
    assert z[3] * PROBES[0] == pytest.approx(interval, rel=5e-4)


def test_once_it_is_nearly_known_every_turn_takes_its_own_command():
    space: Any = Latched(0.07716, 0.779, every=0.01)
    parts = tuple(range(SECONDS))
    begun = np.array([0.1, 0.2, 0.3, 0.07714 / PROBES[0], 0.79 / PROBES[1]])
    z = aligned(space, begun, parts, NEAR)
    before, after = (np.sum(space.residual([each], parts) ** 2) for each in (begun, z))
    assert after < 0.02 * before


def test_an_effect_says_which_of_its_numbers_they_are():
    space: Any = Latched(0.1, 0.0)
    assert turning_of(space) == Turning(3, 0.02, 4, 0.25)
    space.candidates = (Candidate(HOLD, ""), Candidate(LATENCY, ""))
    assert turning_of(space) is None
    z = np.ones(5)
    assert aligned(space, z, (0,)) is z


def test_turns_too_many_to_be_told_apart_are_left_to_the_mean():
    space: Any = Latched(0.005, 0.5)
    z = np.array([0.1, 0.2, 0.3, 0.25, 2.0])
    assert aligned(space, z, tuple(range(SECONDS))) is z
    assert space.looks == 0
    z[3] = 0.0  # not there
    assert aligned(space, z, tuple(range(SECONDS))) is z


def test_what_fits_already_stays():
    space: Any = Latched(0.128, 0.364)
    z = np.array([0.1, 0.2, 0.3, 0.128 / PROBES[0], 0.364 / PROBES[1]])
    assert aligned(space, z, tuple(range(SECONDS))) is z


def test_what_lies_about_two_neighbours_is_looked_at_once():
    alone = _around([(0.02, 0.25)], 1e-4, 0.1)
    assert len(alone) == 15
    both = _around([(0.02, 0.25), (0.02005, 0.25)], 1e-4, 0.1)
    assert both[:15] == alone
    assert len(both) == 18  # of the second one, what is a whole step further
    assert len(_around([(0.02, 0.25), (0.023, 0.25)], 1e-4, 0.1)) == 30


def test_a_neighbour_of_a_better_one_takes_no_place_of_another():
    tries = [(0.02, 0.95), (0.02, 0.05), (0.02001, 0.95), (0.02, 0.5), (0.03, 0.95)]
    costs = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    assert _best(tries, costs, 1e-3, 0.1, 9) == [tries[0], tries[3], tries[4]]
    assert _best(tries, costs[::-1], 1e-3, 0.1, 2) == [tries[4], tries[3]]
