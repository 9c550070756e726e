"""A stand-in for recordings of a small whole arm with hobby servos, several things wrong at once.

Five joints of an SO-101's sizes. Its servos are a law beside MuJoCo: proportional torque within a
limit, damping, friction that is larger at rest (Stribeck) and may grow with the load, commands that
come late. Encoders have 12 bits, the log 50 Hz, and nothing is repeated, as in public recordings of
such arms. The model has one gain and one friction for all joints.

Run ``python -m studies.other_arms.small_arm OUT``.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.real_data.folders import write

JOINTS = ("pan", "lift", "elbow", "wrist", "roll")
_TIMESTEP: Final = 0.0005
_PERIOD: Final = 0.02
_SETTLE: Final = 100
"""Commands that the first one is held for before a recording begins."""
_ENCODER: Final = 2.0 * np.pi / 4096
_LIMIT: Final = 3.35
"""Of a servo's torque (N m)."""
_KP, _KV, _FRICTION, _ARMATURE = 17.8, 0.6, 0.052, 0.028
"""Of the model, alike at every joint (N m/rad, N m s/rad, N m, kg m^2)."""
_MORE: Final = np.array([1.0, 1.2, 1.0, 0.6, 0.5])
"""Friction of one joint beside that of others."""
_STICKS: Final = 0.004
"""Speed within which friction turns round; slower than that a joint creeps (rad/s)."""
_FALLOFF: Final = 0.1
"""Speed by which most of the friction of rest is gone (rad/s)."""
_PUSH: Final = 0.01
"""Random torque at each joint in each step (N m)."""
_REST = np.array([0.0, -0.3, 0.4, 0.3, 0.0])
_SWING = np.array([0.5, 0.35, 0.4, 0.5, 0.6])


@dataclass(frozen=True)
class Wrong:
    """What the arm does that its model does not."""

    delay: float = 0.03
    """Of commands (s)."""
    friction: float = 6.0
    """Times the model's."""
    at_rest: float = 1.2
    """How much larger than that friction is at rest, as a share."""
    load: float = 0.0
    """Friction as a share of the servo's torque."""


def convert(out: Path, wrong: Wrong, seconds: float = 12.0, seed: int = 0) -> None:
    """Write the data set: three recordings to fit to, two held out.

    Args:
        out: the new folder.
        wrong: what the model has not.
        seconds: of a recording.
        seed: of motions, disturbances and each joint's own numbers.
    """
    rng = np.random.default_rng(seed)
    kp, kv, friction = np.exp(rng.normal(0.0, [[0.2], [0.2], [0.15]], (3, len(JOINTS))))
    friction = _FRICTION * wrong.friction * _MORE * friction
    servo = _Servo(_KP * kp, _KV * kv, friction, wrong)
    at: Float64 = _PERIOD * np.arange(round(seconds / _PERIOD), dtype=np.float64)
    trajectories = tuple(
        _recording(name, split, servo, at, _REST + motion(at, rng), rng)
        for name, (split, motion) in _MOTIONS.items()
    )
    notes = {
        "source": "simulated", "seed": seed, "delay": wrong.delay, "load": wrong.load,
        "friction": servo.friction.tolist(), "excess": (wrong.at_rest * servo.friction).tolist(),
    }  # fmt: skip
    write(out, _mjcf(_FRICTION, _KV), "position", JOINTS, trajectories, notes)


@dataclass(frozen=True)
class _Servo:
    """What drives the joints."""

    kp: Float64
    """float64[J] (N m/rad)."""
    kv: Float64
    """float64[J] (N m s/rad)."""
    friction: Float64
    """float64[J] (N m)."""
    wrong: Wrong

    def torque(self, target: Float64, q: Float64, speed: Float64) -> Float64:
        """Return float64[J]: what acts at the joints (N m)."""
        drive = np.clip(self.kp * (target - q), -_LIMIT, _LIMIT)
        level = self.friction * (1.0 + self.wrong.at_rest * np.exp(-((speed / _FALLOFF) ** 2)))
        level = level + self.wrong.load * np.abs(drive)
        return drive - self.kv * speed - level * np.tanh(speed / _STICKS)


