"""Finds what a simulation gets wrong, and says so."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from shared.identification.arm.subject import plant_of
from shared.identification.catalogue import effects
from shared.identification.conclusion.conclude import Conclusion, conclude, extended
from shared.identification.conclusion.evidence import Evidence
from shared.identification.conclusion.gathered import evidence_of
from shared.identification.dataset.caveats import in_words
from shared.identification.dataset.types import (
    Dataset,
    with_encoders,
    with_timestep,
    without_limits,
)
from shared.identification.effect import Effect
from shared.identification.fitting.base import SavedFits
from shared.identification.fitting.drive_limits import low_limits
from shared.identification.fitting.lead import ahead_of_commands
from shared.identification.fitting.problem import BLOCK, Span, Variant
from shared.identification.fitting.saved import fits_of, load, save
from shared.identification.fitting.timestep import coarse_step, shorter
from shared.identification.fitting.whole import fit_to_all
from shared.identification.leftover.located import leftovers
from shared.identification.progress import Progress, silent
from shared.identification.search.again import fresh, leave_out, pushed_in
from shared.identification.search.astray import counted_by_torque
from shared.identification.search.begin import begin, begin_without, doubted_of
from shared.identification.search.bent import is_worse, otherwise, worse_than_file
from shared.identification.search.beyond import is_of_gears, is_seen_beyond, may_be_beyond
from shared.identification.search.cleared import clear
from shared.identification.search.far import bent_beyond_belief
from shared.identification.search.likeness import why_only_like
from shared.identification.search.misstated import misstated
from shared.identification.search.once import is_named, take_back_pushes, take_pushes
from shared.identification.search.rounds import search
from shared.identification.search.searched import Search, is_open
from shared.identification.search.sized import take_back_sizeless
from shared.identification.search.trimmed import led_astray
from shared.identification.verdict import Unexplained, Verdict
from shared.runtime.build import commit
from shared.runtime.service import version
from shared.telemetry.wording import listing

_LITTLE = 4.0
"""Mean square residual, in noise floors, up to which a time step may be all that is wrong."""
_STEP_SHOWS = 0.5
"""Root mean square of a joint, in noise floors, by which a time step shows where no start does."""


@dataclass(frozen=True)
class Finding:
    """A verdict and what it is drawn from."""

    verdict: Verdict
    evidence: Evidence


def identify(
    dataset: Dataset,
    *,
    seed: int = 0,
    progress: Progress = silent,
    resume_folder: Path | None = None,
    without: Sequence[str] = (),
    catalogue: Sequence[Effect] | None = None,
    threads: int = 1,
) -> Finding:
    """Return what the simulation of a data set gets wrong.

    Args:
        dataset: the recordings; ``truth.toml`` beside them is never read.
        seed: of everything random.
        progress: is told how far it is.
        resume_folder: where the base fit is kept, and taken from if it is of the same data.
        without: effects of the catalogue to leave out.
        catalogue: other effects than the project's.
        threads: of the physics; what is found does not depend on it.

    Raises:
        IdentificationError: the model does not fit the recordings, or an effect is unknown.
    """
    clock = _Stages()
    known = effects() if catalogue is None else tuple(catalogue)
    run = _Run(seed, progress, clock, tuple(each for each in known if each.name not in without))

    def begun(
        of: Dataset, folder: Path | None, aside: tuple[Span, ...] = (),
        fits: SavedFits | None = None,
    ) -> Search:  # fmt: skip
        if folder is not None:
            fits = load(folder, of, seed)
        begins = begin(
            of, seed=seed, progress=progress, without=frozenset(without), catalogue=known,
            fits=fits, aside=aside, threads=threads,
        )  # fmt: skip
        if folder is not None:
            save(folder, of, seed, begins)
        clock.over("base fit")
        return begins

    def folder_of(name: str) -> Path | None:
        return None if resume_folder is None else resume_folder / name

    def begun_at(step: float, aside: tuple[Span, ...] = ()) -> Search:
        progress("base fit", 0.0, f"again, at a time step of {1e3 * step:g} ms")
        return begun(with_timestep(own, step), folder_of("shorter_step"), aside)

    own = dataset
    begins = begun(own, resume_folder)
    if low := low_limits(begins.base):
        progress("base fit", 0.0, f"again, with no limit of the drive of {listing(low)}")
        own = without_limits(dataset, low)
        begins = begun(own, folder_of("without_limits"))
    if aside := led_astray(begins):
        progress("base fit", 0.0, f"again, {_without(aside)}")
        begins = begun(own, folder_of("not_led_astray"), aside)
    if (
        begins.problem.noise.has_free_starts
        and (step := shorter(begins.base, _STEP_SHOWS)) is not None
    ):
        begins = begun_at(step, begins.problem.aside)
    found, left = _searched(begins, run)
    if is_open(found) and (aside := pushed_in(found, left)):
        progress("base fit", 0.0, f"again, {_without(aside)}")
        other = begun(found.problem.dataset, folder_of("without_pushes"), aside)
        other, other_left = _searched(other, run, _pushes(left))
        if other.plainly.least < found.plainly.least:
            found, left = other, other_left
    if _may_be_its_step(found) and (step := shorter(found.base)) is not None:
        other, other_left = _searched(begun_at(step, found.problem.aside), run)
        if not is_open(other):
            found, left = other, other_left
    if is_open(found) and may_be_beyond(found.problem.dataset):
        progress("base fit", 0.0, "again, as if encoders sat beyond the gears")
        beyond = with_encoders(found.problem.dataset, "link")
        other = begun(beyond, None, found.problem.aside, fits_of(found))
        if is_seen_beyond(found, other):
            other, other_left = _searched(other, run)
            if not is_open(other) and is_of_gears(other):
                found, left = other, other_left
    if not is_open(found):
        if not found.accepted:
            found.otherwise = otherwise(found, progress)
        elif not any(found.rivals):
            found.only_like = why_only_like(found)
    clock.over("search")
    progress("diagnostics", 0.0)
    evidence = _evidence(found)
    conclusion = conclude(found, left)
    clock.over("diagnostics")
    return Finding(_verdict(found, conclusion, left, dataset, seed, clock.seconds), evidence)


class _Stages:
    """CPU seconds by stage."""

    def __init__(self) -> None:
        self._last = time.process_time()
        self.seconds: dict[str, float] = {}

    def over(self, stage: str) -> None:
        """Take note that a stage is over."""
        now = time.process_time()
        self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._last
        self._last = now


@dataclass(frozen=True)
class _Run:
    """What is the same for every search of a data set."""

    seed: int
    progress: Progress
    clock: _Stages
    effects: tuple[Effect, ...]
    """What may be named."""


def _without(aside: tuple[Span, ...]) -> str:
    return f"without what was pushed in {listing(sorted({each.trajectory for each in aside}))}"


def _searched(
    found: Search, run: _Run, known: Sequence[Unexplained] = ()
) -> tuple[Search, tuple[Unexplained, ...]]:
    """Return a search that is over, and what is left after it.

    Args:
        found: as it begins.
        run: of which it is.
        known: what came from outside, as an earlier search saw it.
    """
    seed, progress, clock = run.seed, run.progress, run.clock
    untouched = fresh(found, seed)
    search(found, progress)
    clear(found, progress)
    clock.over("search")
    progress("unexplained", 0.0)
    left = _left(found, known)
    clock.over("unexplained")
    if is_open(found) and leave_out(untouched, left):
        progress("screen", 0.0, "again, without held-out stretches in which something pushed")
        found = fresh(untouched, seed)
        search(found, progress)
        clock.over("search")
        left = _left(found, _pushes(left))
        clock.over("unexplained")
    left = _pushed_once(found, left)
    clock.over("unexplained")
    if not is_open(found) and (gone := doubted_of(found.current)):
        # A payload on the last link is that link, heavier: only what is known of links tells them
        # apart, and what they would have to be with all that was named says what to believe.
        bent = ", ".join(found.problem.parameters[index].name for index in gone)
        progress("screen", 0.0, f"again, without {bent}")
        other = begin_without(untouched, gone, seed=seed)
        search(other, progress)
        if (
            other.accepted
            and not is_open(other)
            and not is_worse(other.current_losses, found.current_losses)
        ):
            found, left = other, _left(other, known)
        clock.over("search")
    if other := misstated(found, untouched, run.effects, seed, progress):
        found, left = other, _left(other, _pushes(left))
    fit_to_all(found, left)
    take_back_sizeless(found, left)
    clock.over("search")
    return found, left


def _may_be_its_step(found: Search) -> bool:
    """Return whether a time step that is too long could be what a verdict tells of otherwise.

    It leaves a little more than a verdict may leave, or something looks like a small push, or like
    a delay that is hardly longer than what a simulation is late by itself.
    """
    is_little = is_open(found) and max(found.left.least, found.plainly.least) < _LITTLE
    if is_little or any(one.is_event for one in found.accepted):
        return True
    space, subject = found.current.space, found.problem.subject
    sizes = zip(space.candidates, space.values(found.current.z), strict=True)
    return any(
        0.0 < abs(float(values[0])) < 2.0 * each.effect.quantities(subject, each.place)[0].least
        for each, values in sizes
    )


def _pushed_once(found: Search, left: tuple[Unexplained, ...]) -> tuple[Unexplained, ...]:
    """Name what pushed once, if no law is missing; return what is left after that."""
    if take_back_pushes(found, left):
        left = _left(found, _pushes(left))
    if is_open(found) or not take_pushes(found, left):
        return left
    known = [each for each in _pushes(left) if not is_named(found, each)]
    left = _left(found, known)
    return _left(found, known) if take_back_pushes(found, left) else left


def _left(found: Search, known: Sequence[Unexplained] = ()) -> tuple[Unexplained, ...]:
    problem = found.problem
    if problem.noise.is_torque:
        return ()  # all that is left is taken for torques that nobody knows
    asked = (*problem.of("train"), *problem.of("test"))
    aside = sorted(set(range(len(problem.segments))) - set(asked))
    return leftovers(problem, extended(found), (*asked, *aside), known)


def _pushes(left: Sequence[Unexplained]) -> list[Unexplained]:
    """Return what came from outside, of what is left."""
    return [each for each in left if each.is_external]


def _evidence(found: Search) -> Evidence:
    nominal = Variant(np.zeros(len(found.problem.parameters)))
    base = found.base.variant
    return evidence_of(
        found.problem, {"nominal": nominal, "base_fit": base, "extended": extended(found)}
    )


def _verdict(
    found: Search,
    conclusion: Conclusion,
    left: tuple[Unexplained, ...],
    dataset: Dataset,
    seed: int,
    seconds: dict[str, float],
) -> Verdict:
    return Verdict(
        verdict=conclusion.word,
        sentence=f"{conclusion.sentence}{_beyond_limits(found)}",
        causes=conclusion.causes,
        ties=conclusion.ties,
        unexplained=left,
        held_out=conclusion.held_out,
        candidates=conclusion.candidates,
        ruled_out=found.ruled_out,
        limits=conclusion.limits,
        base=conclusion.base,
        caveats=(
            *_uncounted(found),
            *_not_fitted_to(found),
            *filter(
                None,
                [
                    worse_than_file(found),
                    conclusion.far,
                    bent_beyond_belief(found),
                    _shorter_step(found, dataset),
                    _beyond_gears(found, dataset),
                    coarse_step(found.base),
                    _without_limits(found),
                    ahead_of_commands(found.told),
                    counted_by_torque(found.problem.noise),
                ],
            ),
            *in_words(dataset.caveats),
        ),
        record_next=_record_next(conclusion, dataset),
        starts_agree=found.base.starts_agree,
        dataset=dataset.hash,
        model=dataset.source.kind,
        seed=seed,
        version=version(),
        commit=commit(),
        cpu_s=sum(seconds.values()),
        seconds=seconds,
        timestep=found.problem.subject.plant.timestep,
        unlimited=found.problem.dataset.source.unlimited,
    )


def _shorter_step(found: Search, dataset: Dataset) -> str:
    """Return in words that another time step than the model file's was taken; empty if not."""
    step = found.problem.dataset.source.timestep
    if step == dataset.source.timestep or step is None:
        return ""
    own = plant_of(dataset).timestep
    return (
        f"all of this was simulated at a time step of {1e3 * step:g} ms: at the model file's "
        f"{1e3 * own:g} ms more than noise was left, or what looked like a push or a delay of less "
        "than that. model.xml has it"
    )


