"""The figures of the diagnostics and of what else was considered in `riposte identify`."""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.ticker import FuncFormatter, MaxNLocator, NullFormatter, NullLocator

from shared.telemetry.figures import COLOURS, GRID, INK, SOFT, STYLE
from shared.telemetry.identification_figures import (
    STAGE_COLOURS,
    STAGE_NAMES,
    Floats,
    _legend,
    _log,
    _named_rows,
    drawn,
    panel,
    plain,
)

JOINT_COLOURS = ("#c2711c", "#2a8f6d", "#8257b5", "#4f7fbf")
"""Readable on white and on near-black."""
GOOD = COLOURS["protagonist"]


@dataclasses.dataclass(frozen=True)
class Line:
    """One joint's curve."""

    name: str
    x: Floats
    y: Floats
    spread: Floats | None = None
    """Standard deviation about ``y``."""


@dataclasses.dataclass(frozen=True)
class Row:
    """One candidate."""

    effect: str
    where: str
    screen: float
    """Share of the training residual (1)."""
    gain: float | None
    low: float | None
    high: float | None
    is_named: bool
    is_tied: bool


def profile(
    lines: Sequence[Line], x_label: str, y_label: str, *, is_before_and_after: bool = False
) -> str:
    """Return mean residuals over bins of something, of at most four joints.

    Args:
        lines: of joints; or of one joint under the base fit, then under the extended model.
        x_label: with the unit.
        y_label: with the unit.
        is_before_and_after: whether it is the latter.
    """
    colours = JOINT_COLOURS
    if is_before_and_after:
        colours = (STAGE_COLOURS["base_fit"], STAGE_COLOURS["extended"])
    with mpl.rc_context(STYLE):
        figure, axes = panel(2.5)
        axes.axhline(0.0, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        for line, colour in zip(lines, colours, strict=False):
            if line.spread is not None:
                axes.fill_between(
                    line.x, line.y - line.spread, line.y + line.spread, color=colour, alpha=0.10,
                    linewidth=0,
                )  # fmt: skip
            axes.plot(line.x, line.y, color=colour, linewidth=1.6, marker=".", markersize=4,
                      label=plain(line.name))  # fmt: skip
        axes.set_xlabel(x_label)
        axes.set_ylabel(y_label)
        axes.xaxis.set_major_locator(MaxNLocator(6))
        axes.yaxis.set_major_locator(MaxNLocator(5))
        _legend(figure, 2 if len(lines) > 2 else len(lines))
        return drawn(figure)


def spectrum(lines: Sequence[Line], y_label: str) -> str:
    """Return residuals by band, both axes logarithmic."""
    with mpl.rc_context(STYLE):
        figure, axes = panel(2.5)
        for line, colour in zip(lines, JOINT_COLOURS, strict=False):
            is_there = line.y > 0.0
            if is_there.any():
                axes.plot(line.x[is_there], line.y[is_there], color=colour, linewidth=1.6,
                          marker="o", markersize=3.5, label=plain(line.name))  # fmt: skip
        axes.set_yscale("log")
        axes.yaxis.set_minor_locator(NullLocator())
        axes.yaxis.set_minor_formatter(NullFormatter())
        axes.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
        _log(axes, np.concatenate([line.x for line in lines]))
        axes.set_xlabel("frequency (Hz)")
        axes.set_ylabel(y_label)
        _legend(figure, 2 if len(lines) > 2 else len(lines))
        return drawn(figure)


def directions(names: Sequence[str], forward: Floats, backward: Floats, unit: str) -> str:
    """Return the mean residual of each joint while it goes up and while it goes down."""
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.34 * len(names) + 1.1)
        rows = np.arange(len(names))
        axes.axvline(0.0, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.hlines(rows, np.minimum(forward, backward), np.maximum(forward, backward),
                    color=GRID, linewidth=2)  # fmt: skip
        axes.plot(forward, rows, ">", color=COLOURS["protagonist"], markersize=7, label="going up")
        axes.plot(backward, rows, "<", color=COLOURS["antagonist"], markersize=7,
                  label="going down")  # fmt: skip
        _named_rows(axes, names)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel(f"mean residual ({unit})")
        _legend(figure, 2)
        return drawn(figure)


def lags(values: Mapping[str, float]) -> str:
    """Return by how much each channel is late: values (ms), negative where it is early."""
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.34 * len(values) + 0.9)
        rows = range(len(values))
        numbers = np.array([*values.values()])
        axes.barh(rows, numbers, color=COLOURS["antagonist"], height=0.5, alpha=0.9)
        axes.axvline(0.0, color=SOFT, linewidth=0.8)
        _named_rows(axes, [*values])
        reach = max(1.0, float(np.abs(numbers).max(initial=0.0)))
        low = min(0.0, float(numbers.min(initial=0.0)))
        axes.set_xlim(1.25 * low - 0.05 * reach, 1.25 * max(0.05 * reach, float(numbers.max())))
        for row, value in zip(rows, numbers.tolist(), strict=True):
            axes.annotate(
                f"{value:z.1f}".replace("-", "\N{MINUS SIGN}"), (value, row),
                xytext=(5 if value >= 0 else -5, 0), textcoords="offset points", va="center",
                ha="left" if value >= 0 else "right", color=INK, fontsize=9,
            )  # fmt: skip
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel("measured motion behind predicted (ms)")
        return drawn(figure)


