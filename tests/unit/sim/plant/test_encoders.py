"""A controller of poses with a wrong encoder, against one that is simulated step by step."""

import mujoco
import numpy as np
import pytest

from shared.sim.arm import Float64
from shared.sim.plant.encoders import misread
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from shared.sim.plant.structure import compiled

PLANT = pr2("right", None, timestep=0.0005)
"""Fine, so that how each of the two steps makes little difference."""
REST = np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46])
STEPS = 2000


def _command(model: mujoco.MjModel) -> Signal:
    at: Float64 = np.arange(0.0, STEPS * PLANT.timestep, 0.01)
    phase = 2.0 * np.pi * at[:, None] * np.linspace(0.4, 1.0, 7)
    return Signal(at, tool_poses(PLANT, model, REST + 0.2 * np.sin(phase)))


def _step_by_step(command: Signal, joint: int, scale: float, offset: float) -> Float64:
    """Return what the encoders say: torques are taken of a servo at the believed posture."""
    servo, arm = compiled(PLANT, ()), compiled(PLANT, ())
    arm.actuator_gainprm[:] = 0.0
    arm.actuator_biasprm[:] = 0.0
    scales, offsets = np.ones(7), np.zeros(7)
    scales[joint], offsets[joint] = scale, offset
    believed, true = mujoco.MjData(servo), mujoco.MjData(arm)
    true.qpos[:] = (REST - offsets) / scales
    out = np.empty((STEPS, 7))
    for step in range(STEPS):
        out[step] = believed.qpos[:] = scales * true.qpos + offsets
        believed.qvel[:] = scales * true.qvel
        believed.ctrl[:] = command.held(np.array([step * PLANT.timestep]))[0]
        mujoco.mj_forward(servo, believed)
        true.qfrc_applied[:] = believed.qfrc_actuator
        mujoco.mj_step(arm, true)
    return out


@pytest.mark.parametrize(
    ("joint", "scale", "offset"),
    [("shoulder_pan", 1.0, 0.05), ("elbow_flex", 1.0, 0.05), ("forearm_roll", 1.1, 0.0)],
)
def test_a_wrong_encoder_changes_the_motion_as_the_controller_would(
    joint: str, scale: float, offset: float
) -> None:
    index = PLANT.labels.index(joint)
    rollouts = Rollouts(PLANT, (), 2)
    command = _command(rollouts.model)
    right = _step_by_step(command, index, 1.0, 0.0)
    wrong = _step_by_step(command, index, scale, offset)
    at: Float64 = PLANT.timestep * np.arange(STEPS - 1)
    recorded = Recorded(REST, np.zeros(7), command, Signal(at, wrong[:-1]), at, at)

    def enter(row: Row) -> None:
        misread(row, joint, scale, offset)

    found, plain = rollouts.run([(enter, recorded), (lambda row: None, recorded)])

    # The two ways of stepping differ by themselves, so changes are compared.
    moved, expected = found.q - plain.q, (wrong - right)[:-1]
    if joint == "shoulder_pan":  # the whole arm is turned, and nothing else
        np.testing.assert_allclose(expected, 0.0, atol=1e-9)
        np.testing.assert_allclose(moved, 0.0, atol=1e-6)
    else:
        assert np.abs(expected).max() > 1e-3
        # A sixth of an encoder's noise, 0.3 mrad; the controller's damping is explicit here.
        assert np.sqrt(np.mean((moved - expected) ** 2)) < 0.05e-3


def test_without_an_error_nothing_changes() -> None:
    rollouts = Rollouts(PLANT, (), 2)
    command = _command(rollouts.model)
    at: Float64 = 0.01 * np.arange(90)
    q = REST + 0.1 * np.sin(at)[:, None]
    recorded = Recorded(REST, np.zeros(7), command, Signal(at, q), at, at)
    found, plain = rollouts.run(
        [(lambda row: misread(row, "elbow_flex", 1.0, 0.0), recorded), (lambda row: None, recorded)]
    )
    np.testing.assert_allclose(found.q, plain.q, atol=1e-9)
