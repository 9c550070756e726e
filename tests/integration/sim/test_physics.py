"""The compiled scene against independent arithmetic and the PR2's limits."""

import math

import msgspec
import mujoco
import numpy as np
import pytest
from numpy.typing import NDArray

from shared.game.rules import RuleBook
from shared.policy.action import ActionConfig
from shared.sim.arm import load_arm
from shared.sim.batch import FencingBatch
from shared.sim.config import SimConfig
from shared.sim.env import FencingEnv
from shared.sim.model import FencingModel
from shared.sim.parameters import (
    JOINT_NAMES,
    Gains,
    ResidualSpring,
    ServoParameters,
    load_parameters,
)

Float64 = NDArray[np.float64]
NOMINAL = load_parameters("nominal")
MODEL = FencingModel.build(SimConfig())
MIXED = FencingModel.build(SimConfig(arms=("left", "right")))


def turn(axis: Float64, angle: float) -> Float64:
    """Rotation matrix by Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * cross @ cross


def matrix(quaternion: Float64) -> Float64:
    w, *xyz = quaternion / np.linalg.norm(quaternion)
    angle = 2 * math.atan2(float(np.linalg.norm(xyz)), w)
    return turn(np.array(xyz) / max(float(np.linalg.norm(xyz)), 1e-300), angle)


def logarithm(rotation: Float64) -> Float64:
    skew = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    sine = float(np.linalg.norm(skew)) / 2
    angle = math.atan2(sine, (np.trace(rotation) - 1) / 2)
    return skew / (2 * sine) * angle if sine > 0 else np.zeros(3)


def chain(side: str, q: Float64) -> tuple[Float64, Float64, Float64]:
    """Product of the URDF chain's transforms, in the torso frame.

    Returns the tool's position [3], its rotation [3, 3] and its Jacobian [6, 7].
    """
    arm = load_arm("right" if side == "right" else "left")
    place, rotation = np.zeros(3), np.eye(3)
    origins, axes = [], []
    for joint, angle in zip(arm.joints, q, strict=True):
        place = place + rotation @ np.array(joint.origin)
        origins.append(place)
        axes.append(rotation @ np.array(joint.axis))
        rotation = rotation @ turn(np.array(joint.axis), angle)
    place = place + rotation @ np.array(arm.tool)
    columns = [
        np.concatenate([np.cross(axis, place - origin), axis])
        for axis, origin in zip(axes, origins, strict=True)
    ]
    return place, rotation, np.array(columns).T


def postures(count: int, seed: int, model: FencingModel = MODEL) -> Float64:
    rng = np.random.default_rng(seed)
    low, high = model.mj.jnt_range.T.copy()
    free = ~model.mj.jnt_limited.astype(bool)
    low[free], high[free] = -np.pi, np.pi
    return rng.uniform(low, high, (count, 14))


def test_tool_and_bat_are_where_the_urdf_chain_puts_them():
    qpos = postures(50, 0, MIXED)
    batch = FencingBatch(MIXED, len(qpos))
    batch.reset(np.arange(len(qpos)), qpos)
    mount = turn(np.array([0.0, 1.0, 0.0]), -NOMINAL.bat.mount_angle)
    for world, row in enumerate(qpos):
        for agent, side in enumerate(MIXED.cfg.arms):
            place, rotation, _ = chain(side, row[7 * agent : 7 * agent + 7])
            sensed = batch.sensors[world, 20 * agent : 20 * agent + 20]
            assert sensed[13:16] == pytest.approx(place, abs=1e-12)
            assert matrix(sensed[16:20]) == pytest.approx(rotation, abs=1e-12)
            yaw = turn(np.array([0.0, 0.0, 1.0]), MIXED.base_yaw[agent])
            in_world = MIXED.base_position[agent] + yaw @ place
            assert sensed[0:3] == pytest.approx(in_world, abs=1e-12)
            assert matrix(sensed[3:7]) == pytest.approx(yaw @ rotation @ mount, abs=1e-12)


def test_the_sensed_velocities_are_the_jacobians():
    qpos = postures(20, 1)
    batch = FencingBatch(MODEL, len(qpos))
    batch.reset(np.arange(len(qpos)), qpos)
    batch.qvel[:] = np.random.default_rng(2).normal(size=qpos.shape)
    batch.restore(batch.state())
    for world, row in enumerate(qpos):
        for agent in range(2):
            arm = slice(7 * agent, 7 * agent + 7)
            _, _, jacobian = chain("right", row[arm])
            yaw = turn(np.array([0.0, 0.0, 1.0]), MODEL.base_yaw[agent])
            twist = jacobian @ batch.qvel[world, arm]
            sensed = batch.sensors[world, 20 * agent + 7 : 20 * agent + 13]
            expected = np.concatenate([yaw @ twist[:3], yaw @ twist[3:]])
            assert sensed == pytest.approx(expected, abs=1e-12)


def test_the_servo_is_a_jacobian_transpose_controller():
    strong = {
        name: msgspec.structs.replace(NOMINAL.joints[name], torque_limit=1000.0)
        for name in JOINT_NAMES
    }
    gains = ServoParameters(translation=Gains(kp=800, kv=15), orientation=Gains(kp=80, kv=1.2))
    parameters = msgspec.structs.replace(
        NOMINAL, servo=gains, joints=msgspec.structs.replace(NOMINAL.joints, **strong)
    )
    model = FencingModel.of(MIXED.cfg, parameters)
    rng = np.random.default_rng(3)
    data = mujoco.MjData(model.mj)
    for row in postures(40, 4, MIXED):
        data.qpos[:], data.qvel[:] = row, rng.normal(size=14)
        expected = np.zeros(14)
        for agent, side in enumerate(MIXED.cfg.arms):
            arm, control = slice(7 * agent, 7 * agent + 7), slice(7 * agent, 7 * agent + 3)
            place, rotation, jacobian = chain(side, row[arm])
            data.ctrl[control] = place + rng.uniform(-0.2, 0.2, 3)
            wanted = rng.normal(size=4)  # any length, any orientation
            data.ctrl[7 * agent + 3 : 7 * agent + 7] = wanted
            twist = jacobian @ data.qvel[arm]
            force = 800 * (data.ctrl[control] - place) - 15 * twist[:3]
            torque = 80 * logarithm(matrix(wanted) @ rotation.T) - 1.2 * twist[3:]
            expected[arm] = jacobian.T @ np.concatenate([force, torque])
        mujoco.mj_forward(model.mj, data)
        assert data.qfrc_actuator == pytest.approx(expected, abs=1e-9)


def test_joint_speed_and_torque_stay_within_the_pr2s_under_any_bounded_command():
    # Far enough apart that blades never meet: a blow may push a joint faster than its motor.
    model = FencingModel.build(SimConfig(half_distance=2.0))
    arm = load_arm("right")
    speed = np.tile([joint.velocity_limit for joint in arm.joints], 2)
    torque = np.tile([NOMINAL.joints[name].torque_limit for name in JOINT_NAMES], 2)
    rng = np.random.default_rng(5)
    env = FencingEnv(model, RuleBook(), ActionConfig(), 64)
    batch = env.batch
    batch.reset(np.arange(64), postures(64, 6, model))
    data = mujoco.MjData(model.mj)
    fastest = np.zeros(14)
    actions = np.zeros((2, 64, 6), np.float32)
    for step in range(400):
        if step % 10 == 0:  # the longest offsets, long enough in one direction to gain speed
            actions = rng.normal(size=(2, 64, 6)).astype(np.float32) * 10
        env.step(actions[0], actions[1])
        if step % 40 == 0:
            data.qpos[:], data.qvel[:] = batch.qpos[step % 64], batch.qvel[step % 64]
            data.ctrl[:] = batch.ctrl[step % 64]
            mujoco.mj_forward(model.mj, data)
            assert (np.abs(data.qfrc_actuator) <= torque + 1e-12).all()
        fastest = np.maximum(fastest, np.abs(batch.qvel).max(axis=0))
    batch.check()
    assert (fastest <= 1.10 * speed).all(), (fastest / speed).round(2)
    assert (fastest / speed).max() > 0.5  # the commands do drive the arm


def test_an_impossible_command_saturates_every_torque_at_its_limit():
    data = mujoco.MjData(MODEL.mj)
    data.qpos[:] = MODEL.en_garde.ravel()
    data.ctrl[:] = [5, 5, 5, 0, 1, 0, 0] * 2
    mujoco.mj_forward(MODEL.mj, data)
    torque = np.tile([NOMINAL.joints[name].torque_limit for name in JOINT_NAMES], 2)
    assert (np.abs(data.qfrc_actuator) <= torque).all()
    assert (np.abs(data.qfrc_actuator) == torque).sum() >= 6


@pytest.mark.parametrize("physics_timestep", [0.001, 0.002, 0.005, 0.01])
def test_a_step_of_5_cm_settles_at_every_physics_timestep(physics_timestep: float):
    model = FencingModel.build(SimConfig(physics_timestep=physics_timestep))
    batch = FencingBatch(model, 6)
    for world in range(6):
        step = 0.05 * (1 if world < 3 else -1)
        batch.ctrl[world, [world % 3, 7 + world % 3]] += step
    for _ in range(200):
        batch.step()
    batch.check()
    assert np.abs(batch.qvel).max() < 0.06
    for agent in range(2):
        tool = batch.sensors[:, 20 * agent + 13 : 20 * agent + 16]
        assert np.abs(tool - batch.ctrl[:, 7 * agent : 7 * agent + 3]).max() < 0.01


@pytest.mark.parametrize("arms", [("right", "right"), ("left", "left")])
def test_en_garde_with_noise_the_blades_are_clear_of_the_target(arms: tuple[str, str]):
    model = FencingModel.build(msgspec.convert({"arms": arms}, SimConfig))
    batch = FencingBatch(model, 500)
    noise = np.random.default_rng(7).uniform(-0.1, 0.1, (500, 14))
    batch.reset(np.arange(500), model.en_garde.ravel() + noise)
    for agent in range(2):
        for row in batch.sensors[:, 20 * agent : 20 * agent + 7]:
            blade = matrix(row[3:7])[:, 0]
            along = np.clip(
                (model.target_centre - row[:3]) @ blade, model.bat_back, model.bat_front
            )
            gap = np.linalg.norm(row[:3] + along * blade - model.target_centre)
            assert gap - model.target_radius - model.bat_radius > 0.05


def test_en_garde_holds_still():
    batch = FencingBatch(MODEL, 1)
    for _ in range(100):
        batch.step()
    assert batch.qpos[0] == pytest.approx(MODEL.en_garde.ravel(), abs=1e-9)


def test_a_left_arm_fences_as_the_mirror_image_of_a_right_one():
    data = {}
    for side in ("right", "left"):
        model = FencingModel.build(msgspec.convert({"arms": (side, side)}, SimConfig))
        batch = FencingBatch(model, 1)
        data[side] = batch.sensors[0, 33:36].copy()
    assert data["left"] == pytest.approx(data["right"] * [1, -1, 1], abs=1e-12)


def test_blades_that_cross_are_pushed_apart():
    batch = FencingBatch(MODEL, 1)
    for agent in range(2):  # both tools to the middle, blades upright
        batch.ctrl[0, 7 * agent : 7 * agent + 3] = [0.95, 0.0, -0.2]
    data = mujoco.MjData(MODEL.mj)
    touched = 0
    for _ in range(300):
        batch.step()
        data.qpos[:] = batch.qpos[0]
        mujoco.mj_forward(MODEL.mj, data)
        touched += data.ncon
    batch.check()
    assert touched > 20
    assert abs(batch.qvel).max() < 5.0


def test_a_bat_hits_the_opponents_arm_only_when_asked_to():
    model = FencingModel.build(SimConfig(bat_arm_contacts=True))
    assert model.mj.npair == 7
    batch = FencingBatch(model, 1)
    batch.step()
    batch.check()


def test_a_residual_spring_pulls_its_joint_on_both_robots():
    spring = ResidualSpring(joint="elbow_flex", stiffness=4.0, angle=-1.0)
    model = FencingModel.of(SimConfig(), msgspec.structs.replace(NOMINAL, extensions=(spring,)))
    data = mujoco.MjData(model.mj)
    data.qpos[:] = model.en_garde.ravel()
    mujoco.mj_forward(model.mj, data)
    expected = np.zeros(14)
    expected[[3, 10]] = -4.0 * (data.qpos[[3, 10]] + 1.0)
    assert data.qfrc_passive == pytest.approx(expected)
