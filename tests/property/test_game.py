"""The vectorised game equals the slow one, and does not care where in the world it is played."""

from typing import Any

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from shared.game.bout import Judgement, Scoreboard
from shared.game.geometry import (
    BatShape,
    Target,
    blade_direction,
    distance_between_bats,
    distance_to_target,
)
from shared.game.reward import RewardConfig, antagonist_shaping, protagonist_shaping, reward
from shared.game.rules import RuleBook, attack_points, camping_points, count_camping
from tests.unit.game import literal

Floats = NDArray[np.float64]
BAT = BatShape()
TARGET = Target()
SEEDS = st.integers(0, 2**32 - 1)
STEPS = st.lists(st.tuples(st.booleans(), st.booleans(), st.booleans()), max_size=60)


def unit_quaternions(generator: np.random.Generator, *shape: int) -> Floats:
    q = generator.normal(size=(4, *shape))
    return q / np.linalg.norm(q, axis=0)


def scene(generator: np.random.Generator, worlds: int) -> tuple[Floats, Floats]:
    """Bats around the target: float64[3, 2, N] and float64[4, 2, N]."""
    centre = np.array(TARGET.centre)[:, None, None]
    grips = centre + generator.uniform(-0.6, 0.6, (3, 2, worlds))
    return grips, unit_quaternions(generator, 2, worlds)


def slow_distances(grips: Floats, quaternions: Floats) -> tuple[list[float], float]:
    """Of one world: both bats to the target, and to each other."""
    blades = [
        literal.end_points(
            tuple(grips[:, side]),
            literal.rotated_x(tuple(quaternions[:, side])),
            BAT.back,
            BAT.front,
        )
        for side in (0, 1)
    ]  # fmt: skip
    to_target = [
        literal.point_to_segment(TARGET.centre, *blade) - TARGET.radius - BAT.radius
        for blade in blades
    ]
    return to_target, literal.segment_to_segment(*blades) - 2 * BAT.radius


@settings(deadline=None)
@given(STEPS, st.integers(1, 5), st.booleans())
def test_the_rule_equals_the_papers_algorithm_on_any_sequence(
    steps: list[tuple[bool, bool, bool]], free_steps: int, once: bool
) -> None:
    rules = RuleBook(camping_steps=free_steps, camping="once" if once else "every_step")
    camping = np.zeros(1, np.int32)
    points = []
    for a_in, contact, p_in in steps:
        camping = count_camping(camping, np.array([p_in]))
        attack = attack_points(np.array([a_in]), np.array([contact]), rules)
        points.append(float(attack[0] + camping_points(camping, rules)[0]))
    assert points == literal.paper_points(steps, free_steps, once=once)


@settings(deadline=None)
@given(st.lists(st.tuples(st.booleans(), st.integers(1, 700)), max_size=8), st.booleans())
def test_long_waits_in_the_target_pay_as_in_the_paper(
    runs: list[tuple[bool, int]], once: bool
) -> None:
    rules = RuleBook(camping="once" if once else "every_step")
    steps = [(False, False, inside) for inside, length in runs for _ in range(length)]
    camping = np.zeros(1, np.int32)
    points = []
    for _, _, p_in in steps:
        camping = count_camping(camping, np.array([p_in]))
        points.append(float(camping_points(camping, rules)[0]))
    assert points == literal.paper_points(steps, 200, once=once)


