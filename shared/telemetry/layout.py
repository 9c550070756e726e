"""How the Rerun page is laid out: the bout on the left, what is learned on the right."""

from typing import Any

import rerun.blueprint as rrb

from shared.telemetry import recording as paths
from shared.telemetry.scene import Scene

WINDOW_SECONDS = 25.0
"""How far back the curves of the shown bout go."""


def training_layout(scene: Scene | None) -> Any:
    """Return the blueprint of a training run; without a scene there is no 3-D view."""
    tabs = rrb.Tabs(_learning(), _league(), service_views(), active_tab=0)
    side: Any = rrb.Vertical(*bout_views(), tabs, event_log(), row_shares=[1.0, 1.0, 2.7, 1.2])
    if scene is None:
        side = rrb.Vertical(tabs, event_log(), row_shares=[3, 1])
    root = (
        side if scene is None else rrb.Horizontal(scene_view(scene), side, column_shares=[1.1, 1])
    )
    return rrb.Blueprint(
        root,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=paths.WALL_TIME, play_state="following"),
        auto_views=False,
    )


def scene_view(scene: Scene) -> Any:
    """Return the view of the bout."""
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


def recent_range() -> Any:
    """Return the time range of what is recent."""
    return rrb.VisibleTimeRanges(
        [
            rrb.VisibleTimeRange(
                paths.WALL_TIME,
                start=rrb.TimeRangeBoundary.cursor_relative(seconds=-WINDOW_SECONDS),
                end=rrb.TimeRangeBoundary.cursor_relative(),
            )
        ]
    )


def bout_views() -> tuple[Any, Any]:
    """Return the views of the bout's score and events."""
    recent = recent_range()
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


def plot(origin: str, name: str, corner: str = "RightTop", **options: Any) -> Any:
    """Return a plot of everything under ``origin``."""
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
            plot(
                f"{paths.TRAINING}/explained_variance",
                "Explained variance",
                "RightBottom",
                axis_y=rrb.ScalarAxis(range=(-0.2, 1.0)),
            ),
            plot(f"{paths.TRAINING}/approx_kl", "KL per update"),
        ),
        rrb.Horizontal(
            plot(paths.THROUGHPUT, "Samples per second", "RightBottom"),
            plot(f"{paths.TRAINING}/policy_lag_mean", "Policy lag (versions)"),
        ),
        row_shares=[1.5, 1, 1],
        name="Learning",
    )


def _league() -> Any:
    return rrb.Vertical(
        rrb.TextDocumentView(origin=paths.LEAGUE_STATE, name="Where the run stands"),
        plot(paths.VERSIONS, "Versions in the ledger", "LeftTop"),
        row_shares=[1.6, 1],
        name="League",
    )


def service_views() -> Any:
    """Return the curves of all processes."""
    return rrb.Grid(
        plot(f"{paths.SERVICES}/cpu_percent", "CPU (% of a core)"),
        plot(f"{paths.SERVICES}/rss_mib", "Memory (MiB)"),
        plot(f"{paths.SERVICES}/waiting_seconds", "Waiting (s)"),
        plot(f"{paths.SERVICES}/rate", "Rates (per second)"),
        grid_columns=2,
        name="Services",
    )


def event_log() -> Any:
    """Return the log of events."""
    return rrb.TextLogView(
        origin=paths.LOG,
        name="Events",
        columns=rrb.TextLogColumns(
            timeline_columns=[paths.WALL_TIME], text_log_columns=["loglevel", "body"]
        ),
    )
