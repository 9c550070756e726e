"""The league as a ticking service: takes what has arrived, commits it, answers."""

import dataclasses
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import structlog

from services.league import checks, leases, schedule
from services.league.config import LeagueConfig
from services.league.events import (
    Entry,
    Event,
    IncidentNoted,
    LeaseEnd,
    LeaseEnded,
    RunFinished,
    RunStarted,
    StageEnded,
    StageStarted,
    VersionEntered,
)
from services.league.history import RunState
from services.league.ledger import Ledger
from services.league.progress import phase_between, progress_of
from services.league.snapshots import SnapshotStore
from shared.bus.base import Bus, Inbox, Request
from shared.clock import Clock
from shared.errors import LedgerError, RiposteError, SnapshotError
from shared.game.rules import RuleBook
from shared.messages.league import (
    BoutResults,
    Incident,
    Lease,
    LeaseRenewal,
    LeaseRequest,
    LeaseStatus,
    Schedule,
    SnapshotReply,
    SnapshotRequest,
)
from shared.messages.message import Message
from shared.messages.topics import (
    INCIDENT,
    LEASE,
    PROGRESS,
    RENEWAL,
    RESULTS,
    SCHEDULE,
    SNAPSHOT,
    VERSION,
)
from shared.messages.training import AGENTS, Receipt, VersionReceipt, VersionReport
from shared.runtime.service import Health

log = structlog.get_logger()

PERIOD = 1.0
"""Seconds from one Progress to the next."""
RETRY_SECONDS = 0.5
"""After the ledger failed, requests are refused this long before it is tried again."""
MAX_REQUESTS = 64
"""Requests of one kind taken in one tick; the rest wait for the next."""


@dataclasses.dataclass
class _Batch:
    """What one tick has decided and not yet committed."""

    at_ns: int
    events: list[Event] = dataclasses.field(default_factory=list[Event])
    answers: list[tuple[Request[Any, Any], Message]] = dataclasses.field(
        default_factory=list[tuple[Request[Any, Any], Message]]
    )


