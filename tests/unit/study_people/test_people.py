import math

import numpy as np
import pytest

from shared.game.geometry import Target
from shared.policy.scripted.sight import Arena
from shared.study.analysis.regression import compare_slopes
from shared.study.people.fencer import Fencer
from shared.study.people.hand import MAX_SPEED, Hand
from shared.study.people.heart import FALL_SECONDS, RISE_SECONDS, Heart
from shared.study.people.population import Population, draw
from shared.study.people.practice import counting, learned
from shared.study.people.skill import BEGINNER, MASTER, character_at

X = np.array([1.0, 0.0, 0.0])


def test_both_laws_begin_with_nothing_and_rise_towards_all():
    for law in ("exponential", "power"):
        shares = [learned(law, 0.5, games) for games in (0, 1, 5, 50, 10_000)]
        assert shares[0] == 0.0
        assert shares == sorted(shares)
        assert 0.98 < shares[-1] <= 1.0
    assert learned("exponential", 0.5, 2.0) == pytest.approx(1.0 - math.exp(-1.0))
    assert learned("power", 0.5, 3.0) == pytest.approx(0.5)  # 1 - 4^-0.5


def test_without_an_opponents_share_a_new_opponent_costs_nothing():
    assert counting(0.0, 0, 12) == 12.0
    assert counting(1.0, 0, 12) == 0.0
    assert counting(0.25, 4, 12) == 10.0


def test_who_learned_nothing_is_a_beginner_and_who_learned_all_a_master():
    assert character_at(0.0, 0.0) == BEGINNER
    assert character_at(1.0, 1.0) == MASTER
    reads = character_at(0.0, 1.0)
    assert (reads.caution, reads.peak_speed) == (MASTER.caution, BEGINNER.peak_speed)


def test_a_person_is_the_same_one_for_the_same_number_and_seed():
    population = Population()
    assert draw(population, 3, 7) == draw(population, 3, 7)
    assert draw(population, 3, 7) != draw(population, 4, 7)
    people = [draw(population, number, 7) for number in range(1, 200)]
    assert all(0.0 <= each.start <= each.asymptote <= 1.0 for each in people)
    assert np.median([each.rate for each in people]) == pytest.approx(1.0 / 8.0, rel=0.15)


def test_null_people_are_after_a_hundred_games_as_they_were():
    person = draw(Population(learning=0.0, day_spread=0.0), 1, 7)
    assert person.shares(0, 0) == person.shares(50, 100)


def test_a_switch_sets_reading_back_and_the_body_not():
    person = draw(Population(specific=1.0, asymptote=0.9), 1, 7)
    body, reading = person.shares(0, 10)
    assert reading == person.start
    assert body == person.shares(10, 10)[0] > person.start


def test_a_hand_never_outruns_its_limit_and_arrives():
    hand, rng = Hand(np.zeros(3), X), np.random.default_rng(1)
    before = hand.pose()
    for _ in range(200):
        hand.step(np.array([-0.6, 0.0, 0.0]), X, 0.2, 0.01, rng)
        pose = hand.pose()
        assert np.all(np.abs(pose[:3] - before[:3]) <= MAX_SPEED * 0.01 + 1e-12)
        assert np.linalg.norm(pose[3:]) == pytest.approx(1.0)
        before = pose
    assert before[:3] == pytest.approx([-0.6, 0.0, 0.0], abs=0.01)


def test_a_hand_without_noise_moves_as_it_is_told_and_one_with_noise_does_not():
    ends = []
    for noise in (0.0, 0.0, 0.3):
        hand, rng = Hand(np.zeros(3), X), np.random.default_rng(len(ends))
        for k in range(40):
            hand.step(np.array([0.01 * k, 0.0, 0.0]), X, noise, 0.01, rng)
        ends.append(hand.pose())
    assert np.array_equal(ends[0], ends[1])
    assert not np.allclose(ends[0], ends[2], atol=1e-4)


def test_the_blade_of_a_fencer_points_at_the_robot_in_the_world():
    fencer = Fencer(Arena(), Target(), character_at(0.5, 0.5), np.random.default_rng(2))
    x, _, z, a, b, c, d = fencer.pose()
    assert (x, z) == (pytest.approx(0.62), pytest.approx(0.90))  # arena (-0.62, _, -0.15)
    along_x = 1.0 - 2.0 * (c * c + d * d)  # of the bat's x axis in the world
    assert along_x < 0.0  # the antagonist looks along -x
    assert np.linalg.norm([a, b, c, d]) == pytest.approx(1.0)


def test_a_fencer_finds_the_invisible_target_and_scores():
    arena, target = Arena(), Target()
    fencer = Fencer(arena, target, character_at(0.9, 0.9), np.random.default_rng(3))
    bats = np.zeros((2, 13))
    bats[1, :7] = (-3.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0)  # nobody defends
    inside = 0
    for step in range(800):
        bats[0, :7] = fencer.play(bats, 0.01 * step, 0.01)
        a, b, c, d = bats[0, 3:7]
        blade = np.array([a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)])
        away = np.array(target.centre) - bats[0, :3]
        along = np.clip(away @ blade, arena.bat.back, arena.bat.front)
        inside += float(np.linalg.norm(away - along * blade)) < arena.reach_of_target
    assert inside > 300


def test_a_heart_follows_effort_faster_up_than_down_and_comes_back():
    heart = Heart(resting=70.0, age=30.0)
    reserve = 208.0 - 21.0 - 70.0
    up = heart.go_on(0.5, RISE_SECONDS) - 70.0
    assert up == pytest.approx(0.5 * reserve * (1.0 - math.exp(-1.0)))
    down = heart.go_on(0.0, FALL_SECONDS) - 70.0
    assert down == pytest.approx(up * math.exp(-1.0))


@pytest.mark.slow
def test_people_that_learn_nothing_are_found_to_differ_in_five_percent_of_studies():
    # scores made of the shares of null people, with the scatter of games: no learning, so no
    # difference of slopes; the analysis' own test must keep its level
    rng, population = np.random.default_rng(4), Population(learning=0.0, specific=1.0)
    games = np.arange(1.0, 11.0)
    false = 0
    studies = 400
    for study in range(studies):
        cubes = np.empty((2, 10, 10))
        for number in range(10):
            person = draw(population, number + 1, study)
            for condition in range(2):
                for game in range(10):
                    body, reading = person.shares(game, 10 * condition + game, None)
                    cubes[condition, number, game] = 500.0 * (body + reading)
        cubes += 120.0 * rng.standard_normal(cubes.shape)
        found = compare_slopes(games, cubes[0], cubes[1], "null")
        false += found.p is not None and found.p < 0.05
    assert 0.017 <= false / studies <= 0.083  # 3 standard errors
