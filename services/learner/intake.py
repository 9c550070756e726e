"""Where rollouts arrive: each is held, dropped, or its actor told to ask again later.

A held rollout is answered only when the learner says that what was made from it is durable.
"""

import re
from collections import Counter, deque
from collections.abc import Sequence

import structlog

from services.learner.config import LearnerConfig
from services.learner.gate import (
    Decision,
    Ruling,
    check_contents,
    check_new,
    check_provenance,
    check_version,
)
from services.learner.played import Played
from shared.bus.base import Inbox, Request
from shared.bus.delivery import Applied
from shared.clock import Clock
from shared.game.rules import RuleBook
from shared.messages.league import Leases, LeaseSummary, Schedule, Stage
from shared.messages.texts import clipped
from shared.messages.training import Agent, Receipt, Rollout

log = structlog.get_logger()

UNKNOWN_LEASE_SECONDS = 10.0
"""How long a rollout may be told to ask again before it is dropped."""
HELD_BATCHES = 4
"""Rollouts held at once, in batches; more are told to ask again."""
MAX_UNKNOWN_LEASES = 1024
MAX_FAULTS = 64
_SPAN = re.compile(r"(.*):([0-9]{1,18})-([0-9]{1,18})", re.DOTALL | re.ASCII)

Held = tuple[Request[Rollout, Receipt], Rollout]


