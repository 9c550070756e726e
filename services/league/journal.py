"""The state of a run and the ledger it is folded from, changed together or not at all."""

from pathlib import Path

import structlog

from services.league.events import Entry, Event, RunStarted, VersionEntered
from services.league.history import RunState
from services.league.ledger import Ledger
from shared.clock import Clock
from shared.errors import LedgerError
from shared.messages.training import Agent

RETRY_SECONDS = 0.5
"""After the ledger failed, it is left alone this long before it is tried again."""
REMEMBERED = 256
"""Versions of a stage that the state holds at least; an endless stage would fill the memory."""
REMEMBERED_WINDOWS = 3
"""The same, in windows of the test for convergence, which looks at two."""

log = structlog.get_logger()


class Journal:
    """Takes events at once, commits those of one tick in one transaction.

    When a commit fails the state is read back from the ledger, so that nothing that is not
    durable is ever told to anybody.
    """

    def __init__(self, path: Path, start: RunStarted, clock: Clock, *, may_start: bool) -> None:
        """Open the ledger of a run, or begin it.

        Args:
            path: of the ledger.
            start: the run's first event; a ledger of another run or seed is refused.
            clock: dates the events.
            may_start: whether an empty ledger is expected.

        Raises:
            LedgerError: the ledger is in use, damaged, of another run, or cannot be written.
        """
        self.failure = ""
        """Why the ledger cannot be written now; empty while it can."""
        self.failures = 0
        self._is_stale = False
        """The state has events that are not in the ledger."""
        self._clock = clock
        self._retry_at = 0.0
        self._ledger = Ledger(path)
        self._remembers = max(REMEMBERED, REMEMBERED_WINDOWS * start.config.convergence_window)
        try:
            self.state = self._replay(self._remembers)
            if self.state.position:
                _check_same_run(path, self.state, start)
            elif may_start:
                for entry in self._ledger.append([start], clock.wall_ns()):
                    self.state.apply(entry)
            else:
                raise LedgerError(
                    f"ledger {path} is empty, but there are snapshots beside it: it was lost; "
                    "restore it from a copy, or start a new run in another folder"
                )
        except BaseException:
            self._ledger.close()
            raise
        self.at_ns = clock.wall_ns()
        """Wall clock of this tick, the date of its events."""
        self.uncommitted: list[Event] = []

    def begin(self) -> None:
        """Begin a tick."""
        self.at_ns = self._clock.wall_ns()
        self.uncommitted = []

    def record(self, event: Event) -> None:
        """Apply an event now, to be committed with the others of this tick."""
        entry = Entry(seq=self.state.position + 1, at_ns=self.at_ns, event=event)
        self.state.apply(entry)
        self.uncommitted.append(event)

    def commit(self) -> bool:
        """Make this tick's events durable; return False when that failed and they are undone."""
        if not self.uncommitted:
            return True
        try:
            entries = self._ledger.append(self.uncommitted, self.at_ns)
            if len(entries) != len(self.uncommitted) or entries[-1].seq != self.state.position:
                raise LedgerError(f"ledger {self._ledger.path} was changed by somebody else")
        except LedgerError as error:
            self._is_stale = True
            self._fail(error)
            return False
        return True

    def recover(self) -> bool:
        """Return whether the ledger can be used; after a failure, try it again now and then."""
        if not self.failure:
            return True
        if self._clock.now() < self._retry_at:
            return False
        try:
            if self._is_stale:  # once: nobody else writes, and a long ledger takes seconds
                self.state, self._is_stale = self._replay(self._remembers), False
            self._ledger.check_writable()
        except LedgerError as error:
            self._fail(error)
            return False
        self.failure = ""
        log.info("ledger_recovered", events=self.state.position)
        return True

    def rewind(self, position: int) -> None:
        """Forget the events after a position.

        Raises:
            LedgerError: the ledger ends before it, or cannot be written.
        """
        self._ledger.rewind(position)
        self.state = self._replay(self._remembers)

    def rollouts_behind(self, agent: Agent, version: int) -> tuple[str, ...]:
        """Return the names of the rollouts that a version of the state was made from.

        Raises:
            LedgerError: the ledger cannot be read now.
        """
        event = self._entered(agent, version)
        return event.rollouts if event is not None else ()

    def snapshot_of(self, agent: Agent, version: int) -> str:
        """Return the content hash of a version, empty where there is none of that number.

        Raises:
            LedgerError: the ledger cannot be read now.
        """
        if (record := self.state.versions[agent].get(version)) is not None:
            return record.snapshot
        if version > self.state.forgotten.get(agent, -1):
            return ""
        event = self._entered(agent, version)
        return event.snapshot if event is not None else ""

    def since(self, agent: Agent, version: int) -> list[tuple[int, str]]:
        """Return number and content hash of an agent's versions from this number on.

        Raises:
            LedgerError: the ledger cannot be read now.
        """
        records = list(self.state.versions[agent].values())
        if version <= self.state.forgotten.get(agent, -1):
            records += self._replay(None).versions[agent].values()
        return sorted({(r.version, r.snapshot) for r in records if r.version >= version})

    def _entered(self, agent: Agent, version: int) -> VersionEntered | None:
        key = f"{agent}:{version}"
        new = [e for e in self.uncommitted if isinstance(e, VersionEntered) and e.key == key]
        return new[0] if new else self._ledger.find(VersionEntered, key)

    def close(self) -> None:
        """Close the ledger."""
        self._ledger.close()

    def _fail(self, error: LedgerError) -> None:
        if not self.failure:
            log.error("ledger_failed", reason=str(error))
        self.failure = str(error)
        self.failures += 1
        self._retry_at = self._clock.now() + RETRY_SECONDS

    def _replay(self, remembers: int | None) -> RunState:
        try:
            return RunState.fold(self._ledger.replay(), remembers)
        except ValueError as error:
            raise LedgerError(
                f"ledger {self._ledger.path} is damaged: {error}; "
                "restore it from a copy, or start a new run in another folder"
            ) from error


def _check_same_run(path: Path, state: RunState, start: RunStarted) -> None:
    if state.serial != start.serial:
        how, flag = ("in one process", "with") if state.serial else ("by processes", "without")
        raise LedgerError(f"ledger {path} was begun {how}; resume it {flag} --serial")
    if state.run != start.run:
        raise LedgerError(
            f"ledger {path} is of run {state.run!r}, not {start.run!r}; "
            f"give --run-id {state.run}, or choose another folder"
        )
    if state.seed != start.seed:
        raise LedgerError(
            f"ledger {path} is of a run with seed {state.seed}, not {start.seed}; "
            f"give seed {state.seed}, or choose another folder"
        )
