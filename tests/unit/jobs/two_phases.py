"""Writes what a run of both phases leaves, without training: ledger, bouts, best responses."""

import json
from pathlib import Path

import numpy as np

from services.league.config import LeagueConfig
from services.league.events import (
    Entry,
    Event,
    RunFinished,
    RunStarted,
    StageEnded,
    StageStarted,
    VersionEntered,
)
from services.league.history import RunState
from services.league.rounds import Turn, round_stage
from services.league.sampling import Sampler
from shared.game.rules import RuleBook
from shared.messages.training import AGENTS, Agent, UpdateMetrics
from shared.styles.bouts import BoutTable, Provenance
from tests.unit.jobs.ledgers import MODEL, SAMPLES, SECOND, Script, digest

ROUNDS = 3
ITERATIONS = 8
BOUTS = 20
"""Of each pairing of the tournament."""
POINTS_PER_REWARD = 10.0
PEOPLE = ("scripted:stab", "scripted:person-steady")
MEANS = {
    "scripted:static": 1500.0,
    "scripted:heuristic": 300.0,
    "scripted:heuristic-retreating": 150.0,
}
"""What everybody scores against these; against the warm start 400, against round k 100 k."""


class TwoPhases(Script):
    """Makes events, and keeps the state they make; writes them a stage at a time."""

    def __init__(self, path: Path, config: LeagueConfig) -> None:
        super().__init__(path)
        self.config = config
        self.state = RunState()
        self.unwritten: list[Event] = []

    def add(self, *events: Event, seconds: float = 1.0) -> None:
        self.at += round(seconds * SECOND)
        for event in events:
            self.state.apply(Entry(seq=self.state.position + 1, at_ns=self.at, event=event))
        self.unwritten += events
        if isinstance(events[-1], StageStarted | StageEnded | RunFinished):
            self.ledger.append(self.unwritten, self.at)
            self.unwritten = []

    def start(self) -> None:
        self.add(RunStarted(run="both", seed=self.config.seed, serial=False, config=self.config))
        for agent in AGENTS:
            self._version(agent, -1, None)

    def turn(self, turn: Turn, score: float) -> None:
        stage = round_stage(self.config, self.state, turn)
        self.add(StageStarted(stage=stage))
        if turn.iteration == 1:
            self._version(turn.agent, stage.index, None)
        sign = 1.0 if turn.agent == "antagonist" else -1.0
        for _ in range(stage.max_updates):
            self._version(turn.agent, stage.index, sign * score / POINTS_PER_REWARD / 2000)
        last = self.versions[turn.agent]
        self.add(
            StageEnded(
                stage=stage.index, reason="budget", version=last, snapshot=digest(turn.agent, last)
            )
        )

    def _version(self, agent: Agent, stage: int, reward: float | None) -> None:
        number = self.versions[agent] + (stage >= 0)
        self.versions[agent] = number
        total = self.state.total_samples[agent] + SAMPLES
        metrics = None
        if reward is not None:
            metrics = UpdateMetrics(
                samples=SAMPLES, total_samples=total, reward_mean=reward, value_loss=1.0,
                surrogate_loss=0.0, entropy=2.0, approx_kl=0.01, clip_fraction=0.1,
                explained_variance=0.9, policy_lag_mean=0.5, learning_rate=1e-3, action_std=0.5,
                wait_seconds=0.1, update_seconds=0.2,
            )  # fmt: skip
        self.add(
            VersionEntered(
                agent=agent, version=number, stage=stage, snapshot=digest(agent, number),
                rollouts=() if metrics is None else (f"b:{stage}:{number}",), metrics=metrics,
            )
        )  # fmt: skip


def played_run(
    folder: Path, *, sampler: Sampler = "uniform", swing: float = 300.0, rounds: int = ROUNDS
) -> RunState:
    """Write the ledger of both phases; return its state.

    In phase one the score is 1,700 after the antagonist learned and -300 after the protagonist
    did, in iteration 2 only 500 and 150; in a round it is plus and minus half of ``swing``.
    """
    folder.mkdir(parents=True, exist_ok=True)
    config = LeagueConfig(
        seed=7, rounds=rounds, round_iterations=ITERATIONS, round_antagonist_updates=2,
        round_protagonist_updates=3, sampler=sampler,
    )  # fmt: skip
    script = TwoPhases(folder / "league.sqlite", config)
    script.start()
    for index, (begin, end) in enumerate(((-400, 1700), (1700, -300), (-300, 500), (500, 150))):
        script.stage(index, begin, end)
    for number in range(1, rounds + 1):
        for iteration in range(1, ITERATIONS + 1):
            for agent, sign in zip(AGENTS, (0.5, -0.5), strict=True):
                script.turn(Turn(number, iteration, agent), sign * swing)
    script.add(RunFinished())
    script.ledger.close()
    return script.state


def bout_table(state: RunState) -> BoutTable:
    """Return a tournament of the library, the warm start, people and baselines."""
    generator = np.random.default_rng(1)
    warm = state.warm_start()
    assert warm is not None
    library = state.library()
    antagonists = (*(a for _, a, _ in library), warm[0], *PEOPLE)
    protagonists = (*(p for _, _, p in library), warm[1], *MEANS)
    labels = {ref: f"antagonist {k}" for k, ref, _ in library}
    labels |= {ref: f"protagonist {k}" for k, _, ref in library}
    means = {ref: 100.0 * k for k, _, ref in library} | {warm[1]: 400.0} | MEANS
    one, two = np.divmod(np.arange(len(antagonists) * len(protagonists)), len(protagonists))
    antagonist, protagonist = (np.repeat(side, BOUTS).astype(np.int32) for side in (one, two))
    count = len(antagonist)
    mean = np.array([means[ref] for ref in protagonists])[protagonist]
    score = np.round(generator.normal(mean, 50.0)).astype(np.float32)
    is_heuristic = protagonist == protagonists.index("scripted:heuristic")
    camping = np.select([protagonist == 0, is_heuristic], [2, 10], 0).astype(np.int32)
    features = generator.normal(0.0, 0.1, (count, 2, 8)).astype(np.float32)
    features[:, 1] += 5.0 + np.eye(8, dtype=np.float32)[protagonist % 8] * 4.0
    return BoutTable(
        antagonists=antagonists, protagonists=protagonists, antagonist=antagonist,
        protagonist=protagonist, bout=np.tile(np.arange(BOUTS, dtype=np.int32), len(one)),
        seed=np.zeros(count, np.int64), score=score,
        attack_steps=(score + 1000.0 - 10.0 * camping).astype(np.int32),
        penalty_steps=np.full(count, 100, np.int32), camping_steps=camping, features=features,
        provenance=Provenance(
            run="both", seed=1, model=MODEL, control_timestep=0.01, game=RuleBook(), labels=labels
        ),
    )  # fmt: skip


def best_responses(folder: Path, state: RunState) -> None:
    """Write two best responses to each protagonist, and one with a smaller budget."""
    warm = state.warm_start()
    assert warm is not None
    kept = folder / "exploitability"
    kept.mkdir()
    for number, ref in ((0, warm[1]), *((k, p) for k, _, p in state.library())):
        for seed in range(2):
            score = 900.0 - 100.0 * number + 20.0 * seed
            response = {"opponent": ref, "budget": 500_000, "score": score}
            (kept / f"{number}-{seed}.json").write_text(json.dumps(response), encoding="utf-8")
    small = {"opponent": warm[1], "budget": 1000, "score": 5.0}
    (kept / "small.json").write_text(json.dumps(small), encoding="utf-8")
