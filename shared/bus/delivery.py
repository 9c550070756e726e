"""Acknowledged delivery: ask again until answered, and apply once.

The sender keeps every message in an ``Outbox`` until its answer says that it is durable; the
receiver keeps an ``Applied`` beside what it makes durable, and answers a message it has applied
before without applying it again. Together: nothing acknowledged is lost, nothing counts twice.
"""

import bisect
from typing import Generic, TypeVar

import msgspec

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.clock import Clock
from shared.errors import CheckpointError
from shared.messages.message import Message
from shared.messages.topics import Service

In = TypeVar("In", bound=Message)
Out = TypeVar("Out", bound=Message)


class _Entry(Generic[In, Out]):
    """One message that has no answer yet."""

    def __init__(self, message: In, at: float) -> None:
        self.message = message
        self.put_at = at
        self.ask_at = at
        self.pending: Pending[Out] | None = None


class Outbox(Generic[In, Out]):
    """Messages of one service that are asked until they are answered; ``window`` at most."""

    def __init__(
        self, bus: Bus, service: Service[In, Out], clock: Clock, *, window: int, timeout: float,
        retry_delay: float = 0.2, **fields: str,
    ) -> None:  # fmt: skip
        """Make an empty outbox.

        Args:
            bus: where the service is asked.
            service: answered with a receipt once the message is durable.
            clock: decides when to ask again.
            window: how many messages may be without an answer.
            timeout: seconds after which a message is asked again.
            retry_delay: seconds between no answer and the next try.
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
                entry.ask_at = now + self._retry_delay
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
    ``max_boots`` boots, the one that was quiet longest is forgotten.
    """

    def __init__(self, max_boots: int = 1024, max_ranges: int = 1024) -> None:
        self._max_boots = max_boots
        self._max_ranges = max_ranges
        self._boots: dict[str, list[list[int]]] = {}

    def contains(self, boot: str, sequence: int) -> bool:
        """Return whether this message has been applied."""
        ranges = self._boots.get(boot)
        if not ranges:
            return False
        at = bisect.bisect_right(ranges, sequence, key=_start) - 1
        return at >= 0 and sequence <= ranges[at][1]

    def add(self, boot: str, sequence: int) -> None:
        """Enter a message; entering it again changes nothing."""
        ranges = self._boots.pop(boot, None) or []
        self._boots[boot] = ranges  # now the youngest
        at = bisect.bisect_right(ranges, sequence, key=_start)
        if not (at and sequence <= ranges[at - 1][1]):
            joins_left = at > 0 and ranges[at - 1][1] == sequence - 1
            joins_right = at < len(ranges) and ranges[at][0] == sequence + 1
            if joins_left and joins_right:
                ranges[at - 1][1] = ranges.pop(at)[1]
            elif joins_left:
                ranges[at - 1][1] = sequence
            elif joins_right:
                ranges[at][0] = sequence
            else:
                ranges.insert(at, [sequence, sequence])
        if len(ranges) > self._max_ranges:
            ranges[0][1] = ranges.pop(1)[1]
        if len(self._boots) > self._max_boots:
            del self._boots[next(iter(self._boots))]

    def to_json(self) -> str:
        """Return everything as one line of JSON."""
        return msgspec.json.encode(self._boots).decode()

    @classmethod
    def from_json(cls, text: str, max_boots: int = 1024, max_ranges: int = 1024) -> "Applied":
        """Return what ``to_json`` wrote.

        Raises:
            CheckpointError: if the text is anything else.
        """
        applied = cls(max_boots, max_ranges)
        try:
            boots = msgspec.json.decode(text, type=dict[str, list[tuple[int, int]]])
            for boot, ranges in boots.items():
                ends = [-1, *(last for _, last in ranges)]
                if any(
                    last < first or first < end + 1 + (end >= 0)
                    for end, (first, last) in zip(ends, ranges, strict=False)
                ):
                    raise ValueError(f"ranges of {boot[:80]!r} are out of order")
                applied._boots[boot] = [[first, last] for first, last in ranges]
        except ValueError as error:
            raise CheckpointError(f"record of applied messages is damaged: {error}") from error
        return applied


def _start(item: list[int]) -> int:
    return item[0]
