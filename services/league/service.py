"""The league as a ticking service: takes what has arrived, commits it, answers."""

from pathlib import Path
from typing import Any

import numpy as np
import structlog

from services.league import leases, schedule
from services.league.config import LeagueConfig
from services.league.desk import Desk
from services.league.events import RunStarted
from services.league.history import RunState
from services.league.journal import Journal
from services.league.progress import describe, progress_of
from services.league.snapshots import SnapshotStore
from shared.bus.base import Bus, Inbox, Request
from shared.clock import Clock
from shared.errors import RiposteError, SnapshotError
from shared.game.rules import RuleBook
from shared.messages.league import (
    BoutResults,
    Incident,
    Lease,
    LeaseRenewal,
    LeaseRequest,
    Leases,
    LeaseStatus,
    RunSettings,
    Schedule,
    SettingsRequest,
    SnapshotReply,
    SnapshotRequest,
)
from shared.messages.message import Message
from shared.messages.texts import clipped
from shared.messages.topics import (
    INCIDENT,
    LEASE,
    LEASES,
    PROGRESS,
    RENEWAL,
    RESULTS,
    SCHEDULE,
    SETTINGS,
    SNAPSHOT,
    VERSION,
)
from shared.messages.training import AGENTS, Receipt, VersionReceipt, VersionReport
from shared.runtime.service import Health

PERIOD = 1.0
"""Seconds from one Progress to the next."""
MAX_REQUESTS = 64
"""Requests of one kind taken in one tick; the rest wait for the next."""

Answer = tuple[Request[Any, Any], Message]
log = structlog.get_logger()