def candidates(rows: Sequence[Row]) -> str:
    """Return what each candidate takes off the held-out loss, with its interval.

    Candidates that were not refitted have only a share of the training residual.
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.42 * len(rows) + 0.7)
        refitted = [row for row in rows if row.gain is not None]
        axes.axvline(0.0, color=SOFT, linewidth=0.9, linestyle=(0, (4, 3)))
        for place, row in enumerate(rows):
            colour = GOOD if row.is_named else COLOURS["antagonist"] if row.is_tied else SOFT
            if row.gain is None:
                axes.annotate(
                    "not refitted", (0.0, place), xytext=(7, 0), textcoords="offset points",
                    color=SOFT, fontsize=8.5, va="center",
                )  # fmt: skip
                continue
            if row.low is not None and row.high is not None:
                axes.hlines(place, row.low, row.high, color=colour, linewidth=2.2, alpha=0.7)
            axes.plot(row.gain, place, "o", color=colour, markersize=7)
        _named_rows(
            axes, [f"{row.effect}\n{row.where}" if row.where else row.effect for row in rows]
        )
        axes.tick_params(axis="y", labelsize=9)
        if refitted:
            ends = [end for row in refitted for end in (row.gain, row.low, row.high) if end]
            low, high = min(0.0, *ends, 0.0), max(0.0, *ends, 0.0)
            room = 0.08 * max(high - low, 1e-9)
            axes.set_xlim(low - room, high + room)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel("taken off the held-out loss (95 %)")
        return drawn(figure)


def base_ratios(
    names: Sequence[str], base_fit: Floats, extended: Floats, low: Floats, high: Floats
) -> str:
    """Return base parameters as multiples of their nominal values, before and after the causes.

    Args:
        names: of the parameters.
        base_fit: float64[P], over nominal, fitted alone.
        extended: float64[P], fitted together with the causes.
        low: float64[P], the 95 % interval of ``extended``.
        high: float64[P].
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.30 * len(names) + 1.1)
        rows = np.arange(len(names))
        axes.axvline(1.0, color=SOFT, linewidth=0.9, linestyle=(0, (4, 3)))
        axes.hlines(rows, low, high, color=STAGE_COLOURS["extended"], linewidth=4, alpha=0.25)
        axes.hlines(rows, np.minimum(base_fit, extended), np.maximum(base_fit, extended),
                    color=GRID, linewidth=1.5)  # fmt: skip
        for stage, values in (("base_fit", base_fit), ("extended", extended)):
            axes.plot(values, rows, "o", color=STAGE_COLOURS[stage], markersize=6,
                      label=STAGE_NAMES[stage])  # fmt: skip
        _named_rows(axes, names)
        _log(axes, np.concatenate([base_fit, extended, low, high, [1.0]]))
        axes.set_xlabel("multiple of the nominal value")
        _legend(figure, 2)
        return drawn(figure)
