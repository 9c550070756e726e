"""Reads the numbers of a run from its ledger: pure functions from its state to the summary."""

import dataclasses
from collections.abc import Sequence

import numpy as np

from services.jobs.report.rounds import round_summaries
from services.jobs.report.summary import (
    LOWERS_GOAL,
    RECOVERS_GOAL,
    Curve,
    Difference,
    IncidentSummary,
    Meeting,
    Origin,
    Score,
    StageSummary,
    Summary,
)
from services.league.history import SCRIPTED_STATIC, EvaluationRecord, RunState
from services.league.records import CurvePoint, StageRecord
from shared.game.rules import RuleBook
from shared.telemetry.intervals import Interval, difference_interval, mean_interval

CURVE_BINS = 40
"""Points of one stage's curve, at most."""
BIN_BOUTS = 12
"""Bouts in one point of the curve, at least."""


@dataclasses.dataclass(frozen=True)
class Facts:
    """What is known of a run besides its ledger."""

    folder: str
    started_at: str
    rules: RuleBook
    control_timestep: float
    """(s)."""
    origin: Origin


def summarise(state: RunState, facts: Facts) -> Summary:
    """Return the summary of a run; the same ledger gives the same numbers.

    Args:
        state: the ledger, folded.
        facts: what else there is to know.
    """
    generator = np.random.default_rng(state.seed)
    stages = _stages(state, generator)
    meetings = tuple(
        _meeting(state, record, facts.rules, generator) for record in state.evaluations.values()
    )
    differences = _differences(state, generator)
    counts: dict[str, int] = {}
    for incident in state.incidents:
        counts[incident.what] = counts.get(incident.what, 0) + 1
    end_ns = state.finished_at_ns or state.last_at_ns
    rounds = round_summaries(state, facts.rules.bout_steps)
    training = sum(part.seconds for part in (*stages, *rounds))
    samples = sum(state.total_samples.values())
    return Summary(
        run=state.run,
        folder=facts.folder,
        finished=state.finished,
        seed=state.seed,
        serial=state.serial,
        model=state.model,
        started_at=facts.started_at,
        seconds=(end_ns - state.started_at_ns) / 1e9,
        training_seconds=training,
        evaluation_seconds=_evaluation_seconds(state, end_ns),
        first_update_seconds=_first_update(state),
        samples=samples,
        samples_per_s=samples / training if training > 0 else 0.0,
        updates=sum(part.updates for part in (*stages, *rounds)),
        bout_seconds=facts.rules.bout_steps * facts.control_timestep,
        stages=stages,
        rounds=rounds,
        meetings=meetings,
        differences=differences,
        headline_differences=_headline_pair(differences),
        incidents=tuple(
            IncidentSummary(
                seconds=(record.at_ns - state.started_at_ns) / 1e9,
                source=record.source,
                what=record.what,
                detail=record.detail,
            )
            for record in state.incidents
        ),
        incident_counts=counts,
        leases_lapsed=sum(record.end_reason == "lapsed" for record in state.leases.values()),
        repeated_rollouts=state.repeated_rollouts,
        origin=facts.origin,
    )


