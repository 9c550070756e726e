"""Laws at work in a batch, each with all the arms that it acts on."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.row import FrictionLaw, Row, TorqueLaw
from shared.sim.plant.step import Rows, rows_of

_Law = TypeVar("_Law", TorqueLaw, FrictionLaw)


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


def torques_of(rows: Sequence[Row]) -> list[Active]:
    """Return the torques at work, each with the arms that it acts on."""
    return [
        Active(law, rows_of(members), values, np.zeros((len(members), law.memory)))
        for law, members, values in _by_law([(row.index, row.laws) for row in rows])
    ]


def frictions_of(rows: Sequence[Row]) -> list[Rubbing]:
    """Return the frictions at work, each with the arms that it acts on."""
    return [
        Rubbing(law, rows_of(members), values)
        for law, members, values in _by_law([(row.index, row.frictions) for row in rows])
    ]


def _by_law(
    rows: Sequence[tuple[int, list[tuple[_Law, Float64]]]],
) -> list[tuple[_Law, list[int], Float64]]:
    """Return each law with arms and values; several times if an arm has it several times."""
    groups: dict[tuple[_Law, int], list[tuple[int, Float64]]] = defaultdict(list)
    for index, laws in rows:
        seen: dict[_Law, int] = defaultdict(int)
        for law, values in laws:
            groups[law, seen[law]].append((index, values))
            seen[law] += 1
    return [
        (law, [index for index, _ in group], np.stack([values for _, values in group]))
        for (law, _), group in groups.items()
    ]
