"""What a cause is: where it may sit, how big it is, and how it enters a simulation."""

from dataclasses import dataclass
from typing import Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Float64
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Structure

Side = Literal["command", "plant", "joints", "tracker"]
"""Whether a cause changes what reaches the controller, how the arm moves, or what is logged."""
ONCE = "external_contact"
"""The effect that is in one recording, for a while."""
IN_RECORDING = " in "
"""Between the joint and the recording in the name of its place."""


@dataclass(frozen=True)
class Quantity:
    """A number of an effect; 0 is always "not there"."""

    name: str
    unit: str
    low: float
    high: float
    probe: float
    """A size that a good recording shows and that is not extreme: where the search starts."""
    is_smooth: bool = True
    """Whether small changes of it change the motion a little; else it is searched on a grid."""
    scales: tuple[float, ...] = (1.0,)
    """Of a smooth one: sizes, in probes, to look at, if what is larger is not more of the same."""
    phase: str = ""
    """Of an interval that comes again and again: the number that says, in intervals, how late its
    first turn is. Such an interval is searched by turns, see ``turns.py``."""
    grid: tuple[float, ...] = ()
    """Where to look first. Of a number that says how, not how much, and means nothing while the
    others are 0: its probe is only what it is counted in. Or of an only number, not smooth, that
    acts from some size on."""
    ends: tuple[bool, bool] = (False, False)
    """Of such a number: whether the law is no longer this one at its lowest and at its highest."""
    least: float = 0.0
    """Below this size, either way, it is no more than what the simulation is off by itself."""
    is_detail: bool = False
    """Whether an effect is still what it is without it, at 0, though not quite the arm's: one that
    says how, with one place to look."""


class Effect(Protocol):
    """One entry of the catalogue; a module of ``catalogue/`` has one, called ``EFFECT``."""

    name: str
    """``command_latency``: fixed, for programs."""
    title: str
    """For people, as a sentence without a full stop: ``commands reach the controller late``."""
    signature: str
    """How it shows in the residual, in one sentence."""
    side: Side

    def places(self, subject: Subject) -> tuple[str, ...]:
        """Return where it may sit: names of joints, or ``""`` for the whole arm; none if nowhere.

        Effects that the data or the arm rule out (no tracker, no gravity, no motion there) return
        none.
        """
        ...

    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        """Return its numbers at a place."""
        ...

    def structure(self, subject: Subject, place: str) -> Structure:
        """Return what must be compiled into the arm for it; mostly nothing."""
        ...

    def enter(self, row: Row, place: str, values: Float64) -> None:
        """Change one arm: float64[Q], in the order of :meth:`quantities`."""
        ...


@dataclass(frozen=True)
class Candidate:
    """An effect at a place."""

    effect: Effect
    place: str

    @property
    def label(self) -> str:
        """Return its name for people and for programs: ``coulomb_friction elbow_flex``."""
        return f"{self.effect.name} {self.place}".strip()

    @property
    def recording(self) -> str | None:
        """Return the name of the one recording that it is in, None if it may be in any."""
        return self.place.split(IN_RECORDING, 1)[1] if self.effect.name == ONCE else None

    @property
    def where(self) -> str:
        """Return its place, without the recording that it is in if it is in one."""
        return self.place if self.recording is None else self.place.split(IN_RECORDING, 1)[0]

    def forms(self, subject: Subject) -> NDArray[np.bool_]:
        """Return bool[Q], which of its numbers say how, not how much."""
        quantities = self.effect.quantities(subject, self.place)
        return np.array([bool(each.grid) for each in quantities], np.bool_)
