"""Whether what a message claims can be true: pure functions that return what is wrong with it."""

import math

import msgspec
import numpy as np
from numpy.typing import NDArray

from services.league.events import BoutsPlayed, LeaseGranted
from services.league.history import RunState
from services.league.leases import is_chunk_open
from shared.errors import SnapshotError
from shared.game.rules import RuleBook
from shared.messages.league import FEATURE_DIM, BoutResults, LeaseRequest
from shared.messages.texts import LONGEST_NAME
from shared.messages.training import UpdateMetrics, VersionReport
from shared.policy.snapshot import digest_of


def request_problem(request: LeaseRequest) -> str:
    """Return why nobody can have asked for work like this, empty when they can."""
    for field in ("actor", "boot"):
        if (length := len(getattr(request, field))) > LONGEST_NAME:
            return f"{field} has {length} characters; at most {LONGEST_NAME} are expected"
    if request.num_envs < 1:
        return f"num_envs is {request.num_envs}, below 1"
    return ""


def results_problem(state: RunState, results: BoutResults, rules: RuleBook) -> str:
    """Return why these results cannot be entered, empty when they can."""
    lease = state.leases.get(results.lease)
    if lease is None:
        return f"lease {results.lease[:LONGEST_NAME]!r} was never granted in this run"
    return (
        _claim_problem(lease.grant, results)
        or _player_problem(state, lease.grant, results)
        or _model_problem(state, results)
        or _count_problem(results, rules)
        or _chunk_problem(state, lease.grant, results)
        or _feature_problem(results)
    )


def played(results: BoutResults) -> BoutsPlayed:
    """Return the event that enters these results."""
    return BoutsPlayed(
        name=results.name,
        actor=results.actor,
        lease=results.lease,
        stage=results.stage,
        antagonist=results.antagonist,
        protagonist=results.protagonist,
        model=results.model,
        bouts=tuple(results.bouts.tolist()),
        score=tuple(results.score.tolist()),
        attack_steps=tuple(results.attack_steps.tolist()),
        penalty_steps=tuple(results.penalty_steps.tolist()),
        camping_steps=tuple(results.camping_steps.tolist()),
        complete=tuple(results.complete.tolist()),
        features=short_numbers(results.features.reshape(-1, 2 * FEATURE_DIM)),
    )


def short_numbers(rows: NDArray[np.float32]) -> tuple[tuple[float, ...], ...]:
    """Return float32 numbers as the shortest decimals that are read back as the same bits."""
    return tuple(tuple(float(str(number)) for number in row) for row in rows)


def version_problem(state: RunState, report: VersionReport) -> str:
    """Return why this version can never be entered, empty when it can."""
    if report.policy_version < 0:
        return f"policy_version is {report.policy_version}; versions count from 0"
    if report.stage >= len(state.stages) or report.stage < -1:
        return f"stage {report.stage} has not started; the newest is {len(state.stages) - 1}"
    if report.stage >= 0 and report.policy_version > 0:
        learner = state.stages[report.stage].stage.agent
        if learner != report.agent:
            return f"in stage {report.stage} {learner} learns, not {report.agent}"
    if report.rollouts and report.policy_version == 0:
        return f"version 0 is made from no rollouts, this one names {len(report.rollouts)}"
    return ""


def are_finite(metrics: UpdateMetrics) -> bool:
    """Return whether every number of an update is one, and every count one of 64 bits."""
    return all(
        -(2**63) <= value < 2**63 if isinstance(value, int) else math.isfinite(value)
        for value in msgspec.structs.astuple(metrics)
    )


def _claim_problem(granted: LeaseGranted, results: BoutResults) -> str:
    if len(results.name) > LONGEST_NAME:
        return f"boot has {len(results.boot)} characters; at most {LONGEST_NAME} are expected"
    claims = {
        "actor": (results.actor, granted.actor),
        "boot": (results.boot, granted.boot),
        "kind": (results.kind, granted.work),
        "stage": (results.stage, granted.stage),
        "seed": (results.seed, granted.seed),
    }
    for field, (claimed, given) in claims.items():
        if claimed != given:
            return f"{field} is {claimed!r}, lease {granted.lease} says {given!r}"
    return ""


def _player_problem(state: RunState, granted: LeaseGranted, results: BoutResults) -> str:
    for side in ("antagonist", "protagonist"):
        claimed: str = getattr(results, side)
        given: str = getattr(granted, side)
        if given and claimed != given:
            return f"{side} is {claimed[:LONGEST_NAME]!r}, lease {granted.lease} says {given!r}"
        if not given:  # the learning side: whichever snapshot it was by then
            try:
                digest_of(claimed)
            except SnapshotError as error:
                return f"{side}: {error}"
    return ""


def _model_problem(state: RunState, results: BoutResults) -> str:
    if state.model and results.model != state.model:
        return (
            f"simulator model is {results.model[:12]!r}, the bouts of this run were played in "
            f"{state.model[:12]!r}; start every actor with the same [sim] section"
        )
    return ""


def _count_problem(results: BoutResults, rules: RuleBook) -> str:
    if not len(results.bouts):
        return "there are no bouts in it"
    counts = np.stack([results.attack_steps, results.penalty_steps, results.camping_steps])
    counts = counts.astype(np.int64)
    in_target = counts[0] + counts[1]
    limit = rules.bout_steps
    if counts.min() < 0 or in_target.max() > limit or counts[2].max() > limit:
        return f"step counts are outside 0 to {limit}, the steps of a bout"
    weights = np.array([rules.point, rules.penalty, rules.camping_award])
    expected = weights @ counts
    off = np.abs(results.score - expected)
    if np.any(off > 0.5):
        worst = int(off.argmax())
        return (
            f"score of bout {results.bouts[worst]} is {results.score[worst]:g}, its steps make "
            f"{expected[worst]:g} by the rule book; start every actor with the same [game] section"
        )
    return ""


def _feature_problem(results: BoutResults) -> str:
    wanted = len(results.bouts) if results.kind == "evaluate" else 0
    if len(results.features) != wanted:
        return (
            f"there are features of {len(results.features)} bouts; {wanted} are expected of "
            f"{len(results.bouts)} bouts to {results.kind}"
        )
    return ""


def _chunk_problem(state: RunState, granted: LeaseGranted, results: BoutResults) -> str:
    if granted.work != "evaluate":
        return ""
    if len(results.bouts) != granted.bouts or not results.complete.all():
        return (
            f"{int(results.complete.sum())} complete of {len(results.bouts)} bouts, lease "
            f"{granted.lease} is for {granted.bouts} complete ones"
        )
    if not is_chunk_open(state, granted):
        return f"the bouts of lease {granted.lease} were played by another actor meanwhile"
    return ""
