"""Each scripted player by itself, on observations made by hand."""

import copy
import math

import numpy as np
import pytest
from numpy.typing import NDArray

from shared.game.geometry import BatShape
from shared.policy.players import (
    SCRIPTED_ANTAGONISTS,
    SCRIPTED_PLAYERS,
    SCRIPTED_PROTAGONISTS,
    RememberingPlayer,
    scripted_player,
    scripted_role,
)
from shared.policy.scripted.blades import unit
from shared.policy.scripted.heuristic import Heuristic, closest_share
from shared.policy.scripted.memory import Memory
from shared.policy.scripted.person import APPROACHES, DEPTH, TACTICS
from shared.policy.scripted.senses import PENALTY, SCORING, SILENT, Senses
from shared.policy.scripted.sight import OTHER, OWN, Arena, Sight, is_in_target, is_touching
from shared.policy.scripted.tracking import track

Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]
ALL = sorted(SCRIPTED_PLAYERS)
WITH_CHANCE = [name for name in ALL if name not in ("static", "guard")]
FAR: Floats = np.array([3.0, 3.0, 3.0])


def test_every_scripted_player_is_for_one_side():
    assert not SCRIPTED_ANTAGONISTS.keys() & SCRIPTED_PROTAGONISTS.keys()
    assert SCRIPTED_PLAYERS.keys() == SCRIPTED_ANTAGONISTS.keys() | SCRIPTED_PROTAGONISTS.keys()
    roles = {name: scripted_role(name) for name in ALL}
    assert [name for name in ALL if roles[name] == "antagonist"] == sorted(SCRIPTED_ANTAGONISTS)
    for name in ALL:  # who attacks is named after it, or is a person
        attacks = name in ("stab", "slash") or name.startswith("person-")
        assert roles[name] == ("antagonist" if attacks else "protagonist")


def observation(
    own: Floats, own_blade: Floats, other: Floats, other_blade: Floats, seconds: float
) -> Float32s:
    """float32[1, 27] of two bats at rest."""
    obs = np.zeros((1, 27), np.float32)
    for start, grip, blade in ((0, own, own_blade), (13, other, other_blade)):
        obs[0, start : start + 3] = grip
        axis = np.cross([1.0, 0.0, 0.0], blade)
        q = np.array([1.0 + blade[0], *axis])
        obs[0, start + 3 : start + 7] = q / np.linalg.norm(q)
    obs[0, -1] = seconds
    return obs


def fencing(generator: np.random.Generator, count: int, seconds: float) -> Float32s:
    """float32[N, 27] with the bats anywhere near the target."""
    obs = generator.normal(0.0, 0.4, (count, 27)).astype(np.float32)
    for start in (3, 16):
        q = obs[:, start : start + 4]
        obs[:, start : start + 4] = q / np.linalg.norm(q, axis=1, keepdims=True)
    obs[:, -1] = seconds
    return obs


@pytest.mark.parametrize("name", ALL)
def test_a_player_plays_the_same_bout_again_from_the_same_generator(name: str):
    acts: list[bytes] = []
    for _ in range(2):
        player, generator = scripted_player(f"scripted:{name}"), np.random.default_rng(3)
        scene = np.random.default_rng(1)
        made = [player.act(fencing(scene, 5, 0.01 * step), generator) for step in range(40)]
        assert {action.shape for action in made} == {(5, 6)}
        assert {action.dtype for action in made} == {np.dtype(np.float32)}
        assert np.isfinite(made).all()
        acts.append(np.stack(made).tobytes())
    assert acts[0] == acts[1]


@pytest.mark.parametrize("name", WITH_CHANCE)
def test_another_generator_makes_another_bout(name: str):
    acts: list[bytes] = []
    for seed in (3, 4):
        player, generator = scripted_player(f"scripted:{name}"), np.random.default_rng(seed)
        scene = np.random.default_rng(1)
        made = [player.act(fencing(scene, 5, 0.01 * step), generator) for step in range(40)]
        acts.append(np.stack(made).tobytes())
    assert acts[0] != acts[1]


@pytest.mark.parametrize("name", ALL)
def test_extreme_observations_make_finite_actions(name: str):
    player, generator = scripted_player(f"scripted:{name}"), np.random.default_rng(0)
    middle, along = np.zeros(3), np.array([1.0, 0.0, 0.0])
    for step, (own, other) in enumerate([(along, along), (along, -along), (-along, along)]):
        if (own == -along).all() or (other == -along).all():
            own, other = (unit(v[:, None] + 1e-9)[:, 0] for v in (own, other))
        action = player.act(observation(middle, own, middle, other, 0.01 * step), generator)
        assert np.isfinite(action).all()


def test_which_players_remember_is_what_the_protocol_says():
    remembering = {
        n for n in ALL if isinstance(scripted_player(f"scripted:{n}"), RememberingPlayer)
    }
    assert remembering == set(ALL) - {"static"}


