"""What stands-in for other arms have wrong with them is what it is called."""

import mujoco
import numpy as np
import pytest

from studies.other_arms.faults import hang

_LINK = """
<mujoco><worldbody><body name="a"><joint axis="0 1 0"/>
  <geom type="box" size="0.03 0.02 0.1" pos="0.01 0 -0.1" mass="0.7"/>
  <body name="b" pos="0 0 -0.2"><joint axis="1 0 0"/>
    <geom type="capsule" fromto="0 0.01 0 0.02 0 -0.2" size="0.02" mass="0.5"/>{more}
  </body></body></worldbody></mujoco>"""
_MORE = """<body pos="0.03 -0.02 -0.2"><inertial pos="0 0 0" mass="0.3"
  diaginertia="1e-9 1e-9 1e-9"/></body>"""


def _torques(model: mujoco.MjModel) -> np.ndarray:
    """Return float64[9, 2], what motions of all kinds take."""
    data, rng, out = mujoco.MjData(model), np.random.default_rng(3), []
    for _ in range(9):
        data.qpos[:], data.qvel[:], data.qacc[:] = rng.standard_normal((3, 2))
        mujoco.mj_inverse(model, data)
        out.append(data.qfrc_inverse.copy())
    return np.array(out)


def test_a_mass_on_a_link_moves_as_a_body_that_is_fixed_to_it():
    wanted = mujoco.MjModel.from_xml_string(_LINK.format(more=_MORE))
    model = mujoco.MjModel.from_xml_string(_LINK.format(more=""))
    without = _torques(model)
    hang(model, model.body("b").id, np.array([0.03, -0.02, -0.2]), 0.3)
    assert _torques(model) == pytest.approx(_torques(wanted), abs=1e-6)
    assert np.abs(_torques(wanted) - without).max() > 0.1