def _beyond_gears(found: Search, dataset: Dataset) -> str:
    """Return in words that encoders are taken to sit beyond the gears; empty if not."""
    if found.problem.dataset.source.encoders == dataset.source.encoders:
        return ""
    return (
        "encoders are taken to sit beyond the gears, on the links: at the motors they leave more "
        'than noise unexplained. Write encoders = "link" into [model] of dataset.toml if that is '
        'so, or encoders = "motor"'
    )


def _beyond_limits(found: Search) -> str:
    """Return a sentence on drives that are taken to give more than the file says, if any are."""
    joints = found.problem.dataset.source.unlimited
    if not joints:
        return ""
    return f" All this is without the file's limits of the drives at {listing(joints)}."


def _without_limits(found: Search) -> str:
    """Return in words why such limits are left out; empty if none is."""
    joints = found.problem.dataset.source.unlimited
    if not joints:
        return ""
    return (
        f"the model file's drives are at their limits where the arm's are not, at "
        f"{listing(joints)}: with these limits the base leaves twice as much or more, so they are "
        "left out. Look up what the drives give, and correct forcerange and actuatorfrcrange; "
        "model.xml has ten times the file's"
    )


def _uncounted(found: Search) -> tuple[str, ...]:
    blocks = sum(int(each.sum()) for each in found.problem.uncounted.values())
    if not blocks:
        return ()
    return (
        f"{BLOCK * blocks:.1f} s of the held-out recordings are not counted: something outside "
        "pushed the arm there",
    )


def _not_fitted_to(found: Search) -> tuple[str, ...]:
    seconds = sum(each.end - each.begin for each in found.problem.aside)
    if not seconds:
        return ()
    return (
        f"{seconds:.1f} s of the recordings to fit to were left out: something outside pushed the "
        "arm there",
    )


def _record_next(conclusion: Conclusion, dataset: Dataset) -> tuple[str, ...]:
    """Return what would make the next verdict surer, what takes least first."""
    out = [tie.record for tie in conclusion.ties]
    names = {each.name for each in dataset.caveats}
    if "no_repeat" in names:
        out.append("Repeat one recording: without a repeat the noise floor is a guess.")
    if "no_effort" in names and dataset.control == "position" and conclusion.word != "none":
        out.append(
            "Log efforts beside the joints, torques or currents: of a servo how strong it is, how "
            "heavy its load and how much it rubs may all be larger together without them."
        )
    if conclusion.word in ("unexplained", "base_too_coarse"):
        out.append(
            "Record the whole programme that riposte identify excite designs, joint by joint."
        )
    if "no_tracker" in names:
        out.append(
            "Log a tracker beside the joints: what gives or lies behind the encoders does not "
            "show without one."
        )
    return tuple(out)
