"""Scores bouts a second time, slowly, from what was observed."""

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from shared.game.rules import RuleBook
from shared.messages.training import Rollout
from shared.policy.mlp import GaussianPolicy
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from tests.unit.game import literal

UNDECIDED = 1e-5
"""Nearer than this (m) to a border, rounded observations cannot tell on which side it was."""


@dataclasses.dataclass
class Tally:
    """One bout, as far as it was played."""

    seen: list[tuple[bool, bool, bool]] = dataclasses.field(
        default_factory=list[tuple[bool, bool, bool]]
    )
    first_step: int = 0

    @property
    def steps(self) -> int:
        return len(self.seen)

    @property
    def score(self) -> float:
        return sum(self.points)

    @property
    def points(self) -> list[float]:
        return literal.paper_points(self.seen, self.free_steps)

    free_steps: int = 200

    @property
    def attack_steps(self) -> int:
        return sum(a and not c for a, c, _ in self.seen)

    @property
    def penalty_steps(self) -> int:
        return sum(a and c for a, c, _ in self.seen)

    @property
    def camping_steps(self) -> int:
        rest = self.score - self.attack_steps + 10 * self.penalty_steps
        return round(rest / 10)


@dataclasses.dataclass
class Played:
    """All bouts of some rollouts, and which of them ended."""

    bouts: dict[int, Tally]
    ended: set[int]


def verdict(
    antagonist: NDArray[Any], protagonist: NDArray[Any], model: FencingModel, centre: Any
) -> tuple[bool, bool, bool]:
    """Look at one world: two bats' positions and quaternions, seven numbers each."""
    blades = [
        literal.end_points(
            tuple(bat[:3]), literal.rotated_x(tuple(bat[3:7])), model.bat_back, model.bat_front
        )
        for bat in (antagonist.astype(float), protagonist.astype(float))
    ]
    reach = model.target_radius + model.bat_radius
    to_target = [literal.point_to_segment(tuple(centre), *blade) - reach for blade in blades]
    between = literal.segment_to_segment(*blades) - 2 * model.bat_radius
    assert min(abs(margin) for margin in (*to_target, between)) > UNDECIDED
    return to_target[0] <= 0, between <= 0, to_target[1] <= 0


def recounted(
    rollouts: Sequence[Rollout], model: FencingModel, rules: RuleBook
) -> tuple[Played, list[NDArray[np.float64]]]:
    """Return the bouts in consecutive rollouts of one lease, and the points float64[T, N] of each.

    The observations are in the arena's frame, the target's centre its origin; what a step led to
    is what the next one sees.
    """
    played = Played({}, set())
    spans: list[tuple[Rollout, list[tuple[Tally, int]]]] = []
    for rollout in rollouts:
        after = np.concatenate([rollout.obs[1:], rollout.last_obs[None]])
        began: list[tuple[Tally, int]] = []
        for world, bout in enumerate(rollout.bouts.tolist()):
            tally = played.bouts.setdefault(bout, Tally(free_steps=rules.camping_steps))
            began.append((tally, tally.steps))
            for row in after[:, world]:
                own, other = row[:7], row[13:20]
                pair = (own, other) if rollout.agent == "antagonist" else (other, own)
                tally.seen.append(verdict(*pair, model, (0.0, 0.0, 0.0)))
            if rollout.truncated[world]:
                played.ended.add(bout)
        spans.append((rollout, began))
    points = [
        np.stack(
            [tally.points[start : start + len(rollout.rewards)] for tally, start in began], axis=1
        )
        for rollout, began in spans
    ]
    return played, points


def recounted_evaluation(
    env: FencingEnv, players: Sequence[GaussianPolicy], seed: int
) -> list[Tally]:
    """Play an evaluation's bouts again with the means of two policies, and count them slowly."""
    env.reset(np.arange(env.num_envs), np.random.default_rng(seed))
    tallies = [Tally(free_steps=env.rules.camping_steps) for _ in range(env.num_envs)]
    obs = [np.empty((env.num_envs, 27), np.float32) for _ in players]
    for _ in range(env.rules.bout_steps):
        env.observe(*obs)
        env.step(*(player.mean(seen) for player, seen in zip(players, obs, strict=True)))
        for world, tally in enumerate(tallies):
            sensors = env.batch.sensors[world].reshape(2, -1)
            tally.seen.append(verdict(sensors[0], sensors[1], env.model, env.model.target_centre))
    return tallies
