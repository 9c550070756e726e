"""Which residuals may be off together: so many are one piece of evidence."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from shared.identification.fitting.problem import BLOCK, Problem
from shared.identification.gate.held_out import STRETCH

Integers = NDArray[np.intp]


def by_stretch(problem: Problem, segments: tuple[int, ...]) -> list[Integers]:
    """Return indices into ``problem.vector`` on segments of each stretch of ``STRETCH``.

    A joint that is off moves what hangs on it, for as long as the arm remembers.
    """
    size = round(STRETCH / BLOCK)
    return [
        piece.ravel()
        for _, indices in parts_of(problem, segments)
        for piece in np.array_split(indices, max(len(indices) // size, 1))
    ]


def by_channel(problem: Problem, segments: tuple[int, ...]) -> list[Integers]:
    """Return indices into ``problem.vector`` on segments of each channel of each recording.

    A tracker drifts for as long as a recording lasts, in each direction by itself; without one
    there are none.
    """
    if problem.noise.tracker is None:
        return []
    out: dict[tuple[int, int], list[Integers]] = {}
    for segment, indices in parts_of(problem, segments):
        for channel, column in enumerate(indices.T):
            out.setdefault((problem.segments[segment].trajectory, channel), []).append(column)
    return [np.concatenate(pieces) for pieces in out.values()]


def parts_of(problem: Problem, segments: tuple[int, ...]) -> Iterator[tuple[int, Integers]]:
    """Yield each segment with where its residuals are in the vector: int64[B, C]."""
    begin = 0
    for segment in segments:
        rows, channels = problem.shape_of(segment)
        yield segment, np.arange(begin, begin + rows * channels).reshape(rows, channels)
        begin += rows * channels
