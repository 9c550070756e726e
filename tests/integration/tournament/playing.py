"""A finished run that never was: a ledger with two iterations, and real snapshots in its store."""

import json
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from services.jobs.settings import Settings
from services.league.config import LeagueConfig
from services.league.events import RunStarted, StageEnded, StageStarted, VersionEntered
from services.league.history import RunState
from services.league.ledger import Ledger
from shared.messages.league import Stage
from shared.messages.training import AGENTS
from shared.policy.snapshot import Snapshot
from shared.sim.model import FencingModel
from tests.unit.policy.making import snapshot

ROOT = Path(__file__).resolve().parents[3]
SMALL = (
    "game.bout_steps=80",
    "actor.num_envs=8",
    "actor.rollout_steps=20",
    "sim.target_radius=0.45",
    "train.tournament_bouts=12",
)
WORDS = ("--players", "scripted:static", "scripted:stab")
"""What a small tournament is asked for with."""


def a_run(folder: Path, *, stages: int = 4) -> Path:
    """Write a run of so many ended stages; its policies are small and random."""
    settings = Settings.load(None, SMALL)
    model = FencingModel.build(settings.sim).hash
    (folder / "snapshots").mkdir(parents=True)
    (folder / "config.toml").write_text(settings.to_toml())
    ledger = Ledger(folder / "league.sqlite")
    ledger.append([RunStarted(run="small", seed=0, serial=False, config=LeagueConfig())], 1)
    versions: dict[str, Snapshot] = {}
    for number in range(-2, stages):
        agent = AGENTS[number % 2]
        made = snapshot(number + 20, agent=agent, policy_version=number // 2 + 1, model=model)
        versions[agent] = made
        path = folder / "snapshots" / f"{made.digest}.safetensors"
        path.write_bytes(made.payload)
        entered = VersionEntered(
            agent=agent, version=number // 2 + 1, stage=max(-1, number), snapshot=made.digest,
            rollouts=() if number < 0 else (f"r:{number}",), metrics=None,
        )  # fmt: skip
        if number < 0:
            ledger.append([entered], 2)
            continue
        other = versions[AGENTS[1 - number % 2]].reference
        stage = Stage(
            index=number, phase="one", iteration=1 + number // 2, agent=agent, opponent=other,
            max_updates=1, score_weight=1.0, shaping_weight=0.4,
        )  # fmt: skip
        ended = StageEnded(
            stage=number, reason="budget", version=number // 2 + 1, snapshot=made.digest
        )
        ledger.append([StageStarted(stage=stage), entered, ended], 3)
    ledger.close()
    return folder


def command(folder: Path, *words: str) -> list[str]:
    """Return the command line of a tournament of a run."""
    return [sys.executable, "-m", "services.cli", "tournament", str(folder), *words]


def riposte(words: Sequence[str], seconds: float = 100.0) -> "subprocess.CompletedProcess[str]":
    """Run a command to its end."""
    return subprocess.run(
        [sys.executable, "-m", "services.cli", *words], cwd=ROOT, capture_output=True, text=True,
        timeout=seconds, check=False,
    )  # fmt: skip


def tournament(folder: Path, *words: str) -> dict[str, object]:
    """Play a tournament to its end and return its summary."""
    done = riposte(["tournament", str(folder), "--json", *words])
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout.splitlines()[-1])


def assert_one_opponent_a_bout(found: RunState) -> None:
    """Every bout in the ledger has one opponent from start to end: that of its lease."""
    for record in found.evaluations.values():
        assert sorted(record.number) == list(range(record.planned))
    for lease in found.leases.values():
        assert lease.end_reason in ("completed", "lapsed", "superseded", "restarted", "asked_again")
