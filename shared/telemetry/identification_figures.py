"""The figures of `riposte identify`: how far off each stage of the model is, and where.

The same conventions as ``shared.telemetry.figures``. Every figure is a panel that is readable at
the width of a phone; a page sets them side by side where there is room.
"""

# pyright: basic
# (matplotlib's types are partial)

import warnings
from collections.abc import Mapping, Sequence

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LinearSegmentedColormap
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter, NullLocator
from numpy.typing import NDArray

from shared.telemetry.figures import COLOURS, GRID, INK, SOFT, STYLE, _svg

Floats = NDArray[np.float64]
WIDTH = 5.0
"""Of a panel (in)."""
STAGE_COLOURS = {
    "nominal": SOFT,
    "base_fit": COLOURS["antagonist"],
    "extended": COLOURS["protagonist"],
}
STAGE_NAMES = {"nominal": "nominal", "base_fit": "base fit", "extended": "extended"}
HEAT = LinearSegmentedColormap.from_list(
    "heat", [(0.95, 0.62, 0.2, 0.12), (0.93, 0.45, 0.15, 0.75), (0.72, 0.05, 0.2, 1.0)]
)
"""From next to nothing to dark red, on white and on near-black."""
LETTER = 0.025
"""Width of a mark over a lane, as a share of it."""
LONGEST_NAME = 26
MOST_POINTS = 900
"""Of a curve."""


def plain(text: str) -> str:
    """Return a name as matplotlib can write it: printable, not too long, no formulas."""
    shown = "".join(c if c.isprintable() else "\N{REPLACEMENT CHARACTER}" for c in text)
    if len(shown) > LONGEST_NAME:
        shown = shown[: LONGEST_NAME - 1] + "\N{HORIZONTAL ELLIPSIS}"
    shown = shown.replace("\\", "\N{FULLWIDTH REVERSE SOLIDUS}").replace("$", r"\$")
    return f"\N{ZERO WIDTH SPACE}{shown}" if shown.startswith("_") else shown


def panel(height: float) -> tuple[Figure, Axes]:
    """Return an empty panel (in)."""
    figure = Figure(figsize=(WIDTH, height), layout="constrained")
    return figure, figure.add_subplot()


def drawn(figure: Figure) -> str:
    """Return a figure as SVG; the browser has the letters that matplotlib lacks."""
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Glyph .* missing", category=UserWarning)
        return _svg(figure)


def residuals_by_joint(
    names: Sequence[str], stages: Mapping[str, Floats], noise: Floats, unit: str
) -> str:
    """Return root-mean-square residuals of each joint, a dot a stage, the noise floor as a tick.

    Args:
        names: of the joints.
        stages: float64[J] each, by stage.
        noise: float64[J].
        unit: of all of them.
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.36 * len(names) + 1.1)
        rows = np.arange(len(names))
        stacked = np.stack([*stages.values()])
        axes.hlines(
            rows, np.nanmin(stacked, axis=0), np.nanmax(stacked, axis=0), color=GRID, linewidth=2
        )
        axes.plot(noise, rows, "|", color=INK, markersize=13, markeredgewidth=1.6, label="noise")
        for stage, values in stages.items():
            axes.plot(
                values, rows, "o", color=STAGE_COLOURS[stage], markersize=7,
                label=STAGE_NAMES[stage],
            )  # fmt: skip
        _named_rows(axes, names)
        _log(axes, np.concatenate([stacked.ravel(), noise]))
        axes.set_xlabel(f"residual on held-out motion ({unit}, root mean square)")
        _legend(figure, 4)
        return drawn(figure)


def stages_against_noise(values: Mapping[str, float], floor: str = "the noise floor") -> str:
    """Return how many times the floor each stage is off: a bar a stage, the floor at 1.

    Args:
        values: by stage.
        floor: what 1 is.
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(2.3)
        rows = range(len(values))
        names = [STAGE_NAMES[stage] for stage in values]
        numbers = np.array([*values.values()])
        colours = [STAGE_COLOURS[stage] for stage in values]
        lengths = np.where(np.isfinite(numbers), numbers, 0.0)
        axes.barh(rows, lengths, color=colours, height=0.62, alpha=0.9)
        for row, value in zip(rows, numbers.tolist(), strict=True):
            is_finite = bool(np.isfinite(value))
            axes.annotate(
                f"{value:,.3g}" if is_finite else "diverged", (value if is_finite else 0.0, row),
                xytext=(7, 0), textcoords="offset points", va="center", color=INK, fontsize=12,
                fontweight="bold",
            )  # fmt: skip
        axes.axvline(1.0, color=INK, linewidth=1.2, linestyle=(0, (3, 2)))
        axes.annotate(
            floor.removeprefix("the "), (1.0, -0.62), xytext=(4, 0), textcoords="offset points",
            color=SOFT, fontsize=9, va="bottom",
        )  # fmt: skip
        _named_rows(axes, names)
        axes.set_ylim(len(values) - 0.45, -0.75)
        axes.set_xlim(0.0, 1.18 * max(1.0, float(lengths.max())))
        axes.grid(visible=False, axis="y")
        axes.set_xlabel(f"held-out residual; 1 is {floor}")
        return drawn(figure)


