"""Rewards by hand."""

import dataclasses
import math

import numpy as np
import pytest

from shared.game.bout import Judgement
from shared.game.reward import RewardConfig, protagonist_shaping, reward

STEP = Judgement(
    points=np.array([1.0, -10.0]),
    camping_points=np.zeros(2),
    antagonist_in_target=np.array([True, True]),
    protagonist_in_target=np.array([False, True]),
    contact=np.array([False, True]),
    target_distance=np.array([[0.5, -0.1], [1.0, -0.2]]),
    bat_distance=np.array([0.5, -0.01]),
)


def test_the_antagonist_gets_the_score_and_its_nearness_to_the_target():
    cfg = RewardConfig(score_scale=0.1, reach=0.5)
    found = reward(0, STEP, 2.0, 3.0, cfg)
    np.testing.assert_allclose(found, [0.2 + 3.0 * math.exp(-1.0), -2.0 + 3.0])


def test_the_protagonist_gets_the_lost_score_its_guard_and_its_distance_from_the_target():
    cfg = RewardConfig(score_scale=0.1, reach=0.5, guard_weight=0.25)
    found = reward(1, STEP, 2.0, 4.0, cfg)
    np.testing.assert_allclose(found, [-0.2 + 4 * (0.25 * math.exp(-1.0) + 0.75), 2.0 + 4 * 0.25])


def test_without_shaping_only_the_score_counts():
    broken = dataclasses.replace(STEP, target_distance=np.full((2, 2), np.nan))
    np.testing.assert_allclose(reward(0, broken, 1.0, 0.0, RewardConfig()), [0.1, -1.0])


def test_with_shaping_a_lured_protagonist_pays_itself_but_not_the_antagonist():
    camped = dataclasses.replace(
        STEP, points=np.array([10.0, 1.0]), camping_points=np.array([10.0, 0.0])
    )
    cfg = RewardConfig(score_scale=0.1, lure_weight=0.2)

    def game(side: int, shaping: float) -> list[float]:
        whole = reward(side, camped, 1.0, shaping, cfg)
        return (whole - (reward(side, camped, 0.0, shaping, cfg) if shaping else 0.0)).tolist()

    assert game(0, 0.0) == pytest.approx([1.0, 0.1])
    assert game(0, 0.4) == pytest.approx([0.2, 0.1])
    assert game(1, 0.4) == game(1, 0.0) == pytest.approx([-1.0, -0.1])


def test_the_way_out_of_the_target_pays_by_the_centimetre():
    cfg = RewardConfig(guard_weight=0.0, keep_out=0.1)
    at = dataclasses.replace(
        STEP, target_distance=np.array([[0.0, 0.0], [0.04, -0.04]]), bat_distance=np.zeros(2)
    )
    np.testing.assert_allclose(protagonist_shaping(at, cfg), [0.4, 0.0])


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("keep_out", 0.0),
        ("lure_weight", 1.5),
        ("score_scale", 0.0),
        ("reach", -1.0),
        ("guard_weight", 1.5),
        ("guard_weight", -0.1),
    ],
)
def test_a_scale_out_of_range_is_refused_by_name(field: str, value: float):
    with pytest.raises(ValueError, match=field):
        RewardConfig(**{field: value})