def _recording(
    name: str, split: Split, servo: _Servo, at: Float64, command: Float64,
    rng: np.random.Generator,
) -> Trajectory:  # fmt: skip
    """Let the arm follow commands, and log it."""
    model = mujoco.MjModel.from_xml_string(_mjcf(0.0, 0.0, timestep=_TIMESTEP, has_servos=False))
    data = mujoco.MjData(model)
    data.qpos[:] = command[0]
    every, late = round(_PERIOD / _TIMESTEP), round(servo.wrong.delay / _TIMESTEP)
    sent = np.concatenate([np.tile(command[0], (_SETTLE, 1)), command])
    q = np.empty_like(sent)
    for step in range(len(sent) * every):
        if step % every == 0:
            q[step // every] = data.qpos
        target = sent[max(step - late, 0) // every]
        torque = servo.torque(target, data.qpos, data.qvel)
        data.qfrc_applied[:] = torque + _PUSH * rng.standard_normal(len(JOINTS))
        mujoco.mj_step(model, data)
    q = _ENCODER * np.round(q[_SETTLE:] / _ENCODER)
    return Trajectory(name, split, "", q[0], np.zeros(len(JOINTS)), at, command, at, q)


def _sines(at: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[T, J]: a slow sine each."""
    return _SWING * np.sin(2.0 * np.pi * np.array([0.25, 0.3, 0.35, 0.4, 0.45]) * at[:, None])


def _multisine(at: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[T, J]: four sines each, up to 1.4 Hz."""
    hertz = np.array([0.15, 0.4, 0.8, 1.3])[:, None] * np.linspace(0.9, 1.1, len(JOINTS))
    phase = rng.uniform(0.0, 2.0 * np.pi, hertz.shape)
    waves = np.sin(2.0 * np.pi * hertz * at[:, None, None] + phase)
    return 0.5 * _SWING * np.einsum("tkj,k->tj", waves, 1.0 / (1.0 + 0.5 * np.arange(4)))


def _steps(at: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[T, J]: one of two places each, for 0.8 to 2 s."""
    out = np.empty((len(at), len(JOINTS)))
    for column in out.T:
        begin = 0
        while begin < len(at):
            length = int(rng.integers(40, 100))
            column[begin : begin + length] = rng.choice([-0.24, 0.24])
            begin += length
    return out


def _chirp(at: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[T, J]: a sine from 0.2 to 1.5 Hz, all joints together."""
    turns = 0.2 * at + 0.5 * (1.5 - 0.2) / at[-1] * at**2
    return 0.6 * _SWING * np.sin(2.0 * np.pi * turns)[:, None]


def _reaches(at: Float64, rng: np.random.Generator) -> Float64:
    """Return float64[T, J]: from place to place within 1 to 1.8 s, with a rest at each."""
    out, begin, here = np.empty((len(at), len(JOINTS))), 0, np.zeros(len(JOINTS))
    while begin < len(at):
        length = int(rng.integers(50, 90))
        there = _SWING * rng.uniform(-1.2, 1.2, len(JOINTS))
        share = np.clip(np.arange(length) / (0.7 * length), 0.0, 1.0)[:, None]
        way = here + (there - here) * share**2 * (3.0 - 2.0 * share)
        out[begin : begin + length] = way[: len(at) - begin]
        begin, here = begin + length, there
    return out


_MOTIONS: Final[dict[str, tuple[Split, Callable[[Float64, np.random.Generator], Float64]]]] = {
    "sines": ("train", _sines),
    "multisine": ("train", _multisine),
    "steps": ("train", _steps),
    "reaches": ("test", _reaches),
    "chirp": ("test", _chirp),
}


def _mjcf(friction: float, kv: float, timestep: float = 0.002, *, has_servos: bool = True) -> str:
    """Return the MJCF of the arm."""
    joint = f'armature="{_ARMATURE}" damping="{kv}" frictionloss="{friction}"'
    servos = "".join(
        f'<position name="{name}" joint="{name}" kp="{_KP}" forcerange="-{_LIMIT} {_LIMIT}"/>'
        for name in JOINTS * has_servos
    )
    return f"""<mujoco model="small_arm">
  <compiler angle="radian"/>
  <option timestep="{timestep}" integrator="implicitfast"/>
  <worldbody>
    <body name="pan" pos="0 0 0.06">
      <joint name="pan" axis="0 0 1" {joint}/>
      <geom type="box" size="0.025 0.03 0.03" mass="0.15"/>
      <body name="lift" pos="0.03 0 0.05">
        <joint name="lift" axis="0 1 0" {joint}/>
        <geom type="capsule" fromto="0 0 0 0 0 0.116" size="0.018" mass="0.13"/>
        <body name="elbow" pos="0 0 0.116">
          <joint name="elbow" axis="0 1 0" {joint}/>
          <geom type="capsule" fromto="0 0 0 0.135 0 0" size="0.018" mass="0.12"/>
          <body name="wrist" pos="0.135 0 0">
            <joint name="wrist" axis="0 1 0" {joint}/>
            <geom type="capsule" fromto="0 0 0 0.06 0 0" size="0.018" mass="0.1"/>
            <body name="roll" pos="0.06 0 0">
              <joint name="roll" axis="1 0 0" {joint}/>
              <geom type="box" pos="0.05 0.01 0" size="0.05 0.03 0.015" mass="0.09"/>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>{servos}</actuator>
</mujoco>
"""


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    usual = Wrong()
    parser.add_argument("out", type=Path, help="the new folder")
    parser.add_argument("--delay", type=float, default=usual.delay, help="of commands (s)")
    parser.add_argument("--friction", type=float, default=usual.friction, help="times the model's")
    parser.add_argument(
        "--at-rest", type=float, default=usual.at_rest, metavar="SHARE",
        help="how much larger friction is at rest",
    )  # fmt: skip
    parser.add_argument(
        "--load", type=float, default=usual.load, metavar="SHARE",
        help="of the servo's torque that is friction, too",
    )  # fmt: skip
    parser.add_argument("--seconds", type=float, default=12.0, help="of a recording")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    wrong = Wrong(args.delay, args.friction, args.at_rest, args.load)
    convert(args.out, wrong, args.seconds, args.seed)
