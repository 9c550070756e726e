"""What happens next: pure functions of the settings and the state of the run.

Phase one, Yang et al. 2021: in each iteration the antagonist learns against the protagonist's
latest policy until it converges or its budget is spent, then the protagonist against the
antagonist's latest. Then everybody who came out of a stage meets everybody of the other side.
Then come the rounds of phase two (``rounds.py``), if any are asked for.
"""

from collections.abc import Sequence

from services.league.config import LeagueConfig, weight_of
from services.league.events import (
    EvaluationDone,
    EvaluationPlanned,
    Event,
    Pairing,
    RunFinished,
    RunReopened,
    StageEnded,
    StageStarted,
)
from services.league.history import SCRIPTED_STATIC, RunState
from services.league.records import CurvePoint, StageRecord
from services.league.rounds import next_turn, phase_one_done, phase_one_stages, round_stage
from shared.messages.league import Stage
from shared.messages.training import AGENTS, Agent

MIN_WINDOW_BOUTS = 8
"""A window with fewer complete bouts says nothing about convergence."""


def total_stages(cfg: LeagueConfig) -> int:
    """Return how many stages the whole run has."""
    return phase_one_stages(cfg) + cfg.rounds * cfg.round_iterations * len(AGENTS)


def next_event(cfg: LeagueConfig, state: RunState) -> Event | None:
    """Return the event that the schedule asks for now, None while it waits for somebody."""
    if state.finished:
        if phase_one_done(cfg, state) and next_turn(cfg, state) is not None:
            return RunReopened(number=state.ends, config=cfg)
        return None
    if (record := state.stage) is not None:
        return stage_end(cfg, record)
    if not phase_one_done(cfg, state) and not state.is_tournament:
        return stage_start(cfg, state)
    if cfg.evaluation_bouts and state.evaluation_started_at_ns is None and not _in_rounds(state):
        return EvaluationPlanned(plan=0, pairings=evaluation_plan(cfg, state))
    if state.evaluation_started_at_ns is not None and state.evaluation_done_at_ns is None:
        all_played = state.evaluation_done == state.evaluation_total
        return EvaluationDone(plan=0) if all_played else None
    if not state.is_tournament and (turn := next_turn(cfg, state)) is not None:
        return StageStarted(stage=round_stage(cfg, state, turn))
    return RunFinished(number=state.ends)


def _in_rounds(state: RunState) -> bool:
    return state.stages[-1].stage.round > 0


def waiting_for(state: RunState) -> str:
    """Return whom the schedule waits for, in a few words."""
    if state.finished:
        return ""
    if (record := state.stage) is not None:
        return f"learner {record.stage.agent}"
    if state.evaluation_started_at_ns is not None and state.evaluation_done_at_ns is None:
        return "actors"
    missing = [agent for agent in AGENTS if state.latest(agent) is None]
    return " and ".join(f"learner {agent}" for agent in missing)


def stage_now(state: RunState) -> int:
    """Return the index of the stage that runs, 0 before the first, -1 after the last."""
    if (record := state.stage) is not None:
        return record.stage.index
    return -1 if state.stages else 0


def stage_start(cfg: LeagueConfig, state: RunState) -> StageStarted | None:
    """Return the start of the next stage of phase one, None before both agents have a version."""
    index = len(state.stages)
    agent: Agent = AGENTS[index % 2]
    other: Agent = AGENTS[1 - index % 2]
    iteration = 1 + index // 2
    opponent = state.latest(other)
    if opponent is None or state.latest(agent) is None:
        return None
    return StageStarted(
        stage=Stage(
            index=index,
            phase="one",
            iteration=iteration,
            agent=agent,
            opponent=opponent.ref,
            max_updates=(
                cfg.antagonist_updates if agent == "antagonist" else cfg.protagonist_updates
            ),
            score_weight=weight_of(cfg.score_weights, iteration),
            shaping_weight=weight_of(cfg.shaping_weights, iteration),
        )
    )


def stage_end(cfg: LeagueConfig, record: StageRecord) -> StageEnded | None:
    """Return the end of the stage that runs, None while it goes on."""
    last = record.newest
    if last is None:
        return None
    if record.updates >= record.stage.max_updates:
        reason = "budget"
    elif record.stage.phase == "one" and converged(
        cfg, record.stage.agent, record.updates, record.points
    ):
        reason = "converged"
    else:
        return None
    return StageEnded(
        stage=record.stage.index, reason=reason, version=last.version, snapshot=last.snapshot
    )


def converged(cfg: LeagueConfig, agent: Agent, updates: int, points: Sequence[CurvePoint]) -> bool:
    """Return whether the learner's mean score has stopped to improve.

    Compares the mean score over the last ``convergence_window`` finished updates with that over
    as many before them, in the direction the agent wants it. Only bouts that ended before the
    latest version count, so the answer changes with versions and with nothing else.
    """
    window = cfg.convergence_window
    if not cfg.convergence_min_updates or updates < max(cfg.convergence_min_updates, 2 * window):
        return False
    newer = _scores(points, updates - window, updates)
    older = _scores(points, updates - 2 * window, updates - window)
    if min(len(newer), len(older)) < MIN_WINDOW_BOUTS:
        return False
    sign = 1.0 if agent == "antagonist" else -1.0
    progress = sign * (sum(newer) / len(newer) - sum(older) / len(older))
    return progress < cfg.convergence_tolerance


def evaluation_plan(cfg: LeagueConfig, state: RunState) -> tuple[Pairing, ...]:
    """Return the full matrix of the antagonists against a static player and the protagonists.

    Each side brings what it had learned at the end of each of its stages.
    """
    antagonists = _stage_end_players(state, "antagonist")
    protagonists = [SCRIPTED_STATIC, *_stage_end_players(state, "protagonist")]
    return tuple(
        Pairing(antagonist=antagonist, protagonist=protagonist, bouts=cfg.evaluation_bouts)
        for antagonist in antagonists
        for protagonist in protagonists
    )


def _stage_end_players(state: RunState, agent: Agent) -> list[str]:
    refs = (f"sha256:{record.end_snapshot}" for record in state.stage_ends(agent))
    return list(dict.fromkeys(refs))


def _scores(points: Sequence[CurvePoint], first: int, end: int) -> list[float]:
    return [score for point in points if first <= point.update < end for score in point.score]
