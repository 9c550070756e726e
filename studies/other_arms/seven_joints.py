"""A stand-in for recordings of a seven-joint arm under torques, friction and one thing wrong.

Joints and links of about a Panda's sizes. A controller outside of the model file holds the arm on
sums of sines at 1 kHz by torques, of which every second one is logged, and something pushes it a
little all the time. Every joint rubs, of which the file says nothing (as in ``stand_in.py``),
damping and rotors are 20 to 30 % off, and nothing is repeated.

Run ``python -m studies.other_arms.seven_joints OUT --wrong payload``.
"""

import argparse
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Final, Literal, get_args

import mujoco
import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.real_data.folders import write

JOINTS = tuple(f"j{index}" for index in range(7))
Wrong = Literal["none", "payload", "bias", "stribeck", "gain", "mass"]
_LINKS: Final = (
    ("0 0 0.333", "1 0 0 0", 4.97, "0.004 0.002 -0.17", (0.70, 0.70, 0.009)),
    ("0 0 0", "1 -1 0 0", 0.647, "-0.003 -0.029 0.003", (0.008, 0.028, 0.026)),
    ("0 -0.316 0", "1 1 0 0", 3.23, "0.0275 0.039 -0.0665", (0.037, 0.036, 0.011)),
    ("0.0825 0 0", "1 1 0 0", 3.59, "-0.053 0.104 0.027", (0.026, 0.020, 0.028)),
    ("-0.0825 0.384 0", "1 -1 0 0", 1.23, "-0.012 0.041 -0.038", (0.036, 0.030, 0.0087)),
    ("0 0 0", "1 1 0 0", 1.67, "0.06 -0.014 -0.01", (0.002, 0.004, 0.0054)),
    ("0.088 0 0", "1 1 0 0", 1.2, "0.0105 -0.004 0.1", (0.0125, 0.010, 0.0048)),
)
"""Of each link: where its joint is, how it is turned, mass (kg), centre (m), inertia (kg m^2)."""
_ARMATURE: Final = np.array([0.1, 0.1, 0.1, 0.1, 0.05, 0.05, 0.04])
_DAMPING: Final = np.array([1.0, 1.0, 1.0, 1.0, 0.5, 0.5, 0.4])
_LIMIT: Final = np.array([87, 87, 87, 87, 12, 12, 12])
"""Of torques (N m)."""
_KP: Final = np.array([600.0, 600.0, 500.0, 500.0, 250.0, 150.0, 60.0])
_KD: Final = np.array([50.0, 50.0, 40.0, 30.0, 15.0, 12.0, 6.0])
_HOME: Final = np.array([0.0, -0.5, 0.0, -2.0, 0.0, 1.6, 0.7])
_SWING: Final = np.array([1.0, 0.5, 0.8, 0.6, 1.0, 0.7, 1.0])
_RUBS: Final = np.array([1.0, 1.0, 1.0, 1.0, 0.5, 0.4, 0.3])
"""Friction of one joint beside that of others."""
_TIMESTEP, _CYCLE, _PERIOD = 0.0005, 0.001, 0.002
"""Of the simulation, the controller and the log (s)."""
_SETTLE: Final = 3000
"""Steps before a recording begins."""
_MOTIONS: Final[dict[str, tuple[Split, float]]] = {
    "sines_a": ("train", 0.5), "sines_b": ("train", 0.9), "slow": ("train", 0.25),
    "sines_c": ("train", 0.7), "sines_t": ("test", 0.6), "slow_t": ("test", 0.3),
}  # fmt: skip
"""What each is for, and its fastest sine (Hz)."""


@dataclass(frozen=True)
class Arm:
    """What the arm has that its model file has not; torques are in N m."""

    armature: Float64
    damping: Float64
    friction: Float64
    mass: Float64 = field(default_factory=lambda: np.ones(7))
    """Times the file's."""
    payload: float = 0.0
    """Mass 0.15 m before the last joint (kg)."""
    bias: Float64 = field(default_factory=lambda: np.zeros(7))
    """Torque that always acts."""
    at_rest: Float64 = field(default_factory=lambda: np.zeros(7))
    """Friction that is gone at 0.1 rad/s."""
    gain: Float64 = field(default_factory=lambda: np.ones(7))
    """Of the drives."""


_FILE: Final = Arm(_ARMATURE, _DAMPING, np.zeros(7))


def draw(wrong: Wrong, rng: np.random.Generator) -> tuple[Arm, str]:
    """Return an arm with one thing wrong, of random place and size, and what that is in words."""
    arm = Arm(
        armature=_ARMATURE * np.exp(rng.normal(0, 0.2, 7)),
        damping=_DAMPING * np.exp(rng.normal(0, 0.3, 7)),
        friction=rng.uniform(0.2, 0.8, 7) * _RUBS,
    )
    joint, size = int(rng.integers(0, 7)), float(rng.uniform(0.6, 1.5))
    one = np.eye(7)[joint]
    if wrong == "payload":
        return replace(arm, payload=0.6 * size), f"payload of {0.6 * size:.4g} kg"
    if wrong == "bias":
        torque = 0.02 * size * _LIMIT[joint]
        return replace(arm, bias=one * torque), f"torque of {torque:.4g} N m at j{joint}"
    if wrong == "stribeck":
        more = 0.6 * size * arm.friction[joint]
        return replace(arm, at_rest=one * more), f"{more:.4g} N m more at rest at j{joint}"
    if wrong == "gain":
        return replace(arm, gain=1.0 - 0.1 * size * one), f"gain {1 - 0.1 * size:.4g} of j{joint}"
    if wrong == "mass":
        return replace(arm, mass=np.exp(rng.normal(0, 0.08, 7))), "links 8 % off"
    return arm, "nothing"


