"""What a graphics card gains: the physics, an actor's loop, a PPO update, and a whole training run.

Both sides do the same work, in turns. Physics: worlds whose tools are sent about, commands and
sensors copied each step. Actor: rollouts up to their bytes, as actors make them; observations,
policies and judging stay on one core. A run is what `riposte train` starts, without a recorder. The
processors' side has one core where one core is meant, and all of the machine's where it may use
them. Where there is no card it says so and measures nothing.
"""

import importlib.util
import os
import sys
import time
from collections.abc import Callable
from typing import Final

import msgspec
import numpy as np

from benchmarks.actor import ROLLOUT_STEPS, a_collector
from benchmarks.harness import interleaved, median
from benchmarks.rollouts import rollout_of
from benchmarks.throughput import a_rollout
from benchmarks.training_run import ENDLESS, training_run
from services.jobs.bench import Check, Measurement, NotHereError, figure
from services.jobs.settings import Settings
from shared.game.rules import RuleBook
from shared.messages.wire import encode
from shared.policy.action import ActionConfig
from shared.sim.batch import FencingBatch
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.sim.worlds import Worlds, worlds_of

QUESTION = "what a graphics card gains: the physics, an actor's loop, PPO updates, a training run"
WORLDS: Final = (1024, 4096, 16384, 65536)
"""On the card."""
ON_A_CORE: Final = 256
"""Worlds that one core steps; it does best with so many."""
LOOP_WORLDS: Final = 4096
"""Of an actor on the card."""
UPDATES: Final = (20480, 163840)
"""Samples of a PPO update: the default batch, and one rollout of an actor on the card."""
RUN_SECONDS: Final = 10.0
WARM_UP: Final = 3
"""Steps before the clock starts: kernels are loaded by then, and what is launched is recorded."""


def physics(worlds: Worlds, num_envs: int, seconds: float) -> float:
    """Return world steps a second of worlds whose tools are sent about."""
    generator = np.random.default_rng(0)
    begin = worlds.ctrl.copy()
    noise = generator.normal(size=(16, *begin.shape)) * 0.02
    steps, began_at = -WARM_UP, 0.0
    while steps <= 0 or time.perf_counter() - began_at < seconds:
        if steps == 0:
            began_at = time.perf_counter()
        worlds.ctrl[:] = begin + noise[steps % len(noise)]
        worlds.step()
        steps += 1
    rate = steps * num_envs / (time.perf_counter() - began_at)
    worlds.check()
    worlds.ctrl[:] = begin
    return rate


class Actor:
    """An actor's worlds and its loop, without a bus."""

    def __init__(self, model: FencingModel, worlds: Worlds, num_envs: int) -> None:
        env = FencingEnv(model, RuleBook(), ActionConfig(), num_envs, worlds=worlds)
        self._collector, self._policy = a_collector(env)
        self._hash = model.hash
        self._samples = ROLLOUT_STEPS * num_envs

    def play(self, seconds: float) -> float:
        """Return samples a second, up to the rollouts' bytes."""
        self._rollout()
        rollouts, began_at = 0, time.perf_counter()
        while time.perf_counter() - began_at < seconds:
            self._rollout()
            rollouts += 1
        return rollouts * self._samples / (time.perf_counter() - began_at)

    def _rollout(self) -> None:
        encode(rollout_of(self._collector.collect(self._policy), self._policy, self._hash))