def before_and_after(names: Sequence[str], before: Floats, after: Floats, x_label: str) -> str:
    """Return a number of each channel under the base fit and under the extended model."""
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.34 * len(names) + 1.1)
        rows = np.arange(len(names))
        axes.axvline(0.0, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.hlines(rows, np.minimum(before, after), np.maximum(before, after), color=GRID,
                    linewidth=2)  # fmt: skip
        for stage, values in (("base_fit", before), ("extended", after)):
            axes.plot(values, rows, "o", color=STAGE_COLOURS[stage], markersize=7,
                      label=STAGE_NAMES[stage])  # fmt: skip
        _named_rows(axes, names)
        axes.xaxis.set_major_locator(MaxNLocator(5))
        axes.set_xlabel(x_label)
        _legend(figure, 2)
        return drawn(figure)


def motion(at: Floats, measured: Floats, predicted: Mapping[str, Floats], y_label: str) -> str:
    """Return a measured motion and what each stage predicts.

    Args:
        at: float64[T] (s).
        measured: float64[T].
        predicted: float64[T] each, by stage.
        y_label: with the unit.
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(2.7)
        step = _step(at)
        axes.plot(at[::step], measured[::step], color=INK, linewidth=2.6, alpha=0.55,
                  label="measured")  # fmt: skip
        for stage, values in predicted.items():
            axes.plot(
                at[::step], values[::step], color=STAGE_COLOURS[stage], linewidth=1.2,
                label=STAGE_NAMES[stage], linestyle=(0, (4, 2)) if stage == "nominal" else "-",
            )  # fmt: skip
        _time_axis(axes, at)
        axes.set_ylabel(y_label)
        axes.yaxis.set_major_locator(MaxNLocator(5))
        _legend(figure, 4)
        return drawn(figure)


def residual_over_time(
    at: Floats, residuals: Mapping[str, Floats], noise: float | None, y_label: str,
    *, is_distance: bool = False,
) -> str:  # fmt: skip
    """Return what each stage leaves over, the noise floor as a band of two standard deviations.

    Args:
        at: float64[T] (s).
        residuals: float64[T] each, by stage.
        noise: root mean square, of the same unit; None: not drawn.
        y_label: with the unit.
        is_distance: whether none can be below 0.
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(2.7)
        if noise is not None:
            low = 0.0 if is_distance else -2 * noise
            axes.axhspan(low, 2 * noise, color=SOFT, alpha=0.18, linewidth=0, label="noise")
        axes.axhline(0.0, color=SOFT, linewidth=0.7)
        step = _step(at)
        for stage, values in residuals.items():
            axes.plot(
                at[::step], values[::step], color=STAGE_COLOURS[stage], linewidth=1.1,
                label=STAGE_NAMES[stage], alpha=0.75 if stage == "nominal" else 1.0,
            )  # fmt: skip
        _time_axis(axes, at)
        axes.set_ylabel(y_label)
        axes.yaxis.set_major_locator(MaxNLocator(5))
        _legend(figure, 4)
        return drawn(figure)


def timeline(
    lanes: Sequence[tuple[str, Floats, Floats]],
    spans: Sequence[tuple[int, float, float, str]],
    floor: str = "the noise floor",
) -> str:
    """Return a lane a trajectory, dark where much is left over, with what was located marked.

    Args:
        lanes: name, float64[B + 1] edges (s), float64[B] residual in units of the floor.
        spans: lane, begin, end (s), and a mark.
        floor: what a residual of 1 is.
    """
    with mpl.rc_context(STYLE):
        figure, axes = panel(0.5 * len(lanes) + 1.25)
        picture = None
        for row, (_, edges, values) in enumerate(lanes):
            picture = axes.pcolormesh(
                edges, [row - 0.28, row + 0.28], np.log10(np.maximum(values, 0.3))[None],
                cmap=HEAT, vmin=0.0, vmax=1.3, rasterized=False, linewidth=0,
            )  # fmt: skip
        for row, begin, end, _ in spans:
            axes.plot([begin, end], [row + 0.38] * 2, color=INK, linewidth=2.4,
                      solid_capstyle="butt")  # fmt: skip
        longest = max((float(edges[-1]) for _, edges, _ in lanes), default=0.0)
        for row, at, mark in _apart(spans, LETTER * longest):
            axes.text(at, row - 0.31, mark, color=INK, fontsize=9, ha="center", va="bottom",
                      fontweight="bold")  # fmt: skip
        _named_rows(axes, [name for name, _, _ in lanes])
        axes.set_ylim(len(lanes) - 0.45, -0.75)
        axes.set_xlabel("time (s)")
        axes.grid(visible=False)
        if picture is not None:
            bar = figure.colorbar(picture, ax=axes, location="bottom", shrink=0.8, aspect=40)
            bar.set_ticks([0.0, np.log10(3.0), 1.0, np.log10(20.0)], labels=["1", "3", "10", "20"])
            bar.set_label(f"left by the extended model; 1 is {floor}")
            bar.outline.set_visible(False)
        return drawn(figure)


def _apart(
    spans: Sequence[tuple[int, float, float, str]], least: float
) -> list[tuple[int, float, str]]:
    """Return lane, place (s) and mark of each span: over its middle, or right of one that is."""
    found: list[tuple[int, float, str]] = []
    for lane, begin, end, mark in sorted(spans, key=lambda each: (each[0], each[1] + each[2])):
        at = 0.5 * (begin + end)
        if found and found[-1][0] == lane:
            at = max(at, found[-1][1] + least)
        found.append((lane, at, mark))
    return found


def _named_rows(axes: Axes, names: Sequence[str]) -> None:
    shown = ["\n".join(plain(line) for line in name.split("\n")) for name in names]
    axes.set_yticks(range(len(names)), shown)
    axes.tick_params(axis="y", labelcolor=INK)
    axes.set_ylim(len(names) - 0.5, -0.5)
    axes.spines["left"].set_visible(False)
    axes.grid(visible=False, axis="y")


def _log(axes: Axes, values: Floats) -> None:
    good = values[np.isfinite(values) & (values > 0.0)]
    axes.set_xscale("log")
    if len(good):
        axes.set_xlim(good.min() / 1.6, good.max() * 1.6)
    decades = np.log10(good.max() / good.min()) if len(good) else 1.0
    subs = (1.0, 2.0, 5.0) if decades < 1.7 else (1.0, 3.0) if decades < 2.6 else (1.0,)
    axes.xaxis.set_major_locator(LogLocator(subs=subs, numticks=12))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    axes.xaxis.set_minor_locator(NullLocator())
    axes.xaxis.set_minor_formatter(NullFormatter())


def _legend(figure: Figure, columns: int) -> None:
    if not figure.axes[0].get_legend_handles_labels()[1]:
        return
    figure.legend(
        loc="outside upper left", ncols=columns, handlelength=1.4, columnspacing=1.2,
        borderpad=0.1, fontsize=9.5,
    )  # fmt: skip


def _time_axis(axes: Axes, at: Floats) -> None:
    axes.set_xlabel("time (s)")
    axes.xaxis.set_major_locator(MaxNLocator(6))
    if len(at) > 1:
        axes.set_xlim(float(at[0]), float(at[-1]))


def _step(at: Floats) -> int:
    return max(1, -(-len(at) // MOST_POINTS))
