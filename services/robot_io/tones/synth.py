"""Samples of a tone that starts, changes and stops without a click; knows no sound card."""

import math

import numpy as np
from numpy.typing import NDArray

RAMP_SECONDS = 0.005
"""From silence to full loudness and back, along half a period of a cosine."""

Samples = NDArray[np.float32]


class ToneSynth:
    """A sine whose phase never jumps, and whose loudness only ever moves along its ramp.

    With a ramp of 5 ms no two samples in a row differ by more than those of the pure tone do: the
    slope of the envelope (314/s) stays far below that of the carrier (2 pi 300/s).
    """

    def __init__(self, rate: float, amplitude: float) -> None:
        """Begin silent.

        Args:
            rate: samples a second.
            amplitude: of the tone at full loudness, 0 to 1.
        """
        self._rate = rate
        self._amplitude = amplitude
        self._risen = 0.0
        """How far up its ramp the loudness is, 0 to 1."""
        self._phase = 0.0
        self._hz = 0.0

    def render(self, count: int, hz: float) -> Samples:
        """Return the next samples.

        Args:
            count: how many.
            hz: the tone to sound, 0 for silence; taken up at the first of them.

        Returns:
            float32[count], within plus and minus ``amplitude``.
        """
        if hz > 0.0:
            self._hz = hz
        elif self._risen <= 0.0:
            self._phase = 0.0
            return np.zeros(count, np.float32)
        steps = np.arange(1, count + 1)
        slope = (1.0 if hz > 0.0 else -1.0) / (RAMP_SECONDS * self._rate)
        risen = np.clip(self._risen + slope * steps, 0.0, 1.0)
        turn = math.tau * self._hz / self._rate
        loudness = 0.5 * (1.0 - np.cos(math.pi * risen))
        samples = self._amplitude * loudness * np.sin(self._phase + turn * steps)
        self._risen = float(risen[-1])
        self._phase = math.fmod(self._phase + turn * count, math.tau)
        return samples.astype(np.float32)
