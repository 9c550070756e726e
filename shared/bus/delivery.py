"""Acknowledged delivery: ask again until answered, and apply once.

The sender keeps every message in an ``Outbox`` until its answer says that it is durable; the
receiver keeps an ``Applied`` beside what it makes durable, and answers a message it has applied
before without applying it again. Together: nothing acknowledged is lost, nothing counts twice.
"""

from typing import Generic, TypeVar

import msgspec

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.bus.ranges import Ranges
from shared.clock import Clock
from shared.errors import CheckpointError
from shared.messages.message import Message
from shared.messages.topics import Service

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)

MAX_BOOTS = 16_384
"""That a receiver remembers: three times the sessions that a router takes."""
MAX_RANGES = 1024
"""Of one boot."""


class _Entry(Generic[In, Out]):
    """One message that has no answer yet."""

    def __init__(self, message: In, at: float) -> None:
        self.message = message
        self.put_at = at
        self.ask_at = at
        self.delay = 0.0
        """Before the next try (s)."""
        self.pending: Pending[Out] | None = None


class Outbox(Generic[In, Out]):
    """Messages of one service that are asked until they are answered; ``window`` at most."""

    def __init__(
        self, bus: Bus, service: Service[In, Out], clock: Clock, *, window: int, timeout: float,
        retry_delay: float = 0.2, max_retry_delay: float = 2.0, **fields: str,
    ) -> None:  # fmt: skip
        """Make an empty outbox.

        Args:
            bus: where the service is asked.
            service: answered with a receipt once the message is durable.
            clock: decides when to ask again.
            window: how many messages may be without an answer.
            timeout: seconds after which a message is asked again.
            retry_delay: seconds between no answer and the next try; twice as long each time, as
                the whole message travels again.
            max_retry_delay: the longest of them (s); what is refused until a process is up again
                waits no longer than this for it.
            fields: of the service's key.
        """
        self.window = window
        self.last_failure = ""
        """Why the latest try was not answered; empty after an answer."""
        self._bus = bus
        self._service = service
        self._clock = clock
        self._timeout = timeout
        self._retry_delay = retry_delay
        self._max_retry_delay = max_retry_delay
        self._fields = fields
        self._entries: list[_Entry[In, Out]] = []
        self._refused: list[tuple[In, str]] = []

    @property
    def full(self) -> bool:
        """Return whether the window is used up."""
        return len(self._entries) >= self.window

    @property
    def unacknowledged(self) -> int:
        """Return how many messages have no answer yet."""
        return len(self._entries)

    @property
    def oldest_seconds(self) -> float:
        """Return how long the oldest message has been without an answer; 0 when there is none."""
        return self._clock.now() - self._entries[0].put_at if self._entries else 0.0

    def put(self, message: In) -> None:
        """Take charge of a message and send it; the answer comes out of ``pump``.

        Raises:
            ValueError: if the outbox is full; look at ``full`` first.
        """
        if self.full:
            raise ValueError(
                f"outbox of {self._service.key} is full ({self.unacknowledged} of {self.window})"
            )
        entry: _Entry[In, Out] = _Entry(message, self._clock.now())
        self._ask(entry)
        self._entries.append(entry)

    def pump(self) -> list[tuple[In, Out]]:
        """Ask what is due and return the messages answered since the last call, with the answer.

        A message that the other side refuses as malformed is never asked again: see
        ``take_refused``.
        """
        answered: list[tuple[In, Out]] = []
        left: list[_Entry[In, Out]] = []
        now = self._clock.now()
        for entry in self._entries:
            if entry.pending is None and now >= entry.ask_at:
                self._ask(entry)
            answer = entry.pending.take() if entry.pending else None
            if answer is None:
                left.append(entry)
            elif isinstance(answer, NoAnswer) or (isinstance(answer, Refused) and answer.retry):
                self.last_failure = answer.reason
                entry.pending = None
                entry.delay = min(2.0 * entry.delay or self._retry_delay, self._max_retry_delay)
                entry.ask_at = now + entry.delay
                left.append(entry)
            elif isinstance(answer, Refused):
                self.last_failure = answer.reason
                self._refused.append((entry.message, answer.reason))
            else:
                self.last_failure = ""
                answered.append((entry.message, answer))
        self._entries = left
        return answered

    def _ask(self, entry: _Entry[In, Out]) -> None:
        entry.pending = self._bus.ask(self._service, entry.message, self._timeout, **self._fields)

    def take_refused(self) -> list[tuple[In, str]]:
        """Return the messages refused for good since the last call, each with the reason."""
        refused, self._refused = self._refused, []
        return refused


class Applied:
    """Which messages, named by boot and sequence, have been applied; bounded.

    Sequence numbers are kept as ranges per boot. A sender has only a few messages unanswered at
    a time, so far below its newest one nothing is outstanding: when a boot has more than
    ``max_ranges`` ranges, the oldest gap counts as applied, and when there are more than
    ``max_boots`` boots, the one that was quiet longest is forgotten. What a forgotten boot repeats
    would count twice; so there is room for more boots than a run has actors, at 30 bytes each in
    the record.
    """

    def __init__(self, max_boots: int = MAX_BOOTS, max_ranges: int = MAX_RANGES) -> None:
        self._max_boots = max_boots
        self._max_ranges = max_ranges
        self._boots: dict[str, Ranges] = {}

    def contains(self, boot: str, sequence: int) -> bool:
        """Return whether this message has been applied."""
        ranges = self._boots.get(boot)
        return ranges is not None and sequence in ranges

    def contains_name(self, name: str) -> bool:
        """Return whether the message ``boot:sequence`` has been applied."""
        boot, _, sequence = name.rpartition(":")
        return sequence.isdecimal() and self.contains(boot, int(sequence))

    def add(self, boot: str, sequence: int) -> None:
        """Enter a message; entering it again changes nothing."""
        ranges = self._boots.pop(boot, None) or Ranges()
        self._boots[boot] = ranges  # now the youngest
        ranges.add(sequence)
        if len(ranges) > self._max_ranges:
            ranges.close_first_gap()
        while len(self._boots) > self._max_boots:
            del self._boots[next(iter(self._boots))]

    def cover(self, boot: str, first: int, last: int) -> None:
        """Enter all messages of a boot from one number to another.

        Raises:
            ValueError: there are no such numbers.
            OverflowError: ``last`` is no number that fits.
        """
        self.add(boot, first)
        self._boots[boot].cover(first, last)

    def to_json(self) -> str:
        """Return everything as one line of JSON."""
        return msgspec.json.encode(
            {boot: list(ranges) for boot, ranges in self._boots.items()}
        ).decode()

    @classmethod
    def from_json(
        cls, text: str, max_boots: int = MAX_BOOTS, max_ranges: int = MAX_RANGES
    ) -> "Applied":
        """Return what ``to_json`` wrote.

        Raises:
            CheckpointError: if the text is anything else.
        """
        applied = cls(max_boots, max_ranges)
        try:
            boots = msgspec.json.decode(text, type=dict[str, list[tuple[int, int]]])
            for boot, pairs in boots.items():
                ranges = applied._boots[boot] = Ranges()
                for first, last in pairs:
                    ranges.append(first, last)
        except (ValueError, OverflowError) as error:
            raise CheckpointError(f"record of applied messages is damaged: {error}") from error
        return applied