class League:
    """Schedules stages, grants leases, and keeps the ledger and the snapshots of one run.

    Every request of a tick is applied to the state as it comes, all events are committed in one
    transaction, and only then the answers go out. When the commit fails the state is read back
    from the ledger, the askers are told why and to ask again, and so is everybody who comes until
    the ledger can be written.
    """

    def __init__(
        self, cfg: LeagueConfig, bus: Bus, clock: Clock, directory: Path, run: str, seed: int,
        serial: bool, *, rules: RuleBook | None = None,
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

        Raises:
            LedgerError: the ledger is in use, damaged, of another run, or cannot be written.
            SnapshotError: the snapshot folder cannot be made.
        """
        self._cfg = cfg
        self._bus = bus
        self._clock = clock
        self._serial = serial
        self._rules = rules or RuleBook()
        self._store = SnapshotStore(directory / "snapshots")
        self._ledger = Ledger(directory / "league.sqlite")
        try:
            self._state = self._load(run, seed)
        except BaseException:
            self._ledger.close()
            raise
        self._table = leases.LeaseTable(cfg.lease_seconds)
        self._batch = _Batch(at_ns=clock.wall_ns())
        self._failure = ""
        self._retry_at = 0.0
        self._last_error = ""
        self._message = ""
        self._counters: Counter[str] = Counter()
        self._schedule: Schedule | None = None
        self._schedule_due_at = self._progress_due_at = self._moved_at = clock.now()
        self._incidents: Inbox[Incident, Receipt] = bus.answer(INCIDENT)
        self._results: Inbox[BoutResults, Receipt] = bus.answer(RESULTS)
        self._versions: Inbox[VersionReport, VersionReceipt] = bus.answer(VERSION)
        self._renewals: Inbox[LeaseRenewal, LeaseStatus] = bus.answer(RENEWAL)
        self._requests: Inbox[LeaseRequest, Lease] = bus.answer(LEASE)
        self._snapshots: Inbox[SnapshotRequest, SnapshotReply] = bus.answer(SNAPSHOT)

    @property
    def state(self) -> RunState:
        """Return the state of the run; to be read, never changed."""
        return self._state

    @property
    def ledger_position(self) -> int:
        """Return the sequence number of the last event committed."""
        return self._state.position

    def rewind_to(self, position: int) -> None:
        """Go back to an earlier event: a serial run resumes from a cut.

        Raises:
            LedgerError: the ledger ends before it, or cannot be written.
        """
        self._ledger.rewind(position)
        self._reload()
        self._schedule = None

    def tick(self) -> bool:
        """Take what has arrived, commit, answer, publish; return whether anything was done."""
        did = self._answer_snapshots()
        if self._failure and not self._recover():
            return self._refuse_waiting(self._failure) or did
        self._batch = _Batch(at_ns=self._clock.wall_ns())
        self._advance()
        self._take_requests()
        self._end_lapsed()
        did |= bool(self._batch.answers or self._batch.events)
        self._commit()
        self._publish()
        return did

    def health(self) -> Health:
        """Return what the league does and whom it waits for."""
        waiting_for = schedule.waiting_for(self._state)
        waiting = self._clock.now() - self._moved_at if waiting_for else 0.0
        return Health(
            state=f"refusing: {self._failure}" if self._failure else self._describe(),
            waiting_for=waiting_for,
            waiting_seconds=waiting,
            counters=dict(self._counters) | {"ledger_events": self._state.position},
            last_error=self._last_error,
        )

    def close(self) -> None:
        """Stop answering and close the ledger; everything acknowledged is in it."""
        for inbox in (
            self._incidents, self._results, self._versions, self._renewals, self._requests,
            self._snapshots,
        ):  # fmt: skip
            inbox.close()
        self._ledger.close()

    # Requests -------------------------------------------------------------------------------

    def _take_requests(self) -> None:
        """Decide what to answer; bouts before versions, as a stage ends with a version."""
        answers = self._batch.answers
        for _ in range(MAX_REQUESTS):
            if (incident := self._incidents.take()) is None:
                break
            answers.append((incident, self._note(incident.message)))
        for _ in range(MAX_REQUESTS):
            if (results := self._results.take()) is None:
                break
            answers.append((results, self._enter_results(results.message)))
        for _ in range(MAX_REQUESTS):
            if (version := self._versions.take()) is None:
                break
            if (receipt := self._enter_version(version)) is not None:
                answers.append((version, receipt))
        for _ in range(MAX_REQUESTS):
            if (renewal := self._renewals.take()) is None:
                break
            answers.append((renewal, self._renew(renewal.message)))
        for _ in range(MAX_REQUESTS):
            if (request := self._requests.take()) is None:
                break
            answers.append((request, self._lease(request.message)))

    def _note(self, incident: Incident) -> Receipt:
        event = IncidentNoted(
            source=incident.source,
            boot=incident.boot,
            sequence=incident.sequence,
            what=incident.kind,
            detail=incident.detail,
            reported_at_ns=incident.at_ns,
        )
        if event.key not in self._state.incident_keys:
            self._record(event)
            self._message = f"{incident.source}: {incident.kind} {incident.detail}".strip()
        return Receipt(accepted=True)

    def _enter_results(self, results: BoutResults) -> Receipt:
        if results.name in self._state.result_names:
            self._counters["repeated_results"] += 1
            return Receipt(accepted=True)
        if problem := checks.results_problem(self._state, results, self._rules):
            self._counters["refused_results"] += 1
            self._last_error = f"results of {results.actor} refused: {problem}"
            log.warning("results_refused", actor=results.actor, name=results.name, reason=problem)
            return Receipt(accepted=False, reason=problem)
        self._record(checks.played(results))
        self._counters["results"] += 1
        self._counters["bouts"] += len(results.bouts)
        if results.kind == "evaluate":
            self._moved_at = self._clock.now()
            for other in leases.overlapping(self._state, results.lease):
                self._end_lease(other, "superseded")
            if results.lease in self._state.live_leases:
                self._end_lease(results.lease, "completed")
            self._advance()
        return Receipt(accepted=True)

    def _enter_version(
        self, request: Request[VersionReport, VersionReceipt]
    ) -> VersionReceipt | None:
        report = request.message
        known = self._state.versions[report.agent].get(report.policy_version)
        if known is not None:
            if known.snapshot == report.snapshot:
                self._counters["repeated_versions"] += 1
                return self._receipt(report)
            reason = (
                f"version {report.policy_version} of {report.agent} is in the ledger as snapshot "
                f"{known.snapshot[:12]}, not {report.snapshot[:12]}; use a number after the latest"
            )
            self._counters["conflicting_versions"] += 1
            log.warning("version_conflicted", agent=report.agent, reason=reason)
            return self._receipt(report, reason)
        try:
            if problem := checks.version_problem(self._state, report):
                raise SnapshotError(problem)
            self._store.put(report)
        except SnapshotError as error:
            self._counters["refused_versions"] += 1
            self._last_error = f"version {report.policy_version} of {report.agent}: {error}"
            log.warning("version_refused", agent=report.agent, reason=str(error))
            request.refuse(str(error))
            return None
        except RiposteError as error:  # no space, say: it may be there next time
            self._last_error = str(error)
            log.warning("snapshot_not_stored", agent=report.agent, reason=str(error))
            request.refuse(str(error), retry=True)
            return None
        self._record_version(report)
        self._advance()
        return self._receipt(report)

    def _record_version(self, report: VersionReport) -> None:
        metrics = report.metrics
        if metrics is not None and not checks.are_finite(metrics):
            metrics = None
            self._record(
                IncidentNoted(
                    source="league",
                    boot=f"{report.agent}:{report.policy_version}",
                    sequence=0,
                    what="metrics_dropped",
                    detail=f"of version {report.policy_version} of {report.agent}: not finite",
                    reported_at_ns=self._batch.at_ns,
                )
            )
        self._record(
            VersionEntered(
                agent=report.agent,
                version=report.policy_version,
                stage=report.stage,
                snapshot=report.snapshot,
                rollouts=report.rollouts,
                metrics=metrics,
            )
        )
        self._counters["versions"] += 1
        self._moved_at = self._clock.now()

    def _receipt(self, report: VersionReport, reason: str = "") -> VersionReceipt:
        stage = self._state.stage
        if stage is not None:
            index = stage.stage.index
        else:
            index = -1 if self._state.stages else 0
        return VersionReceipt(
            accepted=not reason,
            latest_version=self._state.latest_version(report.agent),
            stage=index,
            reason=reason,
        )

    def _renew(self, renewal: LeaseRenewal) -> LeaseStatus:
        lease = renewal.lease
        if lease not in self._state.live_leases:
            return LeaseStatus(alive=False)
        granted = self._state.leases[lease].grant
        if (granted.actor, granted.boot) != (renewal.actor, renewal.boot):
            return LeaseStatus(alive=False)
        self._table.renew(lease, self._clock.now())
        actors = leases.training_actors(self._state)
        return LeaseStatus(
            alive=True,
            expires_in=self._cfg.lease_seconds,
            window=leases.lease_window(self._cfg, actors, serial=self._serial),
        )

    def _lease(self, request: LeaseRequest) -> Lease:
        # Who asks has no work in hand, whatever we thought: an answer was lost, or it restarted.
        for lease in list(self._state.live_leases):
            held = self._state.leases[lease].grant
            if held.actor == request.actor:
                same_boot = held.boot == request.boot
                self._end_lease(lease, "asked_again" if same_boot else "restarted")
        if request.num_envs < 1:
            return Lease(lease="", kind="none", reason=f"num_envs is {request.num_envs}, below 1")
        granted = leases.grant(self._state, request)
        if granted is None:
            return Lease(lease="", kind="none", reason=self._describe())
        self._record(granted)
        self._table.renew(granted.lease, self._clock.now())
        self._counters["leases"] += 1
        return leases.lease_message(self._state, granted, self._cfg, serial=self._serial)

    def _answer_snapshots(self) -> bool:
        """Answer from the store; needs no ledger, so it works while that cannot be written."""
        did = False
        for _ in range(MAX_REQUESTS):
            if (request := self._snapshots.take()) is None:
                break
            did = True
            try:
                payload = self._store.get(request.message.snapshot)
            except SnapshotError as error:
                self._last_error = str(error)
                log.warning("snapshot_missed", reason=str(error))
                nothing = np.zeros(0, np.uint8)
                request.reply(SnapshotReply(found=False, payload=nothing, reason=str(error)))
            else:
                request.reply(SnapshotReply(found=True, payload=np.frombuffer(payload, np.uint8)))
        return did

    # Schedule -------------------------------------------------------------------------------

    def _advance(self) -> None:
        """Take every step that the schedule asks for now."""
        while (event := schedule.next_event(self._cfg, self._state)) is not None:
            self._record(event)
            self._moved_at = self._clock.now()
            if isinstance(event, StageEnded):
                for lease in list(self._state.live_leases):
                    if self._state.leases[lease].grant.stage == event.stage:
                        self._end_lease(lease, "stage_ended")
            self._tell(event)

    def _tell(self, event: Event) -> None:
        """Note what a reader of the log and of the dashboard should know."""
        match event:
            case StageStarted(stage=stage):
                log.info("stage_started", stage=stage.index, agent=stage.agent)
                self._message = f"stage {stage.index + 1}: {stage.agent} learns"
            case StageEnded():
                log.info("stage_ended", stage=event.stage, reason=event.reason)
            case RunFinished():
                log.info("run_finished", events=self._state.position)
                self._message = "finished"
            case _:
                log.info("schedule_moved", kind=event.kind)
                self._message = self._describe()

    def _end_lapsed(self) -> None:
        """End the leases whose actors have gone silent; renewals of this tick count."""
        for lease in self._table.lapsed(self._state, self._clock.now()):
            actor = self._state.leases[lease].grant.actor
            log.warning("lease_lapsed", lease=lease, actor=actor)
            self._message = f"{actor} went silent, its lease {lease} lapsed"
            self._counters["lapsed_leases"] += 1
            self._end_lease(lease, "lapsed")

    def _end_lease(self, lease: str, reason: LeaseEnd) -> None:
        self._record(LeaseEnded(lease=lease, reason=reason))

    def _describe(self) -> str:
        state = self._state
        if (record := state.stage) is not None:
            stage = record.stage
            return (
                f"stage {stage.index + 1} of {schedule.total_stages(self._cfg)}: {stage.agent} "
                f"learns, update {record.updates} of {stage.max_updates}"
            )
        if phase_between(state) == "evaluation":
            return f"evaluation: {state.evaluation_done} of {state.evaluation_total} bouts played"
        if state.finished:
            return "finished"
        missing = [agent for agent in AGENTS if state.latest(agent) is None]
        return f"waiting for version 0 of {' and '.join(missing)}"

    # Ledger ---------------------------------------------------------------------------------

    def _record(self, event: Event) -> None:
        """Apply an event now, to be committed at the end of the tick."""
        seq = self._state.position + 1
        self._state.apply(Entry(seq=seq, at_ns=self._batch.at_ns, event=event))
        self._batch.events.append(event)

    def _commit(self) -> None:
        """Make this tick's events durable, then answer."""
        batch = self._batch
        if batch.events:
            try:
                entries = self._ledger.append(batch.events, batch.at_ns)
                if len(entries) != len(batch.events):
                    raise LedgerError(f"ledger {self._ledger.path} was changed by somebody else")
            except LedgerError as error:
                self._fail(str(error))
                for request, _ in batch.answers:
                    request.refuse(self._failure, retry=True)
                return
        for request, answer in batch.answers:
            request.reply(answer)
        if self._failure:
            self._failure = ""
            log.info("ledger_recovered", events=self._state.position)

    def _fail(self, reason: str) -> None:
        if not self._failure:
            log.error("ledger_failed", reason=reason)
        self._failure = self._last_error = reason
        self._retry_at = self._clock.now() + RETRY_SECONDS
        self._counters["ledger_failures"] += 1

    def _recover(self) -> bool:
        """After a failure: return whether it is time to try again with the state of the ledger."""
        if self._clock.now() < self._retry_at:
            return False
        try:
            self._reload()
        except LedgerError as error:
            self._fail(str(error))
            return False
        return True

    def _refuse_waiting(self, reason: str) -> bool:
        did = False
        inboxes: tuple[Inbox[Any, Any], ...] = (
            self._incidents, self._results, self._versions, self._renewals, self._requests,
        )  # fmt: skip
        for inbox in inboxes:
            for _ in range(MAX_REQUESTS):
                if (request := inbox.take()) is None:
                    break
                did = True
                request.refuse(reason, retry=True)
        return did

    def _load(self, run: str, seed: int) -> RunState:
        state = self._replay()
        path = self._ledger.path
        if state.position == 0:
            if not self._store.is_empty:
                raise LedgerError(
                    f"ledger {path} is empty, but there are snapshots beside it: it was lost; "
                    "restore it from a copy, or start a new run in another folder"
                )
            start = RunStarted(run=run, seed=seed, serial=self._serial, config=self._cfg)
            for entry in self._ledger.append([start], self._clock.wall_ns()):
                state.apply(entry)
            return state
        if state.run != run:
            raise LedgerError(
                f"ledger {path} is of run {state.run!r}, not {run!r}; "
                f"give --run-id {state.run}, or choose another folder"
            )
        if state.seed != seed:
            raise LedgerError(
                f"ledger {path} is of a run with seed {state.seed}, not {seed}; "
                f"give --seed {state.seed}, or choose another folder"
            )
        return state

    def _reload(self) -> None:
        self._state = self._replay()
        self._table = leases.LeaseTable(self._cfg.lease_seconds)

    def _replay(self) -> RunState:
        try:
            return RunState.fold(self._ledger.replay())
        except ValueError as error:
            raise LedgerError(
                f"ledger {self._ledger.path} is damaged: {error}; "
                "restore it from a copy, or start a new run in another folder"
            ) from error

    # Publishing -----------------------------------------------------------------------------

    def _publish(self) -> None:
        if self._failure:
            return
        now = self._clock.now()
        if self._batch.events or now >= self._schedule_due_at:
            self._schedule_due_at = now + PERIOD
            self._publish_schedule()
        if now >= self._progress_due_at:
            self._progress_due_at = now + PERIOD
            self._bus.publish(
                PROGRESS,
                progress_of(self._cfg, self._state, self._rules.bout_steps, self._message),
            )

    def _publish_schedule(self) -> None:
        state = self._state
        record = state.stage
        current = Schedule(
            stage=record.stage if record is not None else None,
            leases=leases.summaries(state, self._cfg, self._batch.at_ns),
            versions={
                agent: state.latest_version(agent) for agent in AGENTS if state.versions[agent]
            },
            finished=state.finished,
        )
        if current != self._schedule:
            self._schedule = current
            self._bus.publish(SCHEDULE, current)
