"""At which spatial frequencies a joint's torque may ripple, told from the recordings alone.

A ripple is a sharp line in what the recorded motion takes beyond what the drives would have given,
as a function of the joint's position. Looking for it so costs nothing, where simulating every
frequency would cost more than all other effects together.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.arm.motion import motion_of
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.inverse import missing_torques
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import Signal, filtered

FEWEST = 2.0
"""Fewer ripples in a joint's travel would be a spring."""
MOST = 30.0
"""More ripples in a joint's travel are too short for encoders at 100 Hz."""
KEPT = 2
"""Frequencies a joint, at most, that are worth a simulation."""
_BESIDE = 1 / 3
"""Of the strongest one's power that another must have: a strong line leaks into all others."""
_STEP = 0.125
"""Between frequencies that are looked at: an eighth of a ripple in the whole travel."""
_INSTANTS = 4000
"""Looked at, of all recordings together."""


def ripples_of(
    nominal: Rollouts, recordings: Sequence[Trajectory]
) -> tuple[tuple[float, ...], ...]:
    """Return for each joint the strongest ripples in its travel, in cycles per radian (per metre).

    A joint that stood still has none.
    """
    plant, model = nominal.plant, nominal.model
    motions = [motion_of(each) for each in recordings]
    every = max(1, sum(len(each.at) for each in motions) // _INSTANTS)
    parts: list[tuple[Float64, Float64, Float64, Float64]] = []
    for recording, motion in zip(recordings, motions, strict=True):
        command = Signal(recording.command_at, recording.command).later(plant.command.delay)
        command = filtered(command, plant.command.filter, recording.duration)
        q, qd, qdd = motion.q[::every], motion.qd[::every], motion.qdd[::every]
        held = command.held(motion.at[::every])
        parts.append((q, qd, qdd, missing_torques(plant, model, q, qd, qdd, held)))
    q, qd, qdd, torque = (np.concatenate(each) for each in zip(*parts, strict=True))
    return tuple(
        _strongest(q[:, joint], qd[:, joint], qdd[:, joint], torque[:, joint])
        for joint in range(len(plant.labels))
    )


def _strongest(q: Float64, qd: Float64, qdd: Float64, torque: Float64) -> tuple[float, ...]:
    travel = float(np.ptp(q))
    speed = float(np.std(qd))
    if travel <= 0.0 or speed <= 0.0:
        return ()
    off = (q - q.mean()) / travel
    # What friction, servo and gravity may have to do with it.
    rest = np.stack(
        [np.ones_like(q), off, off**2, off**3, np.tanh(qd / (0.1 * speed)), qd, np.abs(qd), qdd],
        axis=1,
    )
    left = torque - rest @ np.linalg.lstsq(rest, torque, rcond=None)[0]
    counts = np.arange(FEWEST, MOST, _STEP)
    power = np.array([_power(left, 2.0 * np.pi * count * off) for count in counts])
    found: list[float] = []
    for index in np.argsort(-power):
        if power[index] < _BESIDE * power.max():
            break
        count = float(counts[index])
        if all(abs(count - other * travel) > 1.0 for other in found):
            found.append(count / travel)
        if len(found) == KEPT:
            break
    return tuple(found)


def _power(left: Float64, phase: Float64) -> float:
    """Return how much of a signal's power a wave takes off."""
    waves = np.stack([np.cos(phase), np.sin(phase)], axis=1)
    along = waves.T @ left
    return float(along @ np.linalg.solve(waves.T @ waves, along))
