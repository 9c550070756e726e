"""What a graphics card gains: world steps a second of the physics, and seconds of a PPO update.

Both sides do the same work, in turns: `FencingBatch` on one core against `WarpBatch` on the card,
commands and sensors copied each step; the learner's update of one batch on each. Where there is no
card it says so and measures nothing.
"""

import importlib.util
import os
import time
from typing import Any

import msgspec
import numpy as np

from benchmarks.harness import interleaved, median
from services.jobs.bench import Check, Measurement, NotHereError
from services.jobs.settings import Settings
from shared.sim.model import FencingModel
from shared.sim.worlds import Backend, worlds_of

QUESTION = "what a graphics card gains: world steps/s of the physics, and PPO updates"
WORLDS = (1024, 4096, 16384)
"""On the card."""
ON_A_CORE = 256


def steps_per_second(
    backend: Backend, model: FencingModel, num_envs: int, seconds: float
) -> dict[str, float]:
    """Return world steps a second of worlds whose tools are sent about."""
    worlds = worlds_of(backend, model, num_envs)
    generator = np.random.default_rng(0)
    begin = worlds.ctrl.copy()
    noise = generator.normal(size=(16, *begin.shape)) * 0.02
    for wanted in noise[:4]:
        worlds.ctrl[:] = begin + wanted
        worlds.step()
    steps, began_at = 0, time.perf_counter()
    while time.perf_counter() - began_at < seconds:
        worlds.ctrl[:] = begin + noise[steps % len(noise)]
        worlds.step()
        steps += 1
    worlds.check()
    return {"steps_per_s": steps * num_envs / (time.perf_counter() - began_at)}


def update_seconds(settings: Settings, device: str, updates: int) -> dict[str, float]:
    """Return the seconds of one PPO update of a default batch (median)."""
    from benchmarks.throughput import a_rollout
    from services.learner.ppo import PolicyOptimiser

    cfg = msgspec.structs.replace(settings.learner, device=device)
    optimiser = PolicyOptimiser(cfg, seed=0)
    one = a_rollout()
    rollouts = [one] * (cfg.batch_samples // one.rewards.size)
    optimiser.update(rollouts)
    times: list[float] = []
    for _ in range(updates):
        begin = time.perf_counter()
        optimiser.update(rollouts)  # ends with figures on the processor, so nothing is left to do
        times.append(time.perf_counter() - begin)
    return {"update_s": float(np.median(times))}


def why_not() -> str:
    """Return why there is nothing to measure; empty where there is."""
    if importlib.util.find_spec("mujoco_warp") is None:
        return "mujoco_warp is not installed: pip install 'riposte[gpu]'"
    import torch

    if not torch.cuda.is_available():
        return f"no graphics card that torch {torch.__version__} can use"
    return ""


def measure(smoke: bool) -> Measurement:
    """Return what the card does beside one core.

    Raises:
        NotHereError: there is no card.
    """
    if why := why_not():
        raise NotHereError(why)
    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:1])
    settings = Settings.load(None)
    model = FencingModel.build(settings.sim)
    seconds, rounds, sizes = (0.5, 1, WORLDS[:1]) if smoke else (5.0, 5, WORLDS)
    turns = interleaved(
        rounds,
        [
            lambda: steps_per_second("cpu", model, ON_A_CORE, seconds),
            *(_on_card(model, size, seconds) for size in sizes),
            lambda: update_seconds(settings, "cpu", 3),
            lambda: update_seconds(settings, "cuda", 3),
        ],
    )
    runs: tuple[dict[str, Any], ...] = tuple(
        {"core": core["steps_per_s"]}
        | {f"card {n}": one["steps_per_s"] for n, one in zip(sizes, card, strict=True)}
        | {"update, core": slow["update_s"], "update, card": fast["update_s"]}
        | {"ratio": max(one["steps_per_s"] for one in card) / core["steps_per_s"]}
        for core, *card, slow, fast in turns
    )
    best = max(sizes, key=lambda size: median(runs, f"card {size}"))
    return Measurement(
        value=median(runs, f"card {best}"),
        unit=f"world steps/s, {best} worlds on the card",
        limit=median(runs, "core"),
        ratio=Check(name="card / one core, physics", value=median(runs, "ratio"), goal=1.0),
        runs=runs,
        checks=(
            *(
                Check(name=f"{size} worlds", value=median(runs, f"card {size}"), unit="steps/s")
                for size in sizes
            ),
            Check(name="PPO update, one core", value=median(runs, "update, core"), unit="s"),
            Check(name="PPO update, card", value=median(runs, "update, card"), unit="s"),
        ),
    )


def _on_card(model: FencingModel, size: int, seconds: float) -> Any:
    return lambda: steps_per_second("warp", model, size, seconds)
