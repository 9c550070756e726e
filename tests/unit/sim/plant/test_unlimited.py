"""Drives that give far more than the model file says, and the file that is written of them."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.sim.plant.export import patched_xml
from shared.sim.plant.plant import mjcf, stepped, unlimited
from tests.arms import JOINTS, make_plant, write_arm


def limits(model: mujoco.MjModel) -> list[float]:
    return [float(model.jnt_actfrcrange[model.joint(name).id, 1]) for name in JOINTS]


def test_only_limits_of_the_joints_that_are_asked_for_are_lifted(tmp_path: Path):
    plant = unlimited(make_plant(tmp_path), ("lift",))
    assert limits(plant.make().compile()) == [20.0, 200.0, 10.0]
    assert plant.unlimited == ("lift",)
    assert stepped(plant, 1e-3).unlimited == ("lift",)


@pytest.mark.parametrize(("joint", "times"), [("elbow", 10.0), ("pan", 1.0)])
def test_so_are_those_of_their_actuators(tmp_path: Path, joint: str, times: float):
    path, own = write_arm(tmp_path), 'joint="elbow" kp="200"'
    path.write_text(path.read_text().replace(own, f'{own} forcerange="-3 4"'))
    weak = unlimited(mjcf(path, "position", JOINTS, JOINTS, "tool"), (joint,))
    model = weak.make().compile()
    np.testing.assert_allclose(model.actuator("elbow").forcerange, [-3.0 * times, 4.0 * times])


def test_the_file_that_is_written_has_them(tmp_path: Path):
    plant = unlimited(make_plant(tmp_path), ("lift", "elbow"))
    text = patched_xml(plant, write_arm(tmp_path), (), {})
    assert limits(mujoco.MjModel.from_xml_string(text)) == [20.0, 200.0, 100.0]
