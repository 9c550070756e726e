"""How a residual looks: over speed, direction, position, effort, time; lag; spectrum; which side.

Pure description of arrays: nothing is decided here. Residual is always measured minus predicted.
"""

from collections.abc import Sequence

import numpy as np

from shared.identification.conclusion.evidence import Diagnostics, Profile, Replay
from shared.identification.conclusion.sides import Floors, sides_of
from shared.identification.dataset.types import Float64

BINS = 16
LEAST_IN_BIN = 8
"""Readings below which a bin says nothing."""
SLOW = 0.02
"""Share of a joint's top speed below which it has no direction."""
BANDS_HZ = (0.1, 0.3, 0.6, 1.0, 2.0, 3.0, 5.0, 8.0, 13.0, 20.0, 32.0, 50.0)
"""Edges of the spectrum's bands."""
LONGEST_LAG = 0.2
"""Beyond which no lag is looked for (s)."""
_COARSE = 0.02
"""Step of the shifts that are tried (s)."""
_STEPS = 3
LEAST_LAGGED = 0.02
"""A joint whose speed has a smaller standard deviation (rad/s, m/s) shows no lag."""


def diagnose(
    replays: Sequence[Replay],
    joints: Sequence[str],
    units: Sequence[str],
    floors: Floors | None = None,
) -> Diagnostics:
    """Return how the residual of the base fit looks over all trajectories together.

    Args:
        replays: at least one.
        joints: names, in the order of every array.
        units: of each joint, ``rad`` or ``m``.
        floors: the noise; without it nothing is said about sides.
    """
    residual = np.concatenate([each.q - each.predicted["base_fit"] for each in replays])
    velocity = np.concatenate([_velocity(each) for each in replays])
    position = np.concatenate([each.q for each in replays])
    elapsed = np.concatenate([each.at - each.at[0] + each.begins for each in replays])
    unit = units[0] if len(set(units)) == 1 else "rad, m"
    profiles = [
        _profile("velocity", f"{unit}/s", velocity, residual),
        _profile("position", unit, position, residual),
    ]
    efforts = [each.effort for each in replays if each.effort is not None]
    if len(efforts) == len(replays):
        name = "N m" if unit == "rad" else "N m, N"
        profiles.append(_profile("effort", name, np.concatenate(efforts), residual))
    profiles.append(
        _profile("time", "s", np.repeat(elapsed[:, None], residual.shape[1], axis=1), residual)
    )
    slow = SLOW * np.nanquantile(np.abs(velocity), 0.98, axis=0)
    frequency, spectrum = _spectrum(replays)
    return Diagnostics(
        profiles=tuple(profiles),
        forward=_mean_where(residual, velocity > slow),
        backward=_mean_where(residual, velocity < -slow),
        lag=_lags(replays, joints),
        frequency=frequency,
        spectrum=spectrum,
        sides=None if floors is None else sides_of(replays, floors),
    )


def _velocity(replay: Replay) -> Float64:
    """Return float64[T, J], the measured velocity over some 40 ms (rad/s, m/s)."""
    rows = len(replay.at)
    reach = max(1, round(0.02 / float(np.median(np.diff(replay.at)))))
    after = np.minimum(np.arange(rows) + reach, rows - 1)
    before = np.maximum(np.arange(rows) - reach, 0)
    way: Float64 = replay.q[after] - replay.q[before]
    return way / (replay.at[after] - replay.at[before])[:, None]


def _profile(over: str, unit: str, x: Float64, residual: Float64) -> Profile:
    joints = residual.shape[1]
    centres, mean, rms = (np.full((joints, BINS), np.nan) for _ in range(3))
    for joint in range(joints):
        is_known = np.isfinite(x[:, joint]) & np.isfinite(residual[:, joint])
        values, left = x[is_known, joint], residual[is_known, joint]
        if not len(values):
            continue
        low, high = np.quantile(values, [0.005, 0.995])
        if high - low < 1e-9:
            low, high = low - 0.5, high + 0.5
        edges: Float64 = np.linspace(float(low), float(high), BINS + 1, dtype=np.float64)
        centres[joint] = (edges[1:] + edges[:-1]) / 2
        place = np.clip(np.searchsorted(edges, values, "right") - 1, 0, BINS - 1)
        count = np.bincount(place, minlength=BINS)
        is_full = count >= LEAST_IN_BIN
        total = np.bincount(place, left, BINS)
        square = np.bincount(place, left**2, BINS)
        mean[joint, is_full] = total[is_full] / count[is_full]
        rms[joint, is_full] = np.sqrt(square[is_full] / count[is_full])
    return Profile(over, unit, centres, mean, rms)


