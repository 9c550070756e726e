"""What to record next goes by what the recordings lack."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from shared.identification.dataset.types import Caveat
from shared.identification.find import _record_next  # pyright: ignore[reportPrivateUsage]


def told(word: str, control: str, *lacks: str) -> str:
    conclusion = SimpleNamespace(word=word, ties=())
    caveats = tuple(Caveat(name, "", "") for name in lacks)
    dataset = SimpleNamespace(caveats=caveats, control=control)
    return " ".join(_record_next(cast(Any, conclusion), cast(Any, dataset)))


@pytest.mark.parametrize(
    ("word", "control", "is_told"),
    [("named", "position", True), ("none", "position", False), ("named", "torque", False)],
)
def test_how_strong_a_servo_is_takes_logged_efforts(word: str, control: str, is_told: bool):
    assert ("Log efforts" in told(word, control, "no_effort")) == is_told
    assert "Log efforts" not in told(word, control, "no_tracker")


def test_repeats_trackers_and_the_whole_programme_are_asked_for_where_they_lack():
    assert told("named", "pose") == ""
    assert "Repeat one recording" in told("none", "pose", "no_repeat")
    assert "Log a tracker" in told("none", "pose", "no_tracker")
    assert "riposte identify excite" in told("unexplained", "pose")


def test_another_instrument_is_asked_for_last():
    told_of_all = told("unexplained", "position", "no_tracker", "no_effort", "no_repeat")
    at = [told_of_all.index(word) for word in ("Repeat", "Log efforts", "excite", "Log a tracker")]
    assert at == sorted(at)
