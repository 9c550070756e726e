"""Judges a cause on each recording that was fitted to, by the size that the others give it.

The base and a cause are fitted together; here the cause's own numbers are found once more without
a recording, as far as the derivative says, the base making up for them. What is left there with
those numbers is held out as to the cause. So all recordings speak for or against it, not only
those that nothing was fitted to.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.problem import Problem
from shared.identification.gate.held_out import parted

_FEWEST = 3
"""Recordings to fit to: with fewer, the others say too little."""
_LEAST = 1e-9
"""Of what a cause changes in all recordings: less is nothing, and says nothing of its size."""


@dataclass(frozen=True)
class LeftOut:
    """Mean square residuals of stretches of recordings that were fitted to."""

    before: Float64
    """float64[S], without the cause."""
    after: Float64
    """float64[S], with it, each with the size that the other recordings give it."""


def left_out(before: Fit, after: Fit, candidate: Candidate, train: tuple[int, ...]) -> LeftOut:
    """Return how a cause does on each recording if that one has no say in its size.

    Args:
        before: without the cause.
        after: with it.
        candidate: the cause.
        train: recordings that both were fitted to; nothing is returned of too few.
    """
    problem = after.space.problem
    groups = _by_recording(problem, train)
    if len(groups) < _FEWEST:
        return LeftOut(np.empty(0), np.empty(0))
    own = after.space.where(candidate)
    moved = _own_part(after.jacobian, own)
    size = after.z[own]
    whole, gradient = moved.T @ moved, moved.T @ after.residual
    ones: list[Float64] = []
    others: list[Float64] = []
    for members in groups.values():
        rows = np.concatenate([np.arange(*span) for span in members.values()])
        here = moved[rows]
        square = here.T @ here
        asked = gradient - here.T @ after.residual[rows]
        step = -np.linalg.lstsq(whole - square, asked, rcond=_LEAST)[0]
        step *= _no_further(square, size, step)
        for segment, (begin, end) in members.items():
            shape = problem.shape_of(segment)
            left = after.residual[begin:end] + moved[begin:end] @ step
            ones.append(parted(problem, segment, before.residual[begin:end].reshape(shape)))
            others.append(parted(problem, segment, left.reshape(shape)))
    return LeftOut(np.concatenate(ones), np.concatenate(others))


def _own_part(jacobian: Float64, own: slice) -> Float64:
    """Return float64[M + n, k], what some numbers change that all others cannot make up for."""
    others = np.delete(jacobian, np.r_[own], axis=1)
    basis, _ = np.linalg.qr(others)
    moved = jacobian[:, own]
    return np.asarray(moved - basis @ (basis.T @ moved), np.float64)


def _no_further(square: Float64, size: Float64, step: NDArray[np.floating]) -> float:
    """Return the share of a step that changes a recording no more than the whole cause does."""
    most, asked = float(size @ square @ size), float(step @ square @ step)
    return 1.0 if asked <= most else float(np.sqrt(most / asked))


def _by_recording(
    problem: Problem, segments: tuple[int, ...]
) -> dict[str, dict[int, tuple[int, int]]]:
    """Return where each segment's numbers are in a residual, by recording.

    A repeat is of the recording that it repeats.
    """
    out: dict[str, dict[int, tuple[int, int]]] = {}
    end = 0
    for segment in segments:
        begin, end = end, end + problem.size_of(segment)
        recording = problem.dataset.trajectories[problem.segments[segment].trajectory]
        out.setdefault(recording.repeats or recording.name, {})[segment] = (begin, end)
    return out