class Intake:
    """The rollouts of one learner, from their arrival to their answer."""

    def __init__(
        self,
        inbox: Inbox[Rollout, Receipt],
        clock: Clock,
        cfg: LearnerConfig,
        agent: Agent,
        model: str,
        rules: RuleBook,
    ) -> None:
        """Hold nothing yet.

        Args:
            inbox: where they arrive.
            clock: measures how long a lease has been unknown.
            cfg: batch sizes and the lag allowed.
            agent: who learns here.
            model: hash of the run's simulator model.
            rules: of the game.
        """
        self.stage: Stage | None = None
        """The league's stage now, as far as it is known here."""
        self.floor = 0
        """Rollouts of versions before this one are of a policy that the learner has left."""
        self.applied = Applied()
        """What has been learned from."""
        self.counters: Counter[str] = Counter(
            rollouts_accepted=0, rollouts_dropped=0, rollouts_repeated=0
        )
        self.faults: deque[str] = deque(maxlen=MAX_FAULTS)
        """Rollouts dropped because somebody got something wrong, oldest first."""
        self._inbox = inbox
        self._clock = clock
        self._cfg = cfg
        self._agent: Agent = agent
        self._model = model
        self._rules = rules
        self._leases: dict[str, LeaseSummary] = {}
        self._gathered: list[Held] = []
        self._committing: list[Held] = []
        self._first_refused_at: dict[str, float] = {}
        self._played: dict[str, Played] = {}
        """By lease, the play that was held."""

    @property
    def in_turn(self) -> bool:
        """Return whether this is the agent that learns now."""
        return self.stage is not None and self.stage.agent == self._agent

    @property
    def samples(self) -> int:
        """Return how many samples are gathered for the next update."""
        return sum(rollout.rewards.size for _, rollout in self._gathered)

    @property
    def is_committing(self) -> bool:
        """Return whether rollouts have been learned from and not been answered."""
        return bool(self._committing)

    @property
    def is_empty(self) -> bool:
        """Return whether no rollout is held."""
        return not self._gathered and not self._committing

    def follow(self, schedule: Schedule) -> None:
        """Take over what the league says; rollouts of a stage that is over are let go."""
        self.stage = schedule.stage
        if not self.in_turn:
            self.release("the stage is over")

    def know(self, leases: Leases) -> None:
        """Take over whose rollouts may be learned from."""
        self._leases = {lease.lease: lease for lease in leases.leases}
        self._played = {k: played for k, played in self._played.items() if k in self._leases}

    def end_stage(self) -> None:
        """The league has ended the stage; what comes next it will say."""
        self.stage = None
        self.release("the stage is over")

    def take(self, version: int, entering: tuple[str, ...]) -> bool:
        """Consider everything that has arrived; return whether there was anything.

        Args:
            version: the learner's newest.
            entering: names of the rollouts behind it while it is not in the ledger.
        """
        did = False
        while (request := self._inbox.take()) is not None:
            did = True
            self._consider(request, version, entering)
        return did

    def begin(self, version: int) -> list[Rollout]:
        """Return the rollouts to learn from now, those that have become too old left out.

        They stay unanswered until ``commit``. Empty when too few are left.
        """
        fresh: list[Held] = []
        for request, rollout in self._gathered:
            ruling = check_version(rollout, version, self._oldest(version))
            if ruling.decision is Decision.LEARN:
                fresh.append((request, rollout))
            else:
                self._drop(request, ruling.reason)
        self._gathered = fresh
        if self.samples < self.needed(version):
            return []
        self._committing, self._gathered = fresh, []
        for _, rollout in self._committing:
            self.applied.add(rollout.boot, rollout.sequence)
        self.counters["rollouts_accepted"] += len(self._committing)
        return [rollout for _, rollout in self._committing]

    def commit(self) -> None:
        """Answer the rollouts of ``begin``: what was made from them is durable."""
        for request, _ in self._committing:
            request.reply(Receipt(accepted=True))
        self._committing = []

    def learned_elsewhere(self, spans: Sequence[str]) -> Applied:
        """Never learn from these: the ledger has versions made from them that are lost here.

        Args:
            spans: ``boot:first-last`` of the numbers in their names.

        Returns:
            These alone.
        """
        elsewhere = Applied()
        for span in spans:
            if (found := _SPAN.fullmatch(span)) is None or int(found[2]) > int(found[3]):
                log.warning("span_ignored", span=clipped(span))
                continue
            for record in (self.applied, elsewhere):
                record.cover(found[1], int(found[2]), int(found[3]))
        kept: list[Held] = []
        for request, rollout in self._gathered:
            if self.applied.contains(rollout.boot, rollout.sequence):
                self.counters["rollouts_repeated"] += 1
                request.reply(Receipt(accepted=True))
            else:
                kept.append((request, rollout))
        self._gathered = kept
        return elsewhere

    def release(self, reason: str) -> None:
        """Answer the gathered rollouts: they will not be learned from."""
        for request, _ in self._gathered:
            self._drop(request, reason)
        self._gathered = []

    def needed(self, version: int) -> int:
        """Return how many samples the next version is made from."""
        is_warming_up = version == 0 and self._cfg.warm_up_samples > 0
        return self._cfg.warm_up_samples if is_warming_up else self._cfg.batch_samples

    def _consider(
        self, request: Request[Rollout, Receipt], version: int, entering: tuple[str, ...]
    ) -> None:
        """Hold a rollout, drop it, or let its actor ask again."""
        rollout = request.message
        for held in (self._gathered, self._committing):
            for index, (_, other) in enumerate(held):
                if other.name == rollout.name:
                    held[index] = (request, other)
                    self.counters["rollouts_repeated"] += 1
                    return
        if self.applied.contains(rollout.boot, rollout.sequence):
            self.counters["rollouts_repeated"] += 1
            if rollout.name in entering:
                request.refuse("its version is being entered in the ledger", retry=True)
            else:
                request.reply(Receipt(accepted=True))
            return
        if self.samples >= HELD_BATCHES * max(self._cfg.batch_samples, self._cfg.warm_up_samples):
            request.refuse("enough rollouts are held here", retry=True)  # for as long as it takes
            return
        ruling = self._rule(rollout, version)
        if ruling.decision is not Decision.LATER:
            self._first_refused_at.pop(rollout.lease, None)
        if ruling.decision is Decision.LEARN:
            self._played.setdefault(rollout.lease, Played()).add(rollout)
            self._gathered.append((request, rollout))
        elif ruling.decision is Decision.LATER and not self._is_too_late(rollout.lease):
            request.refuse(clipped(ruling.reason), retry=True)
        else:
            if ruling.is_fault or ruling.decision is Decision.LATER:
                fault = f"rollout {rollout.name} of {rollout.actor}: {ruling.reason}"
                self.faults.append(clipped(fault))
            self._drop(request, ruling.reason)

    def _rule(self, rollout: Rollout, version: int) -> Ruling:
        ruling = check_provenance(rollout, self._agent, self.stage, self._leases, self._model)
        if ruling.decision is Decision.LEARN:
            ruling = check_version(rollout, version, self._oldest(version))
        if ruling.decision is Decision.LEARN:
            ruling = check_contents(rollout, self._rules.bout_steps)
        if ruling.decision is Decision.LEARN:
            ruling = check_new(rollout, self._played.get(rollout.lease, Played()))
        return ruling

    def _oldest(self, version: int) -> int:
        """Return the oldest version accepted; version 0 acted without a normaliser."""
        if version == 0:
            return 0
        floor = 1 if self._cfg.warm_up_samples else 0
        return max(floor, self.floor, version - self._cfg.max_lag)

    def _is_too_late(self, lease: str) -> bool:
        now = self._clock.now()
        if len(self._first_refused_at) > MAX_UNKNOWN_LEASES:
            self._first_refused_at.clear()
        return now - self._first_refused_at.setdefault(lease, now) > UNKNOWN_LEASE_SECONDS

    def _drop(self, request: Request[Rollout, Receipt], reason: str) -> None:
        self.counters["rollouts_dropped"] += 1
        log.info("rollout_dropped", name=request.message.name, reason=reason)
        request.reply(Receipt(accepted=False, reason=clipped(reason)))
