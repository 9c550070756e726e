"""Motions to record, as postures over time; each begins at rest, and no two are alike.

Designed to show as much as they can: sums of sines over the workspace, swings near the largest
torque, crawling with reversals, chirps, stops. ``gentle`` is what a person does with a mouse.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from shared.identification.dataset.types import Float64
from shared.sim.hidden.arms import HiddenArm

PERIOD: Final = 0.01
"""Between commands (s)."""
_LEAD: Final = 0.4
"""Motion grows from nothing within this long (s)."""

Programme = Callable[[HiddenArm, Float64, np.random.Generator], Float64]
"""Returns postures relative to rest, float64[C, J], at instants float64[C]."""


def sines(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return four sines a joint, 0.1 to 1 Hz."""
    return _limited(arm, at, _sum_of_sines(arm, at, rng, 0.1, 1.0))


def gentle(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return slow, small motion: 0.05 to 0.35 Hz, within 40 % of the reach."""
    return 0.4 * _limited(arm, at, _sum_of_sines(arm, at, rng, 0.05, 0.35))


def swings(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return one swing after the other between postures, as fast as the arm may."""
    return _visits(arm, at, rng, dwell=0.05, pace=1.0)


def holds(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return postures that are held, and quick ways between them."""
    return _visits(arm, at, rng, dwell=0.45, pace=0.8)


def crawl(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return slow motion back and forth, a twentieth of the speed, each joint in its own time."""
    out = np.empty((len(at), len(arm.rest)))
    for joint in range(len(arm.rest)):
        period, phase = rng.uniform(1.0, 1.8), rng.uniform()
        cycle = (at / period + phase) % 1.0
        triangle = 4.0 * np.abs(cycle - 0.5) - 1.0
        out[:, joint] = 0.05 * arm.speed[joint] * period / 4.0 * triangle
    return _led_in(at, out)


def chirp(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return small oscillation that goes from 0.5 to 8 Hz."""
    until = at[-1]
    shift = rng.uniform(0.0, 2.0 * np.pi, len(arm.rest))
    phase = 2.0 * np.pi * (0.5 * at + 0.5 * 7.5 * at**2 / until)
    sizes = 0.08 * arm.reach * rng.uniform(0.8, 1.2, len(arm.rest))
    return _led_in(at, sizes * np.sin(phase[:, None] + shift))


def sweep(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return a crawl, then a chirp."""
    return _in_turn(arm, at, rng, crawl, chirp)


def mixed(arm: HiddenArm, at: Float64, rng: np.random.Generator) -> Float64:
    """Return postures held, then swings."""
    return _in_turn(arm, at, rng, holds, swings)


TRAIN: Final[tuple[tuple[str, Programme], ...]] = (
    ("sines", sines), ("swings", swings), ("sweep", sweep),
)  # fmt: skip
TEST: Final[tuple[tuple[str, Programme], ...]] = (("mixed", mixed), ("sines", sines))
GENTLE: Final[tuple[tuple[str, Programme], ...]] = (("gentle", gentle),)


def _sum_of_sines(
    arm: HiddenArm, at: Float64, rng: np.random.Generator, low: float, high: float
) -> Float64:
    count, joints = 4, len(arm.rest)
    frequency = np.exp(rng.uniform(np.log(low), np.log(high), (joints, count)))
    weight = rng.uniform(0.5, 1.0, (joints, count)) / frequency**0.5
    phase = rng.uniform(0.0, 2.0 * np.pi, (joints, count))
    waves = np.sin(2.0 * np.pi * frequency * at[:, None, None] + phase)
    out = np.einsum("tjk,jk->tj", waves, weight)
    return arm.reach * out / np.abs(out).max(axis=0)


def _visits(
    arm: HiddenArm, at: Float64, rng: np.random.Generator, dwell: float, pace: float
) -> Float64:
    out = np.empty((len(at), len(arm.rest)))
    here, begin = np.zeros(len(arm.rest)), 0.15
    out[:] = here
    while begin < at[-1]:
        there = arm.reach * rng.uniform(-0.95, 0.95, len(arm.rest))
        # the speed of a minimum-jerk way is 1.875 times its mean
        length = max(0.2, float(np.max(1.875 * np.abs(there - here) / (pace * arm.speed))))
        way = _ways(at - begin, length)
        out[at >= begin] = (here + way[:, None] * (there - here))[at >= begin]
        here, begin = there, begin + length + dwell
    return out


def _in_turn(
    arm: HiddenArm, at: Float64, rng: np.random.Generator, first: Programme, second: Programme
) -> Float64:
    half = len(at) // 2
    out = np.empty((len(at), len(arm.rest)))
    out[:half] = first(arm, at[:half], rng)
    here = out[half - 1]
    length = max(0.3, float(np.max(1.875 * np.abs(here) / arm.speed)))
    wait = min(round(length / PERIOD), len(at) - half - 2)
    then = second(arm, at[: len(at) - half - wait], rng)
    out[half : half + wait] = here + _ways(at[:wait], length)[:, None] * (then[0] - here)
    out[half + wait :] = then
    return out


def _ways(at: Float64, length: float) -> Float64:
    """Return float64[C], the share of a minimum-jerk way that is behind at instants."""
    share = np.clip(at / length, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)


def _limited(arm: HiddenArm, at: Float64, out: Float64) -> Float64:
    """Return a motion within the arm's speed, grown from rest."""
    out = _led_in(at, out)
    fastest = np.abs(np.diff(out, axis=0)).max(axis=0) / PERIOD
    return out / np.maximum(1.0, fastest / arm.speed)


def _led_in(at: Float64, out: Float64) -> Float64:
    share = np.clip((at - at[0]) / _LEAD, 0.0, 1.0)
    return (share**2 * (3.0 - 2.0 * share))[:, None] * out
