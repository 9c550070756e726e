"""Where a run stands, for people: pure functions of the settings and the state."""

import itertools
import math
from collections.abc import Sequence

from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.leases import awaits_restart
from services.league.records import StageRecord, VersionRecord
from services.league.rounds import rounds_stages
from services.league.schedule import total_stages
from shared.messages.live import Progress
from shared.messages.training import AGENTS

SCORE_BOUTS = 100
"""The mean score is over this many of the latest complete bouts."""
RATE_VERSIONS = 20
"""Samples per second, and the score of a round, are over this many of the latest versions."""


def progress_of(cfg: LeagueConfig, state: RunState, bout_steps: int, message: str) -> Progress:
    """Return where the run stands."""
    record = state.stages[-1] if state.stages else None
    running = state.stage
    scores = latest_scores(state)
    bouts = len(scores)
    if not scores and record is not None:
        scores = estimated_scores(cfg, round_so_far(state, record), bout_steps)[-RATE_VERSIONS:]
        bouts = round(len(scores) * samples_an_update(round_so_far(state, record)) / bout_steps)
    mean, low, high = mean_interval(scores)
    last = record.versions[-1] if record is not None and record.versions else None
    metrics = last.metrics if last is not None else None
    return Progress(
        run=state.run,
        stage=record.stage.index if record is not None else -1,
        stages=total_stages(cfg),
        phase=running.stage.phase if running is not None else phase_between(state),
        iteration=record.stage.iteration if record is not None else 0,
        agent=running.stage.agent if running is not None else "",
        update=record.updates if record is not None else 0,
        max_updates=record.stage.max_updates if record is not None else 0,
        total_samples=sum(state.total_samples.values()),
        score_mean=mean,
        score_low=low,
        score_high=high,
        score_bouts=bouts,
        evaluations_done=state.evaluation_done,
        evaluations_total=state.evaluation_total,
        samples_per_s=samples_per_second(state) if running is not None else 0.0,
        policy_lag_mean=metrics.policy_lag_mean if metrics is not None else 0.0,
        approx_kl=metrics.approx_kl if metrics is not None else 0.0,
        explained_variance=metrics.explained_variance if metrics is not None else 0.0,
        dropped_rollouts=sum(i.what == "rollout_refused" for i in state.incidents),
        eta_seconds=eta_seconds(cfg, state, bout_steps),
        message=message,
        round=record.stage.round if record is not None else 0,
        rounds=cfg.rounds,
        iterations=(
            cfg.round_iterations if record is not None and record.stage.round else cfg.iterations
        ),
        opponent=state.player_label(running.stage.opponent) if running is not None else "",
    )


def describe(cfg: LeagueConfig, state: RunState) -> str:
    """Return where the run stands in one line."""
    if (record := state.stage) is not None:
        stage = record.stage
        where = f"stage {stage.index + 1} of {total_stages(cfg)}: {stage.agent}"
        if awaits_restart(record):
            return f"{where} goes back to the warm start"
        return f"{where} learns, update {record.updates} of {stage.max_updates}"
    if state.finished:
        return "finished"
    if state.evaluation_started_at_ns is not None and state.evaluation_done_at_ns is None:
        return f"evaluation: {state.evaluation_done} of {state.evaluation_total} bouts played"
    missing = [agent for agent in AGENTS if state.latest(agent) is None]
    return f"waiting for version 0 of {' and '.join(missing)}"


def phase_between(state: RunState) -> str:
    """Return the phase in words while no stage runs."""
    if state.finished:
        return "finished"
    return "start" if state.evaluation_started_at_ns is None else "evaluation"


def latest_scores(state: RunState) -> list[float]:
    """Return the scores of the latest complete training bouts of the newest stage."""
    if not state.stages:
        return []
    points = reversed(state.stages[-1].points)
    newest_first = (score for point in points for score in reversed(point.score))
    return list(itertools.islice(newest_first, SCORE_BOUTS))


def round_so_far(state: RunState, record: StageRecord) -> list[StageRecord]:
    """Return the stages of this stage's round in which its agent learned, oldest first."""
    stages = rounds_stages(state, record.stage.round) if record.stage.round else []
    return [other for other in stages if other.stage.agent == record.stage.agent]