def convert(out: Path, wrong: Wrong, seconds: float = 8.0, seed: int = 0) -> None:
    """Write the data set: four recordings to fit to, two held out.

    Args:
        out: the new folder.
        wrong: what the model has not, beside friction.
        seconds: of a recording.
        seed: of the arm, its motions and disturbances.
    """
    rng = np.random.default_rng(seed)
    arm, words = draw(wrong, rng)
    trajectories = tuple(_recording(name, arm, seconds, rng) for name in _MOTIONS)
    notes = {
        "source": "simulated", "seed": seed, "wrong": words, "friction": arm.friction.tolist(),
    }  # fmt: skip
    write(out, _mjcf(_FILE, 0.002), "torque", JOINTS, trajectories, notes)


def _motion(at: Float64, rng: np.random.Generator, fastest: float) -> Float64:
    """Return float64[T, 7]: four sines each, from rest."""
    hertz, phase = rng.uniform(0.1, fastest, (4, 7)), rng.uniform(0, 6.28, (4, 7))
    waves = np.sin(2.0 * np.pi * hertz[:, None] * at[:, None] + phase[:, None])
    mixed = np.einsum("k,ktj->tj", [0.5, 0.35, 0.25, 0.2], waves - np.sin(phase[:, None]))
    return _HOME + 0.6 * _SWING * mixed * np.minimum(at / 1.5, 1.0)[:, None]


def _recording(name: str, arm: Arm, seconds: float, rng: np.random.Generator) -> Trajectory:
    """Hold the arm on a motion, and log it."""
    split, fastest = _MOTIONS[name]
    cycles: Float64 = _CYCLE * np.arange(round(seconds / _CYCLE), dtype=np.float64)
    command = _motion(cycles, rng, fastest)
    speeds = np.gradient(command, _CYCLE, axis=0)
    model = mujoco.MjModel.from_xml_string(_mjcf(arm, _TIMESTEP))
    model.dof_solimp[:] = [0.99, 0.999, 0.001, 0.5, 2.0]  # joints that rub stick
    known = mujoco.MjModel.from_xml_string(_mjcf(_FILE, _TIMESTEP))
    data, weight = mujoco.MjData(model), mujoco.MjData(known)
    data.qpos[:] = command[0]
    rows = round(seconds / _PERIOD)
    q, qd, torques = (np.empty((rows, 7)) for _ in range(3))
    cycle, every = round(_CYCLE / _TIMESTEP), round(_PERIOD / _TIMESTEP)
    torque, push = np.zeros(7), np.zeros(7)
    for step in range(-_SETTLE, rows * every):
        if step % cycle == 0:
            at = max(step, 0) // cycle
            weight.qpos[:], weight.qvel[:] = data.qpos, data.qvel
            mujoco.mj_forward(known, weight)
            wanted = speeds[at] if step > 0 else np.zeros(7)
            torque = _KP * (command[at] - data.qpos) + _KD * (wanted - data.qvel)
            torque = np.clip(torque + weight.qfrc_bias, -_LIMIT, _LIMIT)
        if step >= 0 and step % every == 0:
            row = step // every
            q[row], qd[row], torques[row] = data.qpos, data.qvel, torque
        push = 0.98 * push + 6e-5 * _LIMIT * rng.standard_normal(7)
        slow = np.tanh(data.qvel / 0.003) * np.exp(-((data.qvel / 0.1) ** 2))
        data.ctrl[:] = arm.gain * torque
        data.qfrc_applied[:] = arm.bias - arm.at_rest * slow + push
        mujoco.mj_step(model, data)
    times: Float64 = _PERIOD * np.arange(rows, dtype=np.float64)
    q += 2e-5 * rng.standard_normal(q.shape)
    qd += 1e-3 * rng.standard_normal(qd.shape)
    return Trajectory(name, split, "", q[0], qd[0], times, torques, times, q, qd=qd)


def _mjcf(arm: Arm, timestep: float) -> str:
    bodies = ""
    for index, (place, turn, mass, centre, inertia) in enumerate(_LINKS):
        bodies += (
            f'<body name="l{index}" pos="{place}" quat="{turn}">'
            f'<joint name="j{index}" axis="0 0 1" armature="{arm.armature[index]}" '
            f'damping="{arm.damping[index]}" frictionloss="{arm.friction[index]}"/>'
            f'<inertial mass="{mass * arm.mass[index]}" pos="{centre}" '
            f'diaginertia="{" ".join(map(str, inertia))}"/>'
        )
    if arm.payload:
        bodies += (
            f'<body pos="0 0 0.15"><inertial mass="{arm.payload}" pos="0 0 0" '
            'diaginertia="1e-3 1e-3 1e-3"/></body>'
        )
    motors = "".join(
        f'<motor name="{name}" joint="{name}" ctrlrange="-{limit} {limit}"/>'
        for name, limit in zip(JOINTS, _LIMIT, strict=True)
    )
    return f"""<mujoco model="seven_joints"><compiler angle="radian" autolimits="true"/>
      <option timestep="{timestep}" integrator="implicitfast"><flag contact="disable"/></option>
      <worldbody>{bodies}<site name="tool" pos="0 0 0.107"/>{"</body>" * 7}</worldbody>
      <actuator>{motors}</actuator></mujoco>"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, help="the new folder")
    parser.add_argument("--wrong", choices=get_args(Wrong), default="none", help="beside friction")
    parser.add_argument("--seconds", type=float, default=8.0, help="of a recording")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    convert(args.out, args.wrong, args.seconds, args.seed)
