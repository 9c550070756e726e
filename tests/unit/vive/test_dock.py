import pytest

from services.robot_io.poses import Vector
from services.robot_io.vive.config import ViveConfig
from services.robot_io.vive.dock import DockCheck

DOCK = (1.0, 2.0, 0.5)


def laid(check: DockCheck, place: Vector, at: float, seconds: float = 0.6) -> float:
    """Hold the bat there; return when that ended."""
    for tick in range(round(seconds * 250)):
        check.offer(place, at + tick * 0.004)
    return at + seconds


def test_a_bat_is_believed_once_it_has_lain_in_its_dock():
    check = DockCheck(DOCK, 0.02)
    assert check.is_due
    assert "lay the bat into its dock" in check.problem
    at = laid(check, (3.0, 2.0, 0.5), 1.0)  # still, and elsewhere
    assert check.is_due
    at = laid(check, (1.0, 2.0, 0.515), at, 0.4)  # too short
    assert check.is_due
    laid(check, (1.0, 2.0, 0.515), at, 0.2)
    assert not check.is_due
    assert check.error == pytest.approx(0.015)
    assert check.problem == ""
    assert check.counters == {"dock_checks": 1, "dock_failures": 0}


def test_a_bat_that_lies_where_it_cannot_be_is_not_believed_until_it_is_right_again():
    check = DockCheck(DOCK, 0.02)
    at = laid(check, (1.0, 2.03, 0.5), 1.0)
    assert check.is_due
    assert "seen 30 mm from where that was recorded, limit 20" in check.problem
    assert check.counters == {"dock_checks": 1, "dock_failures": 1}
    at = laid(check, (1.0, 2.03, 0.5), at, 3.0)  # judged once each time that it is laid in
    assert check.counters["dock_checks"] == 1
    laid(check, DOCK, at)
    assert check.problem == ""


def test_after_a_dropout_a_check_is_due_and_the_old_one_counts_till_then():
    check = DockCheck(DOCK, 0.02)
    at = laid(check, DOCK, 1.0)
    check.lost()
    assert check.is_due
    assert check.problem == ""
    laid(check, DOCK, at)
    assert not check.is_due
    assert check.counters["dock_checks"] == 2


def test_a_bat_in_a_hand_is_never_taken_to_lie():
    check = DockCheck(DOCK, 0.02)
    for tick in range(2000):
        x, y, z = DOCK
        check.offer((x + 0.01 * (tick % 2), y, z), tick * 0.004)
    assert check.counters["dock_checks"] == 0


def test_without_a_dock_nothing_is_asked_for():
    check = DockCheck(None, 0.02)
    laid(check, DOCK, 1.0)
    check.lost()
    assert (check.is_due, check.problem, check.error) == (False, "", None)


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"calibration_days": float("nan")}, "calibration_days is nan; allowed are 0.01 to 3650"),
        ({"dock_limit": 0.5}, "dock_limit is 0.5; allowed are 0.001 to 0.2"),
        ({"mount_position": (0.0, 3.0, 0.0)}, "expected within 1 m"),
        ({"mount_orientation": (1.0, 1.0, 0.0, 0.0)}, "expected a quaternion"),
        ({"calibration": ""}, "expected the name of a file"),
    ],
)
def test_settings_out_of_range_are_refused(values: dict[str, object], text: str):
    with pytest.raises(ValueError, match=text):
        ViveConfig(**values)  # type: ignore[arg-type]
