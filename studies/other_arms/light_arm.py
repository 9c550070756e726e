"""A light arm of which torques are logged, by plain MuJoCo: its file says nothing of drives.

The links of an AIRBOT Play (``studies.real_data.airbot``), 5 % off their file, with friction of
both kinds and rotors at every joint, pushed at random by torques of 2 to 10 % of what it needs. A
controller follows sums of three sines for 12 s; nothing is repeated. Encoders say steps of 0.38
mrad, at instants that are off by 0.3 ms, torques are off by noise of 0.005 to 0.05 N m.

Run ``python -m studies.other_arms.light_arm OUT --seed 1 [--none]``; it prints what was hidden.
"""

import argparse
import sys
from pathlib import Path
from typing import NamedTuple

import mujoco
import numpy as np

from shared.identification.dataset.types import Float64
from studies.real_data.airbot import JOINTS, model
from studies.real_data.folders import in_parts, write

_STEP, _EVERY, _SECONDS, _PARTS = 5e-4, 20, 12.0, 6
_STICKS = 0.999
_GAINS = np.array([60.0, 120.0, 80.0, 10.0, 8.0, 3.0]), np.array([4.0, 8.0, 5.0, 0.5, 0.4, 0.1])
_MIDDLE = np.array([0.5, -0.3, 0.9, 0.7, 0.6, 0.6])
_PUSHES, _LASTING = np.array([0.05, 0.15, 0.1, 0.02, 0.02, 0.01]), 0.3
_TORQUE_NOISE = np.array([0.02, 0.05, 0.05, 0.01, 0.01, 0.005])
_TORQUE_STEP, _ANGLE_STEP = 0.005, 3.8e-4
_JITTER = 0.3e-3
_LINKS_OFF = 0.05


class Drives(NamedTuple):
    """What each joint has that the file lacks: float64[6] each."""

    dry: Float64
    """(N m)."""
    viscous: Float64
    """(N m s/rad)."""
    rotor: Float64
    """(kg m^2)."""


def drawn(rng: np.random.Generator, is_none: bool) -> Drives:
    """Return drives; nothing if so asked."""
    dry = np.array([0.3, 0.8, 0.5, 0.12, 0.1, 0.08]) * np.exp(rng.normal(0.0, 0.2, 6))
    viscous = np.array([0.1, 0.2, 0.1, 0.05, 0.03, 0.03]) * np.exp(rng.normal(0.0, 0.3, 6))
    rotor = np.array([0.02, 0.03, 0.02, 0.004, 0.003, 0.002])
    return Drives(*(each * (not is_none) for each in (dry, viscous, rotor)))


def make(out: Path, seed: int, is_none: bool = False) -> Drives:
    """Write the data set and return what was hidden.

    Args:
        out: the new folder.
        seed: of everything random.
        is_none: whether the drives are as the file has them.
    """
    rng = np.random.default_rng(seed)
    drives = drawn(rng, is_none)
    arm = mujoco.MjModel.from_xml_string(model())
    arm.opt.timestep = _STEP
    arm.dof_frictionloss[:], arm.dof_damping[:], arm.dof_armature[:] = drives
    arm.dof_solimp[:, :2] = _STICKS
    off = np.exp(rng.normal(0.0, _LINKS_OFF, arm.nbody))
    arm.body_mass[:] *= off
    arm.body_inertia[:] *= off[:, None]
    q, torque = _moved(arm, drives.dry, rng)
    every = np.arange(0, len(q), _EVERY)
    read = np.round(every + rng.normal(0.0, _JITTER / _STEP, len(every))).astype(np.int64)
    read = np.clip(read, 0, len(q) - 1)
    angles = _ANGLE_STEP * np.round(q[read] / _ANGLE_STEP)
    told = torque[read] + rng.normal(0.0, _TORQUE_NOISE, (len(read), len(JOINTS)))
    told = _TORQUE_STEP * np.round(told / _TORQUE_STEP)
    at: Float64 = _STEP * every.astype(np.float64)
    parts = in_parts(at, angles, told, (0.0, float(at[-1])), _PARTS)
    write(out, model(), "torque", JOINTS, parts, {"source": f"simulated, seed {seed}"})
    return drives


def _moved(arm: mujoco.MjModel, dry: Float64, rng: np.random.Generator) -> tuple[Float64, Float64]:
    """Return float64[T, 6], angles and torques at each step of a controller that follows sines."""
    at: Float64 = np.arange(0.0, _SECONDS, _STEP)
    rate, phase = rng.uniform(0.1, 0.8, (6, 3)), rng.uniform(0.0, 2.0 * np.pi, (6, 3))
    swing = rng.uniform(0.1, 0.35, (6, 3))
    turned = 2.0 * np.pi * rate * at[:, None, None] + phase
    wanted = _MIDDLE + np.sum(swing * np.sin(turned), axis=2)
    speed = np.sum(2.0 * np.pi * rate * swing * np.cos(turned), axis=2)
    data = mujoco.MjData(arm)
    data.qpos[:], data.qvel[:] = wanted[0], speed[0]
    q, torque, pushes = np.empty_like(wanted), np.empty_like(wanted), np.zeros(len(JOINTS))
    kept = np.exp(-_STEP / _LASTING)
    stiff, damped = _GAINS
    for step in range(len(at)):
        fresh = rng.normal(0.0, 1.0, len(JOINTS))
        pushes = kept * pushes + _PUSHES * np.sqrt(2.0 * _STEP / _LASTING) * fresh
        error, slower = wanted[step] - data.qpos, speed[step] - data.qvel
        given = stiff * error + damped * slower + data.qfrc_bias + dry * np.sign(speed[step])
        data.ctrl[:], data.qfrc_applied[:] = given, pushes
        q[step], torque[step] = data.qpos, given
        mujoco.mj_step(arm, data)
    return q, torque


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="the new folder")
    parser.add_argument("--seed", type=int, default=1, help="of everything random (1)")
    parser.add_argument("--none", action="store_true", help="hide nothing")
    args = parser.parse_args()
    for name, values in make(args.out, args.seed, args.none)._asdict().items():
        sys.stdout.write(f"{name} {np.round(values, 4)}\n")