def test_a_memory_sees_a_new_bout_where_the_time_went_back_and_nowhere_else():
    memory = Memory()
    assert memory.begin(np.array([0.0, 5.0, 19.99])) is None
    for seconds, expected in (
        ([0.01, 5.01, 0.0], [False, False, True]),
        ([0.01, 5.02, 0.01], [False, False, False]),  # asked twice in one step
        ([0.00, 5.03, 0.02], [True, False, False]),
    ):
        is_new = memory.begin(np.array(seconds))
        assert is_new is not None
        assert is_new.tolist() == expected
    assert memory.begin(np.zeros(2)) is None  # other worlds altogether


def test_what_is_kept_of_a_memory_does_not_change_with_it():
    memory = Memory()
    memory.begin(np.zeros(2))
    memory["count"] = np.zeros(2)
    kept = memory.state()
    memory["count"][:] = 7.0
    assert kept["count"].tolist() == [0.0, 0.0]
    memory.restore(kept)
    memory["count"][:] = 5.0
    assert kept["count"].tolist() == [0.0, 0.0]


# -- the paper's heuristic ------------------------------------------------------------------


def test_half_of_the_steps_execute_the_pose_of_the_step_before_and_no_other():
    arena, count, steps = Arena(), 64, 60
    player, generator = Heuristic(arena), np.random.default_rng(11)
    scene = np.random.default_rng(2)
    before, old, new = None, 0, 0
    for step in range(steps):
        obs = fencing(scene, count, 0.01 * step)
        sight = Sight.of(obs)
        pose = player.desired(sight, copy.deepcopy(generator))
        made = player.act(obs, generator)
        candidates = [
            track(sight, middles - arena.middle * blades, blades, arena)
            for middles, blades in ((pose,) if before is None else (pose, before))
        ]
        is_new = (made == candidates[0]).all(axis=1)
        if before is None:
            assert is_new.all()  # there is none before the first
        else:
            assert (is_new ^ (made == candidates[1]).all(axis=1)).all()
            old, new = old + int((~is_new).sum()), new + int(is_new.sum())
        before = pose
    # Five standard deviations of a fair coin.
    assert abs(old - new) < 5 * math.sqrt(old + new)


def test_the_first_step_of_a_bout_never_executes_a_pose_of_the_bout_before():
    arena, count = Arena(), 64
    player, generator = Heuristic(arena), np.random.default_rng(11)
    scene = np.random.default_rng(2)
    player.act(fencing(scene, count, 19.99), generator)
    obs = fencing(scene, count, 0.0)
    middles, blades = player.desired(Sight.of(obs), copy.deepcopy(generator))
    expected = track(Sight.of(obs), middles - arena.middle * blades, blades, arena)
    np.testing.assert_array_equal(player.act(obs, generator), expected)


@pytest.mark.parametrize("projection", ["geometric", "printed"])
def test_the_bats_middle_is_uniform_on_the_outer_half_of_the_way_to_the_opponents_bat(projection):
    bat = BatShape()
    player = Heuristic(Arena(), projection)
    sight = Sight.of(np.repeat(fencing(np.random.default_rng(7), 1, 0.0), 20_000, axis=0))
    middles, _ = player.desired(sight, np.random.default_rng(1))
    grip, blade = sight.grips[:, OTHER, :1], sight.blades[:, OTHER, :1]
    low, up = grip + bat.back * blade, grip + bat.front * blade
    close = low + closest_share(low, up, 0.75, projection) * (up - low)
    shares = (middles * close).sum(0) / (close * close).sum(0)
    np.testing.assert_allclose(middles, shares * close, atol=1e-9)
    deciles = np.quantile(shares, np.linspace(0.0, 1.0, 11))
    np.testing.assert_allclose(deciles, np.linspace(0.5, 1.0, 11), atol=0.01)


def test_the_blade_is_perpendicular_on_average_and_turned_by_up_to_25_degrees_about_each_axis():
    player = Heuristic(Arena())
    own, other = np.array([0.0, 0.0, 1.0]), np.array([1.0, 0.0, 0.0])
    obs = np.repeat(observation(FAR, own, np.zeros(3), other, 0.0), 20_000, axis=0)
    _, blades = player.desired(Sight.of(obs), np.random.default_rng(1))
    # The blade is along z: turns about x move it along -y, turns about y along x.
    off = np.rad2deg(np.arcsin(blades))
    assert np.abs(off[:2].mean(axis=1)).max() < 0.5
    np.testing.assert_allclose(off[:2].std(axis=1), 25.0 / math.sqrt(3.0), rtol=0.06)
    assert 22.0 < np.abs(off[:2]).max() <= 25.0 * math.sqrt(3.0)


# -- people ---------------------------------------------------------------------------------


