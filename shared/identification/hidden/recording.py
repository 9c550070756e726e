"""Records a robot: programmes, noise on everything, one programme twice."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from shared.identification.hidden import noise, programmes
from shared.identification.hidden.programmes import PERIOD, Programme
from shared.identification.hidden.recipe import Recipe
from shared.sim.hidden.arms import HiddenArm
from shared.sim.hidden.commands import commands_for
from shared.sim.hidden.robot import Played, Robot
from shared.sim.plant.signals import Signal

JOINTS_PERIOD: Final = 0.005
TRACKER_PERIOD: Final = 1.0 / 90.0


@dataclass(frozen=True)
class Plan:
    """One recording that is to be made."""

    name: str
    split: Split
    repeats: str
    command: Signal
    joints_at: Float64
    tracker_at: Float64 | None
    """True instants (s)."""
    seed: int
    """Of what is different each time."""


def plans(recipe: Recipe, arm: HiddenArm, rng: np.random.Generator) -> tuple[Plan, ...]:
    """Return the recordings of a data set in the order of making; the first is made twice."""
    at: Float64 = PERIOD * np.arange(round(recipe.seconds / PERIOD), dtype=np.float64)
    found: list[Plan] = []
    seen: dict[str, int] = {}
    asked = [*_kinds(recipe, "train"), *_kinds(recipe, "test")]
    for split, kind, programme in asked:
        seen[kind] = seen.get(kind, 0) + 1
        name = kind if seen[kind] == 1 else f"{kind}_{seen[kind]}"
        q = arm.rest + recipe.reach * programme(arm, at, rng)
        command = Signal(at, commands_for(arm, at, q))
        found.append(_plan(recipe, name, split, "", command, rng))
        if len(found) == 1:
            found.append(_plan(recipe, f"{name}_again", split, name, command, rng))
    return tuple(found)


def play(robot: Robot, arm: HiddenArm, plan: Plan, disturbance: Float64 | None) -> Played:
    """Return what a robot does, without noise of its sensors."""
    return robot.play(
        plan.command, arm.rest, float(plan.joints_at[-1]), plan.joints_at, plan.tracker_at,
        disturbance, plan.name,
    )  # fmt: skip


def record(recipe: Recipe, robot: Robot, arm: HiddenArm, plan: Plan) -> Trajectory:
    """Return what is logged of a robot."""
    rng = np.random.default_rng([recipe.seed, plan.seed])
    steps = int(recipe.seconds / robot.timestep) + 2
    pushed = noise.disturbance(recipe.noise, arm.torque, steps, robot.timestep, rng)
    played = play(robot, arm, plan, pushed)
    q = noise.on_joints(recipe.noise, plan.joints_at, played.q, rng)
    initial = played.q[0] + recipe.noise.initial * rng.standard_normal(len(arm.rest))
    tracker_at = tracker = None
    if plan.tracker_at is not None and played.tracker is not None:
        tracker = noise.on_tracker(recipe.noise, plan.tracker_at, played.tracker, rng)
        tracker_at = robot.stamp(plan.tracker_at)
    arrived = np.ones(len(plan.joints_at), np.bool_)
    for begin, end in robot.outages:
        arrived &= (plan.joints_at < begin) | (plan.joints_at >= end)
    return Trajectory(
        plan.name, plan.split, plan.repeats, initial, np.zeros_like(initial), plan.command.at,
        plan.command.values, plan.joints_at[arrived], q[arrived], None, None, tracker_at, tracker,
    )  # fmt: skip


def _kinds(recipe: Recipe, split: Split) -> list[tuple[Split, str, Programme]]:
    count = recipe.train if split == "train" else recipe.test
    kinds: Sequence[tuple[str, Programme]] = (
        programmes.GENTLE if recipe.is_gentle
        else programmes.TRAIN if split == "train" else programmes.TEST
    )  # fmt: skip
    return [(split, *kinds[index % len(kinds)]) for index in range(count)]


def _plan(
    recipe: Recipe, name: str, split: Split, repeats: str, command: Signal,
    rng: np.random.Generator,
) -> Plan:  # fmt: skip
    joints_at: Float64 = JOINTS_PERIOD * np.arange(
        round(recipe.seconds / JOINTS_PERIOD), dtype=np.float64
    )
    tracker_at = None
    if recipe.has_tracker:
        first = float(rng.uniform(0.0, TRACKER_PERIOD))
        count = int((recipe.seconds - first) / TRACKER_PERIOD)
        tracker_at = first + TRACKER_PERIOD * np.arange(count, dtype=np.float64)
    seed = int(rng.integers(2**31))
    return Plan(name, split, repeats, command, joints_at, tracker_at, seed)
