"""Forward kinematics of many postures, against MuJoCo's own."""

from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.sim.plant.kinematics import tool_motion, tool_poses
from shared.sim.plant.plant import TOOL, Plant, mjcf, pr2
from shared.sim.plant.signals import pose_error
from shared.sim.plant.structure import compiled

_ODD = """
<mujoco>
  <worldbody>
    <body name="rail" pos="0.1 0.2 0.3" euler="10 20 30">
      <joint name="slide" type="slide" axis="0.6 0 0.8"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
      <body name="link" pos="0.3 0 0.1" quat="0.8 0.6 0 0">
        <joint name="hinge" axis="0 0.6 0.8" pos="0.05 0.02 -0.1" ref="20"/>
        <inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
        <site name="tool" pos="0.1 0.2 0.3" euler="5 6 7"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""


def _odd(folder: Path) -> Plant:
    path = folder / "odd.xml"
    path.write_text(_ODD)
    return mjcf(path, "torque", ("hinge", "slide"), ("hinge", "slide"), "tool")


@pytest.mark.parametrize("make", [_odd, lambda folder: pr2("left", None)])
def test_the_tool_is_where_mujoco_has_it(make: Callable[[Path], Plant], tmp_path: Path) -> None:
    plant = make(tmp_path)
    model = compiled(plant, ())
    q = np.random.default_rng(3).uniform(-1.0, 1.0, (5, len(plant.joints)))

    poses = tool_poses(plant, model, q)

    data = mujoco.MjData(model)
    first = int(model.sensor(f"{TOOL}/position").adr[0])
    for posture, pose in zip(q, poses, strict=True):
        for name, value in zip(plant.joints, posture, strict=True):
            data.joint(name).qpos[0] = value
        mujoco.mj_forward(model, data)
        np.testing.assert_allclose(pose[:3], data.sensordata[first : first + 3], atol=1e-12)
        same = abs(pose[3:] @ data.sensordata[first + 3 : first + 7])
        assert same == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("make", [_odd, lambda folder: pr2("right", None)])
def test_the_jacobian_is_the_derivative_of_the_pose(
    make: Callable[[Path], Plant], tmp_path: Path
) -> None:
    plant = make(tmp_path)
    model = compiled(plant, ())
    q = np.random.default_rng(4).uniform(-1.0, 1.0, (3, len(plant.joints)))
    step = 1e-6

    poses, found = tool_motion(plant, model, q)

    np.testing.assert_array_equal(poses, tool_poses(plant, model, q))
    for column in range(len(plant.joints)):
        by = step * np.eye(len(plant.joints))[column]
        ahead, behind = tool_poses(plant, model, q + by), tool_poses(plant, model, q - by)
        np.testing.assert_allclose(
            found[:, :, column], pose_error(ahead, behind) / (2.0 * step), atol=1e-8
        )
