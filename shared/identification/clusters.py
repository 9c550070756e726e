"""Which residuals may be off together: so many are one piece of evidence."""

import numpy as np
from numpy.typing import NDArray

from shared.identification.gate import STRETCH
from shared.identification.problem import BLOCK, Problem

Integers = NDArray[np.intp]


def by_stretch(problem: Problem, segments: tuple[int, ...]) -> list[Integers]:
    """Return indices into ``problem.vector`` on segments of each stretch of ``STRETCH``.

    A joint that is off moves what hangs on it, for as long as the arm remembers.
    """
    size = round(STRETCH / BLOCK)
    out: list[Integers] = []
    begin = 0
    for rows, channels in map(problem.shape_of, segments):
        indices = np.arange(begin, begin + rows * channels)
        pieces = np.array_split(indices.reshape(rows, channels), max(rows // size, 1))
        out.extend(piece.ravel() for piece in pieces)
        begin += rows * channels
    return out


def by_channel(problem: Problem, segments: tuple[int, ...]) -> list[Integers]:
    """Return indices into ``problem.vector`` on segments of each channel of each recording.

    A tracker drifts for as long as a recording lasts, in each direction by itself; without one
    there are none.
    """
    if problem.noise.tracker is None:
        return []
    out: dict[tuple[int, int], list[Integers]] = {}
    begin = 0
    for segment in segments:
        rows, channels = problem.shape_of(segment)
        indices = np.arange(begin, begin + rows * channels).reshape(rows, channels)
        for channel in range(channels):
            key = problem.segments[segment].trajectory, channel
            out.setdefault(key, []).append(indices[:, channel])
        begin += rows * channels
    return [np.concatenate(pieces) for pieces in out.values()]
