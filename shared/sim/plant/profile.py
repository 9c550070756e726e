"""Set points that ramp towards a command: what the firmware of many a servo makes of a step."""

from collections.abc import Callable

import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.signals import Signal, held_spans, instants


def ramped(
    signal: Signal, acceleration: float, period: float, begin: float, until: float
) -> Signal:
    """Return set points that go to each command in the shortest time and stop there.

    Ramps of limited acceleration, planned anew from where the set point is, and as fast as it is,
    whenever a command comes: what manuals of servos call a profile acceleration.

    Args:
        signal: float64[C, J] commands.
        acceleration: the most, either way (rad/s^2, m/s^2).
        period: of the result (s).
        begin: where the set point rests at its command, or at the first one if that is later (s).
        until: when the result may end (s).
    """
    speed = np.zeros(signal.values.shape[1])

    def go(place: Float64, target: Float64, times: Float64) -> Float64:
        nonlocal speed
        found, speed = _ramp(place, speed, target, acceleration, times)
        return found

    return _followed(signal, go, period, begin, until)


def slewed(signal: Signal, speed: float, period: float, begin: float, until: float) -> Signal:
    """Return set points that go to each command at a speed, and no faster.

    Args:
        signal: float64[C, J] commands.
        speed: the most, either way (rad/s, m/s): what manuals of servos call a profile velocity.
        period: of the result (s).
        begin: where the set point rests at its command, or at the first one if that is later (s).
        until: when the result may end (s).
    """

    def go(place: Float64, target: Float64, times: Float64) -> Float64:
        most = speed * times[:, None]
        return place + np.clip(target - place, -most, most)

    return _followed(signal, go, period, begin, until)


_Way = Callable[[Float64, Float64, Float64], Float64]
"""From float64[J] to a target float64[J]: returns float64[K, J], where it is after times (s)."""


def _followed(signal: Signal, go: _Way, period: float, begin: float, until: float) -> Signal:
    """Return where a set point is in the middle of each period, which goes on from way to way."""
    at = instants(signal, period, begin, until)
    targets = signal.held(at)
    out = np.empty_like(targets)
    place = targets[0]
    for here, end in held_spans(targets):
        middles: Float64 = period * (0.5 + np.arange(end - here, dtype=np.float64))
        found = go(place, targets[here], np.r_[middles, period * (end - here)])
        out[here:end], place = found[:-1], found[-1]
    before = signal.at[:1] < at[0]  # who counts from the first command still can
    values = np.concatenate([signal.values[:1][before], out])
    return Signal(np.r_[signal.at[:1][before], at], values)


def _ramp(
    place: Float64, speed: Float64, target: Float64, acceleration: float, times: Float64
) -> tuple[Float64, Float64]:
    """Return float64[K, J], where a ramp is at times, and float64[J], its speed at the last one."""
    stops = place + 0.5 * speed * np.abs(speed) / acceleration
    way = np.where(target >= stops, 1.0, -1.0)
    first = way * speed
    highest = np.sqrt(np.maximum(acceleration * way * (target - place) + 0.5 * first**2, 0.0))
    rises = (highest - first) / acceleration
    falls = highest / acceleration
    up = np.minimum(times[:, None], rises)
    down = np.clip(times[:, None] - rises, 0.0, falls)
    gone = first * up + 0.5 * acceleration * up**2 + highest * down - 0.5 * acceleration * down**2
    last = first + acceleration * (up[-1] - down[-1])
    return place + way * gone, way * last
