"""Stage `play`: what each protagonist is worth on the twin with the hidden effect.

The batch of bouts is the twin's own physics: its model, its time step, its delay of commands. All
protagonists meet the same antagonists in the same bouts: same starts, same draws.
"""

import zlib
from collections.abc import Callable
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from shared.game.rules import RuleBook
from shared.messages.training import OBS_DIM
from shared.policy.action import ActionConfig
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import Player, SnapshotPlayer, scripted_player
from shared.runtime.files import atomic_write
from shared.sim.env import UNJUDGED_STEPS, FencingEnv
from shared.sim.model import FencingModel
from studies.closing_the_loop.protocol import TRAINED, Condition, Folders, Protocol, need, runs_of
from studies.closing_the_loop.training import snapshot_of

Say = Callable[[str], None]
Scores = dict[str, list[float]]
"""The antagonist's points in each bout, by antagonist."""


def play(protocol: Protocol, folders: Folders, say: Say) -> None:
    """Play what was not played yet, and keep every bout's score."""
    cfg = msgspec.structs.replace(protocol.twin, model=str(need(folders.truth, "hide")))
    model = FencingModel.build(cfg)
    for condition, seed in runs_of(protocol):
        path = folders.training(condition, seed) / "play.json"
        if path.exists():
            continue
        found: Scores = {}
        for antagonist in protocol.antagonists:
            found[antagonist] = _bouts(protocol, folders, model, condition, seed, antagonist)
            mean = float(np.mean(found[antagonist]))
            say(f"{condition:<9} seed {seed}  {antagonist:<16} {mean:>8.0f} points against it")
        atomic_write(path, msgspec.json.encode(found))


def scores_of(protocol: Protocol, folders: Folders) -> dict[Condition, NDArray[np.float64]]:
    """Return by condition float64[seeds, antagonists, bouts], the antagonist's points.

    Raises:
        ConfigError: not everything was played yet.
    """
    read: dict[Condition, list[Any]] = {}
    for condition, seed in runs_of(protocol):
        path = need(folders.training(condition, seed) / "play.json", "play")
        found = msgspec.json.decode(path.read_bytes(), type=Scores)
        read.setdefault(condition, []).append([found[name] for name in protocol.antagonists])
    return {condition: np.array(rows, np.float64) for condition, rows in read.items()}


def _bouts(
    protocol: Protocol, folders: Folders, model: FencingModel, condition: Condition, seed: int,
    antagonist: str,
) -> list[float]:  # fmt: skip
    rules = RuleBook(bout_steps=protocol.bout_steps)
    env = FencingEnv(model, rules, ActionConfig(), protocol.bouts)
    protagonist = _trained(folders, condition, seed, 1)
    opponent: Player
    if antagonist == TRAINED:
        opponent = _trained(folders, "nominal", protocol.seeds[0], 0)
    else:
        opponent = scripted_player(f"scripted:{antagonist}", env.arena)
    env.offset_scales = (opponent.offset_scale, 1.0)
    # of the antagonist alone: what it draws and where bouts begin is the same for every protagonist
    rng = np.random.default_rng([protocol.hidden_seed, zlib.crc32(antagonist.encode())])
    unused = np.random.default_rng(0)
    env.reset(np.arange(protocol.bouts), rng)
    theirs, ours = np.zeros((2, protocol.bouts, OBS_DIM), np.float32)
    for _ in range(protocol.bout_steps):
        env.observe(theirs, ours)
        env.advance(opponent.act(theirs, rng), protagonist.act(ours, unused))
        if env.unjudged == UNJUDGED_STEPS:
            env.judge()
    if env.unjudged:
        env.judge()
    return env.scores.score.tolist()


def _trained(folders: Folders, condition: Condition, seed: int, side: int) -> SnapshotPlayer:
    weights = snapshot_of(folders.training(condition, seed), side).weights
    return SnapshotPlayer(GaussianPolicy(weights), stochastic=False)
