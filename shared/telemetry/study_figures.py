"""The figures of a study with people: scores, learning, answers, heart rates, ranks.

The same conventions as ``shared.telemetry.figures``: SVG text, the same for the same data, that
follows the light or dark scheme of the page it is put into.
"""

# pyright: basic
# (matplotlib's types are partial)

import dataclasses
from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from shared.telemetry.figures import INK, SOFT, STYLE, _svg

Floats = NDArray[np.float64]
COLOURS = ("#3576c4", "#d9532c", "#2a8f6d", "#8257b5", "#c2711c", "#8b95a3")
"""Of conditions, in their order; readable on white and on near-black."""
AGREEMENT = ("#c0563b", "#e3a58f", "#a9b1bb", "#8fb4dd", "#3576c4")
"""From strongly disagree to strongly agree."""
MOST_COLUMNS = 4
NORMAL_95 = 1.96


@dataclasses.dataclass(frozen=True)
class ScorePanel:
    """Mean scores of one condition's games."""

    title: str
    games: Sequence[float]
    means: Sequence[float]
    errors: Sequence[float]
    """Standard errors of the means."""
    counts: Sequence[int]
    """People."""
    best: float
    """Best mean over the games that a person reached; NaN without any."""


@dataclasses.dataclass(frozen=True)
class LinePanel:
    """All games of one condition."""

    title: str
    games: Sequence[float]
    scores: Floats
    """float64[n, G]; NaN where a game is missing."""


@dataclasses.dataclass(frozen=True)
class ScatterPanel:
    """One dot a person."""

    title: str
    x: Floats
    y: Floats
    x_label: str
    y_label: str


@dataclasses.dataclass(frozen=True)
class RankPanel:
    """Mean ranks of conditions or sections."""

    title: str
    names: Sequence[str]
    means: Sequence[float]
    errors: Sequence[float]
    most: int
    """Largest rank there is."""


@dataclasses.dataclass(frozen=True)
class RatioBar:
    """A ratio with its interval."""

    name: str
    value: float
    low: float
    high: float


def score_panels(panels: Sequence[ScorePanel]) -> str:
    """Return the paper's figure of scores: mean and standard error of each game by condition."""
    with mpl.rc_context(STYLE):
        figure, grid = _grid(len(panels), 2.9)
        for k, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
            axes.errorbar(
                panel.games, panel.means, yerr=panel.errors, color=_colour(k), marker="o",
                markersize=4.5, linewidth=1.6, capsize=2.5, elinewidth=1.1,
            )  # fmt: skip
            if np.isfinite(panel.best):
                axes.axhline(panel.best, color=SOFT, linewidth=1.1, linestyle=(0, (5, 3)))
                axes.annotate(
                    f"best mean {panel.best:.0f}", (0.99, panel.best),
                    xycoords=("axes fraction", "data"), xytext=(0, 3), textcoords="offset points",
                    ha="right", fontsize=8.5, color=SOFT,
                )  # fmt: skip
            axes.set_title(panel.title)
            axes.set_xlabel("game")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
            axes.margins(y=0.15)
        _same_heights(grid)
        grid[0].set_ylabel("mean score")
        return _svg(figure)


def learning_panels(panels: Sequence[LinePanel]) -> str:
    """Return every game of everybody, each person's line, and the one through all games."""
    with mpl.rc_context(STYLE):
        figure, grid = _grid(len(panels), 3.3)
        for k, (axes, panel) in enumerate(zip(grid, panels, strict=True)):
            colour, x = _colour(k), np.asarray(panel.games)
            for row in panel.scores:
                there = np.isfinite(row)
                if there.sum() > 2:
                    fit = np.polyfit(x[there], row[there], 1)
                    axes.plot(x, np.polyval(fit, x), color=colour, linewidth=0.7, alpha=0.4)
            there = np.isfinite(panel.scores)
            games, scores = np.broadcast_to(x, panel.scores.shape)[there], panel.scores[there]
            axes.plot(games, scores, "o", color=colour, markersize=2.6, alpha=0.45, mew=0)
            line, band = _line(games, scores, x)
            axes.fill_between(x, line - band, line + band, color=INK, alpha=0.10, linewidth=0)
            axes.plot(x, line, color=INK, linewidth=2.0)
            slope = (line[-1] - line[0]) / (x[-1] - x[0])
            rise = f"{slope:+.1f}".replace("-", "\N{MINUS SIGN}")
            axes.set_title(f"{panel.title}: {rise} a game")
            axes.set_xlabel("game")
            axes.xaxis.set_major_locator(MaxNLocator(integer=True))
        _same_heights(grid)
        grid[0].set_ylabel("score")
        return _svg(figure)