def _mean_where(residual: Float64, where: np.ndarray) -> Float64:
    """Return float64[J], means over the rows picked for each joint; 0 where there are none."""
    where = where & np.isfinite(residual)
    count = np.maximum(where.sum(axis=0), 1)
    return np.where(where, residual, 0.0).sum(axis=0) / count


def _lags(replays: Sequence[Replay], joints: Sequence[str]) -> dict[str, float]:
    """Return the lag of each joint that moves, and of the tracker."""
    lags: dict[str, float] = {}
    for index, joint in enumerate(joints):
        pairs = [(e.at, e.q[:, index], e.predicted["base_fit"][:, index]) for e in replays]
        if (lag := _lag(pairs)) is not None:
            lags[joint] = lag
    axes = [
        (e.tracker_at, e.tracker[:, axis], e.tracked["base_fit"][:, axis])
        for e in replays
        if e.tracker_at is not None and e.tracker is not None and "base_fit" in e.tracked
        for axis in range(3)
    ]
    if (lag := _lag(axes)) is not None:
        lags["tracker"] = lag
    return lags


def _lag(pairs: Sequence[tuple[Float64, Float64, Float64]]) -> float | None:
    """Return by how long measured signals are behind predicted ones (s).

    First the shift of least squares on a coarse grid, then Gauss-Newton steps from there: what a
    signal that is late by a short time more leaves is minus that time its rate,
    r = -lag dq/dt, with a constant offset a signal left free.
    """
    known = [
        (at[is_known], measured[is_known], predicted[is_known])
        for at, measured, predicted in pairs
        if (is_known := np.isfinite(measured - predicted)).sum() >= 10
    ]
    if not any(float(np.std(np.gradient(each[2], each[0]))) > LEAST_LAGGED for each in known):
        return None
    coarse: Float64 = np.arange(-LONGEST_LAG, LONGEST_LAG + 1e-9, _COARSE, dtype=np.float64)
    misfits = [
        sum(
            float(np.sum(_against(shift, each)[0] ** 2))
            for each in known
            if each[0][-1] - each[0][0] > 3.0 * LONGEST_LAG
        )
        for shift in coarse
    ]
    lag = float(coarse[int(np.argmin(misfits))]) if any(misfits) else 0.0
    for _ in range(_STEPS):
        upper = lower = 0.0
        for each in known:
            left, rate = _against(lag, each)
            upper -= float((left * rate).sum())
            lower += float((rate**2).sum())
        if lower == 0.0:
            return None
        lag = float(np.clip(lag + upper / lower, -LONGEST_LAG, LONGEST_LAG))
    return lag


def _against(shift: float, pair: tuple[Float64, Float64, Float64]) -> tuple[Float64, Float64]:
    """Return what a shifted prediction leaves, and its rate, both without their means.

    Only of instants that every shift has, so that all are compared on the same ones.
    """
    at, measured, predicted = pair
    margin = min(LONGEST_LAG, 0.1 * float(at[-1] - at[0]))
    inside = (at >= at[0] + margin) & (at <= at[-1] - margin)
    shifted = np.interp(at[inside] - shift, at, predicted)
    left = measured[inside] - shifted
    rate = np.gradient(shifted, at[inside])
    return left - left.mean(), rate - rate.mean()


def _spectrum(replays: Sequence[Replay]) -> tuple[Float64, Float64]:
    """Return bands (Hz) and float64[J, F], root mean square of the residual in each."""
    edges: Float64 = np.array(BANDS_HZ, np.float64)
    joints = replays[0].q.shape[1]
    power = np.zeros((joints, len(edges) - 1))
    rows = 0
    for each in replays:
        residual = each.q - each.predicted["base_fit"]
        if not np.isfinite(residual).all() or len(residual) < 32:
            continue
        period = float(np.median(np.diff(each.at)))
        even: Float64 = np.arange(each.at[0], each.at[-1], period, dtype=np.float64)
        power += len(even) * _band_power(each.at, residual, even, edges)
        rows += len(even)
    centres: Float64 = np.sqrt(edges[1:] * edges[:-1])
    return centres, np.sqrt(power / max(rows, 1))


def _band_power(at: Float64, residual: Float64, even: Float64, edges: Float64) -> Float64:
    """Return float64[J, F], mean square in each band: a periodogram under a Hann window."""
    window = np.hanning(len(even))
    period = float(even[1] - even[0])
    hertz = np.fft.rfftfreq(len(even), period)
    power = np.zeros((residual.shape[1], len(edges) - 1))
    for joint in range(residual.shape[1]):
        column = np.interp(even, at, residual[:, joint])
        bins = np.abs(np.fft.rfft(window * (column - column.mean()))) ** 2
        mean_square = 2.0 * bins / (len(even) * float((window**2).sum()))  # Parseval
        place = np.searchsorted(edges, hertz, "right") - 1
        for band in range(len(edges) - 1):
            power[joint, band] = float(mean_square[place == band].sum())
    return power
