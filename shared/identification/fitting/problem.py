"""Variants of the model against the recordings: residuals in units of the noise floor."""

import copy
import math
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from shared.identification.arm.segments import Segment, segments_of
from shared.identification.arm.start_errors import Doubt, FreeStarts, StartErrors
from shared.identification.arm.subject import Subject
from shared.identification.dataset.types import Dataset, Float64
from shared.identification.effect import Candidate
from shared.identification.fitting.lacking import Lacking
from shared.identification.fitting.parameters import BaseParameter, enter_base
from shared.identification.noise.blocks import Bins, beside
from shared.identification.noise.floor import Noise
from shared.sim.plant.plant import Plant, stepped
from shared.sim.plant.replay import Reports
from shared.sim.plant.rollouts import Entry, Rollouts, as_it_is
from shared.sim.plant.row import Row
from shared.sim.plant.signals import pose_error, smoothed
from shared.sim.plant.structure import Structure

BLOCK = 0.02
"""Residuals are averaged over this long: what a 50 Hz look at the arm would see (s)."""
_WITH_MORE = 64
"""Arms at once, of those with what an effect compiles into them."""
DIVERGED = 1e3
"""Residual of an arm whose physics diverged, in noise floors."""


@dataclass(frozen=True)
class Variant:
    """The base model at coordinates, with effects in it."""

    x: Float64
    """float64[n]."""
    extras: tuple[tuple[Candidate, Float64], ...] = ()

    def with_extra(self, candidate: Candidate, values: Float64) -> "Variant":
        """Return it with one more effect, or with another size of one it has."""
        kept = tuple(extra for extra in self.extras if extra[0] != candidate)
        return Variant(self.x, (*kept, (candidate, values)))


class Span(NamedTuple):
    """Some of a recording."""

    trajectory: str
    begin: float
    """(s)."""
    end: float
    """(s)."""


