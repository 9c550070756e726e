"""Writes a run that went through phase two, with its snapshots and its tournament's bouts."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from services.league.config import LeagueConfig
from services.league.events import (
    RunFinished,
    RunStarted,
    StageEnded,
    StageStarted,
    VersionEntered,
)
from services.league.ledger import Ledger
from shared.game.rules import RuleBook
from shared.messages.league import Stage
from shared.messages.training import AGENTS
from shared.policy.snapshot import Snapshot
from shared.styles.bouts import BoutTable, Provenance, save
from shared.styles.features import FEATURES
from tests.unit.policy.making import snapshot
from tests.unit.styles.samples import NOISE, THREE_OF_SIX, TYPICAL

MODEL = "m" * 64
RUN = "made-up"
STATIC = "scripted:static"


def player(agent: str, round: int) -> Snapshot:
    """Return the snapshot that an agent ended a round with; round 0 is the warm start."""
    number = 2 * round + AGENTS.index(agent)  # pyright: ignore[reportArgumentType]
    return snapshot(seed=number, agent=agent, policy_version=1 + round)


def write_run(folder: Path, rounds: int = 6, bouts: int = 20) -> Path:
    """Write a finished run whose protagonists' styles are THREE_OF_SIX; return its folder."""
    (folder / "snapshots").mkdir(parents=True)
    ledger = Ledger(folder / "league.sqlite")
    at = 0

    def add(event: Any) -> None:
        nonlocal at
        at += 10**9
        ledger.append([event], at)

    add(RunStarted(run=RUN, seed=5, serial=False, config=LeagueConfig()))
    for index, (number, agent) in enumerate(
        (number, agent) for number in range(rounds + 1) for agent in AGENTS
    ):
        made = player(agent, number)
        (folder / "snapshots" / f"{made.digest}.safetensors").write_bytes(made.payload)
        stage = Stage(
            index=index, phase="two" if number else "one", iteration=1, agent=agent,
            opponent=STATIC, max_updates=1, score_weight=1.0, shaping_weight=0.0, round=number,
        )  # fmt: skip
        version = made.card.policy_version
        add(StageStarted(stage=stage))
        add(
            VersionEntered(
                agent=agent, version=version, stage=index, snapshot=made.digest, rollouts=(),
                metrics=None,
            )
        )  # fmt: skip
        add(StageEnded(stage=index, reason="budget", version=version, snapshot=made.digest))
    add(RunFinished())
    ledger.close()
    (folder / "tournament").mkdir()
    save(table(rounds, bouts), folder / "tournament" / "bouts.parquet")
    return folder


def table(rounds: int = 6, bouts: int = 20, seed: int = 0) -> BoutTable:
    """Return the bouts of the library, the warm start and a still player, against everybody."""
    generator = np.random.default_rng(seed)
    antagonists = [player("antagonist", number).reference for number in range(rounds + 1)]
    protagonists = [player("protagonist", number).reference for number in range(rounds + 1)]
    centres: Sequence[Any] = [np.full(8, -1.0), *THREE_OF_SIX[:rounds], np.full(8, -15.0)]
    pools = (tuple(antagonists), (*protagonists, STATIC))
    one, two, number = np.indices((len(pools[0]), len(pools[1]), bouts), np.int32).reshape(3, -1)
    count = len(one)
    features = np.zeros((count, 2, len(FEATURES)), np.float32)
    features[:, 1] = TYPICAL + NOISE * (
        np.array(centres)[two] + generator.normal(size=(count, len(FEATURES)))
    )
    features[:, 0] = generator.normal(size=(count, len(FEATURES)))
    attack = generator.integers(0, 900, count, np.int32)
    zero = np.zeros(count, np.int32)
    return BoutTable(
        antagonists=pools[0],
        protagonists=pools[1],
        antagonist=one.copy(),
        protagonist=two.copy(),
        bout=number.copy(),
        seed=np.zeros(count, np.int64),
        score=attack.astype(np.float32),
        attack_steps=attack,
        penalty_steps=zero,
        camping_steps=zero,
        features=features,
        provenance=Provenance(
            run=RUN, seed=9, model=MODEL, control_timestep=0.01, game=RuleBook(), labels={}
        ),
    )