def bins(points: Sequence[CurvePoint]) -> list[list[CurvePoint]]:
    """Return the points of a stage's curve put together in order, with enough bouts in each."""
    total = sum(len(point.score) for point in points)
    least = max(BIN_BOUTS, -(-total // CURVE_BINS))
    found: list[list[CurvePoint]] = []
    bouts = least
    for point in points:
        if bouts >= least:
            found.append([])
            bouts = 0
        found[-1].append(point)
        bouts += len(point.score)
    if len(found) > 1 and bouts < least:
        few = found.pop()
        found[-1] += few
    return found


def _stages(state: RunState, generator: np.random.Generator) -> tuple[StageSummary, ...]:
    before = 0
    found: list[StageSummary] = []
    for record in state.stages:
        if record.stage.round:
            break
        found.append(_stage(state, record, before, generator))
        before += record.samples
    return tuple(found)


def _stage(
    state: RunState, record: StageRecord, before: int, generator: np.random.Generator
) -> StageSummary:
    metrics = [version.metrics for version in record.versions if version.metrics is not None]
    scores = [score for point in record.points for score in point.score]
    tenth = max(64, len(scores) // 10)
    end_ns = record.ended_at_ns or state.last_at_ns

    def mean(name: str) -> float:
        values = [float(getattr(metric, name)) for metric in metrics]
        return float(np.mean(values)) if values else 0.0

    return StageSummary(
        index=record.stage.index,
        iteration=record.stage.iteration,
        agent=record.stage.agent,
        opponent=_label(state, record.stage.opponent),
        updates=record.updates,
        max_updates=record.stage.max_updates,
        samples=record.samples,
        samples_before=before,
        seconds=(end_ns - record.started_at_ns) / 1e9,
        ended=record.end_reason or "no",
        complete_bouts=record.complete_bouts,
        first=_score(mean_interval(scores[:tenth], generator)),
        last=_score(mean_interval(scores[-tenth:], generator)),
        approx_kl=mean("approx_kl"),
        clip_fraction=mean("clip_fraction"),
        explained_variance=mean("explained_variance"),
        policy_lag=mean("policy_lag_mean"),
        curve=_curve(record, generator),
    )


def _curve(record: StageRecord, generator: np.random.Generator) -> Curve:
    samples: list[float] = []
    found: list[Interval] = []
    for part in bins(record.points):
        scores = [score for point in part for score in point.score]
        interval = mean_interval(scores, generator)
        if interval is not None:
            found.append(interval)
            samples.append(float(np.mean([point.total_samples for point in part])))
    return Curve(
        samples=tuple(samples),
        mean=tuple(interval.mean for interval in found),
        low=tuple(interval.low for interval in found),
        high=tuple(interval.high for interval in found),
    )


def _meeting(
    state: RunState, record: EvaluationRecord, rules: RuleBook, generator: np.random.Generator
) -> Meeting:
    bouts = max(1, record.done)
    attack, penalty = sum(record.attack_steps), sum(record.penalty_steps)
    attack_points = rules.point * attack / bouts
    penalty_points = rules.penalty * penalty / bouts
    camping_points = rules.camping_award * sum(record.camping_steps) / bouts
    moved = abs(attack_points) + abs(penalty_points) + abs(camping_points)
    return Meeting(
        antagonist=_label(state, record.antagonist),
        protagonist=_label(state, record.protagonist),
        antagonist_player=record.antagonist,
        protagonist_player=record.protagonist,
        bouts=record.done,
        planned=record.planned,
        score=_score(mean_interval(record.score, generator)),
        attack_points=attack_points,
        penalty_points=penalty_points,
        camping_points=camping_points,
        camping_share=abs(camping_points) / moved if moved else 0.0,
        in_target_share=(attack + penalty) / (bouts * rules.bout_steps),
    )


def _differences(state: RunState, generator: np.random.Generator) -> tuple[Difference, ...]:
    """Return what each iteration's protagonist takes and what the next antagonist regains."""
    antagonists = [record.end_ref for record in state.stage_ends("antagonist", 0)]
    protagonists = [record.end_ref for record in state.stage_ends("protagonist", 0)]

    def scores(antagonist: str, protagonist: str) -> list[float]:
        record = state.evaluations.get((antagonist, protagonist))
        return record.score if record is not None else []

    found: list[Difference] = []
    for k, protagonist in enumerate(protagonists):
        antagonist, number = antagonists[k], k + 1
        against = scores(antagonist, protagonist)
        taken = difference_interval(scores(antagonist, SCRIPTED_STATIC), against, generator)
        if taken is not None:
            text = f"protagonist {number} lowers the score of antagonist {number}, v static"
            found.append(_difference("lowers", number, text, taken, LOWERS_GOAL))
        if k + 1 < len(antagonists):
            won = difference_interval(scores(antagonists[k + 1], protagonist), against, generator)
            if won is not None:
                text = (
                    f"antagonist {number + 1} recovers against protagonist {number}, "
                    f"v antagonist {number}"
                )
                found.append(_difference("recovers", number, text, won, RECOVERS_GOAL))
    return tuple(found)


def _difference(kind: str, number: int, text: str, found: Interval, goal: float) -> Difference:
    return Difference(
        kind=kind,
        iteration=number,
        text=text,
        score=Score(mean=found.mean, low=found.low, high=found.high, bouts=found.count),
        goal=goal,
        met=found.mean >= goal,
        certain=found.low >= goal,
    )


def _headline_pair(differences: Sequence[Difference]) -> tuple[Difference, ...]:
    """Return the last protagonist that was both trained and answered, and the answer to it."""
    recovered = [d.iteration for d in differences if d.kind == "recovers"]
    lowered = [d.iteration for d in differences if d.kind == "lowers"]
    wanted = max(recovered or lowered, default=0)
    return tuple(d for d in differences if d.iteration == wanted)


def _label(state: RunState, player: str) -> str:
    """Return a player's name; who has not learned yet is called that."""
    for agent, versions in state.versions.items():
        if 0 in versions and versions[0].ref == player:
            return f"untrained {agent}"
    return state.player_label(player)


def _score(found: Interval | None) -> Score | None:
    if found is None:
        return None
    return Score(mean=found.mean, low=found.low, high=found.high, bouts=found.count)


def _evaluation_seconds(state: RunState, end_ns: int) -> float:
    if state.evaluation_started_at_ns is None:
        return 0.0
    return ((state.evaluation_done_at_ns or end_ns) - state.evaluation_started_at_ns) / 1e9


def _first_update(state: RunState) -> float:
    learned = [
        version.at_ns for record in state.stages for version in record.versions if version.metrics
    ]
    return (min(learned) - state.started_at_ns) / 1e9 if learned else -1.0
