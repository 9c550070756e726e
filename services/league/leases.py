"""Work for actors: pure functions of the state, and the table of when live leases lapse.

A lease is the only claim an actor has. An actor that vanishes stops renewing, its lease lapses,
and what it had promised is granted again; nothing else remembers it.
"""

import hashlib
import itertools
import math
from collections.abc import Iterable

import numpy as np

from services.league.config import LeagueConfig
from services.league.events import LeaseGranted
from services.league.history import EvaluationRecord, RunState
from services.league.records import StageRecord
from shared.messages.league import Lease, LeaseRequest, LeaseSummary
from shared.messages.wire import MAX_HEADER

MOST_SAMPLES = 2**40
"""In one rollout; more is nobody's."""
MOST_BYTES = MAX_HEADER - 4096
"""Of the list of leases as it travels: some 5,500 of them."""
OVERHEAD_BYTES = 80
"""Of a lease in it, beside its texts."""


def lease_seed(run_seed: int, number: int) -> int:
    """Return the seed of a lease: 63 bits that follow from the run's seed and its number."""
    sequence = np.random.SeedSequence((run_seed, number))
    return int(sequence.generate_state(1, np.uint64)[0] >> np.uint64(1))


def evaluation_seed(run_seed: int, antagonist: str, protagonist: str, first_bout: int) -> int:
    """Return the seed of a batch of bouts: the same whoever plays it, and when."""
    text = f"{run_seed} {antagonist} {protagonist} {first_bout}"
    return int.from_bytes(hashlib.sha256(text.encode()).digest()[:8], "little") >> 1


def lease_window(cfg: LeagueConfig, actors: int, rollout_samples: int = 0, *, serial: bool) -> int:
    """Return how many unacknowledged rollouts one of this many actors may have.

    Two batches between all of them, however long their rollouts: one that is learned from, one that
    is played meanwhile. In a serial run exactly one batch: the lag is fixed and the run
    reproducible.

    Args:
        cfg: says how long a batch is.
        actors: that train.
        rollout_samples: in one rollout of this actor; 0: as the run's own actors have them.
        serial: whether the run is.
    """
    if serial:
        return cfg.batch_rollouts
    batches = cfg.batch_samples / rollout_samples if rollout_samples > 0 else cfg.batch_rollouts
    return math.ceil(2 * batches / max(actors, 1))


def grant(state: RunState, request: LeaseRequest) -> LeaseGranted | None:
    """Return the work for an actor, None when there is none now."""
    number = state.leases_granted + 1
    record = state.stage
    if record is not None and awaits_restart(record):
        return None
    if record is not None:
        stage = record.stage
        learns = stage.agent == "antagonist"
        return LeaseGranted(
            lease=f"L{number:06d}",
            number=number,
            actor=request.actor,
            boot=request.boot,
            work="train",
            stage=stage.index,
            antagonist="" if learns else stage.opponent,
            protagonist=stage.opponent if learns else "",
            seed=lease_seed(state.seed, number),
            rollout_samples=min(max(request.num_envs * request.rollout_steps, 0), MOST_SAMPLES),
        )
    for evaluation in state.evaluations.values():
        chunk = open_chunk(state, evaluation, request.num_envs)
        if chunk is not None:
            return LeaseGranted(
                lease=f"L{number:06d}",
                number=number,
                actor=request.actor,
                boot=request.boot,
                work="evaluate",
                stage=-1,
                antagonist=evaluation.antagonist,
                protagonist=evaluation.protagonist,
                first_bout=chunk.start,
                bouts=len(chunk),
                seed=evaluation_seed(
                    state.seed, evaluation.antagonist, evaluation.protagonist, chunk.start
                ),
            )
    return None


def awaits_restart(record: StageRecord) -> bool:
    """Return whether the learner has yet to go back to the warm start: its policy is no use."""
    return record.stage.start == "warm" and not record.versions


def open_chunk(state: RunState, evaluation: EvaluationRecord, most: int) -> range | None:
    """Return the first bouts of a pairing that are neither played nor promised, at most so many."""
    taken = list(evaluation.played)
    for lease in state.live_leases:
        held = state.leases[lease].grant
        if (held.antagonist, held.protagonist) == (evaluation.antagonist, evaluation.protagonist):
            taken[held.first_bout : held.first_bout + held.bouts] = [True] * held.bouts
    if False not in taken:
        return None
    start = taken.index(False)
    free = itertools.takewhile(lambda bout: not taken[bout], range(start, len(taken)))
    return range(start, start + min(len(list(free)), most))


