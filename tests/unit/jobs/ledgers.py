"""Writes the ledger of a plausible run, without a league, a learner or an actor."""

from pathlib import Path

import numpy as np

from services.league.config import LeagueConfig
from services.league.events import (
    BoutsPlayed,
    EvaluationDone,
    EvaluationPlanned,
    Event,
    IncidentNoted,
    LeaseEnded,
    LeaseGranted,
    Pairing,
    RunFinished,
    RunStarted,
    StageEnded,
    StageStarted,
    VersionEntered,
)
from services.league.ledger import Ledger
from shared.messages.league import Stage
from shared.messages.training import AGENTS, UpdateMetrics

SAMPLES = 20480
UPDATES = 40
BOUTS = 8
SECOND = 10**9
MODEL = "c0ffee" * 10 + "beef"


def digest(agent: str, version: int) -> str:
    return f"{AGENTS.index(agent)}{version:063x}"  # pyright: ignore[reportArgumentType]


class Script:
    """Makes events, one after the other."""

    def __init__(self, path: Path, seed: int = 0) -> None:
        self.ledger = Ledger(path)
        self.generator = np.random.default_rng(seed)
        self.at = 1_790_000_000 * SECOND
        self.versions = {"antagonist": 0, "protagonist": 0}
        self.leases = 0

    def add(self, *events: Event, seconds: float = 1.0) -> None:
        self.at += round(seconds * SECOND)
        self.ledger.append(events, self.at)

    def start(self) -> None:
        self.add(RunStarted(run="quick", seed=7, serial=False, config=LeagueConfig()))
        for agent in AGENTS:
            self.add(
                VersionEntered(
                    agent=agent, version=0, stage=-1, snapshot=digest(agent, 0), rollouts=(),
                    metrics=None,
                )
            )  # fmt: skip

    def lease(
        self, work: str, stage: int, antagonist: str, protagonist: str, bouts: int = 0
    ) -> str:
        self.leases += 1
        name = f"lease-{self.leases}"
        self.add(
            LeaseGranted(
                lease=name, number=self.leases, actor="actor-0", boot="b", work=work,  # pyright: ignore[reportArgumentType]
                stage=stage, antagonist=antagonist, protagonist=protagonist, bouts=bouts, seed=1,
            ),
            seconds=0.1,
        )  # fmt: skip
        return name

    def bouts(self, lease: str, stage: int, pair: tuple[str, str], mean: float, n: int) -> None:
        penalty = self.generator.integers(10, 40, n)
        camping = self.generator.integers(0, 4, n)
        score = np.round(self.generator.normal(mean, 150.0, n))
        attack = np.maximum(0, score + 10 * penalty - 10 * camping).astype(int)
        self.add(
            BoutsPlayed(
                name=f"{lease}:{self.at}", actor="actor-0", lease=lease, stage=stage,
                antagonist=pair[0], protagonist=pair[1], model=MODEL, bouts=tuple(range(n)),
                score=tuple(score.tolist()), attack_steps=tuple(attack.tolist()),
                penalty_steps=tuple(penalty.tolist()), camping_steps=tuple(camping.tolist()),
                complete=(True,) * n,
            ),
            seconds=0.2,
        )  # fmt: skip

    def stage(self, index: int, begin: float, end: float, updates: int = UPDATES) -> None:
        agent, other = AGENTS[index % 2], AGENTS[1 - index % 2]
        opponent = f"sha256:{digest(other, self.versions[other])}"
        stage = Stage(
            index=index, phase="one", iteration=1 + index // 2, agent=agent, opponent=opponent,
            max_updates=UPDATES, score_weight=1.0, shaping_weight=0.5,
        )  # fmt: skip
        self.add(StageStarted(stage=stage))
        lease = self.lease("train", index, "", "")
        for update in range(1, updates + 1):
            mean = end + (begin - end) * np.exp(-update / (UPDATES / 4))
            self.bouts(lease, index, (opponent, opponent), float(mean), BOUTS)
            self.versions[agent] += 1
            version = self.versions[agent]
            metrics = UpdateMetrics(
                samples=SAMPLES, total_samples=version * SAMPLES, reward_mean=0.1, value_loss=1.0,
                surrogate_loss=0.0, entropy=2.0,
                approx_kl=float(0.009 + 0.002 * self.generator.standard_normal()),
                clip_fraction=float(0.1 + 0.02 * self.generator.standard_normal()),
                explained_variance=float(0.9 - 0.8 * np.exp(-update / 10)),
                policy_lag_mean=float(self.generator.uniform(0, 1)), learning_rate=1e-3,
                action_std=0.6 - 0.004 * update, wait_seconds=0.1, update_seconds=0.2,
            )  # fmt: skip
            entered = VersionEntered(
                agent=agent, version=version, stage=index, snapshot=digest(agent, version),
                rollouts=(f"b:{index}:{update}",), metrics=metrics,
            )  # fmt: skip
            self.add(entered, seconds=0.4)
        if updates == UPDATES:
            self.add(LeaseEnded(lease=lease, reason="stage_ended"), seconds=0.0)
            last = self.versions[agent]
            ended = StageEnded(
                stage=index, reason="budget", version=last, snapshot=digest(agent, last)
            )
            self.add(ended)

    def evaluation(self, means: dict[tuple[str, str], float], bouts: int = 64) -> None:
        pairs = list(means)
        pairings = [Pairing(antagonist=a, protagonist=p, bouts=bouts) for a, p in pairs]
        self.add(EvaluationPlanned(plan=0, pairings=tuple(pairings)))
        for pair in pairs:
            lease = self.lease("evaluate", -1, *pair, bouts=bouts)
            self.bouts(lease, -1, pair, means[pair], bouts)
            self.add(LeaseEnded(lease=lease, reason="completed"), seconds=0.0)
        self.add(EvaluationDone(plan=0))

    def incident(self, what: str, detail: str) -> None:
        noted = IncidentNoted(
            source="train", boot="b", sequence=self.at, what=what, detail=detail,
            reported_at_ns=self.at,
        )  # fmt: skip
        self.add(noted)


def finished_run(folder: Path, *, incidents: bool = True) -> Path:
    """Write the ledger of two whole iterations and their evaluation; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    script = Script(folder / "league.sqlite")
    script.start()
    for index, (begin, end) in enumerate(((-400, 1700), (1700, -300), (-300, 1100), (1100, 150))):
        script.stage(index, begin, end)
        if incidents and index == 1:
            script.incident("process_restarted", "actor-0 <killed by signal 9> & started again")
    one, two = (f"sha256:{digest('antagonist', n)}" for n in (UPDATES, 2 * UPDATES))
    first, second = (f"sha256:{digest('protagonist', n)}" for n in (UPDATES, 2 * UPDATES))
    script.evaluation(
        {
            (one, "scripted:static"): 1780.0, (one, first): -250.0, (one, second): 60.0,
            (two, "scripted:static"): 1650.0, (two, first): 1080.0, (two, second): 140.0,
        }
    )  # fmt: skip
    script.add(RunFinished())
    script.ledger.close()
    return folder


def stopped_run(folder: Path) -> Path:
    """Write the ledger of a run that stopped in its second stage; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    script = Script(folder / "league.sqlite")
    script.start()
    script.stage(0, -400, 1700)
    script.stage(1, 1700, -300, updates=13)
    script.ledger.close()
    return folder


def empty_run(folder: Path) -> Path:
    """Write the ledger of a run in which nothing has happened yet; return the folder."""
    folder.mkdir(parents=True, exist_ok=True)
    script = Script(folder / "league.sqlite")
    script.start()
    script.ledger.close()
    return folder