@settings(deadline=None, max_examples=40)
@given(SEEDS, st.booleans())
def test_a_scoreboard_of_many_bouts_equals_one_slow_bout_at_a_time(seed: int, once: bool) -> None:
    generator = np.random.default_rng(seed)
    worlds, length = 3, 40
    rules = RuleBook(camping_steps=2, bout_steps=length, camping="once" if once else "every_step")
    board = Scoreboard(worlds, rules, BAT, TARGET)
    # Poses are held for some steps, so that there is camping.
    held = [scene(generator, worlds) for _ in range(8)]
    seen: list[list[tuple[bool, bool, bool]]] = [[] for _ in range(worlds)]
    points = np.zeros((length, worlds))
    for step in range(length):
        grips, quaternions = held[step // 5]
        assert not board.finished().any()
        points[step] = board.judge(grips, quaternions).points
        for world in range(worlds):
            to_target, between = slow_distances(grips[..., world], quaternions[..., world])
            seen[world].append((to_target[0] <= 0, between <= 0, to_target[1] <= 0))
    assert board.finished().all()
    for world in range(worlds):
        expected = literal.paper_points(seen[world], 2, once=once)
        assert points[:, world].tolist() == expected
        assert board.score[world] == sum(expected)
        assert board.attack_steps[world] == sum(a and not c for a, c, _ in seen[world])
        assert board.penalty_steps[world] == sum(a and c for a, c, _ in seen[world])
        split = board.attack_steps[world] - 10 * board.penalty_steps[world]
        assert board.score[world] == split + 10 * board.camping_steps[world]


@settings(deadline=None)
@given(SEEDS)
def test_distances_equal_the_slow_ones(seed: int) -> None:
    grips, quaternions = scene(np.random.default_rng(seed), 4)
    directions = blade_direction(quaternions)
    to_target = distance_to_target(grips, directions, BAT, TARGET)
    between = distance_between_bats(
        grips[:, 0], directions[:, 0], grips[:, 1], directions[:, 1], BAT
    )
    for world in range(4):
        slow_target, slow_between = slow_distances(grips[..., world], quaternions[..., world])
        np.testing.assert_allclose(to_target[:, world], slow_target, atol=1e-9)
        np.testing.assert_allclose(between[world], slow_between, atol=1e-9)


@settings(deadline=None)
@given(SEEDS, st.floats(-12.0, 0.0), st.booleans())
def test_distances_of_almost_parallel_bats_equal_the_slow_ones(
    seed: int, exponent: float, opposed: bool
) -> None:
    generator = np.random.default_rng(seed)
    grips = generator.uniform(-1.0, 1.0, (3, 2, 1))
    first = generator.normal(size=3)
    first /= np.linalg.norm(first)
    tilt = generator.normal(size=3)
    tilt -= first * (tilt @ first)
    second = first + 10.0**exponent * tilt / np.linalg.norm(tilt)
    second *= (-1.0 if opposed else 1.0) / np.linalg.norm(second)
    found = distance_between_bats(grips[:, 0], first[:, None], grips[:, 1], second[:, None], BAT)
    blades = [
        literal.end_points(tuple(grips[:, side, 0]), tuple(d), BAT.back, BAT.front)
        for side, d in enumerate((first, second))
    ]
    expected = literal.segment_to_segment(*blades) - 2 * BAT.radius
    np.testing.assert_allclose(found[0], expected, atol=1e-6)


@settings(deadline=None)
@given(SEEDS)
def test_who_is_asked_first_does_not_matter(seed: int) -> None:
    grips, quaternions = scene(np.random.default_rng(seed), 5)
    directions = blade_direction(quaternions)
    one = distance_between_bats(grips[:, 0], directions[:, 0], grips[:, 1], directions[:, 1], BAT)
    other = distance_between_bats(grips[:, 1], directions[:, 1], grips[:, 0], directions[:, 0], BAT)
    np.testing.assert_allclose(one, other, atol=1e-9)


def quaternion_product(p: Floats, q: Floats) -> Floats:
    w, x, y, z = p
    return np.stack(
        [
            w * q[0] - x * q[1] - y * q[2] - z * q[3],
            w * q[1] + x * q[0] + y * q[3] - z * q[2],
            w * q[2] - x * q[3] + y * q[0] + z * q[1],
            w * q[3] + x * q[2] - y * q[1] + z * q[0],
        ]
    )


def rotation_matrix(q: Floats) -> Floats:
    """Columns are the images of the axes under q v q*."""
    back = q * np.array([1.0, -1.0, -1.0, -1.0])
    images = [quaternion_product(quaternion_product(q, np.eye(4)[i + 1]), back) for i in range(3)]
    return np.stack([image[1:] for image in images], axis=1)


@settings(deadline=None)
@given(SEEDS)
def test_a_rigid_motion_of_the_whole_scene_changes_nothing(seed: int) -> None:
    generator = np.random.default_rng(seed)
    worlds = 6
    rules = RuleBook(camping_steps=1)
    turn = unit_quaternions(generator)
    matrix = rotation_matrix(turn)
    shift = generator.uniform(-5.0, 5.0, 3)
    moved_centre = matrix @ np.array(TARGET.centre) + shift
    moved_target = Target((moved_centre[0], moved_centre[1], moved_centre[2]), TARGET.radius)
    here = Scoreboard(worlds, rules, BAT, TARGET)
    there = Scoreboard(worlds, rules, BAT, moved_target)
    for _ in range(3):
        grips, quaternions = scene(generator, worlds)
        moved = np.einsum("ij,jkn->ikn", matrix, grips) + shift[:, None, None]
        turned = quaternion_product(turn, quaternions)
        one, other = here.judge(grips, quaternions), there.judge(moved, turned)
        margins = np.concatenate([one.target_distance.ravel(), one.bat_distance])
        assume(np.abs(margins).min() > 1e-9)
        np.testing.assert_allclose(other.target_distance, one.target_distance, atol=1e-9)
        np.testing.assert_allclose(other.bat_distance, one.bat_distance, atol=1e-9)
        np.testing.assert_array_equal(other.points, one.points)
    np.testing.assert_array_equal(there.score, here.score)
    np.testing.assert_array_equal(there.camping_steps, here.camping_steps)


FINITE: dict[str, Any] = {"allow_nan": False, "allow_infinity": False}
DISTANCES = st.floats(-1.0, 1e6, **FINITE)


@settings(deadline=None)
@given(
    st.tuples(DISTANCES, DISTANCES), DISTANCES,
    st.floats(1e-3, 100.0), st.floats(0.0, 1.0), st.floats(0.0, 10.0), st.floats(0.0, 10.0),
)  # fmt: skip
def test_shaping_is_bounded_and_the_game_part_is_zero_sum(
    to_target: tuple[float, float],
    between: float,
    reach: float,
    guard: float,
    score_weight: float,
    shaping_weight: float,
) -> None:
    cfg = RewardConfig(reach=reach, guard_weight=guard)
    distances = np.array(to_target)[:, None]
    judgement = Judgement(
        points=np.array([-10.0]),
        camping_points=np.zeros(1),
        antagonist_in_target=distances[0] <= 0,
        protagonist_in_target=distances[1] <= 0,
        contact=np.array([between]) <= 0,
        target_distance=distances,
        bat_distance=np.array([between]),
    )
    for shaping in (antagonist_shaping, protagonist_shaping):
        assert 0.0 <= shaping(judgement, cfg)[0] <= 1.0
    for side in (0, 1):
        whole = reward(side, judgement, score_weight, shaping_weight, cfg)
        game = reward(side, judgement, score_weight, 0.0, cfg)
        assert -1e-9 <= (whole - game)[0] <= shaping_weight + 1e-9
    sides = [reward(side, judgement, score_weight, 0.0, cfg)[0] for side in (0, 1)]
    assert sum(sides) == 0.0