def answer_bars(bars: Sequence[tuple[str, Sequence[float]]], options: Sequence[str]) -> str:
    """Return diverging bars of answers on a scale, the middle one split around zero.

    Args:
        bars: name and percentages of each.
        options: of the scale, from least to most.
    """
    points = len(options)
    colours = AGREEMENT if points == 5 else _ramp(points)
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 0.34 * len(bars) + 1.3), layout="constrained")
        axes = figure.add_subplot()
        for row, (_, shares) in enumerate(bars):
            left = -sum(shares[: points // 2]) - (shares[points // 2] / 2 if points % 2 else 0.0)
            for k, share in enumerate(shares):
                axes.barh(row, share, left=left, height=0.72, color=colours[k], linewidth=0,
                          label=options[k] if row == 0 else None)  # fmt: skip
                if share >= 6.0:
                    ink = "#ffffff" if k in (0, points - 1) else "#1c2128"
                    axes.text(left + share / 2, row, f"{share:.3g}", ha="center", va="center",
                              fontsize=8.5, color=ink)  # fmt: skip
                left += share
        axes.axvline(0.0, color=SOFT, linewidth=0.8)
        axes.set_yticks(range(len(bars)), [name for name, _ in bars])
        axes.invert_yaxis()
        axes.set_xlim(-105, 105)
        axes.set_xticks([-100, -50, 0, 50, 100], ["100 %", "50 %", "0", "50 %", "100 %"])
        axes.grid(visible=False, axis="y")
        axes.spines["left"].set_visible(False)
        figure.legend(loc="outside upper center", ncols=min(points, 5), fontsize=9)
        return _svg(figure)


def heart_panel(sections: Sequence[Floats], edges: Sequence[float]) -> str:
    """Return the ratio of peak to walking heart rate of every game, by section.

    Args:
        sections: of each, the ratios of all games.
        edges: limits of the levels.
    """
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 3.4), layout="constrained")
        axes = figure.add_subplot()
        for edge in edges:
            axes.axhline(100 * edge, color=SOFT, linewidth=0.9, linestyle=(0, (4, 3)))
        for k, values in enumerate(sections):
            if not len(values):
                continue
            # spread by rank within a few percent, so that dots do not hide each other
            spread = (np.argsort(np.argsort(values, kind="stable")) * 0.61803) % 1.0
            axes.plot(k + 1 + 0.5 * (spread - 0.5), 100 * values, "o", color=COLOURS[0],
                      markersize=3.6, alpha=0.5, mew=0)  # fmt: skip
            axes.hlines(100 * np.median(values), k + 0.68, k + 1.32, color=INK, linewidth=2.0)
        axes.set_xticks(range(1, len(sections) + 1), [str(k + 1) for k in range(len(sections))])
        axes.set_xlabel("section, in the order played (line: median)")
        axes.set_ylabel("peak / walking (%)")
        axes.grid(visible=False, axis="x")
        return _svg(figure)