def update_seconds(settings: Settings, device: str, samples: int) -> float:
    """Return the seconds of one PPO update of so many samples, the first one left out."""
    from services.learner.ppo import PolicyOptimiser

    cfg = msgspec.structs.replace(settings.learner, device=device)
    optimiser = PolicyOptimiser(cfg, seed=0)
    one = a_rollout()
    rollouts = [one] * (samples // one.rewards.size)
    optimiser.update(rollouts)
    begin = time.perf_counter()
    optimiser.update(rollouts)  # ends with figures on the processor, so nothing is left to do
    return time.perf_counter() - begin


def trained(words: tuple[str, ...], seconds: float) -> float:
    """Return training samples a second of a run with these settings over the default ones."""
    with training_run((*ENDLESS, "train.record=false", *words)) as run:
        return float(run.window(seconds)["samples_per_s"])


def run_on_card(seconds: float) -> float:
    """Return training samples a second of a run with one actor and the learner on the card."""
    words = (
        "train.actors=1", "actor.backend=warp", f"actor.num_envs={LOOP_WORLDS}",
        "learner.device=cuda", f"learner.batch_samples={LOOP_WORLDS * ROLLOUT_STEPS}",
    )  # fmt: skip
    return trained(words, seconds)


def run_on_cores(seconds: float) -> float:
    """Return training samples a second of a default run that has all of the machine's cores."""
    actors = max(1, (os.cpu_count() or 2) - 2)  # the learner and the router want one each
    batch = max(20480, 5120 * actors)  # as many rollouts an update as there are actors
    return trained((f"train.actors={actors}", f"learner.batch_samples={batch}"), seconds)


def why_not() -> str:
    """Return why there is nothing to measure; empty where there is."""
    if importlib.util.find_spec("mujoco_warp") is None:
        return "mujoco_warp is not installed: pip install 'riposte[gpu]'"
    import torch

    if not torch.cuda.is_available():
        return f"no graphics card that torch {torch.__version__} can use"
    return ""


def card_name() -> str:
    """Return what the first card is called."""
    import torch

    return torch.cuda.get_device_name(0)


def measure(smoke: bool) -> Measurement:
    """Return what the card does beside the processor.

    Raises:
        NotHereError: there is no card.
    """
    if why := why_not():
        raise NotHereError(why)
    settings = Settings.load(None)
    model = FencingModel.build(settings.sim)
    seconds, rounds, sizes = (0.5, 1, WORLDS[:2]) if smoke else (2.0, 3, WORLDS)
    cores = os.cpu_count() or 1
    sides: dict[str, Callable[[], float]] = {}
    few = FencingBatch(model, ON_A_CORE)
    many = FencingBatch(model, ON_A_CORE * cores, num_threads=cores)
    sides["one core"] = lambda: physics(few, ON_A_CORE, seconds)
    sides["all cores"] = lambda: physics(many, ON_A_CORE * cores, seconds)
    for size in sizes:
        sides[f"card, {size} worlds"] = _physics_on_card(model, size, seconds)
    core = Actor(model, FencingBatch(model, ON_A_CORE), ON_A_CORE)
    card = Actor(model, worlds_of("warp", model, LOOP_WORLDS), LOOP_WORLDS)
    sides["actor, one core"] = lambda: core.play(seconds)
    sides["actor, card"] = lambda: card.play(seconds)
    for samples in UPDATES:
        for device in ("cpu", "cuda"):
            sides[f"PPO update of {samples}, {device}"] = _update(settings, device, samples)
    window = seconds if smoke else RUN_SECONDS
    sides["training run, card"] = lambda: run_on_card(window)
    sides["training run, all cores"] = lambda: run_on_cores(window)
    turns = interleaved(rounds, [_told(name, side) for name, side in sides.items()])
    seen = [dict(zip(sides, turn, strict=True)) for turn in turns]
    best = max(sizes, key=lambda size: median(seen, f"card, {size} worlds"))
    runs = tuple(run | {"ratio": run[f"card, {best} worlds"] / run["all cores"]} for run in seen)
    return Measurement(
        value=median(runs, f"card, {best} worlds"),
        unit=f"world steps/s, {best} worlds on an {card_name()}",
        limit=median(runs, "all cores"),
        ratio=Check(
            name=f"card / all {cores} cores, physics", value=median(runs, "ratio"), goal=1.0
        ),
        runs=runs,
        checks=tuple(
            Check(name=name, value=1e3 * median(runs, name), unit="ms")
            if name.startswith("PPO")
            else Check(name=name, value=median(runs, name), unit="/s")
            for name in seen[0]
        ),
    )


def _told(name: str, side: Callable[[], float]) -> Callable[[], float]:
    """Return a side that says what it measured: all of it takes minutes."""

    def measured() -> float:
        value = side()
        print(f"{name}: {figure(value)}", file=sys.stderr, flush=True)
        return value

    return measured


def _physics_on_card(model: FencingModel, size: int, seconds: float) -> Callable[[], float]:
    worlds = worlds_of("warp", model, size)
    return lambda: physics(worlds, size, seconds)


def _update(settings: Settings, device: str, samples: int) -> Callable[[], float]:
    return lambda: update_seconds(settings, device, samples)
