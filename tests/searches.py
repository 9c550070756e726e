"""Searches put together by hand, for tests of what is made of them."""

from pathlib import Path

import numpy as np

from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.viscous_friction import EFFECT as VISCOUS
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.base import WINDOW
from shared.identification.fitting.fit import Fit, Start, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.held_out import compare
from shared.identification.search.screen import Screened
from shared.identification.search.searched import Search, Tried
from tests.measured import Enter, measure, nothing, plain, problem_of

ELBOW, LIFT = Candidate(BIAS, "elbow"), Candidate(BIAS, "lift")
DRAG, OFFSET = Candidate(VISCOUS, "elbow"), Candidate(BIAS, "pan")


class Searches:
    """Makes searches of one small data set; only the losses are made up."""

    def __init__(self, folder: Path, seconds: float = 2.0, enter: Enter = nothing) -> None:
        rng = np.random.default_rng(0)
        # losses that are made up are the same whatever of the noise is new
        self.problem = plain(problem_of(measure(folder, rng, enter, seconds=seconds)))
        self.base = self.fit(())
        in_parts = Space(self.problem.in_parts(WINDOW))
        self.parts = Fit.at(in_parts, self.base.z, in_parts.problem.of("train"))
        self._fits: dict[tuple[Candidate, ...], Fit] = {}

    def fit(self, candidates: tuple[Candidate, ...]) -> Fit:
        """Return the nominal arm with effects of half a probe."""
        space = Space(self.problem, candidates)
        z = np.zeros(space.size)
        z[space.base_size :] = 0.5
        return polish(space, z, self.problem.of("train"), steps=0)

    def tried(
        self, candidate: Candidate, before: Float64, after: Float64, numbers: int = 1,
        is_event: bool = False, fitted: Float64 | None = None,
    ) -> Tried:  # fmt: skip
        """Return a candidate that came from one loss to another."""
        if (candidate,) not in self._fits:
            self._fits[candidate,] = self.fit((candidate,))
        fit = self._fits[candidate,]
        signature = np.array([1.0, 0.0])
        screened = Screened(candidate, np.ones(numbers), self.base.z, 0.5, signature)
        gain = compare(before, after, np.random.default_rng(0))
        others = np.empty(0) if fitted is None else fitted
        return Tried(screened, fit, gain, after, is_event, fitted=others)

    def search(
        self, base: Float64, accepted: Tried | None = None, rivals: tuple[Tried, ...] = (),
        doubted: tuple[str, ...] = (), tried: tuple[Tried, ...] = (),
        before: tuple[Tried, ...] = (),
    ) -> Search:  # fmt: skip
        """Return a search that is over; ``before`` was accepted first, without a rival."""
        taken = before if accepted is None else (*before, accepted)
        current = self.fit(tuple(each.candidate for each in taken)) if before else None
        looked = (*taken, *rivals, *tried)
        return Search(
            problem=self.problem,
            rng=np.random.default_rng(0),
            candidates=(ELBOW, LIFT, DRAG),
            ruled_out={},
            doubted=doubted,
            base=self.base,
            nominal=Start(self.base.z, self.base.jacobian),
            parts=self.parts,
            current=current or (self.base if accepted is None else accepted.fit),
            nominal_losses=base,
            base_losses=base,
            current_losses=base if accepted is None else accepted.losses,
            screened={each.candidate.label: each.screened for each in looked},
            tried={each.candidate.label: each for each in looked},
            accepted=list(taken),
            rivals=[() for _ in before] + ([] if accepted is None else [rivals]),
        )