def estimated_scores(
    cfg: LeagueConfig, stages: Sequence[StageRecord], bout_steps: int
) -> list[float]:
    """Return the antagonist's score a bout that each update's samples amount to.

    A stage of phase two is shorter than a bout, so that none is played in it from start to end;
    but its bouts stand side by side at every moment of the game, and its reward is the game score
    alone: the mean reward of a step, in points, times the steps of a bout is the mean score.
    """
    scores: list[float] = []
    for record in stages:
        stage = record.stage
        if stage.shaping_weight or not stage.score_weight:
            continue
        sign = 1.0 if stage.agent == "antagonist" else -1.0
        factor = sign * cfg.points_per_reward * bout_steps / stage.score_weight
        scores += [factor * v.metrics.reward_mean for v in record.versions if v.metrics is not None]
    return scores


def samples_an_update(stages: Sequence[StageRecord]) -> float:
    """Return the mean samples of an update of these stages, 0 before the first."""
    updates = sum(record.updates for record in stages)
    return sum(record.samples for record in stages) / updates if updates else 0.0


def mean_interval(values: Sequence[float]) -> tuple[float, float, float]:
    """Return mean, low and high end of its 95 % interval (normal); zeros without values."""
    count = len(values)
    if not count:
        return 0.0, 0.0, 0.0
    mean = sum(values) / count
    if count == 1:
        return mean, mean, mean
    variance = sum((value - mean) ** 2 for value in values) / (count - 1)
    half = 1.96 * math.sqrt(variance / count)
    return mean, mean - half, mean + half


def recent_versions(state: RunState) -> list[VersionRecord]:
    """Return the latest versions of the newest stage that has at least two, oldest first.

    In a round those of the stages before it too: each is short.
    """
    if state.stages and state.stages[-1].stage.round:
        stages = [record for record in state.stages[-RATE_VERSIONS:] if record.stage.round]
        versions = sorted((v for r in stages for v in r.versions), key=lambda v: v.at_ns)
        if len(versions) > 1:
            return versions[-RATE_VERSIONS:]
    for record in reversed(state.stages):
        if len(record.versions) > 1:
            return record.versions[-RATE_VERSIONS:]
    return []


def samples_per_second(state: RunState) -> float:
    """Return how fast the newest versions came, in samples per second; 0 when unknown."""
    versions = recent_versions(state)
    if not versions:
        return 0.0
    seconds = (versions[-1].at_ns - versions[0].at_ns) / 1e9
    samples = sum(version.metrics.samples for version in versions[1:] if version.metrics)
    return samples / seconds if seconds > 0 else 0.0


def eta_seconds(cfg: LeagueConfig, state: RunState, bout_steps: int) -> float:
    """Return the seconds until the end if every stage uses its budget up, -1 when unknown."""
    if state.finished:
        return 0.0
    rate = samples_per_second(state)
    versions = [version.metrics.samples for version in recent_versions(state) if version.metrics]
    if rate <= 0 or not versions:
        return -1.0
    seconds = remaining_updates(cfg, state) * (sum(versions) / len(versions)) / rate
    if state.evaluation_done_at_ns is not None:
        return seconds
    if (started := state.evaluation_started_at_ns) is not None and state.evaluation_done:
        elapsed = (state.last_at_ns - started) / 1e9
        left = state.evaluation_total - state.evaluation_done
        return seconds + left * elapsed / state.evaluation_done
    left = state.evaluation_total or expected_evaluation_bouts(cfg)
    return seconds + left * bout_steps / rate


def remaining_updates(cfg: LeagueConfig, state: RunState) -> int:
    """Return how many updates the stages still have, if each uses its budget up."""
    budgets = [cfg.antagonist_updates, cfg.protagonist_updates] * cfg.iterations
    a_round = [cfg.round_antagonist_updates, cfg.round_protagonist_updates] * cfg.round_iterations
    budgets += a_round * cfg.rounds
    left = sum(budgets[len(state.stages) :])
    if (record := state.stage) is not None:
        left += max(record.stage.max_updates - record.updates, 0)
    return left


def expected_evaluation_bouts(cfg: LeagueConfig) -> int:
    """Return how many bouts the evaluation will have: everybody against everybody, and static."""
    return cfg.evaluation_bouts * cfg.iterations * (1 + cfg.iterations)
