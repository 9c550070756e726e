"""Fits of given causes to real recordings, without a search."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shared.identification.arm.subject import subject_of
from shared.identification.catalogue import effects
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import polish
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import noise_of


@dataclass(frozen=True)
class Fitted:
    values: dict[str, Float64]
    """Of each cause, and of each base parameter, by its label."""
    train: float
    """Root mean square of what is left (rad, m)."""
    test: float
    variant: Variant


def problem_of(folder: Path) -> Problem:
    dataset = read_dataset(folder)
    subject = subject_of(dataset)
    return Problem(subject, dataset, base_parameters(subject), noise_of(dataset, BLOCK, {}))


def fitted(problem: Problem, *names: str, steps: int = 6) -> Fitted:
    """Fit the base and effects, each at every joint that it may sit at."""
    known = {effect.name: effect for effect in effects()}
    causes = tuple(
        Candidate(known[name], place)
        for name in names
        for place in known[name].places(problem.subject)
    )
    space = Space(problem, causes)
    start = np.zeros(space.size)
    start[space.base_size :] = 0.5
    fit = polish(space, start, problem.of("train"), steps)
    variant = space.variant(fit.z)
    values = {candidate.label: found for candidate, found in variant.extras}
    for parameter, x in zip(problem.parameters, variant.x, strict=True):
        values[parameter.name] = np.array([parameter.value(float(x))])
    return Fitted(values, left(problem, variant, "train"), left(problem, variant, "test"), variant)


def left(problem: Problem, variant: Variant, split: str) -> float:
    """Return the root mean square residual of one split (rad, m)."""
    segments = problem.of(split)
    reports = problem.reports([variant], segments)[0]
    parts = [
        problem.raw(report, segment)[0].ravel()
        for report, segment in zip(reports, segments, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))