def overlapping(state: RunState, lease: str) -> list[str]:
    """Return the live evaluation leases, but for this one, that hold a bout this one holds."""
    own = state.leases[lease].grant
    return [
        other
        for other in state.live_leases
        if other != lease and _overlap(own, state.leases[other].grant)
    ]


def is_chunk_open(state: RunState, granted: LeaseGranted) -> bool:
    """Return whether none of an evaluation lease's bouts has been played yet."""
    record = state.evaluations[granted.antagonist, granted.protagonist]
    return not any(record.played[granted.first_bout : granted.first_bout + granted.bouts])


def lease_message(
    state: RunState, granted: LeaseGranted, cfg: LeagueConfig, *, serial: bool
) -> Lease:
    """Return what an actor is told of its new lease."""
    record = state.stages[granted.stage] if granted.work == "train" else None
    return Lease(
        lease=granted.lease,
        kind=granted.work,
        stage=record.stage if record is not None else None,
        antagonist=granted.antagonist,
        protagonist=granted.protagonist,
        bouts=granted.bouts,
        stochastic=(
            cfg.opponent_stochastic if granted.work == "train" else cfg.evaluation_stochastic
        ),
        seed=granted.seed,
        expires_in=cfg.lease_seconds,
        window=lease_window(cfg, state.training_leases, granted.rollout_samples, serial=serial),
    )


def summaries(state: RunState, cfg: LeagueConfig, now_ns: int) -> tuple[LeaseSummary, ...]:
    """Return the training leases that are alive, and those that ended a moment ago.

    No more than one message holds: first those that are alive, then the newest of the others.
    """
    oldest_ns = now_ns - round(cfg.ended_lease_seconds * 1e9)
    ended = itertools.takewhile(
        lambda lease: state.leases[lease].ended_at_ns > oldest_ns, reversed(state.ended_leases)
    )
    listed: list[LeaseSummary] = []
    room = MOST_BYTES
    for summary in _summaries(state, itertools.chain(state.live_leases, ended)):
        texts = summary.lease, summary.actor, summary.agent, summary.opponent, summary.boot
        room -= OVERHEAD_BYTES + len("".join(texts).encode())
        if room < 0:
            break
        listed.append(summary)
    return tuple(sorted(listed, key=lambda summary: summary.lease))


def _summaries(state: RunState, leases: Iterable[str]) -> Iterable[LeaseSummary]:
    for lease in leases:
        granted = state.leases[lease].grant
        if granted.work == "train":
            stage = state.stages[granted.stage].stage
            yield LeaseSummary(
                lease=lease,
                actor=granted.actor,
                agent=stage.agent,
                stage=stage.index,
                opponent=stage.opponent,
                seed=granted.seed,
                boot=granted.boot,
            )


def _overlap(one: LeaseGranted, other: LeaseGranted) -> bool:
    return (
        other.work == "evaluate"
        and (one.antagonist, one.protagonist) == (other.antagonist, other.protagonist)
        and one.first_bout < other.first_bout + other.bouts
        and other.first_bout < one.first_bout + one.bouts
    )


class LeaseTable:
    """When each live lease lapses, on the league's own monotonic clock.

    The one thing about leases that is not in the ledger: a restarted league gives every live
    lease its full time again.
    """

    def __init__(self, seconds: float, live: Iterable[str], now: float) -> None:
        """Give every live lease its full time.

        Args:
            seconds: from a renewal until a lease lapses.
            live: ids.
            now: by the league's clock (s).
        """
        self._seconds = seconds
        self._lapses_at = dict.fromkeys(live, now + seconds)
        """By id, the first to lapse in front: all leases have the same time."""

    def renew(self, lease: str, now: float) -> None:
        """Give a lease its full time from now."""
        self._lapses_at.pop(lease, None)
        self._lapses_at[lease] = now + self._seconds

    def lapsed(self, state: RunState, now: float) -> list[str]:
        """Return the live leases whose time is over, oldest first; looks at no others."""
        over = itertools.takewhile(
            lambda item: item[1] <= now or item[0] not in state.live_leases,
            self._lapses_at.items(),
        )
        found = [lease for lease, _ in over]
        for lease in found:
            del self._lapses_at[lease]
        return [lease for lease in found if lease in state.live_leases]