def adjective_panels(panels: Sequence[tuple[str, Sequence[float]]], options: Sequence[str]) -> str:
    """Return shares of sections described by each adjective, a panel a heart-rate level."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 0.26 * len(options) + 1.1), layout="constrained")
        grid: Any = figure.subplots(1, len(panels), sharey=True, squeeze=False)[0]
        for axes, (title, shares) in zip(grid, panels, strict=True):
            axes.barh(range(len(options)), [100 * share for share in shares], color=COLOURS[0],
                      height=0.68, alpha=0.85)  # fmt: skip
            axes.set_title(title.replace(", ", "\n", 1), fontsize=9)
            axes.set_xlim(0, 100)
            axes.set_xlabel("% of sections")
            axes.grid(visible=False, axis="y")
        grid[0].set_yticks(range(len(options)), list(options))
        grid[0].invert_yaxis()
        return _svg(figure)


def scatter_panels(panels: Sequence[ScatterPanel]) -> str:
    """Return a dot for each person, with the least-squares line."""
    with mpl.rc_context(STYLE):
        figure, grid = _grid(len(panels), 3.1)
        for axes, panel in zip(grid, panels, strict=True):
            there = np.isfinite(panel.x) & np.isfinite(panel.y)
            x, y = panel.x[there], panel.y[there]
            axes.plot(x, y, "o", color=COLOURS[0], markersize=5, alpha=0.75, mew=0)
            if len(x) > 2 and np.ptp(x) > 0.0:
                ends = np.array([x.min(), x.max()])
                axes.plot(ends, np.polyval(np.polyfit(x, y, 1), ends), color=SOFT, linewidth=1.2)
            axes.set_title(panel.title)
            axes.set_xlabel(panel.x_label)
            axes.set_ylabel(panel.y_label)
            axes.xaxis.set_major_locator(MaxNLocator(5))
        return _svg(figure)


def rank_panels(panels: Sequence[RankPanel]) -> str:
    """Return bars of mean ranks with standard errors."""
    with mpl.rc_context(STYLE):
        figure, grid = _grid(len(panels), 2.7, columns=2 if len(panels) > 1 else 1)
        for axes, panel in zip(grid, panels, strict=True):
            at = range(len(panel.names))
            axes.bar(at, panel.means, 0.62, yerr=panel.errors, color=COLOURS[0], alpha=0.8,
                     error_kw={"ecolor": INK, "elinewidth": 1.1, "capsize": 2.5})  # fmt: skip
            axes.set_xticks(at, list(panel.names))
            axes.set_ylim(0.8, panel.most)
            axes.yaxis.set_major_locator(MaxNLocator(integer=True))
            axes.set_title(panel.title)
            axes.set_ylabel("mean rank")
            axes.grid(visible=False, axis="x")
        return _svg(figure)


def ratio_bars(bars: Sequence[RatioBar]) -> str:
    """Return ratios with their intervals on a logarithmic axis; 1 is marked."""
    with mpl.rc_context(STYLE):
        figure = Figure(figsize=(10, 0.34 * len(bars) + 0.9), layout="constrained")
        axes = figure.add_subplot()
        for row, bar in enumerate(bars):
            axes.hlines(row, bar.low, bar.high, color=COLOURS[0], linewidth=2.2, alpha=0.7)
            axes.plot([bar.value], [row], "o", color=COLOURS[0], markersize=6)
        axes.axvline(1.0, color=SOFT, linewidth=1.0)
        axes.set_xscale("log")
        axes.set_yticks(range(len(bars)), [bar.name for bar in bars])
        axes.invert_yaxis()
        axes.xaxis.set_major_formatter(lambda value, _: f"{value:g}")
        axes.xaxis.set_minor_formatter(lambda value, _: "")
        axes.set_xlabel("variance of the best / variance of the worst")
        axes.grid(visible=False, axis="y")
        return _svg(figure)


def _grid(count: int, height: float, columns: int = MOST_COLUMNS) -> tuple[Figure, list[Any]]:
    columns = max(1, min(columns, count))
    rows = -(-count // columns)
    width = min(10.0, 5.0 * columns) if count > 1 else 6.5
    figure = Figure(figsize=(width, height * rows), layout="constrained")
    return figure, [figure.add_subplot(rows, columns, k + 1) for k in range(count)]


def _same_heights(grid: Sequence[Any]) -> None:
    low = min(axes.get_ylim()[0] for axes in grid)
    high = max(axes.get_ylim()[1] for axes in grid)
    for axes in grid:
        axes.set_ylim(low, high)


def _line(x: Floats, y: Floats, at: Floats) -> tuple[Floats, Floats]:
    """Return the least-squares line at places, and the half width of its 95 % band."""
    slope, start = np.polyfit(x, y, 1)
    spread = float(((x - x.mean()) ** 2).sum())
    noise = float(((y - start - slope * x) ** 2).sum()) / max(len(x) - 2, 1)
    error = np.sqrt(noise * (1.0 / len(x) + (at - x.mean()) ** 2 / spread))
    return start + slope * at, NORMAL_95 * error


def _colour(k: int) -> str:
    return COLOURS[k % len(COLOURS)]


def _ramp(points: int) -> list[str]:
    """Return so many colours from disagreement to agreement."""
    anchors = np.array([[int(c[i : i + 2], 16) for i in (1, 3, 5)] for c in AGREEMENT], np.float64)
    at = np.linspace(0.0, len(anchors) - 1.0, points)
    mixed = [np.interp(at, range(len(anchors)), anchors[:, k]) for k in range(3)]
    return [f"#{int(r):02x}{int(g):02x}{int(b):02x}" for r, g, b in zip(*mixed, strict=True)]
