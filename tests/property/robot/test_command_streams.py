"""The gate under 100,000 random streams of commands; the quick suite plays the first of them."""

import random

import pytest

from services.robot_io.gate import Gate
from tests.property.robot.streams import (
    BLADE,
    KINDS,
    PERIOD,
    STEPS,
    Tally,
    play,
    random_limits,
)

STREAMS = 100_000
QUICK = 1_000
STREAMS_PER_GATE = 50


def tally_of(streams: int) -> Tally:
    tally = Tally()
    for seed in range(streams // STREAMS_PER_GATE):
        draw = random.Random(seed)
        gate = Gate(random_limits(draw), BLADE, PERIOD)
        for _ in range(STREAMS_PER_GATE):
            play(draw, gate, tally)
    return tally


def check_coverage(tally: Tally, streams: int) -> None:
    """The streams were such as to tell: each limit was reached, each mode entered."""
    assert tally.streams == streams
    assert tally.steps == streams * STEPS
    assert tally.commands > 0.4 * tally.steps
    assert tally.fastest > 0.999
    assert tally.hardest > 0.999
    assert tally.furthest > 0.95
    assert set(tally.kinds) == set(KINDS)
    assert set(tally.modes) == {"disarmed", "ramping", "armed", "holding", "tripped"}
    assert tally.modes["armed"] > 0.2 * tally.steps


def test_no_stream_leads_over_a_limit():
    check_coverage(tally_of(QUICK), QUICK)


@pytest.mark.slow
@pytest.mark.timeout(1800)
def test_none_of_a_hundred_thousand_streams_leads_over_a_limit():
    check_coverage(tally_of(STREAMS), STREAMS)
