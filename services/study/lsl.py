"""A session as Lab Streaming Layer streams, for who records other sensors beside it.

Two streams: ``riposte-events``, a JSON text for each event of the journal, and
``riposte-heart-rate`` (1/min). Nothing in them names a condition or a person; but whoever is on the
same network can read them, so they are off unless `study.lsl` says otherwise.
"""

import importlib
from collections.abc import Sequence
from typing import Any, Protocol

import msgspec

from shared.errors import ConfigError
from shared.messages.play import HeartRate
from shared.study.events import Event

EVENTS, HEART = "riposte-events", "riposte-heart-rate"


class Outlet(Protocol):
    """Whoever is told what a session does."""

    def event(self, event: Event) -> None:
        """Tell of an event that is in the journal."""
        ...

    def beats(self, beats: Sequence[HeartRate]) -> None:
        """Tell of measurements, none before the participant's consent."""
        ...


class LslOutlet:
    """Sends markers and heart rate, stamped with LSL's own clock when they are sent."""

    def __init__(self, participant: str, session: int) -> None:
        """Announce both streams.

        Args:
            participant: ``sub-01``; in the source ids.
            session: its number.

        Raises:
            ConfigError: pylsl is not installed, or has no library of its own here.
        """
        try:
            pylsl: Any = importlib.import_module("pylsl")
        except (ImportError, RuntimeError) as error:
            raise ConfigError(
                f"study.lsl is on and pylsl cannot be used ({error}): pip install 'riposte[lsl]', "
                "or set study.lsl = false"
            ) from error
        source = f"{participant}-ses-{session:02d}"
        irregular = pylsl.IRREGULAR_RATE
        self._events = pylsl.StreamOutlet(
            pylsl.StreamInfo(EVENTS, "Markers", 1, irregular, pylsl.cf_string, f"{EVENTS}-{source}")
        )
        info = pylsl.StreamInfo(HEART, "HR", 1, irregular, pylsl.cf_float32, f"{HEART}-{source}")
        info.desc().append_child("channels").append_child("channel").append_child_value(
            "unit", "1/min"
        )
        self._heart = pylsl.StreamOutlet(info)

    def event(self, event: Event) -> None:
        """Send number, kind, step and monotonic time (ns) of an event."""
        said = {"number": event.number, "kind": event.kind, "step": event.step, "t_ns": event.t_ns}
        self._events.push_sample([msgspec.json.encode(said).decode()])

    def beats(self, beats: Sequence[HeartRate]) -> None:
        """Send measurements with skin at the sensor."""
        for beat in beats:
            if beat.contact:
                self._heart.push_sample([beat.beats_per_minute])
