"""Wall time until the antagonist keeps its bat in the target of a player that holds still.

Ours is what `riposte train` starts, with its recorder; the others are loops in one process. All
train against a frozen fresh protagonist with the same PPO, from nothing, and are over when the
policy without noise is in the target for 95 % of the steps of 32 bouts. The clock runs from the
start of the process, or of the run, and stands still while a loop is measured; the versions of a
run are measured afterwards. Interquartile means over the seeds, with 95 % bootstrap intervals.
"""

import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from benchmarks.harness import on_first_cores
from benchmarks.peer_loops.running import Peer, fresh_protagonist, run, work_of
from benchmarks.peer_loops.skill import EVERY, MOST_UPDATES, Act, share_in_target
from benchmarks.seeds import Interval, iqm_interval, ratio_interval
from benchmarks.training_run import ENDLESS, TrainingRun, training_run
from services.jobs.bench import Check, Measurement
from services.jobs.runs import state_of
from services.jobs.settings import Settings
from services.learner.config import LearnerConfig
from shared.errors import RiposteError
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SnapshotPlayer
from shared.policy.snapshot import unpack

QUESTION = "wall time until the antagonist is in a still player's target for 95 % of the time"
SKILL = 0.95
GOAL = 0.6
SEEDS = 5
PEERS = (
    Peer(name="rsl_rl's runner", module="rsl_rl_runner", num_envs=256),
    Peer(
        name="rsl_rl's runner, begun as ours", module="rsl_rl_runner", mode="begun-alike",
        num_envs=256,
    ),
    Peer(name="CleanRL's style", module="cleanrl_style", num_envs=256),
    Peer(
        name="Stable-Baselines3", module="stable_baselines3", num_envs=256,
        requirements="stable-baselines3",
    ),
)  # fmt: skip
"""Sample Factory and RLlib keep their policy in another process and are slower than the best of
these a sample (`peers.py`): they are not asked."""
RUN_SECONDS = 300.0


def ours(seed: int, updates: int) -> dict[str, Any]:
    """Return when a run of so many updates had the skill.

    Raises:
        RiposteError: a process died, or the run took too long.
    """
    began_ns = time.time_ns()
    with training_run((*ENDLESS, f"train.seed={seed}")) as training:
        training.wait_for_version(updates, RUN_SECONDS)
        training.stop()
        return _race_of(training, began_ns)


def _race_of(training: TrainingRun, began_ns: int) -> dict[str, Any]:
    versions = [it for it in state_of(training.folder).stages[0].versions if it.metrics]
    skill, version = 0.0, versions[0]
    for version in versions[EVERY - 1 :: EVERY]:
        skill = share_in_target(_player(training.folder, version.snapshot))
        if skill >= SKILL:
            break
    assert version.metrics is not None
    return {
        "peer": "ours",
        "wall_s": (version.at_ns - began_ns) / 1e9,
        "first_update_s": (versions[0].at_ns - began_ns) / 1e9,
        "samples": version.metrics.total_samples + LearnerConfig().warm_up_samples,
        "updates": version.version,
        "skill": skill,
    }


def _player(folder: Path, snapshot: str) -> Act:
    payload = (folder / "snapshots" / f"{snapshot}.safetensors").read_bytes()
    player = SnapshotPlayer(GaussianPolicy(unpack(payload, snapshot).weights), stochastic=False)
    generator = np.random.default_rng(0)
    return lambda obs: player.act(obs, generator)


def measure(smoke: bool) -> Measurement:
    """Return our time to the skill beside that of the loops."""
    settings = Settings.load(None)
    seeds, updates = (1, 2 * EVERY) if smoke else (SEEDS, MOST_UPDATES)
    skill = 1e-9 if smoke else SKILL
    peers = PEERS[:1] if smoke else PEERS
    races: list[dict[str, Any]] = []
    with on_first_cores(2), tempfile.TemporaryDirectory(prefix="riposte-skill-") as folder:
        opponent = fresh_protagonist(settings, Path(folder) / "opponent.safetensors")
        for seed in range(seeds):
            _add(races, seed, ours(seed, updates))
            for peer in peers:
                work = work_of(peer, settings, opponent, RUN_SECONDS)
                work = msgspec.structs.replace(work, seed=seed, skill=skill)
                _add(races, seed, run(peer, work))
    if not smoke and not any(race["skill"] >= SKILL for race in races):
        raise RiposteError(f"nobody was in the target for {SKILL:.0%}: nothing to compare")
    return _measurement(races, [peer.name for peer in peers])


def _add(races: list[dict[str, Any]], seed: int, race: dict[str, Any]) -> None:
    races.append(race | {"seed": seed})
    print(
        f"seed {seed}: {race['peer']:<30} {race['wall_s']:6.1f} s, {race['samples']:>9,} samples, "
        f"in the target {race['skill']:.3f}",
        file=sys.stderr, flush=True,
    )  # fmt: skip


def _measurement(races: list[dict[str, Any]], peers: Sequence[str]) -> Measurement:
    def times(name: str, *, learning: bool = False) -> list[float]:
        mine = [race for race in races if race["peer"] == name]
        return [race["wall_s"] - learning * race["first_update_s"] for race in mine]

    walls = {name: iqm_interval(times(name)) for name in ("ours", *peers)}
    best = min(peers, key=lambda name: walls[name].value)
    ratio = ratio_interval(times("ours"), times(best))
    quickest = min(peers, key=lambda name: iqm_interval(times(name, learning=True)).value)
    learning = ratio_interval(times("ours", learning=True), times(quickest, learning=True))
    return Measurement(
        value=walls["ours"].value,
        unit="s to the skill",
        limit=walls[best].value,
        ratio=_check(f"ours / {best}, from the start", ratio, goal=GOAL),
        runs=tuple(races),
        checks=(
            _check(f"ours / {quickest}, from the first update", learning),
            *(_check(f"{name}, from the start", wall, unit="s") for name, wall in walls.items()),
            *(
                Check(name=f"{name}: samples", value=float(np.median(_of(races, name, "samples"))))
                for name in walls
            ),
            *(
                Check(
                    name=f"{name}: seeds that got there", goal=float(len(skills)),
                    value=float(sum(skill >= SKILL for skill in skills)),
                )
                for name in walls
                for skills in (_of(races, name, "skill"),)
            ),
        ),
    )  # fmt: skip


def _of(races: list[dict[str, Any]], name: str, what: str) -> list[float]:
    return [race[what] for race in races if race["peer"] == name]


def _check(name: str, found: Interval, unit: str = "", goal: float | None = None) -> Check:
    return Check(
        name=name, value=found.value, unit=unit, low=found.low, high=found.high, goal=goal,
        goal_is="at most",
    )  # fmt: skip
