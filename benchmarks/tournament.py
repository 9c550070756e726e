"""A tournament's speed against the actor benchmark's loop, on one core, in turns.

A round plays one whole pairing of 100 bouts through the real actor, league and ledger in one
process: lease, snapshots fetched and unpacked, both players' policies, the style meter, judging,
results, their commit. Then the training loop of ``riposte bench actor`` plays about as long.
"""

import os
import tempfile
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from benchmarks.actor import Loop, a_policy
from benchmarks.harness import cpu_of, interleaved, median
from services.actor.config import ActorConfig
from services.actor.service import Actor
from services.jobs.bench import Check, Measurement
from services.jobs.settings import Settings
from services.jobs.tournament.command import begin_ledger
from services.jobs.tournament.plan import Plan, batch_size
from services.league.service import League
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock
from shared.game.reward import RewardConfig
from shared.messages.training import AGENTS
from shared.policy.action import ACTION_SCHEMA, ActionConfig
from shared.policy.observation import OBSERVATION_SCHEMA
from shared.policy.snapshot import Card, Fit, Snapshot, normaliser_hash, pack
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel

QUESTION = "how much of the actor benchmark's speed is left in a tournament, on one core"
GOAL = 0.70
BOUTS = 100
BATCH = 256


def a_snapshot(agent: Any, number: int, fit: Fit, weights: Any) -> Snapshot:
    """Return a policy as a run's store has it."""
    card = Card(
        agent=agent, policy_version=number, stage=0, run="bench", seed=0, total_samples=0,
        observation_schema=OBSERVATION_SCHEMA, action_schema=ACTION_SCHEMA,
        normaliser=normaliser_hash(weights.obs_mean, weights.obs_std),
        control_timestep=fit.control_timestep, offset_bound_m=fit.offset_bound_m,
        offset_bound_rad=fit.offset_bound_rad, model=str(fit.model), activation="tanh",
        hidden_dims=(64, 64),
    )  # fmt: skip
    return pack(card, weights)


class Tournament:
    """League and actor in one process, with so many pairings before them."""

    def __init__(self, folder: Path, pairings: int, bout_steps: int) -> None:
        settings = Settings.load(None, (f"game.bout_steps={bout_steps}",))
        model = FencingModel.build(settings.sim)
        fit = Fit.of(ActionConfig(), model.cfg.control_timestep, model.hash)
        generator = np.random.default_rng(0)
        (folder / "snapshots").mkdir(parents=True)
        players: dict[str, list[str]] = {agent: [] for agent in AGENTS}
        for agent in AGENTS:
            for number in range(pairings if agent == "antagonist" else 1):
                made = a_snapshot(agent, number, fit, a_policy(generator).weights)
                (folder / "snapshots" / f"{made.digest}.safetensors").write_bytes(made.payload)
                players[agent].append(made.reference)
        plan = Plan(
            run="bench", antagonists=tuple(players["antagonist"]),
            protagonists=tuple(players["protagonist"]), labels={}, bouts=BOUTS, commit="",
        )  # fmt: skip
        begin_ledger(folder, plan, settings)
        clock = SystemClock()
        self._hub = MemoryHub(clock, max_messages=1024)
        self.league = League(
            settings.league, self._hub.join("league-0"), clock, folder, "bench-tournament",
            settings.league.seed, serial=False, rules=settings.game,
        )  # fmt: skip
        cfg = msgspec.structs.replace(
            ActorConfig(), num_envs=batch_size(BOUTS, BATCH), frame_period=0.0
        )
        env = FencingEnv(model, settings.game, ActionConfig(), cfg.num_envs)
        self.actor = Actor(cfg, RewardConfig(), env, fit, self._hub.join("actor-0"), clock)
        self.steps = BOUTS * settings.game.bout_steps

    def play(self) -> None:
        """Play one pairing, up to its commit."""
        wanted = self.league.state.evaluation_done + BOUTS
        while self.league.state.evaluation_done < wanted:
            self.actor.tick()
            self.league.tick()

    def close(self) -> None:
        """Close the ledger."""
        self.league.close()


def measure(smoke: bool) -> Measurement:
    """Return the tournament's speed beside the actor's training loop."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    rounds, bout_steps, rollouts = (2, 200, 1) if smoke else (9, 2000, 20)
    loop = Loop(256, rollouts)
    loop_steps = rollouts * 40 * 256
    with tempfile.TemporaryDirectory() as folder:
        tournament = Tournament(Path(folder) / "run", rounds + 1, bout_steps)
        tournament.play()  # warm up

        def one() -> dict[str, Any]:
            mine = cpu_of(tournament.play) / tournament.steps
            its = cpu_of(lambda: [loop.play() for _ in range(rollouts)]) / loop_steps
            return {"tournament_us": 1e6 * mine, "loop_us": 1e6 * its, "ratio": its / mine}

        runs = [run for (run,) in interleaved(rounds, [one])]
        cached = tournament.actor.health().counters["opponents_cached"]
        tournament.close()
    return Measurement(
        value=1e6 / median(runs, "tournament_us"),
        unit="world steps per CPU second, 100 bouts a pairing",
        limit=1e6 / median(runs, "loop_us"),
        ratio=Check(
            name="tournament / actor loop at 256 worlds", value=median(runs, "ratio"), goal=GOAL
        ),
        runs=tuple(runs),
        checks=(
            Check(name="tournament", value=median(runs, "tournament_us"), unit="us"),
            Check(name="actor loop", value=median(runs, "loop_us"), unit="us"),
            Check(
                name="opponents in memory", value=cached, goal=ActorConfig().opponent_cache,
                goal_is="at most",
            ),
        ),
    )  # fmt: skip
