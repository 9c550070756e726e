"""A stand-in for recordings of a 7-joint arm: 1 kHz logs of a simulated one that rubs.

No recording of such an arm lies beside the project. This one has the sizes of a Franka Panda
(lengths of its data sheet, masses of Gaz et al. 2019, inertias of rods and balls), and what its
model lacks: Coulomb friction in every joint. The model is heavier damped and has links up to 5 %
lighter or heavier. Encoders are read in steps of 0.01 mrad, torques with 0.05 N m of noise.

Run ``python -m studies.real_data.stand_in OUT``.
"""

import argparse
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import mujoco
import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.real_data.folders import write

Control = Literal["torque", "position"]
JOINTS = tuple(f"joint{number}" for number in range(1, 8))
FRICTION = (0.7, 0.6, 0.5, 0.6, 0.3, 0.25, 0.2)
"""Coulomb friction of the arm (N m); the model has none."""
_DAMPING = (0.9, 1.2, 0.8, 0.9, 0.4, 0.5, 0.3)
_MASS = (4.97, 0.65, 3.23, 3.59, 1.23, 1.67, 1.44)
_KP = (600.0, 600.0, 600.0, 600.0, 250.0, 150.0, 50.0)
_LINKS = (
    # place, turn about x (quarters), centre of mass, its distance that inertia is like
    ((0, 0, 0.333), 0, (0, 0, -0.05), 0.10),
    ((0, 0, 0), -1, (0, -0.03, 0), 0.12),
    ((0, -0.316, 0), 1, (0.03, 0.04, -0.07), 0.10),
    ((0.0825, 0, 0), 1, (-0.05, 0.10, 0.03), 0.10),
    ((-0.0825, 0.384, 0), -1, (0, 0.04, -0.04), 0.12),
    ((0, 0, 0), 1, (0.06, -0.01, -0.01), 0.06),
    ((0.088, 0, 0), 1, (0.01, 0, 0.10), 0.07),
)
_HOME = np.array([0.0, -0.3, 0.0, -2.0, 0.0, 1.8, 0.0])
_SWING = np.array([0.8, 0.5, 0.7, 0.6, 0.9, 0.7, 1.0])
_TIMESTEP = 0.0005
_PERIOD = 0.001
_QUANTUM = 1e-5
_TORQUE_NOISE = 0.05


@dataclass(frozen=True)
class Arm:
    """Numbers of the arm, or of its model."""

    mass: tuple[float, ...]
    damping: tuple[float, ...]
    friction: tuple[float, ...]
    timestep: float


def convert(out: Path, control: Control = "torque", seconds: float = 12.0, seed: int = 0) -> None:
    """Write the data set: two recordings to fit to, one held out.

    Args:
        out: the new folder.
        control: whether the log's command is the motors' torque or the servos' target.
        seconds: of a recording.
        seed: of motions, noise and what the model has wrong.
    """
    rng = np.random.default_rng(seed)
    truth = Arm(_MASS, _DAMPING, FRICTION, _TIMESTEP)
    wrong = tuple(mass * rng.uniform(0.95, 1.05) for mass in _MASS)
    known = Arm(wrong, (1.0,) * 7, (0.0,) * 7, 0.001)
    splits: dict[str, Split] = {"one": "train", "two": "train", "three": "test"}
    trajectories = tuple(
        _recording(name, split, truth, control, seconds, rng) for name, split in splits.items()
    )
    notes = {"source": "simulated", "seed": seed, "friction": list(FRICTION)}
    write(out, mjcf(known, control), control, JOINTS, trajectories, notes)


def mjcf(arm: Arm, control: Control) -> str:
    """Return the MJCF of an arm: motors, or servos on positions."""
    bodies, inner = "", ""
    for index, (place, turn, centre, size) in enumerate(_LINKS):
        x, y, z = place
        inertia = arm.mass[index] * size**2
        bodies += f"""
  <body name="link{index + 1}" pos="{x} {y} {z}" quat="1 {turn} 0 0">
    <joint name="{JOINTS[index]}" axis="0 0 1" armature="0.1" damping="{arm.damping[index]}"
           frictionloss="{arm.friction[index]}"/>
    <inertial pos="{centre[0]} {centre[1]} {centre[2]}" mass="{arm.mass[index]}"
              diaginertia="{inertia} {inertia} {0.6 * inertia}"/>"""
        inner += "</body>"
    drives = "".join(
        f'<motor name="{joint}" joint="{joint}"/>'
        if control == "torque"
        else f'<position name="{joint}" joint="{joint}" kp="{kp}" kv="{0.1 * kp}"/>'
        for joint, kp in zip(JOINTS, _KP, strict=True)
    )
    return f"""<mujoco model="seven">
  <compiler angle="radian"/>
  <option timestep="{arm.timestep}" integrator="implicitfast"/>
  <worldbody>{bodies}{inner}</worldbody>
  <actuator>{drives}</actuator>
</mujoco>
"""


def _recording(
    name: str, split: Split, truth: Arm, control: Control, seconds: float,
    rng: np.random.Generator,
) -> Trajectory:  # fmt: skip
    """Let the arm follow a sum of sines under servos, and log it."""
    model = mujoco.MjModel.from_xml_string(mjcf(truth, "position"))
    model.dof_solimp[:, :2] = 0.999
    data = mujoco.MjData(model)
    data.qpos[:] = _HOME
    every = round(_PERIOD / _TIMESTEP)
    count = round(seconds / _PERIOD)
    at: Float64 = _PERIOD * np.arange(count, dtype=np.float64)
    target = _HOME + _motion(at, rng)
    sag = _gravity(model) / model.actuator_gainprm[:, 0]
    q, torque = np.empty((count, 7)), np.empty((count, 7))
    command = target + sag
    for index in range(count):
        q[index] = data.qpos
        data.ctrl[:] = command[index]
        for _ in range(every):
            mujoco.mj_step(model, data)
        torque[index] = data.actuator_force
    q = _QUANTUM * np.round(q / _QUANTUM)
    torque += rng.normal(0.0, _TORQUE_NOISE, torque.shape)
    still = np.zeros(7)
    made = Trajectory(name, split, "", q[0], still, at, command, at, q, effort=torque)
    return made if control == "position" else replace(made, command=torque, effort=None)


def _motion(at: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[T, 7]: four sines a joint, swelling for two seconds."""
    hertz = rng.uniform(0.08, 0.6, (4, 7))
    phase = rng.uniform(0.0, 2.0 * np.pi, (4, 7))
    waves = np.sin(2.0 * np.pi * hertz * at[:, None, None] + phase).mean(axis=1)
    return np.minimum(at / 2.0, 1.0)[:, None] ** 2 * _SWING * waves


def _gravity(model: mujoco.MjModel) -> Float64:
    data = mujoco.MjData(model)
    data.qpos[:] = _HOME
    mujoco.mj_forward(model, data)
    return np.array(data.qfrc_bias)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="the new folder")
    parser.add_argument("--control", choices=get_args(Control), default="torque")
    parser.add_argument("--seconds", type=float, default=12.0, help="of a recording")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    convert(args.out, args.control, args.seconds, args.seed)
