"""The controller looks at its command only every so often."""

import numpy as np

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.identification.effect import Quantity, Side
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from shared.sim.plant.structure import Structure


class SampleAndHold:
    """A loop of its own period that takes the newest command at each turn.

    Turns are counted from the first command of a recording. When the first one is matters as long
    as the interval is not much longer than that of the commands: it decides how old what is taken
    is. Recordings are taken to begin alike.
    """

    name = "sample_and_hold"
    title = "the controller takes a new command only at intervals"
    signature = "Every channel lags by half a period on average, as a sawtooth of that period."
    side: Side = "command"

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return the whole arm: one controller."""
        return ("",)

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return the interval, and how much of one the first turn is late.

        Which commands are taken jumps with both.
        """
        return (
            Quantity("period", "s", 0.0, 0.2, probe=0.02, is_smooth=False, phase="phase"),
            Quantity("phase", "1", 0.0, 1.0, probe=0.25, grid=(0.0, 0.25, 0.5, 0.75)),
        )

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return nothing: only the command changes."""
        return ()

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Let only the commands in force at each turn through."""
        period, phase = float(values[0]), float(values[1])
        if period < row.plant.timestep:
            return
        first, last = float(row.command.at[0]), float(row.command.at[-1])
        turns = int(np.ceil((last - first) / period)) + 1
        at: Float64 = first + period * (phase + np.arange(turns, dtype=np.float64))
        if phase > 0.0:
            at = np.r_[first, at]
        row.command = Signal(at, row.command.held(at))


EFFECT = SampleAndHold()
