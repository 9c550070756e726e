"""Phase two: whose turn it is, and from whom the opponent is drawn; pure functions of the state.

Yang et al. 2021, algorithm 1 with the opponent of phase two: in each iteration the antagonist
makes N_mu updates against a random earlier protagonist, then the protagonist N_nu updates against
a random earlier antagonist. A round has a history of its own, which begins with the warm start,
the pair that phase one ended with, and grows by what each stage ends with.
"""

import dataclasses

from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.records import StageRecord
from services.league.sampling import Pool, draw
from shared.messages.league import Stage
from shared.messages.training import AGENTS, Agent


@dataclasses.dataclass(frozen=True)
class Turn:
    """The place of a stage in phase two."""

    round: int
    iteration: int
    agent: Agent


def phase_one_stages(cfg: LeagueConfig) -> int:
    """Return how many stages phase one has."""
    return cfg.iterations * len(AGENTS)


def phase_one_done(cfg: LeagueConfig, state: RunState) -> bool:
    """Return whether every stage of phase one has been started, and the run has left it."""
    if not state.stages:
        return False
    return state.stages[-1].stage.round > 0 or len(state.stages) >= phase_one_stages(cfg)


def next_turn(cfg: LeagueConfig, state: RunState) -> Turn | None:
    """Return the turn after the newest stage, None when all rounds are played."""
    last = state.stages[-1].stage
    if last.round and last.agent == AGENTS[0]:
        return Turn(last.round, last.iteration, AGENTS[1])
    if last.round and last.iteration < cfg.round_iterations:
        return Turn(last.round, last.iteration + 1, AGENTS[0])
    return Turn(last.round + 1, 1, AGENTS[0]) if last.round < cfg.rounds else None


def round_stage(cfg: LeagueConfig, state: RunState, turn: Turn) -> Stage:
    """Return the stage of a turn, its opponent drawn."""
    index = len(state.stages)
    is_antagonist = turn.agent == "antagonist"
    return Stage(
        index=index,
        phase="two",
        round=turn.round,
        iteration=turn.iteration,
        agent=turn.agent,
        opponent=draw(cfg.rule, pool_of(cfg, state, turn), state.seed, index),
        max_updates=(
            cfg.round_antagonist_updates if is_antagonist else cfg.round_protagonist_updates
        ),
        score_weight=1.0,
        shaping_weight=0.0,
        start="warm" if turn.iteration == 1 else "continue",
    )


def pool_of(cfg: LeagueConfig, state: RunState, turn: Turn) -> Pool:
    """Return the opponents that a turn's learner can meet: the other side of this round."""
    warm = state.warm_start()
    assert warm is not None  # phase one is done
    side = 1 - AGENTS.index(turn.agent)
    ends = state.stage_ends(AGENTS[side], turn.round)
    return Pool(
        history=(warm[side], *(record.end_ref for record in ends)),
        results=results_of(state, turn.round, turn.agent) if cfg.sampler == "pfsp" else {},
        anchors=cfg.antagonist_anchors if side == 0 else cfg.protagonist_anchors,
    )


def results_of(state: RunState, round: int, agent: Agent) -> dict[str, list[float]]:
    """Return the mean reward of each update an agent made in a round, by opponent."""
    found: dict[str, list[float]] = {}
    for record in rounds_stages(state, round):
        if record.stage.agent == agent:
            rewards = [v.metrics.reward_mean for v in record.versions if v.metrics is not None]
            found.setdefault(record.stage.opponent, []).extend(rewards)
    return found


def rounds_stages(state: RunState, round: int) -> list[StageRecord]:
    """Return the stages of a round, oldest first."""
    return [record for record in state.stages if record.stage.round == round]
