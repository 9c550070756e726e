"""How the Rerun page of a live bout is laid out: the bout on the left, its curves on the right."""

from typing import Any

import rerun.blueprint as rrb

from shared.telemetry import live
from shared.telemetry import recording as paths
from shared.telemetry.layout import (
    bout_views,
    event_log,
    plot,
    recent_range,
    scene_view,
    service_views,
)
from shared.telemetry.scene import Scene


def live_layout(scene: Scene) -> Any:
    """Return the blueprint of a run of live bouts."""
    (score, events), recent = bout_views(), recent_range()
    tabs = rrb.Tabs(
        rrb.Vertical(
            plot(
                f"{live.TOOL}/protagonist", "Tool, measured and commanded (m)", time_ranges=recent
            ),
            rrb.Horizontal(
                plot(live.HEART_PATH, "Heart rate (beats per minute)", time_ranges=recent),
                plot(live.FORCE, "Force on the tool (N)", time_ranges=recent),
            ),
            name="Fencing",
        ),
        rrb.Vertical(
            plot(f"{live.JOINT}/protagonist/position", "Protagonist's joints (rad)",
                 time_ranges=recent),
            plot(f"{live.OFFSET}/protagonist/translation", "Offset its policy wants (m)",
                 time_ranges=recent),
            name="Robot",
        ),
        rrb.Vertical(
            plot(live.LATENESS, "Late by (ms)", time_ranges=recent),
            plot("bout/command", "Commands sent and clipped", time_ranges=recent),
            name="Timing",
        ),
        service_views(),
        active_tab=0,
    )  # fmt: skip
    side = rrb.Vertical(score, events, tabs, event_log(), row_shares=[1.0, 1.5, 2.7, 1.0])
    return rrb.Blueprint(
        rrb.Horizontal(scene_view(scene), side, column_shares=[1.1, 1]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=paths.WALL_TIME, play_state="following"),
        auto_views=False,
    )
