"""The torque that a motion takes beyond what the model's drives give there."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue import effects
from shared.sim.plant.missing import missing_beside_laws, missing_torque
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from tests.arms import make_plant, recorded


def nothing(row: Row) -> None:
    """Change nothing."""


def test_a_servo_that_is_let_down_lacks_what_holds_the_arm(tmp_path: Path) -> None:
    # Straight out at rest: gravity asks 4.66 N m of the lift and 0.736 N m of the elbow (see
    # tests.arms); servos of 200 N m/rad told to stand 0.01 rad further give 2 N m each.
    arms = Rollouts(make_plant(tmp_path), (), 1)
    row = arms.entered(nothing, recorded([0.01, 0.01, 0.01]))
    still = np.zeros((1, 3))
    found = missing_torque(row, np.array([0.5]), still, still, still)[0]
    assert abs(found[0] + 2.0) <= 0.1  # the pan's friction holds up to 0.1 N m of its 2
    assert found[1] == pytest.approx(-4.66 - 2.0, abs=0.12)
    assert found[2] == pytest.approx(-0.736 - 2.0, abs=0.06)


def test_friction_and_gains_are_those_of_the_row(tmp_path: Path) -> None:
    arms = Rollouts(make_plant(tmp_path, has_gravity=False), (), 1)

    def enter(row: Row) -> None:
        row.field("dof_damping")[row.dof("pan")] = 3.0

    speed = np.array([[0.2, 0.0, 0.0]])
    still, at = np.zeros((1, 3)), np.array([0.0])
    idle = recorded([0.0, 0.0, 0.0])
    lacks = [
        missing_torque(arms.entered(each, idle), at, still, speed, still)[0, 0]
        for each in (nothing, enter)
    ]
    assert lacks[1] - lacks[0] == pytest.approx(2.5 * 0.2)  # 3 N m s/rad in place of 0.5


@pytest.mark.parametrize(
    ("name", "values", "wanted"),
    [
        ("asymmetric_friction", [0.4], 0.4 * 0.3),  # of a speed of 0.3 rad/s, the same either way
        ("load_friction", [0.1, 0.0], 0.1 * 5.0),  # of the 5 N m that the drive gives; it moves on
        ("torque_gain", [-0.2], 0.2 * 5.0),
    ],
)
def test_what_laws_do_is_not_missing(
    tmp_path: Path, name: str, values: list[float], wanted: float
) -> None:
    arms = Rollouts(make_plant(tmp_path, "torque", has_gravity=False), (), 1)
    effect = next(each for each in effects() if each.name == name)
    row = arms.entered(
        lambda row: effect.enter(row, "lift", np.array(values)), recorded([0.0, 0.0, 0.0])
    )
    at, still = np.array([0.0, 0.01]), np.zeros((2, 3))
    speed, command = still.copy(), still.copy()
    speed[:, 1], command[:, 1] = 0.3, 5.0
    q = np.tile([0.0, 0.3, 0.0], (2, 1))
    plain = missing_beside_laws(
        arms.entered(nothing, recorded([0.0] * 3)), at, q, speed, still, command
    )
    found = missing_beside_laws(row, at, q, speed, still, command)
    assert found - plain == pytest.approx(np.tile([0.0, wanted, 0.0], (2, 1)), abs=1e-9)
