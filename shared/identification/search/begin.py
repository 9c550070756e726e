"""Begins a search: what the noise is, and the base fitted without any cause."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from shared.identification.arm.subject import subject_of
from shared.identification.dataset.types import Dataset
from shared.identification.effect import Candidate, Effect
from shared.identification.fitting.base import (
    BaseFits,
    SavedFits,
    as_kept,
    fit_again,
    fit_base,
    fit_without,
    floor_from_base,
    with_starts,
)
from shared.identification.fitting.fit import Fit
from shared.identification.fitting.lacking import shows
from shared.identification.fitting.parameters import BaseParameter, base_parameters, bends
from shared.identification.fitting.problem import BLOCK, Problem, Span
from shared.identification.fitting.shown import if_shown, with_shown
from shared.identification.fitting.space import Space
from shared.identification.gate.held_out import stretches
from shared.identification.noise.floor import noise_of
from shared.identification.progress import Progress
from shared.identification.search.astray import astray, leads_astray, no_more
from shared.identification.search.bare import (
    lacking,
    loads_of,
    offsets_of,
    screened_of,
    with_all,
    with_drives,
)
from shared.identification.search.family import Family
from shared.identification.search.screen import candidates_of
from shared.identification.search.searched import Search, join

FAR_FROM_KNOWN = 3.0
"""Standard deviations from what is known of a link at which the base itself is doubted."""


def begin(
    dataset: Dataset,
    *,
    seed: int,
    progress: Progress,
    without: frozenset[str],
    catalogue: Sequence[Effect],
    fits: SavedFits | None = None,
    aside: tuple[Span, ...] = (),
    threads: int = 1,
) -> Search:
    """Return a search with its base fitted.

    Args:
        dataset: the recordings.
        seed: of everything random.
        progress: is told how far it is.
        without: effects to leave out, by name.
        catalogue: what is looked for.
        fits: the base's fit, if it was found before.
        aside: what nothing is fitted to; what happened once in such a recording is not looked for.
        threads: of the physics.

    Raises:
        IdentificationError: the model does not fit the recordings.
    """
    rng = np.random.default_rng(seed)  # of the base fit, which may have been done before
    progress("noise floor", 0.0)
    subject = subject_of(dataset, threads=threads)
    noise = noise_of(dataset, BLOCK, subject.starts, subject.nominal)
    released = known = base_parameters(subject)
    shown = if_shown(subject)
    by_name = {each.name: each for each in (*known, *shown)}
    if fits is not None and not by_name.keys() >= set(fits.names):
        fits = None
    candidates, ruled_out = candidates_of(catalogue, subject, without)
    pushed = {each.trajectory for each in aside}
    candidates = tuple(each for each in candidates if each.recording not in pushed)
    full = Problem(subject, dataset, released, noise, aside=aside)
    lacks = lacking(Space(full), candidates)
    if not noise.is_measured:
        progress("noise floor", 0.5, "no repeats: from what the base leaves")
        noise = floor_from_base(Space(full))
        if lacks:
            noise = no_more(noise, Space(full, lacks))
        full = replace(full, noise=noise)
    if fits is not None:
        known = tuple(by_name[name] for name in fits.names)
    problem = replace(full, parameters=known)
    progress("base fit", 0.0, f"{len(known)} parameters" + ("" if fits is None else ", kept"))
    step = _Step(released, shown, candidates, seed, progress, fits)
    is_pushed = fits is not None and fits.is_torque
    begun = None if is_pushed else step.from_base(problem, rng)
    is_new = fits is None and lacks and not noise.is_measured
    if begun is None or (is_new and begun[1] is None):
        progress("base fit", 0.5, "as an arm that torques push which nobody knows")
        by_torque = replace(problem, noise=astray(Space(full, lacks)))
        pushed_arm = step.from_base(by_torque, rng)
        assert pushed_arm is not None  # torques do not speak against torques
        # Where drives show in neither, links tell: torques that nobody knows bend them in one.
        held = _held_of(pushed_arm[0], released)
        if begun is None or pushed_arm[1] is not None or _held_of(begun[0], released) > held:
            begun = pushed_arm
    done, family = begun
    problem = done.whole.space.problem
    if problem.noise.is_torque:
        candidates = _shown_by_torques(problem, candidates, ruled_out)
    return begun_with(
        done,
        family,
        seed=seed,
        candidates=candidates,
        ruled_out=ruled_out,
        doubted=tuple(each.name for each in released if each not in problem.parameters),
    )


def _held_of(fits: BaseFits, released: tuple[BaseParameter, ...]) -> int:
    """Return how many numbers a base bent beyond belief, so that they are held."""
    return sum(each not in fits.whole.space.problem.parameters for each in released)


def _shown_by_torques(
    problem: Problem, candidates: tuple[Candidate, ...], ruled_out: dict[str, str]
) -> tuple[Candidate, ...]:
    """Return what missing torques tell of, and note what they do not."""
    recorded = problem.segments[0].recorded
    kept = tuple(each for each in candidates if shows(problem.subject, each, recorded))
    names = {each.effect.name for each in kept}
    for each in candidates:
        if each.effect.name not in names:
            ruled_out[each.effect.name] = "the torques that a motion takes do not show it"
    return kept


@dataclass(frozen=True)
class _Step:
    """What it takes to fit a base, and what the model file lacks of drives."""

    released: tuple[BaseParameter, ...]
    shown: tuple[BaseParameter, ...]
    candidates: tuple[Candidate, ...]
    seed: int
    progress: Progress
    fits: SavedFits | None

    def from_base(
        self, problem: Problem, rng: np.random.Generator
    ) -> tuple[BaseFits, Family | None] | None:
        """Return the fits; parameters that they bend beyond belief are not released.

        None if torques speak against what replays make of drives.
        """
        space, fits = Space(problem), self.fits
        done = (
            with_shown(fit_base(space, rng), self.shown) if fits is None else fit_again(space, fits)
        )
        has_free_starts = fits is None and problem.noise.has_free_starts
        if has_free_starts:
            done = as_kept(with_starts(done))
        problem = done.whole.space.problem
        is_held = any(each not in problem.parameters for each in self.released)
        together = None
        if lacks := lacking(done.whole.space, self.candidates):
            self.progress(
                "base fit", 0.5, "with friction and rotors of all joints that the file lacks"
            )
            if not is_held:  # else it begins with a load
                together = with_all(problem, lacks)
                is_known = problem.noise.is_measured or problem.noise.is_torque
                if fits is None and not is_known and leads_astray(together):
                    return None
        family = _drives(done, self.candidates, self.seed, together)
        best = done.whole if family is None else family.fit
        if fits is None and (doubted := doubted_of(best)):
            # What is known of a link does not hold, so the base may not bend it: what is wrong
            # there is looked for like any other cause.
            bent = ", ".join(problem.parameters[index].name for index in doubted)
            self.progress("base fit", 0.5, f"without {bent}")
            done = _held(done, doubted)
            if has_free_starts:
                done = as_kept(done)
            family = _drives(done, self.candidates, self.seed)
        return done, family


def begun_with(
    done: BaseFits,
    family: Family | None,
    *,
    seed: int,
    candidates: tuple[Candidate, ...],
    ruled_out: dict[str, str],
    doubted: tuple[str, ...],
) -> Search:
    """Return a search that has just begun, from fits of its base.

    Args:
        done: the fits.
        family: what the model file lacks of the drives, if anything.
        seed: of everything random.
        candidates: what is looked for.
        ruled_out: effects that cannot be, and why.
        doubted: parameters that were taken out of the base.
    """
    space = done.whole.space
    problem, test = space.problem, space.problem.of("test")
    losses = stretches(problem, space.variant(done.whole.z), test)
    found = Search(
        problem=problem,
        rng=np.random.default_rng([seed, 1]),
        candidates=candidates,
        ruled_out=ruled_out,
        doubted=doubted,
        base=done.whole,
        nominal=done.nominal,
        parts=done.parts,
        current=done.whole,
        nominal_losses=stretches(problem, space.variant(np.zeros(space.size)), test),
        base_losses=losses,
        current_losses=losses,
    )
    if family is not None:
        found.screened |= {each.label: screened_of(family.fit, each) for each in family.gains}
        join(found, family)
        found.parts = found.current
    return found


def begin_without(found: Search, gone: Sequence[int], *, seed: int) -> Search:
    """Return a search that has just begun, as another one whose base may not bend so much.

    Args:
        found: the other one, just begun.
        gone: which of its base's parameters stay as the model file has them.
        seed: of everything random.
    """
    known = found.problem.parameters
    done = _held(BaseFits(found.nominal, found.base_parts, found.base), gone)
    return begun_with(
        done,
        _drives(done, found.candidates, seed),
        seed=seed,
        candidates=found.candidates,
        ruled_out=found.ruled_out,
        doubted=(*found.doubted, *(known[index].name for index in gone)),
    )


def _drives(
    done: BaseFits, candidates: Sequence[Candidate], seed: int, together: Fit | None = None
) -> Family | None:
    """Return what the model file lacks of the drives; beside a load where links are held.

    Args:
        done: the fits of the base.
        candidates: what is looked for.
        seed: of everything random.
        together: a fit with all that the file may lack; None where the base may not bend some of
            its links.
    """
    lacks = lacking(done.whole.space, candidates)
    loads = loads_of(candidates) if together is None else ()
    rng = np.random.default_rng([seed, 3])
    return with_drives(done.whole, lacks, rng, loads, offsets_of(candidates), together)


def _held(done: BaseFits, gone: Sequence[int]) -> BaseFits:
    """Return a base's fits with some of its parameters as the model file has them."""
    return fit_without(Space(done.whole.space.problem.without(gone)), done, gone)


def doubted_of(fit: Fit) -> list[int]:
    """Return which parameters a fit bends further than what is known of them allows."""
    off = np.abs(bends(fit.space.problem.parameters, fit.z))
    return [int(index) for index in np.flatnonzero(off > FAR_FROM_KNOWN)]
