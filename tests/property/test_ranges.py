"""Whatever is entered in whatever order: the ranges are the set of it."""

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

from shared.bus.ranges import LARGEST, Ranges

SPANS = st.tuples(st.integers(0, 60), st.integers(0, 12)).map(lambda at: (at[0], at[0] + at[1]))


@given(st.lists(SPANS, max_size=30))
def test_ranges_hold_what_was_entered_with_a_gap_between_any_two(spans: list[tuple[int, int]]):
    ranges, model = Ranges(), set[int]()
    for first, last in spans:
        assert ranges.overlaps(first, last) == bool(model & set(range(first, last + 1)))
        if first == last:
            ranges.add(first)
        else:
            ranges.cover(first, last)
        model |= set(range(first, last + 1))
    assert {number for first, last in ranges for number in range(first, last + 1)} == model
    for number in range(75):
        assert (number in ranges) == (number in model)
    ends = list(ranges)
    assert all(one[1] + 1 < other[0] for one, other in itertools.pairwise(ends))


def test_the_largest_number_can_be_covered_and_nothing_beyond_or_below_nought():
    ranges = Ranges()
    ranges.cover(LARGEST - 1, LARGEST)
    ranges.cover(5, LARGEST)
    assert list(ranges) == [(5, LARGEST)]
    with pytest.raises(OverflowError):
        Ranges().cover(0, LARGEST + 1)
    for first, last in ((-1, 3), (3, 2)):
        with pytest.raises(ValueError, match="no numbers"):
            ranges.cover(first, last)
