"""The numbers of phase two: each round, each of its short stages, who was drawn."""

import msgspec
import numpy as np

from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.progress import estimated_scores
from services.league.records import StageRecord
from services.league.rounds import rounds_stages
from shared.telemetry.intervals import mean_interval

ENDS = 5
"""Iterations at the beginning and at the end of a round whose scores are compared."""


class Estimate(msgspec.Struct, frozen=True, kw_only=True):
    """A mean score of training, in points a bout, with its 95 % bootstrap interval.

    Over updates, each the mean reward of its samples times a bout's steps: a stage is shorter than
    a bout (``services.league.progress.estimated_scores``).
    """

    mean: float
    low: float
    high: float
    updates: int


class Turn(msgspec.Struct, frozen=True, kw_only=True):
    """One stage of a round."""

    stage: int
    iteration: int
    agent: str
    """Who learned."""
    opponent: str
    """Who was drawn."""
    age: int
    """Versions that the opponent's side had left after it: 0 for the newest; -1 for a scripted
    player."""
    updates: int
    samples: int
    samples_before: int
    """That both agents had learned from when it began, over the whole run."""
    seconds: float
    score: float | None
    """The antagonist's mean score (points a bout); None before the first update."""


class RoundSummary(msgspec.Struct, frozen=True, kw_only=True):
    """One round of phase two."""

    round: int
    finished: bool
    antagonist: str
    """Player reference of the newest version of the round; empty before the first."""
    protagonist: str
    updates: int
    samples: int
    seconds: float
    first: Estimate | None
    """Score over the first iterations."""
    last: Estimate | None
    """Score over the last iterations."""
    turns: tuple[Turn, ...]


def round_summaries(state: RunState, bout_steps: int) -> tuple[RoundSummary, ...]:
    """Return every round that was begun; the same ledger gives the same numbers."""
    generator = np.random.default_rng(state.seed)
    finished = {number for number, _, _ in state.library()}
    last = max((record.stage.round for record in state.stages), default=0)
    before = sum(r.samples for r in state.stages if r.stage.round == 0)
    found: list[RoundSummary] = []
    for number in range(1, last + 1):
        made = _round(state, number, before, bout_steps, number in finished, generator)
        before += made.samples
        found.append(made)
    return tuple(found)


def _round(
    state: RunState,
    number: int,
    before: int,
    bout_steps: int,
    finished: bool,
    generator: np.random.Generator,
) -> RoundSummary:
    cfg = state.config or LeagueConfig()
    records = rounds_stages(state, number)
    turns: list[Turn] = []
    for record in records:
        turn = _turn(state, cfg, record, before, bout_steps)
        before += turn.samples
        turns.append(turn)
    final = records[-1].stage.iteration
    ends = [state.stage_ends(agent, number) for agent in ("antagonist", "protagonist")]
    antagonist, protagonist = (side[-1].end_ref if side else "" for side in ends)

    def score(first: int, last: int) -> Estimate | None:
        part = [r for r in records if first <= r.stage.iteration <= last]
        found = mean_interval(estimated_scores(cfg, part, bout_steps), generator)
        if found is None:
            return None
        return Estimate(mean=found.mean, low=found.low, high=found.high, updates=found.count)

    return RoundSummary(
        round=number,
        finished=finished,
        antagonist=antagonist,
        protagonist=protagonist,
        updates=sum(turn.updates for turn in turns),
        samples=sum(turn.samples for turn in turns),
        seconds=sum(turn.seconds for turn in turns),
        first=score(1, ENDS),
        last=score(final - ENDS + 1, final),
        turns=tuple(turns),
    )


def _turn(
    state: RunState, cfg: LeagueConfig, record: StageRecord, before: int, bout_steps: int
) -> Turn:
    stage = record.stage
    scores = estimated_scores(cfg, [record], bout_steps)
    return Turn(
        stage=stage.index,
        iteration=stage.iteration,
        agent=stage.agent,
        opponent=state.player_label(stage.opponent),
        age=_age(state, record),
        updates=record.updates,
        samples=record.samples,
        samples_before=before,
        seconds=((record.ended_at_ns or state.last_at_ns) - record.started_at_ns) / 1e9,
        score=float(np.mean(scores)) if scores else None,
    )


def _age(state: RunState, record: StageRecord) -> int:
    """Return how many versions the other side had left after the one drawn, -1 if scripted."""
    stage = record.stage
    ends = [
        other
        for other in state.stages[: stage.index]
        if other.stage.round == stage.round and other.stage.agent != stage.agent
    ]
    refs = [other.end_ref for other in ends]
    if stage.opponent in refs:
        return len(refs) - 1 - refs.index(stage.opponent)
    return len(refs) if stage.opponent in (state.warm_start() or ()) else -1
