"""What the bus said last of the robot, the game and the person's heart."""

import math

import msgspec

from shared.bus.base import Bus
from shared.clock import Clock
from shared.messages.live import ServiceStatus
from shared.messages.play import BatStates, GateState, HeartRate, RefereeState
from shared.messages.topics import BATS, GATE, HEART_RATE, REFEREE, STATUS

TAKE_MOST = 64
"""Values of one topic taken at a time, so that a flood cannot hold up the rest."""
GATE_SILENCE = 1.0
"""A gate that was not heard for so long is gone (s)."""
REFEREE_SILENCE = 2.5
"""The same of the referee, which repeats itself every second (s)."""
BATS_SILENCE = 0.5
HEART_SILENCE = 5.0
"""A heart rate older than this says nothing of now (s)."""
STATUS_SILENCE = 3.5


class Heard(msgspec.Struct, frozen=True, kw_only=True):
    """What is known of the others now; what they have been silent about for long is left out."""

    gate: GateState | None = None
    """None while robot_io is silent."""
    referee: RefereeState | None = None
    """None while there is no referee."""
    is_tracked: bool = False
    """Whether the person's bat is."""
    lost_seconds: float = math.inf
    """Since when it is not (s)."""
    beats: tuple[HeartRate, ...] = ()
    """Measurements that came since the last look."""
    heart: HeartRate | None = None
    """The newest, while it is fresh."""
    has_policy: bool = False
    """Whether the robot's is there."""
    has_recorder: bool = False

    @property
    def mode(self) -> str:
        """Return the gate's mode; empty while robot_io is silent."""
        return self.gate.mode if self.gate is not None else ""

    @property
    def beats_per_minute(self) -> float | None:
        """Return the heart rate now; None where there is none, or no skin at the sensor."""
        return self.heart.beats_per_minute if self.heart and self.heart.contact else None


class Hearing:
    """Listens to robot_io, the referee and everybody's health."""

    def __init__(self, bus: Bus, clock: Clock) -> None:
        """Begin to listen.

        Args:
            bus: this process's end of the bus.
            clock: dates what is heard.
        """
        self._bus = bus
        self._clock = clock
        self._gates = bus.subscribe(GATE)
        self._said = bus.subscribe(REFEREE)
        self._bats = bus.subscribe(BATS)
        self._hearts = bus.subscribe(HEART_RATE)
        self._health = bus.subscribe(STATUS)
        self._gate: GateState | None = None
        self._referee: RefereeState | None = None
        self._heart: HeartRate | None = None
        self._gate_at = self._referee_at = self._bats_at = self._heart_at = -math.inf
        self._tracked_at = -math.inf
        self._is_tracked = False
        self._statuses: dict[str, tuple[float, ServiceStatus]] = {}
        for role in ("robot-io", "referee", "policy", "recorder"):
            bus.alive(role)  # begins to watch for them

    def listen(self) -> Heard:
        """Take what has arrived and return what is known."""
        now = self._clock.now()
        if (gate := self._gates.take()) is not None:
            self._gate, self._gate_at = gate, now
        if (said := self._said.take()) is not None:
            self._referee, self._referee_at = said, now
        for _ in range(TAKE_MOST):
            if (bats := self._bats.take()) is None:
                break
            self._note(bats, now)
        beats = self._take_beats(now)
        for _ in range(TAKE_MOST):
            if (status := self._health.take()) is None:
                break
            self._statuses[status.name] = (now, status)
        return self._known(beats, now)

    def services(self) -> tuple[tuple[str, bool, str], ...]:
        """Return name, whether it is well, and state of every process heard so far.

        The researcher's page shows them: what a policy says of itself names its player.
        """
        now = self._clock.now()
        return tuple(
            (name, now - at <= STATUS_SILENCE, _blinded(status))
            for name, (at, status) in sorted(self._statuses.items())
        )

    def close(self) -> None:
        """Stop listening."""
        for one in (self._gates, self._said, self._bats, self._hearts, self._health):
            one.close()

    def _note(self, bats: BatStates, now: float) -> None:
        self._bats_at = now
        self._is_tracked = bool(bats.is_valid[0])
        if self._is_tracked:
            self._tracked_at = now

    def _take_beats(self, now: float) -> tuple[HeartRate, ...]:
        beats: list[HeartRate] = []
        while len(beats) < TAKE_MOST and (beat := self._hearts.take()) is not None:
            self._heart, self._heart_at = beat, now
            beats.append(beat)
        return tuple(beats)

    def _known(self, beats: tuple[HeartRate, ...], now: float) -> Heard:
        is_here = bool(self._bus.alive("referee"))
        if is_here and self._referee is not None:
            self._referee_at = now
        return Heard(
            gate=self._gate if now - self._gate_at <= GATE_SILENCE else None,
            referee=self._referee if now - self._referee_at <= REFEREE_SILENCE else None,
            is_tracked=self._is_tracked and now - self._bats_at <= BATS_SILENCE,
            lost_seconds=now - self._tracked_at,
            beats=beats,
            heart=self._heart if now - self._heart_at <= HEART_SILENCE else None,
            has_policy=any("antagonist" not in name for name in self._bus.alive("policy")),
            has_recorder=bool(self._bus.alive("recorder")),
        )


def _blinded(status: ServiceStatus) -> str:
    """Return what a process does, without the words of a policy."""
    if status.role == "policy":
        return "waits" if status.waiting_for else "ready"
    return status.waiting_for or status.state
