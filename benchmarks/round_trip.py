"""The control path by itself: bat states read -> command sent, beside a bare round trip.

The same match and the same bare pair as in ``control``, on all cores, and no training run: what
robot_io, bus and policy add to the two ways through the router. A tick wakes every process of the
match, and a bare message that is sent then waits for a core too: the goal is held against those.
"""

from typing import Any

import numpy as np

from benchmarks.control import SMOKE_SECONDS, answer_times, beside_states, times, watched
from services.jobs.bench import Check, Measurement
from shared.messages.play import GateState

QUESTION = "bat states read to command sent, nothing else running"
GOAL = 1.3
SECONDS = 120.0
PARTS = 6
"""Entries of the rounds."""


def measure(smoke: bool) -> Measurement:
    """Return the times of the control path and of the bare round trip."""
    return measurement(watched(SMOKE_SECONDS if smoke else SECONDS, is_alone=True))


def measurement(seen: dict[str, Any]) -> Measurement:
    """Return the figures of what was seen."""
    gates: list[GateState] = seen["gates"]
    answers, close_ms = answer_times(gates), beside_states(seen["bare"], seen["read_ns"])
    command, bare, close = times(answers), times(seen["bare"]["times_ms"]), times(close_ms)
    return Measurement(
        value=command["p50"],
        unit="ms",
        limit=close["p50"],
        ratio=Check(
            name="control path / bare round trip begun with it, p50",
            value=command["p50"] / close["p50"], goal=GOAL, goal_is="at most",
        ),
        runs=tuple(
            {"ratio": float(np.median(ours) / np.median(theirs))}
            for ours, theirs in zip(
                np.array_split(answers, PARTS), np.array_split(close_ms, PARTS), strict=True
            )
        ),
        checks=(
            Check(
                name="control path / bare round trip at any moment, p50",
                value=command["p50"] / bare["p50"],
            ),
            Check(name="states read to command sent, p99", value=command["p99"], unit="ms"),
            Check(name="bare round trip begun with it, p99", value=close["p99"], unit="ms"),
            Check(name="bare round trip at any moment, p50", value=bare["p50"], unit="ms"),
            Check(name="the same, p99", value=bare["p99"], unit="ms"),
            Check(name="bare round trips missed", value=seen["bare"]["missed"]),
            Check(
                name="ticks without an answer in time", value=seen["counts"]["commands_repeated"]
            ),
            Check(name="ticks", value=seen["counts"]["ticks"]),
        ),
        details={"bytes": seen["bytes"]},
    )  # fmt: skip
