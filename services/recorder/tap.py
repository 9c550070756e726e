"""Hears every stream of a live bout and turns what was said into rows."""

import dataclasses
from collections import OrderedDict
from collections.abc import Callable
from typing import Any, cast

from shared.bus.base import Bus, Subscription
from shared.clock import Clock
from shared.messages import topics
from shared.messages.live import ServiceStatus
from shared.messages.message import Message
from shared.messages.play import BatStates, RefereeState
from shared.messages.topics import Qos, Topic
from shared.messages.training import AGENTS
from shared.telemetry import streams
from shared.telemetry.streams import Rows, Stream, rows_of

TAKE_MOST = 256
"""Messages of one stream taken in one tick, so that a flood cannot hold up the rest."""
WAIT_MOST = 4096
"""Messages of one stream that wait to become rows."""
TICKS_KNOWN = 1024
"""Ticks whose time is remembered."""


@dataclasses.dataclass(frozen=True)
class Heard:
    """What was said since the last time."""

    rows: dict[str, Rows]
    """By stream; those that said nothing are not in it."""
    referee: tuple[RefereeState, ...]
    dropped: dict[str, int]
    """By stream, since the start: messages that arrived and were thrown away."""
    boot: str
    """Of the robot_io heard last."""
    referee_at: float
    """When the referee said anything last, things it had said before included (s)."""


@dataclasses.dataclass
class _Ear:
    """One subscription and what it brought."""

    stream: Stream
    subscription: Subscription[Any]
    messages: list[Message] = dataclasses.field(default_factory=list[Message])
    heard_ns: list[int] = dataclasses.field(default_factory=list[int])
    bases: list[int] = dataclasses.field(default_factory=list[int])
    last: object = None
    discarded: int = 0

    @property
    def dropped(self) -> int:
        return self.subscription.dropped + self.discarded


class Tap:
    """Subscribes to the streams; nothing here waits, and everything that grows is bounded."""

    def __init__(self, bus: Bus, clock: Clock, timestep: float) -> None:
        """Begin to listen.

        Args:
            bus: this process's end of the bus.
            clock: dates what has no time of its own.
            timestep: from tick to tick (s).
        """
        self._clock = clock
        self._period_ns = round(1e9 * timestep)
        self._ears = [
            _Ear(streams.BATS, _every(bus, topics.BATS)),
            _Ear(streams.ARMS, _every(bus, topics.ARMS)),
            _Ear(streams.ROBOT, _every(bus, topics.ROBOT)),
            _Ear(streams.GATE, _every(bus, topics.GATE)),
            _Ear(streams.REFEREE, _every(bus, topics.REFEREE)),
            *(
                _Ear(streams.OFFSETS[agent], _every(bus, topics.OFFSET, agent=agent))
                for agent in AGENTS
            ),
            _Ear(streams.TRACKER, _every(bus, topics.TRACKER)),
            _Ear(streams.TRACKER_RAW, _every(bus, topics.TRACKER_RAW)),
            _Ear(streams.HEART_RATE, _every(bus, topics.HEART_RATE)),
        ]
        self._statuses: list[ServiceStatus] = []
        self._status_ns: list[int] = []
        self._times: OrderedDict[int, int] = OrderedDict()
        self._boot = ""
        self._base = 0
        """Ticks of all earlier boots."""
        self._last_tick = 0
        self._referee_at = -1e9
        self.heard_at = -1e9
        """When bat states came last (s)."""

    @property
    def dropped(self) -> dict[str, int]:
        """Return what was thrown away since the start, by stream."""
        return {ear.stream.name: ear.dropped for ear in self._ears}

    def listen(self) -> bool:
        """Take what has arrived; return whether anything has."""
        did = False
        wall_ns = self._clock.wall_ns()
        for ear in self._ears:
            for _ in range(TAKE_MOST):
                if (message := ear.subscription.take()) is None:
                    break
                did = True
                self._keep(ear, message, wall_ns)
        return did

    def add_status(self, status: ServiceStatus) -> None:
        """Take what a process said of itself, which the recorder hears anyway."""
        if len(self._statuses) < WAIT_MOST:
            self._statuses.append(status)
            self._status_ns.append(self._clock.wall_ns())

    def take(self) -> Heard:
        """Return what was said since the last call."""
        found: dict[str, Rows] = {}
        referee: tuple[RefereeState, ...] = ()
        for ear in self._ears:
            if not ear.messages:
                continue
            times = [self._time_of(m, ns) for m, ns in zip(ear.messages, ear.heard_ns, strict=True)]
            found[ear.stream.name] = rows_of(ear.stream, ear.messages, times, ear.bases)
            if ear.stream is streams.REFEREE:
                referee = tuple(cast(RefereeState, message) for message in ear.messages)
            ear.messages, ear.heard_ns, ear.bases = [], [], []
        if self._statuses:
            name = streams.SERVICES.name
            found[name] = rows_of(streams.SERVICES, self._statuses, self._status_ns)
            self._statuses, self._status_ns = [], []
        return Heard(found, referee, self.dropped, self._boot, self._referee_at)

    def close(self) -> None:
        """Stop listening."""
        for ear in self._ears:
            ear.subscription.close()

    def _keep(self, ear: _Ear, message: Message, wall_ns: int) -> None:
        if ear.stream is streams.REFEREE:
            self._referee_at = self._clock.now()
        mark = _MARKS.get(ear.stream.name, _itself)(message)
        if mark is not message and mark == ear.last:
            return  # a value that is sent again every second
        ear.last = mark
        if isinstance(message, BatStates):
            self._note_tick(message)
        if len(ear.messages) >= WAIT_MOST:
            ear.discarded += 1
            return
        ear.messages.append(message)
        ear.heard_ns.append(wall_ns)
        ear.bases.append(self._base)

    def _note_tick(self, states: BatStates) -> None:
        self.heard_at = self._clock.now()
        if states.boot != self._boot:
            self._base += self._last_tick + 1 if self._boot else 0
            self._boot = states.boot
            self._times.clear()
        self._last_tick = states.tick
        self._times[states.tick] = states.at_ns
        if len(self._times) > TICKS_KNOWN:
            self._times.popitem(last=False)

    def _time_of(self, message: Any, heard_ns: int) -> int:
        """Return the wall clock at which a message held."""
        own = getattr(message, "at_ns", None)
        if own is not None:
            return own
        tick: int | None = getattr(message, "tick", None)
        if tick is None or not self._times:
            return heard_ns
        known = self._times.get(tick)
        if known is not None:
            return known
        newest, at_ns = next(reversed(self._times.items()))
        guess = at_ns + (tick - newest) * self._period_ns
        return guess if abs(guess - heard_ns) < TICKS_KNOWN * self._period_ns else heard_ns


def _every(bus: Bus, topic: Topic[Any], **fields: str) -> Subscription[Any]:
    """Listen to every value of a topic, not only to the newest."""
    return bus.subscribe(dataclasses.replace(topic, qos=Qos.STREAM), **fields)


def _itself(message: Message) -> object:
    return message


def _mark_of(*names: str) -> Callable[[Any], tuple[object, ...]]:
    return lambda message: tuple(getattr(message, name) for name in names)


_MARKS: dict[str, Callable[[Any], object]] = {
    streams.GATE.name: _mark_of("tick", "mode", "reason"),
    streams.REFEREE.name: _mark_of("bout", "phase", "reason", "tick", "step"),
}
"""What two values of a LATEST topic share when one is the other, sent again."""
