"""Joints that are ahead of their commands."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.identification.fitting.lead import lead_of
from shared.identification.fitting.parameters import enter_base
from shared.sim.hidden.arms import ARMS
from shared.sim.plant.plant import Plant
from shared.sim.plant.row import Row
from tests.arms import make_plant, make_subject, recorded
from tests.measured import swings

_BETWEEN = 5
"""Steps from command to command: 10 ms."""


def _stepped(plant: Plant, commands: np.ndarray) -> np.ndarray:
    """Return the joints of an arm that gets its commands and is stepped, before each of them."""
    model = make_subject(plant).nominal.model
    data = mujoco.MjData(model)
    q = np.empty_like(commands)
    for row, command in enumerate(commands):
        q[row], data.ctrl[:] = data.qpos, command
        mujoco.mj_step(model, data, _BETWEEN)
    return q


def test_an_arm_that_is_stepped_with_its_command_is_half_a_step_ahead(tmp_path: Path):
    plant = make_plant(tmp_path)
    subject = make_subject(plant)
    (lead,) = lead_of(subject)
    replay = recorded(lambda at: swings(float(at[-1]) + 0.01, 0.0))
    wanted = _stepped(plant, replay.command.values)

    def off(x: float) -> float:
        def enter(row: Row) -> None:
            enter_base((lead,), np.array([x]), row)

        return float(np.abs(subject.nominal.run([(enter, replay)])[0].q - wanted).max())

    assert lead.value(1.0) == 0.5 * plant.timestep
    assert off(1.0) < 1e-9
    assert off(0.0) > 1e-4


def test_of_a_controller_of_poses_nothing_is_asked():
    assert lead_of(make_subject(ARMS["pr2"].make())) == ()


@pytest.mark.parametrize("arm", ["arm3", "torque2"])
def test_joints_are_never_behind_their_commands_by_it(arm: str):
    (lead,) = lead_of(make_subject(ARMS[arm].make()))
    assert (lead.low, lead.nominal) == (0.0, 0.0)
