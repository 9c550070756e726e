"""Moves an arm with something wrong, and logs it."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import mujoco
import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.other_arms.arms import Arm, Numbers
from studies.other_arms.faults import Fault, draw
from studies.real_data.folders import write

_STEP: Final = 0.00005
"""Of what moves the arm (s): at 0.5 ms MuJoCo itself is off by more than the encoders."""
_PUSHED: Final = 0.0005
"""For which a random torque lasts (s)."""
_FILE_STEP: Final = 0.002
_SETTLE: Final = 2.0
"""For which the arm holds still before a recording begins (s)."""
_SPREAD: Final = 0.15
_MOTIONS: Final[dict[str, tuple[Split, str, float]]] = {
    "slow": ("train", "", 0.25), "slow_again": ("train", "slow", 0.25),
    "sines": ("train", "", 0.6), "fast": ("train", "", 1.2),
    "sines_held_out": ("test", "", 0.7), "fast_held_out": ("test", "", 1.1),
}  # fmt: skip
"""What each is for, what it repeats, and its fastest sine (Hz)."""


def convert(
    out: Path, arm: Arm, name: str, seconds: float = 8.0, seed: int = 0, step: float = _STEP
) -> Fault:
    """Write a data set: four recordings to fit to, one of them a repeat, and two held out.

    Args:
        out: the new folder.
        arm: what moves.
        name: of what is wrong.
        seconds: of a recording.
        seed: of everything random.
        step: of what moves the arm (s).

    Returns:
        What is wrong, which is in the notes of ``dataset.toml`` for people, too.
    """
    rng = np.random.default_rng(seed)
    own = arm.numbers.spread(_SPREAD, rng)
    fault = draw(name, arm, rng)
    rig = _Rig(arm, own, fault, arm.limit, rng, step)
    commands = {name: _motion(arm, name, seconds, seed) for name in _MOTIONS}
    if fault.name == "torque_saturation":
        joint = arm.joints.index(fault.where)
        _, torques = rig.moved(commands["fast"])
        limit = arm.limit.copy()
        limit[joint] = fault.value * np.abs(torques[:, joint]).max()
        fault = replace(fault, value=float(limit[joint]), unit="N m")
        rig = replace(rig, fault=fault, limit=limit)
    made = tuple(rig.recording(name, wanted) for name, wanted in commands.items())
    wrong = {"effect": fault.name, "where": fault.where, "value": fault.value, "unit": fault.unit}
    notes = {"source": "simulated", "seed": seed, "wrong": wrong}
    write(out, arm.mjcf(arm.numbers, _FILE_STEP), arm.control, arm.joints, made, notes)
    return fault


def _motion(arm: Arm, name: str, seconds: float, seed: int) -> Float64:
    """Return float64[T, J]: four sines a joint, from rest; what repeats a motion is the same."""
    _, repeats, fastest = _MOTIONS[name]
    rng = np.random.default_rng([seed, list(_MOTIONS).index(repeats or name)])
    at = arm.period * np.arange(round(seconds / arm.period))
    count = len(arm.joints)
    hertz = rng.uniform(0.2 * fastest, fastest, (4, 1, count))
    phase = rng.uniform(0.0, 2.0 * np.pi, (4, 1, count))
    waves = np.sin(2.0 * np.pi * hertz * at[None, :, None] + phase).mean(axis=0)
    return arm.home + 1.5 * arm.swing * np.minimum(at / 1.5, 1.0)[:, None] * (waves - waves[0])


@dataclass(frozen=True)
class _Rig:
    """An arm, what is wrong with it, and what moves it."""

    arm: Arm
    own: Numbers
    fault: Fault
    limit: Float64
    """Largest torques, float64[J] (N m, N)."""
    rng: np.random.Generator
    step: float
    """Of the physics (s)."""

    def recording(self, name: str, wanted: Float64) -> Trajectory:
        """Return what is logged of a motion, float64[T, J], with the noise of readings."""
        arm, (split, repeats, _) = self.arm, _MOTIONS[name]
        q, torques = self.moved(wanted)
        at: Float64 = arm.period * np.arange(len(q), dtype=np.float64)
        q = q + arm.noise * self.rng.standard_normal(q.shape)
        command = torques if arm.control == "torque" else wanted
        return Trajectory(name, split, repeats, q[0], np.zeros(q.shape[1]), at, command, at, q)

    def moved(self, wanted: Float64) -> tuple[Float64, Float64]:
        """Return positions and torques, those commanded where torques are, float64[T, J] each."""
        arm, limit = self.arm, self.limit
        model = mujoco.MjModel.from_xml_string(arm.mjcf(self.own, self.step))
        self.fault.edit(model)
        model.actuator_forcerange[:] = np.stack([-limit, limit], axis=1)
        data = mujoco.MjData(model)
        data.qpos[:] = wanted[0]
        controller = _Controller(arm, self.own)
        every, settle = round(arm.period / self.step), round(_SETTLE / self.step)
        speeds = np.gradient(wanted, arm.period, axis=0)
        q, torques = np.empty_like(wanted), np.empty_like(wanted)
        sent: list[Float64] = []
        push = np.zeros(len(limit))
        for count in range(settle + every * len(wanted)):
            row, part = divmod(count - settle, every)
            if part == 0:
                if row >= 0:
                    q[row] = data.qpos
                moving = speeds[row] if row > 0 else np.zeros(len(limit))
                command = controller(wanted[max(row, 0)], moving, data)
            sent.append(command)
            data.ctrl[:] = sent[self._arrived(count)]
            if count % round(_PUSHED / self.step) == 0:
                push = 0.98 * push + arm.push * arm.limit * self.rng.standard_normal(len(limit))
            data.qfrc_applied[:] = self.fault.law(data.qpos, data.qvel) + push
            mujoco.mj_step(model, data)
            if part == 0 and row >= 0:
                torques[row] = command if arm.control == "torque" else data.actuator_force
        return q, torques

    def _arrived(self, count: int) -> int:
        """Return the number of the command that acts in a step, late or kept for a while."""
        if self.fault.hold:
            count -= count % round(self.fault.hold / self.step)
        return max(count - round(self.fault.delay / self.step), 0)


class _Controller:
    """What is sent to the drives: where to be, or the torques of a PD controller and the weight."""

    def __init__(self, arm: Arm, own: Numbers) -> None:
        self._arm, self._own = arm, own
        self._known = mujoco.MjModel.from_xml_string(arm.mjcf(arm.numbers, _FILE_STEP))
        self._weight = mujoco.MjData(self._known)

    def __call__(self, wanted: Float64, speed: Float64, data: mujoco.MjData) -> Float64:
        """Return float64[J]."""
        if self._arm.control != "torque":
            return wanted
        self._weight.qpos[:] = data.qpos
        mujoco.mj_forward(self._known, self._weight)
        torque = self._own.kp * (wanted - data.qpos) + self._own.kv * (speed - data.qvel)
        limit = self._arm.limit
        return np.asarray(np.clip(torque + self._weight.qfrc_bias, -limit, limit), np.float64)
