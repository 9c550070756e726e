"""What the control benchmark makes of what it saw."""

from typing import Any

import numpy as np
import pytest

from benchmarks import round_trip
from benchmarks.control import answer_times, beside_states, measurement
from shared.messages.play import GateState


def gate(tick: int, answer_ms: float | None, behind: int = 0) -> GateState:
    return GateState(
        tick=tick, mode="armed", commanded=np.zeros(7), is_clipped=False,
        lateness_ms=0.1, answer_ms=answer_ms, late_ticks=0,
        answered_tick=None if answer_ms is None else tick - behind,
    )  # fmt: skip


READ_NS = [10_000_000 * tick for tick in range(60)]


def bare(times_ms: list[float], missed: int = 0) -> dict[str, Any]:
    """Return trips of which the first sixty begin just after states were read."""
    asked = [READ_NS[index % 60] + (300_000 if index < 60 else 5_000_000) for index in
             range(len(times_ms))]  # fmt: skip
    return {"asked_ns": asked, "times_ms": times_ms, "missed": missed}


def test_a_bare_trip_is_compared_if_it_began_within_a_millisecond_of_the_states():
    asked = [-1, 0, 999_999, 1_000_000, 9_999_999, 10_000_500]
    found = {"asked_ns": asked, "times_ms": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0], "missed": 0}
    assert beside_states(found, [10_000_000, 0]) == [2.0, 3.0, 6.0]


def test_a_command_that_answers_the_tick_before_is_as_old_as_that_ticks_states():
    gates = [gate(1, 2.0), gate(2, None), gate(3, 0.5, behind=1)]
    assert answer_times(gates) == [2.0, 10.5]


def test_late_and_lost_ticks_count_alike_and_misses_are_shown():
    gates = [gate(tick, 2.0 if tick % 10 else None) for tick in range(90)]
    counts = {"ticks": 95, "ticks_late": 2, "ticks_lost": 3, "commands_repeated": 9}
    seen = {
        "gates": gates, "counts": counts, "trips": 1, "bouts": 4, "updates": 7, "bytes": 500,
        "bare": bare([0.5] * 99 + [1.5], missed=2), "read_ns": READ_NS,
    }  # fmt: skip
    found = measurement(seen)
    assert found.value == pytest.approx(2.0)
    assert found.limit == pytest.approx(0.5)
    assert found.ratio.value == pytest.approx(5 / 98)
    assert not found.ratio.is_met
    figures = {check.name: check.value for check in found.checks}
    assert figures["ticks"] == 98
    assert figures["ticks over 10 ms late"] == 2
    assert figures["ticks lost"] == 3
    assert figures["ticks without an answer in time"] == 9
    assert figures["ticks not heard here"] == 5
    assert figures["bare round trips missed"] == 2
    assert figures["trips of the gate"] == 1
    assert found.runs[0]["ratio"] == 0.0


def test_the_control_path_by_itself_is_a_multiple_of_the_bare_round_trip():
    seen = {
        "gates": [gate(tick, 0.5 + 0.01 * (tick % 3)) for tick in range(60)],
        "counts": {"ticks": 60, "commands_repeated": 0}, "bytes": 500,
        "bare": bare([0.4] * 60 + [0.1] * 200), "read_ns": READ_NS,
    }  # fmt: skip
    found = round_trip.measurement(seen)
    assert found.ratio.value == pytest.approx(0.51 / 0.4)
    assert found.ratio.is_met
    assert found.checks[0].value == pytest.approx(0.51 / 0.1)
    assert len(found.runs) == round_trip.PARTS
