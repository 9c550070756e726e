"""What runs beside the 100 Hz loop and never holds it up: heart rate and tones.

Nothing here gates safety. Where a device is missing it says so once and the rest goes on; what
must wait for a device waits on a thread of its own and hands over through a bounded queue.
"""

from typing import Protocol

from services.robot_io.heart_rate.source import HeartRateConfig, open_heart_rate
from services.robot_io.tones.tones import TonesConfig, open_tones
from shared.bus.base import Bus
from shared.clock import Clock
from shared.runtime.serve import ServeArgs


class Extra(Protocol):
    """Something that the loop ticks after its own work."""

    def tick(self, now: float) -> None:
        """Take and publish what has come; never waits."""
        ...

    def rates(self) -> dict[str, float]:
        """Return what it measures, by name with unit."""
        ...

    def counters(self) -> dict[str, int]:
        """Return what it has counted since the start."""
        ...

    @property
    def problem(self) -> str:
        """Return why it does not work now; empty when it does."""
        ...

    def close(self) -> None:
        """Let go of the device, within a few seconds."""
        ...


class Extras:
    """All of them as one."""

    def __init__(self, extras: tuple[Extra, ...] = ()) -> None:
        self._extras = extras

    def tick(self, now: float) -> None:
        """Take and publish what has come; never waits."""
        for extra in self._extras:
            extra.tick(now)

    def rates(self) -> dict[str, float]:
        """Return what they measure, by name with unit."""
        return {name: rate for extra in self._extras for name, rate in extra.rates().items()}

    def counters(self) -> dict[str, int]:
        """Return what they have counted since the start."""
        return {name: count for extra in self._extras for name, count in extra.counters().items()}

    @property
    def problem(self) -> str:
        """Return what does not work now, in one line; empty when all does."""
        return "; ".join(extra.problem for extra in self._extras if extra.problem)

    def close(self) -> None:
        """Let go of every device."""
        for extra in self._extras:
            extra.close()


def open_extras(args: ServeArgs, bus: Bus, clock: Clock) -> Extras:
    """Return what the site file asks for in ``[heart_rate]`` and ``[tones]``.

    Raises:
        ConfigError: a value is out of its range, or a recording cannot be read.
    """
    heart_rate = open_heart_rate(args.section("heart_rate", HeartRateConfig), bus, clock)
    tones = open_tones(args.section("tones", TonesConfig), bus)
    return Extras(tuple(extra for extra in (heart_rate, tones) if extra is not None))
