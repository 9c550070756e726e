"""Finished bouts on their way to the league: those of one pair of players in one message.

Side by side, staggered bouts end with every rollout. A message for each would be as many as the
rollouts are, and cost everybody more than what is in it.
"""

import dataclasses

import numpy as np
import structlog

from services.actor.collector import Results
from shared.bus.base import Bus
from shared.bus.delivery import Outbox
from shared.clock import Clock
from shared.messages.league import BoutResults, Lease
from shared.messages.topics import RESULTS
from shared.messages.training import Receipt

log = structlog.get_logger()

WINDOW = 256
"""Result messages that may wait for the league before no more are taken on."""
_LAST_ONES = 2
"""Messages that what was taken on by then can still become."""
GATHER_SECONDS = 1.0
"""Longest that finished bouts wait for others of the same players."""
GATHER_BOUTS = 256
"""Finished bouts that are worth a message by themselves."""


@dataclasses.dataclass(frozen=True)
class _Source:
    """Whose bouts these are; those of one source may share a message."""

    lease: Lease
    players: tuple[str, str]


class Reports:
    """Gathers what was finished, hands it over, and hears whether it was entered."""

    def __init__(self, bus: Bus, clock: Clock, timeout: float, model: str) -> None:
        """Begin with nothing to report.

        Args:
            bus: where the league answers.
            clock: tells how long bouts have waited for others.
            timeout: seconds to wait for the league's answer.
            model: hash of the simulator model the bouts are played in.
        """
        self._bus = bus
        self._clock = clock
        self._model = model
        self._outbox: Outbox[BoutResults, Receipt] = Outbox(
            bus, RESULTS, clock, window=WINDOW + _LAST_ONES, timeout=timeout
        )
        self._source: _Source | None = None
        self._gathered: list[Results] = []
        self._since = 0.0
        self.sequence = 0
        """Of the next message."""
        self.last_error = ""

    @property
    def full(self) -> bool:
        """Return whether the league has to answer before more may be reported."""
        return self._outbox.unacknowledged >= WINDOW

    @property
    def outstanding(self) -> int:
        """Return how many messages are not acknowledged, with what is gathered for the next."""
        return self._outbox.unacknowledged + bool(self._gathered)

    def add(self, lease: Lease, players: tuple[str, str], results: Results) -> None:
        """Take charge of finished bouts; an evaluation's go at once, it is waited for.

        Args:
            lease: under which they were played.
            players: references of antagonist and protagonist.
            results: of the bouts.
        """
        source = _Source(lease, players)
        if self._source != source:
            self.flush()
            self._source = source
            self._since = self._clock.now()
        self._gathered.append(results)
        if lease.stage is None or sum(len(r.bouts) for r in self._gathered) >= GATHER_BOUTS:
            self.flush()

    def flush(self) -> None:
        """Send what was gathered."""
        source, gathered = self._source, self._gathered
        self._source, self._gathered = None, []
        if source is None:
            return
        lease = source.lease
        columns = {
            field.name: np.concatenate([getattr(results, field.name) for results in gathered])
            for field in dataclasses.fields(Results)
        }
        message = BoutResults(
            actor=self._bus.name,
            boot=self._bus.boot,
            sequence=self.sequence,
            lease=lease.lease,
            kind="evaluate" if lease.stage is None else "train",
            stage=-1 if lease.stage is None else lease.stage.index,
            antagonist=source.players[0],
            protagonist=source.players[1],
            model=self._model,
            seed=lease.seed,
            **columns,
        )
        self.sequence += 1
        self._outbox.put(message)

    def tick(self) -> bool:
        """Send what has waited long enough, ask again what is due; return whether any came in."""
        if self._gathered and self._clock.now() - self._since >= GATHER_SECONDS:
            self.flush()
        answered = self._outbox.pump()
        for results, receipt in answered:
            if receipt.accepted:
                log.info("results_acknowledged", name=results.name)
            else:
                self.last_error = f"results {results.name} dropped: {receipt.reason}"
                log.warning("results_dropped", name=results.name, reason=receipt.reason)
        for results, reason in self._outbox.take_refused():
            self.last_error = f"results {results.name} refused: {reason}"
            log.warning("results_refused", name=results.name, reason=reason)
        return bool(answered)
