"""Laws at work in a batch, each with all the arms that it acts on."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.bristles import Bristles
from shared.sim.plant.row import FrictionLaw, Row, TorqueLaw
from shared.sim.plant.step import Rows, Step, rows_of

_Law = TypeVar("_Law", TorqueLaw, FrictionLaw)
_Kept = TypeVar("_Kept")


@dataclass
class Active:
    """A torque law, and the arms that it acts on."""

    law: TorqueLaw
    rows: Rows
    """K arms of the batch."""
    values: Float64
    """float64[K, P]."""
    memory: Float64
    """float64[K, M], which the law changes."""


@dataclass
class Rubbing:
    """A friction law, and the arms that it acts on."""

    law: FrictionLaw
    rows: Rows
    """K arms of the batch."""
    values: Float64
    """float64[K, P]."""
    bristles: Bristles | None
    """None where it turns round at once in all of them."""

    def rub(self, step: Step, at_once: Float64, damping: Float64, torque: Float64) -> None:
        """Add what it does in a step to that of all N arms.

        Args:
            step: the state of its own arms.
            at_once: float64[N, J], friction that the simulator lets stick (N m, N).
            damping: float64[N, J], that it takes implicitly (N m s/rad, N s/m).
            torque: float64[N, J] (N m, N).
        """
        level = self.law(step, self.values)
        if self.bristles is None:
            at_once[self.rows] += level
            return
        bent, stiff = self.bristles.act(level, step.qd, step.timestep)
        torque[self.rows] += bent
        damping[self.rows] += stiff
        at_once[self.rows] += np.where(self.bristles.are_there, 0.0, level)


def torques_of(rows: Sequence[Row]) -> list[Active]:
    """Return the torques at work, each with the arms that it acts on."""
    return [
        Active(law, _indices(members), np.stack(values), np.zeros((len(members), law.memory)))
        for law, members, values in _by_law([(row, row.laws) for row in rows])
    ]


def frictions_of(rows: Sequence[Row]) -> list[Rubbing]:
    """Return the frictions at work, each with the arms that it acts on."""
    found: list[Rubbing] = []
    for law, members, each in _by_law(
        [(row, [(one.law, one) for one in row.frictions]) for row in rows]
    ):
        ways = np.stack([one.ways for one in each])
        speed = np.stack([row.initial_qd for row in members])
        bristles = Bristles(ways, speed) if ways.any() else None
        values = np.stack([one.values for one in each])
        found.append(Rubbing(law, _indices(members), values, bristles))
    return found


def _indices(rows: Sequence[Row]) -> Rows:
    return rows_of([row.index for row in rows])


def _by_law(
    rows: Sequence[tuple[Row, list[tuple[_Law, _Kept]]]],
) -> list[tuple[_Law, list[Row], list[_Kept]]]:
    """Return each law with its arms and what they gave it; several times if an arm did so."""
    groups: dict[tuple[_Law, int], list[tuple[Row, _Kept]]] = defaultdict(list)
    for row, laws in rows:
        seen: dict[_Law, int] = defaultdict(int)
        for law, kept in laws:
            groups[law, seen[law]].append((row, kept))
            seen[law] += 1
    return [
        (law, [row for row, _ in group], [kept for _, kept in group])
        for (law, _), group in groups.items()
    ]