def test_people_see_and_hear_late_by_exactly_their_reaction_times():
    memory, arena = Memory(), Arena()
    senses = Senses(memory, arena, sight_steps=22, hearing_steps=17, anticipation=0.0, lead=0.0)
    away, up = np.array([-0.9, 0.5, 0.0]), np.array([0.0, 0.0, 1.0])
    blade = np.array([1.0, 0.0, 0.0])
    first = Sight.of(observation(away, up, FAR, up, 0.0))
    memory.begin(first.seconds)
    senses.allocate(1)
    senses.begin(np.ones(1, np.bool_), first)
    seen: list[float] = []
    heard: list[int] = []
    for step in range(60):
        grip = np.array([-0.5, 0.0, 0.0]) if step >= 10 else away  # enters the target at step 10
        other = FAR if step < 30 else np.array([0.0, 0.0, -0.3])  # is there, and hits, at 30
        sight = Sight.of(observation(grip, blade, other, up, 0.01 * step))
        grips, _, tones = senses.perceive(sight)
        seen.append(float(grips[0, 0]))
        heard.append(int(tones[0]))
    assert [step for step in range(60) if seen[step] != seen[step - 1]][-1] == 30 + 22
    assert heard == [SILENT] * 27 + [SCORING] * 20 + [PENALTY] * 13


def test_anticipation_makes_up_for_the_delay_where_the_other_moves_steadily():
    memory, arena = Memory(), Arena()
    senses = Senses(memory, arena, sight_steps=20, hearing_steps=17, anticipation=1.0, lead=0.0)
    up = np.array([0.0, 0.0, 1.0])
    for step in range(80):
        obs = observation(-FAR, up, FAR + 0.01 * step * np.array([1.0, -2.0, 0.0]), up, 0.01 * step)
        obs[0, 20:23] = [1.0, -2.0, 0.0]
        sight = Sight.of(obs)
        if memory.begin(sight.seconds) is None:
            senses.allocate(1)
            senses.begin(np.ones(1, np.bool_), sight)
        grips, _, _ = senses.perceive(sight)
    np.testing.assert_allclose(grips, sight.grips[:, OTHER], atol=1e-5)


def test_a_person_that_is_still_silent_looks_elsewhere_and_one_that_scores_stays():
    """The hand goes where it is told at once; only the second person's bat meets the target."""
    aside = np.array([-0.9, 0.5, 0.0])
    aims: list[float] = []
    for is_there in (False, True):
        player, generator = scripted_player("scripted:person-steady"), np.random.default_rng(5)
        assert isinstance(player, RememberingPlayer)
        guesses: list[Floats] = []
        for step in range(400):
            grip = np.array([-0.6, 0.0, 0.0]) if is_there and step > 100 else aside
            obs = observation(
                grip, np.array([1.0, 0.0, 0.0]), -FAR, FAR / math.sqrt(27), 0.01 * step
            )
            player.act(obs, generator)
            guesses.append(player.state()["guess"][:, 0].copy())
        aims.append(float(np.abs(np.diff(np.array(guesses)[150:], axis=0)).max()))
    silent, scoring = aims
    assert silent > 0.02  # jumps
    assert scoring < 0.01  # creeps towards the blade


def test_the_adaptive_person_comes_to_play_the_tactic_that_pays():
    """Its bat is in the target, untouched, in the bouts in which it plays tactic 2."""
    player, generator = scripted_player("scripted:person-adaptive"), np.random.default_rng(5)
    assert isinstance(player, RememberingPlayer)
    worlds, steps, bouts, good = 12, 40, 26, 2
    way = APPROACHES[:, good]
    inside = observation(-DEPTH * way, way, FAR, way, 0.0)
    outside = observation(-3.0 * way, way, FAR, way, 0.0)
    played: list[NDArray[np.int64]] = []
    for _ in range(bouts):
        tactic = np.full(worlds, -1)
        for step in range(steps):
            obs = np.where(tactic[:, None] == good, inside, outside)
            obs[:, -1] = 0.01 * step
            player.act(obs, generator)
            tactic = player.state()["tactic"]
        played.append(tactic.copy())
    first, last = np.array(played[:TACTICS]), np.array(played[TACTICS + 2 :])
    assert (first == good).mean() < 0.3
    assert (last == good).mean() > 0.75


def test_the_arena_judges_as_the_rule_book_does():
    """On the edge of the target and of contact, by hand: 0.20 + 0.025 m, and 0.05 m."""
    arena, x, z = Arena(), np.array([1.0, 0.0, 0.0]), np.array([0.0, 0.0, 1.0])
    for height, inside in ((0.2249, True), (0.2251, False)):
        sight = Sight.of(observation(np.array([-0.3, 0.0, height]), x, FAR, z, 0.0))
        assert is_in_target(sight, OWN, arena).tolist() == [inside]
        assert is_in_target(sight, OTHER, arena).tolist() == [False]
    for gap, touching in ((0.0499, True), (0.0501, False)):
        other = np.array([0.1, gap, -0.3])
        sight = Sight.of(observation(np.array([-0.3, 0.0, 0.0]), x, other, z, 0.0))
        assert is_touching(sight, arena).tolist() == [touching]
