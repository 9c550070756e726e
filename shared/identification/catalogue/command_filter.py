"""The controller smooths its commands: a filter of first order between them and its set points."""

import numpy as np
from scipy.signal import lfilter  # pyright: ignore[reportUnknownVariableType]

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.identification.laws.servo import EARLIER, servo_joints
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, instants
from shared.sim.plant.structure import Structure

_LEAST = 1e-6
"""A time that smooths nothing (s)."""
_SHORTEST = 5e-3
"""A filter that is no more than a delay to what arms can follow (s)."""


class CommandFilter:
    """A low-pass filter of first order, alike for all joints."""

    name = "command_filter"
    title = "the controller smooths its commands"
    signature = "Joints lag as if commands were late, and round off what is quick."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm, if positions are told; a PR2's filter is in its model file."""
        return ("",) if servo_joints(subject) else ()

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the filter's time constant."""
        return (Quantity("time", "s", 0.0, 0.5, probe=0.01, scales=(1.0, 5.0), least=_SHORTEST),)

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Smooth the commands."""
        time = float(values[0])
        if time > _LEAST:
            row.command = smoothed(row.command, time, row.plant.timestep, row.duration)


def smoothed(signal: Signal, time: float, period: float, until: float) -> Signal:
    """Return a signal behind a low-pass filter that begins settled.

    Args:
        signal: float64[C, U].
        time: constant of the filter (s).
        period: of the result, each value of which is the mean over one (s).
        until: when it may end (s).
    """
    at = instants(signal, period, -EARLIER, until)
    told = signal.mean(at, period)
    kept = np.exp(-period / time)
    ends: Float64 = lfilter([1.0 - kept], [1.0, -kept], told, axis=0, zi=kept * told[:1])[0]
    begins = np.concatenate([told[:1], ends[:-1]])
    means = told + (begins - told) * (1.0 - kept) * time / period
    return Signal(at, means)


EFFECT = CommandFilter()
