import random

import pytest

from services.league.config import LeagueConfig
from services.league.history import CurvePoint
from services.league.schedule import converged
from shared.messages.training import Agent

CFG = LeagueConfig(convergence_min_updates=20, convergence_window=10, convergence_tolerance=10.0)


def curve(scores: list[float], noise: float = 0.0) -> list[CurvePoint]:
    generator = random.Random(1)
    return [
        CurvePoint(update, 0, 0, score=[score + generator.gauss(0, noise) for _ in range(4)])
        for update, score in enumerate(scores)
    ]


@pytest.mark.parametrize(
    ("agent", "slope", "is_over"),
    [
        ("antagonist", 0.0, True),
        ("antagonist", 0.5, True),
        ("antagonist", 5.0, False),
        ("antagonist", -5.0, True),
        ("protagonist", 0.0, True),
        ("protagonist", -5.0, False),
        ("protagonist", 5.0, True),
    ],
)
def test_a_learner_has_converged_when_its_score_stops_to_improve(
    agent: Agent, slope: float, is_over: bool
) -> None:
    points = curve([slope * update for update in range(41)], noise=1.0)
    assert converged(CFG, agent, 40, points) is is_over


def test_nothing_has_converged_before_its_least_updates() -> None:
    points = curve([0.0] * 40)
    assert not converged(CFG, "antagonist", 19, points)
    assert converged(CFG, "antagonist", 20, points)


def test_windows_with_too_few_bouts_say_nothing() -> None:
    points = curve([0.0] * 12)
    assert not converged(CFG, "antagonist", 30, points)


def test_zero_least_updates_never_end_a_stage_early() -> None:
    cfg = LeagueConfig(convergence_min_updates=0, convergence_window=10)
    assert not converged(cfg, "antagonist", 1000, curve([0.0] * 1000))


def test_bouts_after_the_latest_version_change_nothing() -> None:
    points = curve([0.0] * 30)
    late = [*points, CurvePoint(30, 0, 0, score=[1e6] * 50)]
    assert converged(CFG, "antagonist", 30, points)
    assert converged(CFG, "antagonist", 30, late)
