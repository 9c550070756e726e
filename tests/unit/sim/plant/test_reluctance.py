"""How hard a joint is to move: by what it has to turn, and by its damper."""

from pathlib import Path

import numpy as np
import pytest

from shared.sim.plant.inverse import reluctance
from shared.sim.plant.plant import mjcf
from shared.sim.plant.rollouts import Rollouts

_ARM = """<mujoco>
  <worldbody>
    <body name="bar">
      <joint name="turn" axis="0 0 1" armature="0.2" damping="3"/>
      <inertial pos="0.5 0 0" mass="2" diaginertia="0.01 0.01 0.01"/>
      <geom size="0.1" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator><motor name="turn" joint="turn"/></actuator>
</mujoco>"""


def test_it_is_inertia_and_damping_over_the_time_that_a_torque_has(tmp_path: Path):
    path = tmp_path / "bar.xml"
    path.write_text(_ARM)
    plant = mjcf(path, "torque", ("turn",), ("turn",), "bar")
    model = Rollouts(plant, (), 1).model
    found = reluctance(plant, model, np.array([[0.0], [1.0]]), 0.1)
    inertia = 2.0 * 0.5**2 + 0.01 + 0.2
    assert found == pytest.approx(np.full((2, 1), inertia / 0.01 + 3.0 / 0.1))