class League:
    """Schedules stages, grants leases, and keeps the ledger and the snapshots of one run.

    Every request of a tick is applied to the state as it comes, all events are committed in one
    transaction, and only then the answers go out. When the commit fails everything of the tick is
    undone, the askers are told why and to ask again, and so is everybody who comes until the
    ledger can be written.
    """

    def __init__(
        self, cfg: LeagueConfig, bus: Bus, clock: Clock, directory: Path, run: str, seed: int,
        serial: bool, *, rules: RuleBook | None = None, settings: RunSettings | None = None,
    ) -> None:  # fmt: skip
        """Open the run in ``directory``, or start one there.

        Args:
            cfg: section ``[league]``.
            bus: where to answer and publish.
            clock: instants and time-outs.
            directory: folder of the run.
            run: its id; a ledger of another run is refused.
            seed: of the run.
            serial: whether everything ticks in one process, with a fixed policy lag.
            rules: the rule book results are checked against.
            settings: what actors that join from elsewhere are told; None: all defaults.

        Raises:
            LedgerError: the ledger is in use, damaged, of another run, or cannot be written.
            SnapshotError: the snapshot folder cannot be made.
        """
        self._cfg = cfg
        self._bus = bus
        self._clock = clock
        self._rules = rules or RuleBook()
        self._store = SnapshotStore(directory / "snapshots")
        start = RunStarted(run=run, seed=seed, serial=serial, config=cfg)
        self._journal = Journal(
            directory / "league.sqlite", start, clock, may_start=self._store.is_empty
        )
        self._desk = Desk(cfg, self._journal, self._store, clock, self._rules, serial=serial)
        self._schedule: Schedule | None = None
        self._leases: Leases | None = None
        self._schedule_due_at = self._progress_due_at = clock.now()
        self._incidents: Inbox[Incident, Receipt] = bus.answer(INCIDENT)
        self._results: Inbox[BoutResults, Receipt] = bus.answer(RESULTS)
        self._versions: Inbox[VersionReport, VersionReceipt] = bus.answer(VERSION)
        self._renewals: Inbox[LeaseRenewal, LeaseStatus] = bus.answer(RENEWAL)
        self._requests: Inbox[LeaseRequest, Lease] = bus.answer(LEASE)
        self._snapshots: Inbox[SnapshotRequest, SnapshotReply] = bus.answer(SNAPSHOT)
        self._settings = settings or RunSettings(toml="")
        self._settings_asked: Inbox[SettingsRequest, RunSettings] = bus.answer(SETTINGS)

    @property
    def state(self) -> RunState:
        """Return the state of the run; to be read, never changed."""
        return self._journal.state

    @property
    def finished(self) -> bool:
        """Return whether the run went to its end, and its settings ask for no more."""
        return self.state.finished and schedule.next_event(self._cfg, self.state) is None

    @property
    def ledger_position(self) -> int:
        """Return the sequence number of the last event committed."""
        return self._journal.state.position

    def rewind_to(self, position: int) -> None:
        """Go back to an earlier event: a serial run resumes from a cut.

        Raises:
            LedgerError: the ledger ends before it, or cannot be written.
        """
        self._journal.rewind(position)
        self._desk.restart()
        self._schedule = self._leases = None

    def tick(self) -> bool:
        """Take what has arrived, commit, answer, publish; return whether anything was done."""
        did = self._answer_snapshots()
        if self._journal.failure:
            if not self._journal.recover():
                return self._refuse_waiting(self._journal.failure) or did
            self._desk.restart()
        self._journal.begin()
        self._desk.advance()
        answers = self._take_requests()
        did |= bool(answers or self._journal.uncommitted)
        if self._journal.commit():
            for request, answer in answers:
                request.reply(answer)
            self._publish()
        else:
            for request, _ in answers:
                request.refuse(self._journal.failure, retry=True)
        return did

    def health(self) -> Health:
        """Return what the league does and whom it waits for."""
        failure = self._journal.failure
        waiting_for = schedule.waiting_for(self.state)
        counters = {
            "ledger_events": self.state.position,
            "ledger_failures": self._journal.failures,
            "live_leases": len(self.state.live_leases),
        }
        return Health(
            state=f"refusing: {failure}" if failure else describe(self._cfg, self.state),
            waiting_for=waiting_for,
            waiting_seconds=self._clock.now() - self._desk.moved_at if waiting_for else 0.0,
            counters=counters | dict(self._desk.counters),
            last_error=failure or self._desk.last_error,
            policies=self._newest_versions(),
        )

    def close(self) -> None:
        """Stop answering and close the ledger; everything acknowledged is in it."""
        for inbox in (*self._writing_inboxes(), self._snapshots, self._settings_asked):
            inbox.close()
        self._journal.close()

    def _take_requests(self) -> list[Answer]:
        """Decide what to answer; bouts before versions, as a stage ends with a version."""
        desk = self._desk
        answers: list[Answer] = [(r, desk.note(r.message)) for r in _take(self._incidents)]
        answers += [(r, desk.enter_results(r.message)) for r in _take(self._results)]
        for version in _take(self._versions):
            if (receipt := self._enter_version(version)) is not None:
                answers.append((version, receipt))
        answers += [(r, desk.renew(r.message)) for r in _take(self._renewals)]
        desk.end_lapsed()  # after renewals that waited, before their work is granted again
        answers += [(r, desk.lease(r.message)) for r in _take(self._requests)]
        return answers

    def _enter_version(
        self, request: Request[VersionReport, VersionReceipt]
    ) -> VersionReceipt | None:
        """Return the answer, None when the request was refused."""
        report = request.message
        try:
            return self._desk.enter_version(report)
        except RiposteError as error:
            # Nonsense stays nonsense; a full disk may have room next time.
            is_final = isinstance(error, SnapshotError)
            what = f"version {report.policy_version} of {report.agent}: {error}"
            self._desk.counters["refused_versions"] += 1
            self._desk.last_error = clipped(what)
            log.warning("version_refused", agent=report.agent, reason=what, is_final=is_final)
            request.refuse(what, retry=not is_final)
            return None

    def _answer_snapshots(self) -> bool:
        """Answer from the store; needs no ledger, so it works while that cannot be written."""
        did = False
        for asked in _take(self._settings_asked):
            did = True
            asked.reply(self._settings)
        for request in _take(self._snapshots):
            did = True
            try:
                payload = self._store.get(request.message.snapshot)
            except SnapshotError as error:
                self._desk.last_error = clipped(str(error))
                log.warning("snapshot_missed", reason=str(error))
                nothing = np.zeros(0, np.uint8)
                request.reply(SnapshotReply(found=False, payload=nothing, reason=str(error)))
            else:
                request.reply(SnapshotReply(found=True, payload=np.frombuffer(payload, np.uint8)))
        return did

    def _refuse_waiting(self, reason: str) -> bool:
        did = False
        for inbox in self._writing_inboxes():
            for request in _take(inbox):
                did = True
                request.refuse(reason, retry=True)
        return did

    def _writing_inboxes(self) -> tuple[Inbox[Any, Any], ...]:
        return (self._incidents, self._results, self._versions, self._renewals, self._requests)

    def _publish(self) -> None:
        now = self._clock.now()
        if self._journal.uncommitted or now >= self._schedule_due_at:
            self._schedule_due_at = now + PERIOD
            self._publish_schedule()
        if now >= self._progress_due_at:
            self._progress_due_at = now + PERIOD
            steps, message = self._rules.bout_steps, self._desk.message
            self._bus.publish(PROGRESS, progress_of(self._cfg, self.state, steps, message))

    def _publish_schedule(self) -> None:
        """Say what has changed; what has not the bus says again."""
        state = self.state
        record = state.stage
        schedule = Schedule(
            stage=record.stage if record is not None else None,
            versions=self._newest_versions(),
            finished=state.finished,
        )
        if schedule != self._schedule:
            self._schedule = schedule
            self._bus.publish(SCHEDULE, schedule)
        live = Leases(leases=leases.summaries(state, self._cfg, self._journal.at_ns))
        if live != self._leases:
            self._leases = live
            self._bus.publish(LEASES, live)

    def _newest_versions(self) -> dict[str, int]:
        state = self.state
        return {agent: state.latest_version(agent) for agent in AGENTS if state.versions[agent]}


def _take(inbox: Inbox[Any, Any]) -> list[Request[Any, Any]]:
    """Return the requests that wait, at most a tick's worth."""
    taken: list[Request[Any, Any]] = []
    while len(taken) < MAX_REQUESTS and (request := inbox.take()) is not None:
        taken.append(request)
    return taken
