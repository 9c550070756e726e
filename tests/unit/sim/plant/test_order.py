"""What a run comes to does not go by what ran before it."""

from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.plant.rollouts import Entry, Rollouts
from shared.sim.plant.row import Row
from tests.arms import make_plant, recorded


def swing(at: Float64) -> Float64:
    return np.stack([0.3 * np.sin(4 * at), 0.4 * np.sin(5 * at), 0.3 * np.sin(7 * at)], axis=1)


def heavy(row: Row) -> None:
    for name in ("body_mass", "body_inertia"):
        row.field(name)[:] *= 5.0


def rubs(friction: float) -> Entry:
    def enter(row: Row) -> None:
        row.field("dof_frictionloss")[:] = friction

    return enter


def test_arms_are_nominal_again_after_fewer_ran_in_between(tmp_path: Path):
    """What follows from masses is worked out again for all, not just for the next few."""
    plant = make_plant(tmp_path)
    recordings = [recorded(swing, seconds=1.0 + 0.1 * index) for index in range(3)]
    work = [(rubs(0.3), each) for each in recordings]
    fresh = Rollouts(plant, (), 3).run(work)
    rollouts = Rollouts(plant, (), 3)
    rollouts.run([(heavy, each) for each in recordings])
    rollouts.run(work[:1])
    for again, before in zip(rollouts.run(work), fresh, strict=True):
        np.testing.assert_array_equal(again.q, before.q)
