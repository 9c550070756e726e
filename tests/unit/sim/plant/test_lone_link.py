"""Arms of one link that turns about its centre of mass."""

from pathlib import Path

import pytest

from shared.sim.plant.plant import mjcf
from shared.sim.plant.row import Row
from tests.arms import make_subject, recorded

WHEEL = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="wheel">
      <joint name="turn" axis="0 1 0" damping="0.05"/>
      <inertial mass="1" pos="0 0 0" diaginertia="0.01 0.02 0.025"/>
      <site name="tool" pos="0.1 0 0"/>
    </body>
  </worldbody>
  <actuator><position name="turn" joint="turn" kp="20" kv="1"/></actuator>
</mujoco>
"""


def test_the_centre_of_a_lone_wheel_may_move(tmp_path: Path):
    path = tmp_path / "wheel.xml"
    path.write_text(WHEEL)
    subject = make_subject(mjcf(path, "position", ("turn",), ("turn",), "tool"))

    def enter(row: Row) -> None:
        row.field("body_ipos")[row.tool_body(), 0] += 0.05

    still = recorded([0.0], seconds=2.0, initial_q=[0.0])
    (sags,) = subject.nominal.run([(enter, still)])
    # 1 kg at 0.05 m, held by 20 N m/rad
    assert sags.q[-1, 0] * 20.0 == pytest.approx(9.81 * 0.05, rel=0.01)
