"""At which spatial frequencies a joint's torque may ripple, told from the recordings alone.

A ripple is a sharp line in what the recorded motion takes beyond what the drives would have given,
as a function of the joint's position. Looking for it so costs nothing, where simulating every
frequency would cost more than all other effects together.

Two looks: at that torque less what the joint's own friction, inertia and gravity may have to do
with it; and, where nothing is clear, less what a drive's gain and all other joints may, whitened,
since what is left then is mostly slow: there small ripples show.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.motion import motion_of
from shared.identification.arm.projection import basis_of, without
from shared.identification.dataset.types import Float64, Trajectory
from shared.sim.plant.inverse import given_torques, inverse_dynamics
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import Signal, filtered

FEWEST = 2.0
"""Fewer ripples in a joint's travel would be a spring."""
MOST = 30.0
"""More ripples in a joint's travel are too short for encoders at 100 Hz."""
KEPT = 2
"""Frequencies a joint and look, at most, that are worth a simulation."""
_BESIDE = 1 / 3
"""Of the strongest one's power that another must have: a strong line leaks into all others."""
_COUNTS = np.arange(FEWEST, MOST, 0.125)
"""Ripples in the whole travel that are looked at."""
RANK = 1e-8
"""Of the largest singular value: what is less is nothing."""
_INSTANTS = 4000
"""Looked at, of all recordings together."""
_APART = 1.0
"""Ripples in the whole travel that two frequencies are apart by (1)."""


@dataclass(frozen=True)
class _Motion:
    """All recordings, one after the other, at instants that are the same time apart in each."""

    q: Float64
    """float64[N, J] (rad, m)."""
    qd: Float64
    """float64[N, J] (rad/s, m/s)."""
    qdd: Float64
    """float64[N, J] (rad/s^2, m/s^2)."""
    given: Float64
    """float64[N, J], what the drives would have given (N m, N)."""
    missing: Float64
    """float64[N, J], what the motion takes beyond that (N m, N)."""
    is_first: NDArray[np.bool_]
    """bool[N], whether a recording begins there."""


def ripples_of(
    nominal: Rollouts, recordings: Sequence[Trajectory]
) -> tuple[tuple[float, ...], ...]:
    """Return for each joint the strongest ripples in its travel, in cycles per radian (per metre).

    A joint that stood still has none.
    """
    motion = _moved(nominal, recordings)
    return tuple(_strongest(motion, joint) for joint in range(motion.q.shape[1]))


def _moved(nominal: Rollouts, recordings: Sequence[Trajectory]) -> _Motion:
    plant, model = nominal.plant, nominal.model
    motions = [motion_of(each) for each in recordings]
    every = max(1, sum(len(each.at) for each in motions) // _INSTANTS)
    parts: list[tuple[np.ndarray, ...]] = []
    for recording, motion in zip(recordings, motions, strict=True):
        command = Signal(recording.command_at, recording.command).later(plant.command.delay)
        command = filtered(command, plant.command.filter, recording.duration)
        q, qd, qdd = motion.q[::every], motion.qd[::every], motion.qdd[::every]
        held = command.held(motion.at[::every])
        given = given_torques(plant, model, q, qd, held)
        missing = inverse_dynamics(plant, model, q, qd, qdd) - given
        parts.append((q, qd, qdd, given, missing, np.arange(len(q)) == 0))
    return _Motion(*(np.concatenate(each) for each in zip(*parts, strict=True)))


def _strongest(motion: _Motion, joint: int) -> tuple[float, ...]:
    q, qd, torque = motion.q[:, joint], motion.qd[:, joint], motion.missing[:, joint]
    travel = float(np.ptp(q))
    speed = float(np.std(qd))
    if travel <= 0.0 or speed <= 0.0:
        return ()
    off = (q - q.mean()) / travel
    ways = (off, off**2, off**3, np.tanh(qd / (0.1 * speed)), qd, np.abs(qd), motion.qdd[:, joint])
    own = np.stack([np.ones_like(q), *ways], axis=1)
    found = lines(own, torque, off, np.asarray, ())
    if len(found) > 1:  # none of them is clear
        given = motion.given[:, [joint]]
        postures = np.sin(motion.q), np.cos(motion.q)
        others = np.concatenate([own, given, motion.qd, motion.qdd, *postures], axis=1)
        left = without(basis_of(others, RANK), torque[:, None])[:, 0]
        found += lines(others, torque, off, whitening(left, motion.is_first), found)
    return tuple(count / travel for count in found)


def lines(
    rest: Float64, signal: Float64, off: Float64, white: Callable[[Float64], Float64],
    known: Sequence[float], clear: float = 0.0, ways: Sequence[Float64] = (),
) -> list[float]:  # fmt: skip
    """Return the strongest few ripples in the travel that are not known, the strongest first.

    Args:
        rest: float64[N, K], what else a signal may be a sum of.
        signal: float64[N], a torque, or what follows from it.
        off: float64[N], places in the travel (1).
        white: what both and ripples are seen through.
        known: ripples that are.
        clear: power that one must have, in mean squares of what the rest leaves.
        ways: float64[N] each, what ripples may come with beside themselves: the way the joint went.
    """
    basis = basis_of(white(rest), RANK)
    left = without(basis, white(signal[:, None]))[:, 0]
    clear *= float(np.mean(left**2))
    phases = (2.0 * np.pi * count * off for count in _COUNTS)
    plain = (np.stack([np.cos(phase), np.sin(phase)], axis=1) for phase in phases)
    waves = (
        np.concatenate([each, *(each * way[:, None] for way in ways)], axis=1) for each in plain
    )
    powers = np.array([_power(left, without(basis, white(each))) for each in waves])
    found: list[float] = []
    for index in np.argsort(-powers):
        if powers[index] < max(_BESIDE * powers.max(), clear) or len(found) == KEPT:
            break
        count = float(_COUNTS[index])
        if all(abs(count - other) > _APART for other in (*known, *found)):
            found.append(count)
    return found


def whitening(left: Float64, is_first: NDArray[np.bool_]) -> Callable[[Float64], Float64]:
    """Return what takes off a signal, float64[N, K], what the instant before says of it.

    Args:
        left: float64[N], what is to be white then.
        is_first: bool[N], where nothing came before.
    """
    before = left[:-1][~is_first[1:]]
    share = float(left[1:][~is_first[1:]] @ before) / max(float(before @ before), 1e-18)

    def white(signal: Float64) -> Float64:
        return (signal[1:] - share * signal[:-1])[~is_first[1:]]

    return white


def _power(left: Float64, waves: Float64) -> float:
    """Return how much of the power of float64[N] a few waves, float64[N, W], take off."""
    along = waves.T @ left
    return float(along @ np.linalg.pinv(waves.T @ waves) @ along)