@dataclass
class Problem:
    """A data set, an arm, and what is fitted."""

    subject: Subject
    dataset: Dataset
    parameters: tuple[BaseParameter, ...]
    noise: Noise
    window: float | None = None
    """Length of the parts that are replayed (s); None for as long as they come."""
    uncounted: dict[int, NDArray[np.bool_]] = field(default_factory=dict[int, NDArray[np.bool_]])
    """bool[B] by segment: blocks that no loss counts, since something outside acted there."""
    aside: tuple[Span, ...] = ()
    """What nothing is fitted to, since something outside acted there."""
    free_starts: FreeStarts | None = None
    """What parts are off by where they begin, where noise is without it; of the nominal arm, unless
    another one is given."""
    segments: tuple[Segment, ...] = field(init=False)
    _arms: dict[tuple[Structure, float], Rollouts] = field(
        default_factory=dict[tuple[Structure, float], Rollouts]
    )
    """Compiled, by what effects have added and by time step."""
    _bins: dict[int, tuple[Bins, Bins | None]] = field(init=False)
    _whitening: dict[int, Float64 | None] = field(init=False)
    _lacking: Lacking = field(init=False)
    _doubts: dict[int, dict[str, Doubt]] = field(init=False)
    """What residuals have in them of first states, by segment; where that is taken off: of them as
    they are, and of what is new in each block."""

    def __post_init__(self) -> None:
        self.segments = segments_of(self.dataset, self.subject, self.window)
        self._lacking = Lacking(self.subject, self.dataset)
        self._arms.setdefault(((), self.subject.plant.timestep), self.subject.nominal)
        self._bins = {}
        self._whitening = {}
        self._doubts = {}
        if not self.noise.has_free_starts:
            self.free_starts = None
        elif self.free_starts is None:
            self.free_starts = FreeStarts(self.subject.nominal, as_it_is)
        for index, segment in enumerate(self.segments):
            recorded = segment.recorded
            tracker = None if recorded.tracker_at is None else Bins.of(recorded.tracker_at, BLOCK)
            of_joints = Bins.of(recorded.joints_at, BLOCK)
            self._bins[index] = (of_joints, tracker)
            q = of_joints.mean(segment.q)
            self._whitening[index] = self.noise.whitening(self.subject.nominal, q)

    def in_parts(self, longest: float) -> "Problem":
        """Return :meth:`windowed`, no longer than what the problem has already."""
        is_short = all(segment.recorded.joints_at[-1] <= longest for segment in self.segments)
        return self if is_short else self.windowed(longest)

    def windowed(self, window: float) -> "Problem":
        """Return the same with recordings in parts that each start from the measured state."""
        return Problem(
            self.subject, self.dataset, self.parameters, self.noise, window,
            aside=self.aside, free_starts=self.free_starts, _arms=self._arms,
        )  # fmt: skip

    def starting_as(self, variant: Variant) -> "Problem":
        """Return the same with first states as free as a variant answers them."""
        arms = self._compiled(self.structure(variant), None)
        return replace(self, free_starts=FreeStarts(arms, self.entry(variant)))

    def with_plant(self, plant: Plant) -> "Problem":
        """Return the same recordings of another arm, which has the same numbers in its base."""
        known = self.subject.nominal
        nominal = Rollouts(plant, (), known.capacity, known.threads)
        return Problem(
            replace(self.subject, plant=plant, nominal=nominal), self.dataset, self.parameters,
            self.noise, self.window, aside=self.aside, free_starts=self.free_starts,
        )  # fmt: skip

    def without(self, gone: Sequence[int]) -> "Problem":
        """Return the same with some parameters as the model file has them, by their places."""
        kept = tuple(each for index, each in enumerate(self.parameters) if index not in gone)
        return replace(self, parameters=kept)

    def smooth(self) -> "Problem":
        """Return the same with commands that move on straight lines, not from step to step."""
        is_pose = self.subject.control == "pose"
        same = copy.copy(self)
        same.segments = tuple(
            replace(each, recorded=replace(each.recorded, command=smoothed(command, is_pose)))
            for each in self.segments
            for command in (each.recorded.command,)
        )
        return same

    def freer(self, more: Sequence[BaseParameter]) -> "Problem":
        """Return the same with more numbers in the base, after those that it has."""
        return Problem(
            self.subject, self.dataset, (*self.parameters, *more), self.noise, self.window,
            self.uncounted, self.aside, self.free_starts, _arms=self._arms,
        )  # fmt: skip

    def of(self, split: str) -> tuple[int, ...]:
        """Return the segments of the trajectories to fit to (``train``) or held out (``test``).

        Without those to fit to that are set aside, if only in part.
        """
        return tuple(
            index
            for index, segment in enumerate(self.segments)
            if self.dataset.trajectories[segment.trajectory].split == split
            and not (split == "train" and self._is_aside(segment))
        )

    def _is_aside(self, segment: Segment) -> bool:
        name = self.dataset.trajectories[segment.trajectory].name
        begin = segment.recorded.begin
        end = begin + float(segment.recorded.joints_at[-1])
        return any(
            each.trajectory == name and each.begin < end and begin < each.end for each in self.aside
        )

    def structure(self, variant: Variant) -> Structure:
        """Return what has to be compiled into the arm for a variant."""
        edits = [
            edit
            for candidate, _ in variant.extras
            for edit in candidate.effect.structure(self.subject, candidate.place)
        ]
        return tuple(dict.fromkeys(edits))

    def reports(
        self, variants: Sequence[Variant], segments: Sequence[int], timestep: float | None = None
    ) -> list[list[Reports]]:
        """Return what each variant would have logged, by variant and segment.

        Args:
            variants: of the model.
            segments: which they replay.
            timestep: of the physics (s); the arm's own if None.
        """
        self._free_starts(segments)
        groups: dict[Structure, list[int]] = defaultdict(list)
        for index, variant in enumerate(variants):
            groups[self.structure(variant)].append(index)
        out: list[list[Reports]] = [[] for _ in variants]
        for structure, members in groups.items():
            work = [
                (self.entry(variants[index]), self.segments[segment].recorded)
                for index in members
                for segment in segments
            ]
            found = self._compiled(structure, timestep).run(work)
            for position, index in enumerate(members):
                out[index] = found[position * len(segments) : (position + 1) * len(segments)]
        return out

    def _compiled(self, structure: Structure, timestep: float | None) -> Rollouts:
        plant = self.subject.plant
        key = structure, timestep or plant.timestep
        if key not in self._arms:
            nominal = self.subject.nominal
            capacity = _WITH_MORE if structure else nominal.capacity
            other = plant if timestep is None else stepped(plant, timestep)
            self._arms[key] = Rollouts(other, structure, capacity, nominal.threads)
        return self._arms[key]

    def residuals(
        self, variants: Sequence[Variant], segments: Sequence[int], timestep: float | None = None
    ) -> list[list[Float64]]:
        """Return residuals in noise floors, by variant and segment: float64[B, C].

        Where repeats say what noise carries on, what is new in each block. B blocks of
        ``BLOCK``; C are the joints, then position and rotation of the tracker.
        """
        return [
            [
                self._without("new", self.noise.news(each), segment)
                for each, segment in zip(parts, segments, strict=True)
            ]
            for parts in self._off(variants, segments, timestep)
        ]

    def _without(self, which: Literal["plain", "new"], off: Float64, segment: int) -> Float64:
        """Return float64[B, C] without what a segment's first state may be off by."""
        doubts = self._doubts.get(segment)
        return off if doubts is None else doubts[which].without(off, self.uncounted.get(segment))

    def shape_of(self, segment: int) -> tuple[int, int]:
        """Return the shape of a segment's :meth:`residuals`: blocks, channels."""
        of_joints, of_tracker = self._bins[segment]
        rows, channels = len(of_joints.starts), len(self.noise.joints)
        if of_tracker is not None and self.noise.tracker is not None:
            rows, channels = min(rows, len(of_tracker.starts)), channels + len(self.noise.tracker)
        return rows, channels

    def positions(self, segment: int) -> Float64:
        """Return float64[B, J], where joints were in the blocks of a segment (rad, m)."""
        return self._bins[segment][0].mean(self.segments[segment].q)[: self.shape_of(segment)[0]]

    def size_of(self, segment: int) -> int:
        """Return how many numbers of :meth:`vector` are a segment's."""
        return math.prod(self.shape_of(segment))

    def rows_of(self, segments: Sequence[int], picked: Sequence[int]) -> NDArray[np.bool_]:
        """Return bool[M]: which numbers of :meth:`vector` on segments are of those picked."""
        wanted = set(picked)
        return np.concatenate(
            [np.full(self.size_of(segment), segment in wanted) for segment in segments]
        )

    def plain(self, variant: Variant, segments: Sequence[int]) -> list[Float64]:
        """Return residuals in noise floors as they are, whatever noise carries on, by segment.

        What is slow counts for as much there as what is fast.
        """
        parts = self._off([variant], segments)[0]
        return [self._without("plain", *each) for each in zip(parts, segments, strict=True)]

    def _off(
        self, variants: Sequence[Variant], segments: Sequence[int], timestep: float | None = None
    ) -> list[list[Float64]]:
        """Return residuals as they are, with what first states may be off by, in noise floors."""
        if (floor := self.noise.torque) is not None:
            return [[one / floor for one in self._lacks(each, segments)] for each in variants]
        return [
            [
                self._floors(report, segment)
                for report, segment in zip(reports, segments, strict=True)
            ]
            for reports in self.reports(variants, segments, timestep)
        ]

    def _lacks(self, variant: Variant, segments: Sequence[int]) -> list[Float64]:
        """Return float64[B, J] by segment: block means of torques that are missing (N m, N)."""
        entry = self.entry(variant)
        recordings = {self.segments[each].trajectory for each in segments}
        missing = {each: self._lacking.torque(entry, each) for each in recordings}
        out: list[Float64] = []
        for index in segments:
            segment = self.segments[index]
            at = self.dataset.trajectories[segment.trajectory].joints_at
            first = int(np.searchsorted(at, segment.recorded.begin))
            own = missing[segment.trajectory][first : first + len(segment.q)]
            out.append(self._bins[index][0].mean(own))
        return out

    def vector(
        self, variants: Sequence[Variant], segments: Sequence[int], timestep: float | None = None
    ) -> Float64:
        """Return float64[V, M]: the residuals of each variant in one row."""
        return np.stack(
            [
                np.concatenate([part.ravel() for part in parts])
                for parts in self.residuals(variants, segments, timestep)
            ]
        )

    @property
    def rough_timestep(self) -> float | None:
        """Return a longer step that does for what a change of the arm changes (s), if one does."""
        return self.subject.plant.rough_timestep

    def moved(
        self, variant: Variant, others: Sequence[Variant], segments: Sequence[int],
        is_rough: bool = False,
    ) -> tuple[Float64, Float64]:  # fmt: skip
        """Return residuals of a variant, float64[M], and how others differ, float64[V, M].

        Args:
            variant: where.
            others: what it is held against.
            segments: which they replay.
            is_rough: whether differences may be those at a longer step, whose error both have.
        """
        rough = self.rough_timestep if is_rough else None
        found = self.vector([variant, *others], segments, rough)
        own = found[0] if rough is None else self.vector([variant], segments)[0]
        return own, found[1:] - found[0]

    def raw(self, reports: Reports, segment: int) -> tuple[Float64, Float64 | None]:
        """Return the residuals at every reading: float64[T, J] (rad, m) and float64[K, 6]."""
        recorded, logged = self.segments[segment].recorded, self.segments[segment]
        joints = logged.q - reports.q
        if recorded.tracker_at is None or reports.tracker is None or logged.tracker is None:
            return joints, None
        return joints, pose_error(logged.tracker, reports.tracker)

    def in_floors(self, joints: Float64, segment: int) -> Float64:
        """Return block means of a segment's joint residuals, float64[B, J], in noise floors."""
        return self.noise.floors(joints, self._whitening[segment])

    def floors(self, reports: Reports, segment: int) -> Float64:
        """Return float64[B, C]: block means of a segment's residuals in noise floors.

        Args:
            reports: what a variant would have logged.
            segment: of which part.
        """
        return self._without("plain", self._floors(reports, segment), segment)

    def _floors(self, reports: Reports, segment: int) -> Float64:
        """Return the same with what first states may be off by."""
        joints, tracker = self.raw(reports, segment)
        of_joints, of_tracker = self._bins[segment]
        out = self.in_floors(of_joints.mean(joints), segment)
        if tracker is not None and of_tracker is not None and self.noise.tracker is not None:
            out = beside(out, of_tracker.mean(tracker) / self.noise.tracker)
        return np.nan_to_num(out, nan=DIVERGED, posinf=DIVERGED, neginf=-DIVERGED)

    def _free_starts(self, segments: Sequence[int]) -> None:
        """See to it that it is known of segments what they are off by where they begin."""
        if self.free_starts is None:
            return
        unknown = [each for each in segments if each not in self._doubts]
        errors = self.free_starts.of([self.segments[each].recorded for each in unknown])
        for segment, error in zip(unknown, errors, strict=True):
            columns = self._in_floors_of(error, segment)
            plain = new = Doubt.of(columns)
            if self.noise.memory is not None:
                fresh = [self.noise.news(each) for each in np.moveaxis(columns, -1, 0)]
                new = Doubt.of(np.stack(fresh, axis=-1))
            self._doubts[segment] = {"plain": plain, "new": new}

    def _in_floors_of(self, error: StartErrors, segment: int) -> Float64:
        """Return float64[B, C, K]: what starts are off by, in floors as residuals are."""
        of_joints, of_tracker = self._bins[segment]
        out = of_joints.mean(error.joints) / self.noise.joints[:, None]
        if error.tracker is not None and of_tracker is not None and self.noise.tracker is not None:
            out = beside(out, of_tracker.mean(error.tracker) / self.noise.tracker[:, None])
        doubt = self.noise.start_doubt
        return out if doubt is None else out * doubt.ravel()

    def entry(self, variant: Variant) -> Entry:
        """Return what lets a variant into an arm."""
        return _Enter(self.parameters, variant)


@dataclass(frozen=True)
class _Enter:
    parameters: tuple[BaseParameter, ...]
    variant: Variant

    def __call__(self, row: Row) -> None:
        enter_base(self.parameters, self.variant.x, row)
        for candidate, values in self.variant.extras:
            candidate.effect.enter(row, candidate.place, values)
