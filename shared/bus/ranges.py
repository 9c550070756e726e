"""Whole numbers kept as ranges: as much memory as there are gaps, whatever their number."""

import bisect
from array import array
from collections.abc import Iterator

LARGEST = 2**63 - 1
"""Of a number that fits."""


class Ranges:
    """A set of whole numbers from 0 on, most of which follow each other."""

    __slots__ = ("_firsts", "_lasts")

    def __init__(self) -> None:
        self._firsts = array("q")
        self._lasts = array("q")

    def __len__(self) -> int:
        """Return how many ranges there are."""
        return len(self._firsts)

    def __iter__(self) -> Iterator[tuple[int, int]]:
        """Yield first and last number of each range, in order."""
        return zip(self._firsts, self._lasts, strict=True)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Ranges):
            return NotImplemented
        return self._firsts == other._firsts and self._lasts == other._lasts

    __hash__ = None  # pyright: ignore[reportAssignmentType] - it changes

    def __contains__(self, number: int) -> bool:
        at = bisect.bisect_right(self._firsts, number) - 1
        return at >= 0 and number <= self._lasts[at]

    def add(self, number: int) -> None:
        """Enter a number; entering it again changes nothing.

        Raises:
            OverflowError: it is larger than ``LARGEST``.
        """
        firsts, lasts = self._firsts, self._lasts
        at = bisect.bisect_right(firsts, number)
        if at and number <= lasts[at - 1]:
            return
        joins_left = at > 0 and lasts[at - 1] == number - 1
        joins_right = at < len(firsts) and firsts[at] == number + 1
        if joins_left and joins_right:
            lasts[at - 1] = lasts.pop(at)
            firsts.pop(at)
        elif joins_left:
            lasts[at - 1] = number
        elif joins_right:
            firsts[at] = number
        else:
            firsts.insert(at, number)
            lasts.insert(at, number)

    def overlaps(self, first: int, last: int) -> bool:
        """Return whether a number from ``first`` to ``last`` is in the set."""
        at = bisect.bisect_right(self._firsts, last) - 1
        return at >= 0 and self._lasts[at] >= first

    def cover(self, first: int, last: int) -> None:
        """Enter all numbers from ``first`` to ``last``; those that are there change nothing.

        Raises:
            ValueError: the range ends before it begins, or is not from 0 on.
            OverflowError: ``last`` is larger than ``LARGEST``.
        """
        if first < 0 or last < first:
            raise ValueError(f"there are no numbers from {first} to {last}")
        firsts, lasts = self._firsts, self._lasts
        begin = bisect.bisect_left(lasts, first - 1)  # the first range that it touches, or none
        end = bisect.bisect_right(firsts, min(last, LARGEST - 1) + 1)
        if begin < end:
            first, last = min(first, firsts[begin]), max(last, lasts[end - 1])
        lasts[begin:end] = array("q", (last,))
        firsts[begin:end] = array("q", (first,))

    def append(self, first: int, last: int) -> None:
        """Enter a range after all others, with a gap before it.

        Raises:
            ValueError: it is not after them, or ends before it begins.
            OverflowError: ``last`` is larger than ``LARGEST``.
        """
        if first < 0 or last < first or (self._lasts and first <= self._lasts[-1] + 1):
            raise ValueError(f"range {first} to {last} is out of order")
        self._lasts.append(last)
        self._firsts.append(first)

    def close_first_gap(self) -> None:
        """Enter the numbers between the first two ranges."""
        self._lasts[0] = self._lasts.pop(1)
        self._firsts.pop(1)
