"""When which of the two tones sounds in a recording, and when the referee asked for it."""

import dataclasses

import numpy as np

from shared.telemetry.archive import ArchivedBout
from shared.testing.recorded_sound import RATE

TONES = (300.0, 440.0)
WINDOW = RATE // 20
"""50 ms, whole periods of both tones: one is not heard in the other."""
STEP = RATE // 100
SHORTEST = 0.06
"""A tone shorter than this need not fill a window (s)."""
LATE = 0.4
"""From the referee's word to the sound and back, at most: 20 to 160 ms are what the card has ahead,
the rest is what a busy machine takes (s)."""
SILENCE_AFTER = 0.25
"""Without a word of the referee for so long, robot_io ends the tone (s)."""


@dataclasses.dataclass(frozen=True)
class Tone:
    """A stretch of one tone, on the wall clock (s)."""

    hz: float
    begin: float
    end: float


def asked(bout: ArchivedBout) -> list[Tone]:
    """Return the tones that the referee asked for, in order."""
    rows = bout.streams["referee"]
    times, pitches = 1e-9 * rows["t_ns"], rows["tone_hz"]
    tones: list[Tone] = []
    for k, hz in enumerate(pitches.tolist()):
        after = times[k + 1] if k + 1 < len(times) else times[k] + SILENCE_AFTER
        end = min(after, times[k] + SILENCE_AFTER)
        if hz and tones and tones[-1].hz == hz and tones[-1].end >= times[k]:
            tones[-1] = dataclasses.replace(tones[-1], end=float(end))
        elif hz:
            tones.append(Tone(hz, float(times[k]), float(end)))
    return tones


class Hearing:
    """A recording, listened to for both tones."""

    def __init__(self, samples: np.ndarray, began_at: float, volume: float) -> None:
        """Listen.

        Args:
            samples: float32[n] at ``RATE``.
            began_at: wall clock of the first (s).
            volume: of the tones; half of it is heard.
        """
        starts = np.arange(0, len(samples) - WINDOW, STEP)
        self.times = began_at + (starts + WINDOW / 2) / RATE
        """float64[F], the middles of the windows (s)."""
        self.heard = {
            hz: _amplitudes(samples, hz, starts) > 0.5 * volume for hz in TONES
        }  # fmt: skip
        """bool[F] each."""

    def hears(self, tone: Tone) -> bool:
        """Return whether a tone that was asked for sounds."""
        first, last = np.searchsorted(self.times, (tone.begin, tone.end + LATE))
        return bool(self.heard[tone.hz][first:last].any())

    def unasked(self, tones: list[Tone]) -> float:
        """Return for how long a tone sounded that nobody had asked for (s)."""
        seconds = 0.0
        for hz, heard in self.heard.items():
            wanted = np.zeros(len(self.times), bool)
            for tone in tones:
                if tone.hz == hz:
                    first, last = np.searchsorted(self.times, (tone.begin, tone.end + LATE))
                    wanted[max(first - 3, 0) : last] = True
            seconds += float((heard & ~wanted).sum()) * STEP / RATE
        return seconds


def _amplitudes(samples: np.ndarray, hz: float, starts: np.ndarray) -> np.ndarray:
    """Return float64[F], how loud a pitch is in each window."""
    turns = np.exp(-2j * np.pi * hz / RATE * np.arange(RATE))  # whole turns in a second
    summed = np.concatenate(
        [[0.0], np.cumsum(samples * np.resize(turns, len(samples)).astype(np.complex64),
                          dtype=np.complex128)]
    )  # fmt: skip
    return 2.0 * np.abs(summed[starts + WINDOW] - summed[starts]) / WINDOW
