"""What the league answers to each request, and what it records for it; knows no bus."""

from collections import Counter

import structlog

from services.league import checks, leases, schedule
from services.league.config import LeagueConfig
from services.league.events import (
    Event,
    IncidentNoted,
    LeaseEnd,
    LeaseEnded,
    RunFinished,
    StageEnded,
    StageStarted,
    VersionEntered,
)
from services.league.history import RunState
from services.league.journal import Journal
from services.league.names import Names
from services.league.progress import describe
from services.league.snapshots import SnapshotStore
from shared.clock import Clock
from shared.errors import SnapshotError
from shared.game.rules import RuleBook
from shared.messages.league import (
    BoutResults,
    Incident,
    Lease,
    LeaseRenewal,
    LeaseRequest,
    LeaseStatus,
)
from shared.messages.texts import clipped
from shared.messages.training import Receipt, VersionReceipt, VersionReport

log = structlog.get_logger()


class Desk:
    """Decides; every answer holds only once the journal has committed."""

    def __init__(
        self, cfg: LeagueConfig, journal: Journal, store: SnapshotStore, clock: Clock,
        rules: RuleBook, *, serial: bool,
    ) -> None:  # fmt: skip
        self.counters: Counter[str] = Counter()
        self.last_error = ""
        self.message = ""
        """The latest event worth a line."""
        self.moved_at = clock.now()
        """When whoever the schedule waits for last did something."""
        self._cfg = cfg
        self._journal = journal
        self._store = store
        self._clock = clock
        self._rules = rules
        self._serial = serial
        self.restart()

    @property
    def _state(self) -> RunState:
        return self._journal.state

    def restart(self) -> None:
        """Give every live lease its full time, after the state was read back from the ledger."""
        self._table = leases.LeaseTable(
            self._cfg.lease_seconds, self._state.live_leases, self._clock.now()
        )

    def note(self, incident: Incident) -> Receipt:
        """Enter an incident once."""
        event = IncidentNoted(
            source=incident.source,
            boot=incident.boot,
            sequence=incident.sequence,
            what=incident.kind,
            detail=incident.detail,
            reported_at_ns=incident.at_ns,
        )
        if event.key not in self._state.incident_keys:
            self._journal.record(event)
            self.message = f"{incident.source}: {incident.kind} {incident.detail}".strip()
        return Receipt(accepted=True)

    def enter_results(self, results: BoutResults) -> Receipt:
        """Enter bouts once, if they are what their lease is for."""
        if results.name in self._state.result_names:
            self.counters["repeated_results"] += 1
            return Receipt(accepted=True)
        if problem := checks.results_problem(self._state, results, self._rules):
            self.counters["refused_results"] += 1
            self.last_error = clipped(f"results of {results.actor} refused: {problem}")
            log.warning("results_refused", actor=results.actor, name=results.name, reason=problem)
            return Receipt(accepted=False, reason=clipped(problem))
        self._journal.record(checks.played(results))
        self.counters["results"] += 1
        self.counters["bouts"] += len(results.bouts)
        if results.kind == "evaluate":
            self.moved_at = self._clock.now()
            for other in leases.overlapping(self._state, results.lease):
                self._end_lease(other, "superseded")
            if results.lease in self._state.live_leases:
                self._end_lease(results.lease, "completed")
            self.advance()
        return Receipt(accepted=True)

    def enter_version(self, report: VersionReport) -> VersionReceipt:
        """Enter a version once and store its snapshot.

        Raises:
            SnapshotError: it can never be entered; says why.
            RiposteError: it cannot be stored, or the ledger cannot be read, now.
        """
        known = self._journal.snapshot_of(report.agent, report.policy_version)
        if known:
            if known == report.snapshot:
                self.counters["repeated_versions"] += 1
                return self._receipt(report)
            reason = (
                f"version {report.policy_version} of {report.agent} is in the ledger as snapshot "
                f"{known[:12]}, not {report.snapshot[:12]}; use a number after the latest"
            )
            self.counters["conflicting_versions"] += 1
            log.warning("version_conflicted", agent=report.agent, reason=reason)
            return self._receipt(report, reason)
        if problem := checks.version_problem(self._state, report):
            raise SnapshotError(problem)
        card = self._store.put(report)
        self._record_version(report, card.model)
        self.advance()
        return self._receipt(report)

    def renew(self, renewal: LeaseRenewal) -> LeaseStatus:
        """Give a lease its full time again, if it is alive and the actor's own."""
        lease = renewal.lease
        if lease not in self._state.live_leases:
            return LeaseStatus(alive=False)
        granted = self._state.leases[lease].grant
        if (granted.actor, granted.boot) != (renewal.actor, renewal.boot):
            return LeaseStatus(alive=False)
        self._table.renew(lease, self._clock.now())
        actors = self._state.training_leases
        return LeaseStatus(
            alive=True,
            expires_in=self._cfg.lease_seconds,
            window=leases.lease_window(
                self._cfg, actors, granted.rollout_samples, serial=self._serial
            ),
        )

    def lease(self, request: LeaseRequest) -> Lease:
        """Grant the work there is for an actor."""
        if problem := checks.request_problem(request):
            return Lease(lease="", kind="none", reason=problem)
        # Who asks has no work in hand, whatever we thought: an answer was lost, or it restarted.
        for lease in list(self._state.live_leases_of.get(request.actor, ())):
            boot = self._state.leases[lease].grant.boot
            self._end_lease(lease, "asked_again" if boot == request.boot else "restarted")
        granted = leases.grant(self._state, request)
        if granted is None:
            return Lease(lease="", kind="none", reason=describe(self._cfg, self._state))
        self._journal.record(granted)
        self._table.renew(granted.lease, self._clock.now())
        self.counters["leases"] += 1
        return leases.lease_message(self._state, granted, self._cfg, serial=self._serial)

    def advance(self) -> None:
        """Take every step that the schedule asks for now."""
        while (event := schedule.next_event(self._cfg, self._state)) is not None:
            self._journal.record(event)
            self.moved_at = self._clock.now()
            if isinstance(event, StageEnded):
                for lease in list(self._state.live_leases):
                    if self._state.leases[lease].grant.stage == event.stage:
                        self._end_lease(lease, "stage_ended")
            self._tell(event)

    def end_lapsed(self) -> None:
        """End the leases whose actors have gone silent."""
        for lease in self._table.lapsed(self._state, self._clock.now()):
            actor = self._state.leases[lease].grant.actor
            log.warning("lease_lapsed", lease=lease, actor=actor)
            self.message = f"{actor} went silent, its lease {lease} lapsed"
            self.counters["lapsed_leases"] += 1
            self._end_lease(lease, "lapsed")

    def _end_lease(self, lease: str, reason: LeaseEnd) -> None:
        self._journal.record(LeaseEnded(lease=lease, reason=reason))

    def _record_version(self, report: VersionReport, model: str) -> None:
        metrics = report.metrics
        if metrics is not None and not checks.are_finite(metrics):
            metrics = None
            self._journal.record(
                IncidentNoted(
                    source="league",
                    boot=f"{report.agent}:{report.policy_version}",
                    sequence=0,
                    what="metrics_dropped",
                    detail=f"of version {report.policy_version} of {report.agent}: not finite, "
                    "or out of range",
                    reported_at_ns=self._journal.at_ns,
                )
            )
        self._journal.record(
            VersionEntered(
                agent=report.agent,
                version=report.policy_version,
                stage=report.stage,
                snapshot=report.snapshot,
                rollouts=report.rollouts,
                metrics=metrics,
                model=model,
            )
        )
        self.counters["versions"] += 1
        self.moved_at = self._clock.now()

    def _receipt(self, report: VersionReport, reason: str = "") -> VersionReceipt:
        elsewhere = Names()
        for version, snapshot in self._journal.since(report.agent, report.policy_version):
            if snapshot != report.snapshot:
                for name in self._journal.rollouts_behind(report.agent, version):
                    elsewhere.add(name)
        return VersionReceipt(
            accepted=not reason,
            latest_version=self._state.latest_version(report.agent),
            stage=schedule.stage_now(self._state),
            learned_elsewhere=tuple(elsewhere.spans()),
            reason=reason,
        )

    def _tell(self, event: Event) -> None:
        """Note what a reader of the log and of the dashboard should know."""
        match event:
            case StageStarted(stage=stage):
                log.info("stage_started", stage=stage.index, agent=stage.agent)
                self.message = f"stage {stage.index + 1}: {stage.agent} learns"
                if stage.round:
                    opponent = self._state.player_label(stage.opponent)
                    where = f"round {stage.round}, iteration {stage.iteration}"
                    self.message = f"{where}: {stage.agent} learns against {opponent}"
            case StageEnded():
                log.info("stage_ended", stage=event.stage, reason=event.reason)
            case RunFinished():
                log.info("run_finished", events=self._state.position)
                self.message = "finished"
            case _:
                log.info("schedule_moved", kind=event.kind)
                self.message = describe(self._cfg, self._state)
