"""An arm of seven joints that all rub, as real ones do, recorded at 1 kHz under torque control."""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.identification.dataset.types import Dataset, Float64, ModelSource, Trajectory
from shared.identification.find import identify

JOINTS = tuple(f"joint{number}" for number in range(1, 8))
_FRAMES = (
    ("0 0 0.333", "1 0 0 0"), ("0 0 0", "0.7071 -0.7071 0 0"), ("0 -0.316 0", "0.7071 0.7071 0 0"),
    ("0.0825 0 0", "0.7071 0.7071 0 0"), ("-0.0825 0.384 0", "0.7071 -0.7071 0 0"),
    ("0 0 0", "0.7071 0.7071 0 0"), ("0.088 0 0", "0.7071 0.7071 0 0"),
)  # fmt: skip
"""Where each link's frame is in the one before: the published sizes of a Franka arm (m)."""
_LINKS = (
    (4.97, "0.004 0.002 -0.05", "0.0373 0.0373 0.009"),
    (0.647, "-0.003 -0.03 0.003", "0.0109 0.004 0.0109"),
    (3.23, "0.027 0.039 -0.066", "0.0372 0.0361 0.0108"),
    (3.59, "-0.053 0.104 0.027", "0.0259 0.0196 0.0283"),
    (1.23, "-0.012 0.041 -0.038", "0.0355 0.0295 0.0086"),
    (1.67, "0.06 -0.014 -0.01", "0.002 0.0044 0.0054"),
    (1.47, "0.01 -0.004 0.08", "0.0125 0.01 0.0048"),
)
"""Mass (kg), centre (m) and inertia (kg m^2) of each; about those of such an arm."""
FRICTION = np.array([0.67, 0.86, 0.53, 0.70, 0.45, 0.26, 0.34])
"""Of the real arm; its model has none (N m)."""
HOME = np.array([0.0, -0.6, 0.0, -1.9, 0.0, 1.6, 0.5])
REACH = np.array([0.9, 0.5, 0.8, 0.7, 0.9, 0.7, 1.0])
SECONDS = 6.0


def arm(timestep: float, damping: Float64, friction: Float64, mass: Float64) -> str:
    """Return the arm's MJCF; each joint's damping and friction, each link's factor of mass."""
    bodies = "".join(
        f'<body name="link{index + 1}" pos="{place}" quat="{turn}">'
        f'<joint name="{JOINTS[index]}" axis="0 0 1" armature="0.1" damping="{damping[index]}" '
        f'frictionloss="{friction[index]}"/>'
        f'<inertial mass="{link[0] * mass[index]}" pos="{link[1]}" diaginertia="{link[2]}"/>'
        for index, ((place, turn), link) in enumerate(zip(_FRAMES, _LINKS, strict=True))
    )
    motors = "".join(f'<motor name="{name}" joint="{name}"/>' for name in JOINTS)
    return (
        f'<mujoco><option timestep="{timestep}" integrator="implicitfast"/>'
        f"<worldbody>{bodies}{'</body>' * 7}</worldbody><actuator>{motors}</actuator></mujoco>"
    )


def way(at: Float64, rng: np.random.Generator) -> Float64:
    """Return four sines a joint, 0.1 to 0.8 Hz, that grow from rest within 1 s: float64[T, 7]."""
    frequency = np.exp(rng.uniform(np.log(0.1), np.log(0.8), (7, 4)))
    phase = rng.uniform(0.0, 2.0 * np.pi, (7, 4))
    waves = np.sin(2.0 * np.pi * frequency * at[:, None, None] + phase)
    sum_of = np.einsum("tjk,jk->tj", waves, rng.uniform(0.5, 1.0, (7, 4)) / frequency**0.5)
    lead = np.clip(at, 0.0, 1.0)[:, None]
    return HOME + lead**2 * (3.0 - 2.0 * lead) * REACH * sum_of / np.abs(sum_of).max(axis=0)


def recording(
    real: mujoco.MjModel, nominal: mujoco.MjModel, name: str, split: str, rng: np.random.Generator
) -> Trajectory:
    """Return what the real arm does under a controller that knows the nominal one, at 1 kHz."""
    at: Float64 = np.arange(0.0, SECONDS, 1e-3)
    target = way(at, rng)
    speed = np.gradient(target, at, axis=0)
    data, known = mujoco.MjData(real), mujoco.MjData(nominal)
    data.qpos[:] = target[0]
    q, torques = np.empty_like(target), np.empty_like(target)
    stiffness = np.array([420.0, 420.0, 420.0, 420.0, 175.0, 105.0, 35.0])
    damping = np.array([25.0, 25.0, 25.0, 25.0, 15.0, 12.0, 8.0])
    for row in range(len(at)):
        known.qpos[:], known.qvel[:] = data.qpos, data.qvel
        mujoco.mj_forward(nominal, known)
        torques[row] = (
            known.qfrc_bias
            + stiffness * (target[row] - data.qpos)
            + damping * (speed[row] - data.qvel)
        )
        q[row] = data.qpos + 1e-5 * rng.standard_normal(7)
        data.ctrl[:] = torques[row]
        mujoco.mj_step(real, data, 2)
    return Trajectory(
        name=name, split="train" if split == "train" else "test", repeats="", initial_q=q[0],
        initial_qd=np.zeros(7), command_at=at, command=torques, joints_at=at, q=q,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_where_every_joint_rubs_every_joint_is_named(tmp_path: Path):
    rng = np.random.default_rng(1)
    path = tmp_path / "arm.xml"
    path.write_text(arm(1e-3, np.full(7, 0.5), np.zeros(7), np.ones(7)))
    nominal = mujoco.MjModel.from_xml_path(str(path))
    damping = 0.8 * np.exp(0.3 * rng.standard_normal(7))
    mass = np.exp(0.05 * rng.standard_normal(7))
    real = mujoco.MjModel.from_xml_string(arm(0.5e-3, damping, FRICTION, mass))
    real.dof_solimp[:, :2] = 0.999, 0.9999  # what sticks does not creep
    splits = {"one": "train", "two": "train", "three": "train", "four": "test", "five": "test"}
    made = tuple(recording(real, nominal, name, split, rng) for name, split in splits.items())
    source = ModelSource("mjcf", path)
    dataset = Dataset(tmp_path, source, "torque", JOINTS, JOINTS, made, (), "")
    verdict = identify(dataset).verdict
    assert verdict.verdict == "named"
    assert {cause.effect for cause in verdict.causes} == {"coulomb_friction"}
    found = {cause.where: cause.value for cause in verdict.causes}
    assert found == pytest.approx(dict(zip(JOINTS, FRICTION, strict=True)), rel=0.05)
