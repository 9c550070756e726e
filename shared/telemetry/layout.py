"""How the Rerun page is laid out: the bout on the left, what is learned on the right."""

from typing import Any

import rerun.blueprint as rrb

from shared.telemetry import recording as paths
from shared.telemetry.scene import Scene

WINDOW_SECONDS = 25.0
"""How far back the curves of the shown bout go."""


def training_layout(scene: Scene | None) -> Any:
    """Return the blueprint of a training run; without a scene there is no 3-D view."""
    tabs = rrb.Tabs(_learning(), _league(), _services(), active_tab=0)
    side: Any = rrb.Vertical(*_bout_views(), tabs, _log(), row_shares=[1.0, 1.0, 2.7, 1.2])
    if scene is None:
        side = rrb.Vertical(tabs, _log(), row_shares=[3, 1])
    root = side if scene is None else rrb.Horizontal(_scene(scene), side, column_shares=[1.1, 1])
    return rrb.Blueprint(
        root,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=paths.WALL_TIME, play_state="following"),
        auto_views=False,
    )


def _scene(scene: Scene) -> Any:
    x, y, z = (float(value) for value in scene.target_centre)
    return rrb.Spatial3DView(
        origin=paths.SCENE,
        name="Bout",
        background=[24, 26, 31],
        line_grid=rrb.LineGrid3D(visible=True, spacing=0.5, color=[90, 94, 104, 90]),
        eye_controls=rrb.EyeControls3D(
            kind="orbital",
            position=[x + 0.3, y - 3.0, z + 0.75],
            look_target=[x, y, z - 0.12],
            eye_up=[0, 0, 1],
        ),
    )


def _bout_views() -> tuple[Any, Any]:
    recent = rrb.VisibleTimeRanges(
        [
            rrb.VisibleTimeRange(
                paths.WALL_TIME,
                start=rrb.TimeRangeBoundary.cursor_relative(seconds=-WINDOW_SECONDS),
                end=rrb.TimeRangeBoundary.cursor_relative(),
            )
        ]
    )
    score = rrb.TimeSeriesView(
        origin=paths.BOUT_SCORE,
        name="Score of this bout",
        time_ranges=recent,
        plot_legend=rrb.PlotLegend(visible=False),
    )
    events = rrb.StateTimelineView(
        origin=paths.EVENTS, name="In target, bats touching", time_ranges=recent
    )
    return score, events


def _plot(origin: str, name: str, corner: str = "RightTop", **options: Any) -> Any:
    return rrb.TimeSeriesView(
        origin=origin, name=name, plot_legend=rrb.PlotLegend(rrb.Corner2D[corner]), **options
    )


def _learning() -> Any:
    return rrb.Vertical(
        rrb.TimeSeriesView(
            origin=paths.SCORE,
            name="Antagonist's score per bout, 95 % (orange: it learns, blue: the protagonist)",
            plot_legend=rrb.PlotLegend(visible=False),
        ),
        rrb.Horizontal(
            _plot(
                f"{paths.TRAINING}/explained_variance",
                "Explained variance",
                "RightBottom",
                axis_y=rrb.ScalarAxis(range=(-0.2, 1.0)),
            ),
            _plot(f"{paths.TRAINING}/approx_kl", "KL per update"),
        ),
        rrb.Horizontal(
            _plot(paths.THROUGHPUT, "Samples per second", "RightBottom"),
            _plot(f"{paths.TRAINING}/policy_lag_mean", "Policy lag (versions)"),
        ),
        row_shares=[1.5, 1, 1],
        name="Learning",
    )


def _league() -> Any:
    return rrb.Vertical(
        rrb.TextDocumentView(origin=paths.LEAGUE_STATE, name="Where the run stands"),
        _plot(paths.VERSIONS, "Versions in the ledger", "LeftTop"),
        row_shares=[1.6, 1],
        name="League",
    )


def _services() -> Any:
    return rrb.Grid(
        _plot(f"{paths.SERVICES}/cpu_percent", "CPU (% of a core)"),
        _plot(f"{paths.SERVICES}/rss_mib", "Memory (MiB)"),
        _plot(f"{paths.SERVICES}/waiting_seconds", "Waiting (s)"),
        _plot(f"{paths.SERVICES}/rate", "Rates (per second)"),
        grid_columns=2,
        name="Services",
    )


def _log() -> Any:
    return rrb.TextLogView(
        origin=paths.LOG,
        name="Events",
        columns=rrb.TextLogColumns(
            timeline_columns=[paths.WALL_TIME], text_log_columns=["loglevel", "body"]
        ),
    )
