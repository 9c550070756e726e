"""What the pictures show is computed right."""

from dataclasses import replace

import numpy as np
import pytest

from services.jobs.identify.residuals import (
    clearest_profile,
    diagnostics_after,
    lane,
    rms_by_joint,
    tracker_off,
    window_of,
    worst_joint,
)
from shared.identification.conclusion.diagnose import diagnose
from tests.unit.identify_job.examples import NOISE, example


def test_the_window_is_about_where_the_base_fit_is_furthest_off() -> None:
    found = example("unexplained").evidence
    window = window_of(found, 3)
    assert window.replay.name == "swings test"
    assert window.at[0] < 7.7
    assert window.at[-1] > 8.7
    assert window.at[-1] - window.at[0] == pytest.approx(5.0, abs=0.05)


def test_the_worst_joint_is_the_named_one_else_the_one_furthest_off() -> None:
    named = example("named")
    assert worst_joint(named.verdict, named.evidence) == 3
    left = example("unexplained")
    assert worst_joint(left.verdict, left.evidence) == 3


def test_root_mean_squares_are_over_all_recordings() -> None:
    found = example("none").evidence
    rms = rms_by_joint(found.held_out, "base_fit")
    assert rms == pytest.approx(NOISE / np.sqrt(2.0), rel=0.1)
    found.held_out[0].predicted["base_fit"][-1] = np.nan
    assert np.isinf(rms_by_joint(found.held_out, "base_fit")).all()


def test_a_lane_is_dark_where_something_happened() -> None:
    found = example("unexplained").evidence
    pushed = next(replay for replay in found.replays if replay.name == "swings test")
    edges, values = lane(found, pushed)
    assert len(edges) == len(values) + 1
    loudest = int(np.argmax(values))
    assert 7.7 < edges[loudest] < 8.7
    assert values[loudest] == pytest.approx(0.012 / 3e-4, rel=0.15)
    assert np.median(values) < 2.0


def test_the_profile_over_speed_is_the_one_that_friction_flattens() -> None:
    found = example("named").evidence
    after = diagnostics_after(found)
    picked = found.diagnostics.profiles[clearest_profile(found.diagnostics, after, 3)]
    assert picked.over in ("velocity", "effort")
    assert abs(after.forward[3]) < 0.1 * abs(found.diagnostics.forward[3])


def test_the_tracker_is_off_by_a_distance() -> None:
    replay = example("named").evidence.replays[0]
    off = tracker_off(replay)
    assert set(off) == {"nominal", "base_fit", "extended"}
    assert off["extended"].mean() == pytest.approx(5e-4 * np.sqrt(8 / np.pi), rel=0.2)
    assert tracker_off(example("named", has_tracker=False).evidence.replays[0]) == {}


def test_time_since_the_start_is_the_same_before_and_after() -> None:
    found = example("named").evidence
    begins, replays = 0.0, []
    for replay in found.replays:
        replays.append(replace(replay, begins=begins))
        begins += float(replay.at[-1])
    before = diagnose(replays, found.joints, found.units)
    after = diagnostics_after(replace(found, replays=tuple(replays), diagnostics=before))
    over_time = [
        next(each for each in one.profiles if each.over == "time") for one in (before, after)
    ]
    assert over_time[1].centres == pytest.approx(over_time[0].centres)
    assert over_time[0].centres.max() > 0.9 * begins
