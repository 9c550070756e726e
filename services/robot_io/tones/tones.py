"""What the players hear: section ``[tones]``, and the referee's tone on its way to a sink."""

import math
from typing import Literal, Protocol

import msgspec

from shared.bus.base import Bus
from shared.config.ranges import check_ranges
from shared.messages.topics import REFEREE

LEAST_HZ, MOST_HZ = 20.0, 8000.0
CONFIRM_SECONDS = 0.1
"""A tone that goes on is said again so often, for a sink forgets what is not kept up."""
TAKE_MOST = 4
"""States of the referee taken in one tick."""


class TonesConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The tones of the score: 440 Hz for a point, 300 Hz for a penalty."""

    sink: Literal["null", "sounddevice"] = "null"
    """A sound card of this machine, or none; a page makes its own sound."""
    device: str = ""
    """Part of the sound device's name; empty for the system's default."""
    volume: float = 0.3
    """Of the tone at full loudness, 0 to 1."""
    latency: float = 0.02
    """Sound made ahead; doubled, up to 0.16, while the machine is too busy to keep up (s)."""
    silence_after: float = 0.25
    """Without the referee for so long a tone ends (s)."""
    retry: float = 5.0
    """Wait before a sound card that is missing is looked for again (s)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_ranges(
            self,
            ("volume", 0.0, 1.0), ("latency", 0.005, 0.16), ("silence_after", 0.05, 5.0),
            ("retry", 0.1, 600.0),
        )  # fmt: skip
        if self.device and self.sink != "sounddevice":
            raise ValueError(
                f"device is {self.device!r} and sink is {self.sink!r}: "
                "a device is for sink = 'sounddevice'"
            )


class ToneSink(Protocol):
    """Something that sounds; nothing here may block."""

    def play(self, hz: float) -> None:
        """Sound a tone, 0 for silence; said again while it shall go on."""
        ...

    def rates(self) -> dict[str, float]:
        """Return what it measures, by name with unit."""
        ...

    def counters(self) -> dict[str, int]:
        """Return what it has counted since the start."""
        ...

    @property
    def problem(self) -> str:
        """Return why nothing sounds; empty when it would."""
        ...

    def close(self) -> None:
        """Let go of the device."""
        ...


class Tones:
    """Sounds what the referee says, while it says it; the loop ticks this."""

    def __init__(self, sink: ToneSink, silence_after: float, bus: Bus) -> None:
        """Listen to the referee.

        Args:
            sink: it is closed with this.
            silence_after: without the referee for so long a tone ends (s).
            bus: this process's end of the bus.
        """
        self._sink = sink
        self._silence_after = silence_after
        self._said = bus.subscribe(REFEREE)
        self._hz = 0.0
        self._heard_at = -math.inf
        self._told_at = -math.inf
        self._counters = {"tone_switches": 0, "tones_cut": 0, "tones_refused": 0}

    def tick(self, now: float) -> None:
        """Sound the newest tone; end one that nobody keeps up."""
        for _ in range(TAKE_MOST):
            if (state := self._said.take()) is None:
                break
            self._heard_at = now
            self._turn_to(self._usable(state.tone_hz), now)
        if self._hz and now - self._heard_at > self._silence_after:
            self._counters["tones_cut"] += 1
            self._turn_to(0.0, now)
        elif self._hz and now - self._told_at > CONFIRM_SECONDS:
            self._tell(now)

    def _usable(self, hz: float) -> float:
        if hz == 0.0 or LEAST_HZ <= hz <= MOST_HZ:
            return hz
        self._counters["tones_refused"] += 1  # NaN too
        return 0.0

    def _turn_to(self, hz: float, now: float) -> None:
        if hz == self._hz:
            return
        self._hz = hz
        self._counters["tone_switches"] += 1
        self._tell(now)

    def _tell(self, now: float) -> None:
        self._told_at = now
        self._sink.play(self._hz)

    def rates(self) -> dict[str, float]:
        """Return the tone that sounds (Hz), and what the sink measures."""
        return {"tone_hz": self._hz, **self._sink.rates()}

    def counters(self) -> dict[str, int]:
        """Return how often the tone changed, and what the sink counted."""
        return {**self._counters, **self._sink.counters()}

    @property
    def problem(self) -> str:
        """Return why nothing sounds; empty when it would."""
        return f"tones: {self._sink.problem}" if self._sink.problem else ""

    def close(self) -> None:
        """Fall silent and let go of the device."""
        self._sink.play(0.0)
        self._sink.close()
        self._said.close()


def open_tones(cfg: TonesConfig, bus: Bus) -> Tones | None:
    """Return what the settings ask for; None for no sound."""
    if cfg.sink == "null":
        return None
    from services.robot_io.tones.sounddevice_sink import SoundCard  # a process more

    return Tones(SoundCard(cfg), cfg.silence_after, bus)
