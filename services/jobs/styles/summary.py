"""What `riposte styles` finds out about a run's protagonists, as one value."""

import dataclasses

import msgspec
import numpy as np
from numpy.typing import NDArray

from services.league.history import RunState
from shared.errors import ConfigError, RiposteError
from shared.styles import components, diversity, selection, separability
from shared.styles.bouts import BoutTable
from shared.styles.components import Components
from shared.styles.features import FEATURES
from shared.styles.sample import StyleSample
from shared.styles.selection import Selection

SCHEMA = 2
PROTAGONIST = 1
"""Row of a bout's features."""
GOAL_ACCURACY = 0.9
"""Share of bouts of the selected three that are to be given to the right one."""
WARM_START = "warm start"
_GENERATOR_SEED = 0
"""Of folds and bootstraps: the same table gives the same numbers."""


class Frozen(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Base of what ``styles.json`` holds."""


class FeatureNote(Frozen, frozen=True, kw_only=True):
    """One feature's name, unit and definition."""

    name: str
    title: str
    unit: str
    definition: str


class PolicyStyle(Frozen, frozen=True, kw_only=True):
    """How one protagonist moves."""

    label: str
    reference: str
    part: str
    """``selected``, ``library``, ``warm_start`` or ``other`` (a scripted one, for comparison)."""
    round: int
    """Round of phase two that made it; 0 for the others."""
    bouts: int
    score: float
    """Antagonist's mean points a bout against it."""
    mean: tuple[float, ...]
    """Of the eight features: its style."""
    spread: tuple[float, ...]
    """Standard deviation of each from bout to bout."""
    components: tuple[float, ...]
    """Its style in the first three components."""
    component_spread: tuple[float, ...]


class TripleNote(Frozen, frozen=True, kw_only=True):
    """Three policies and how far apart they are."""

    policies: tuple[str, ...]
    smallest: float
    mean: float


class AccuracyNote(Frozen, frozen=True, kw_only=True):
    """Share of bouts given to the policy that played them, with its 95 % interval."""

    share: float
    low: float
    high: float
    folds: int
    confusion: tuple[tuple[int, ...], ...]
    """Bouts of a policy (row) taken for another's (column)."""


class SeparabilityNote(Frozen, frozen=True, kw_only=True):
    """How well some policies can be told apart by a bout's features."""

    policies: tuple[str, ...]
    bouts: int
    chance: float
    random_folds: AccuracyNote
    """By a support vector machine, on bouts held out at random."""
    linear: AccuracyNote
    """On the same bouts, by a linear discriminant."""
    by_opponent: AccuracyNote | None
    """By a linear discriminant, on bouts against an opponent it has not seen."""


class MeasureNote(Frozen, frozen=True, kw_only=True):
    """A number with its 95 % interval."""

    value: float
    low: float
    high: float


class StylesSummary(Frozen, frozen=True, kw_only=True):
    """Everything ``styles.json`` holds."""

    schema: int = SCHEMA
    run: str
    seed: int
    """Of the run."""
    tournament_seed: int
    opponents: tuple[str, ...]
    """Antagonists that every style was measured against."""
    features: tuple[FeatureNote, ...]
    policies: tuple[PolicyStyle, ...]
    """Selected ones first, then the warm start, the rest of the library, the others."""
    information: tuple[float, ...]
    """Share of the policies' variance kept by 1, 2, ... components."""
    information_of_bouts: tuple[float, ...]
    """The same for components fitted to single bouts."""
    axes: tuple[tuple[float, ...], ...]
    """Weights of the standardised features in each of the three components."""
    why_not: str
    """Why three components keep less than 98 %; empty when they do."""
    criterion: str
    triples: tuple[TripleNote, ...]
    """All of them, the selected one first."""
    distances: tuple[tuple[float, ...], ...]
    """Between the policies of the library, in the order of ``library``."""
    library: tuple[str, ...]
    selected_apart: SeparabilityNote
    library_apart: SeparabilityNote
    distance: MeasureNote
    """Mean distance of two policies of the library, in standard deviations from bout to bout."""
    effective_styles: MeasureNote
    trained_by: str
    selected_by: str
    commit: str

    def of_part(self, part: str) -> list[PolicyStyle]:
        """Return the policies of a part, in order."""
        return [policy for policy in self.policies if policy.part == part]


@dataclasses.dataclass(frozen=True)
class Cast:
    """Who takes part: player references by label."""

    library: dict[str, str]
    """Protagonists of phase two: ``round 3`` and its reference, in order."""
    rounds: dict[str, int]
    warm_start: str | None
    others: dict[str, str]
    """Other protagonists of the tournament, for comparison."""
    opponents: dict[str, str]
    """Antagonists of phase two by label."""

    @property
    def protagonists(self) -> dict[str, str]:
        """Return everybody by label; the warm start only if there is one."""
        warm = {} if self.warm_start is None else {WARM_START: self.warm_start}
        return {**self.library, **warm, **self.others}


@dataclasses.dataclass(frozen=True)
class Analysis:
    """The summary, and what figures need besides it."""

    summary: StylesSummary
    sample: StyleSample
    """Of everybody."""
    components: Components


def cast_of(state: RunState, table: BoutTable) -> Cast:
    """Return who of a run's tournament is who.

    Raises:
        ConfigError: the run has too few protagonists to select from.
    """
    pairs = state.library()
    if len(pairs) < selection.SELECTED:
        raise ConfigError(
            f"selecting {selection.SELECTED} protagonists needs at least {selection.SELECTED} "
            f"rounds of phase two, this run has {len(pairs)}; "
            "train it with: riposte train --phase all --rounds 6"
        )
    library = {f"round {number}": protagonist for number, _, protagonist in pairs}
    warm = state.warm_start()
    known = {*library.values(), *([warm[1]] if warm else [])}
    return Cast(
        library=library,
        rounds={f"round {number}": number for number, _, _ in pairs},
        warm_start=warm[1] if warm else None,
        others={table.label(ref): ref for ref in table.protagonists if ref not in known},
        opponents={f"antagonist of round {number}": antagonist for number, antagonist, _ in pairs},
    )


def sample_of(cast: Cast, table: BoutTable) -> StyleSample:
    """Return the bouts of everybody who met all of the library's antagonists equally often.

    Raises:
        RiposteError: a protagonist of the library has not, or not equally often; says who and whom.
    """
    absent = [label for label, ref in cast.opponents.items() if ref not in table.antagonists]
    if absent:
        raise RiposteError(
            f"the table of bouts has none against the {absent[0]}, or is of another run; "
            "play them with: riposte tournament RUN"
        )
    met = {
        label: [_bouts(table, opponent, reference) for opponent in cast.opponents.values()]
        for label, reference in cast.protagonists.items()
    }
    most = max(len(rows) for label in cast.library for rows in met[label])
    for label in cast.library:
        for opponent, rows in zip(cast.opponents, met[label], strict=True):
            if len(rows) != most or not most:
                raise RiposteError(
                    f"{label} has played {len(rows)} of {most} bouts against the {opponent}; "
                    "finish with: riposte tournament RUN"
                )
    whole = [label for label in met if all(len(rows) == most for rows in met[label])]
    rows = np.concatenate([rows for label in whole for rows in met[label]])
    return StyleSample.of(
        [label for label in whole for _ in range(most * len(cast.opponents))],
        [opponent for _ in whole for opponent in cast.opponents for _ in range(most)],
        table.features[rows, PROTAGONIST].astype(np.float64),
    )


def _bouts(table: BoutTable, antagonist: str, protagonist: str) -> NDArray[np.intp]:
    """Return the rows of two players' bouts, none if one of them is not in the table."""
    if protagonist not in table.protagonists:
        return np.empty(0, np.intp)
    return table.pairing(table.antagonists.index(antagonist), table.protagonists.index(protagonist))


def analyse(
    cast: Cast, table: BoutTable, seed: int, trained_by: str, selected_by: str, commit: str
) -> Analysis:
    """Return everything there is to say about the styles of a run's protagonists.

    Args:
        cast: who is who.
        table: the tournament's bouts.
        seed: of the run.
        trained_by: command line that trains such a run.
        selected_by: command line that asked for this.
        commit: of the code.

    Raises:
        RiposteError: the table is incomplete, or the policies are all alike.
    """
    sample = sample_of(cast, table)
    library = sample.subset(list(cast.library))
    fitted = components.fit_components(library)
    found = selection.select(library, fitted)
    generator = np.random.default_rng(_GENERATOR_SEED)
    three = _separability(sample.subset(found.chosen.policies), generator)
    everybody = _separability(library, generator)
    measured = diversity.diversity(library, generator)
    summary = StylesSummary(
        run=table.provenance.run,
        seed=seed,
        tournament_seed=table.provenance.seed,
        opponents=sample.opponents,
        features=tuple(FeatureNote(**feature._asdict()) for feature in FEATURES),
        policies=tuple(_styles(cast, table, sample, fitted, found)),
        information=tuple(fitted.information(k + 1) for k in range(len(FEATURES))),
        information_of_bouts=_floats(np.cumsum(fitted.bout_shares)),
        axes=tuple(_floats(axis) for axis in fitted.axes[: components.KEPT]),
        why_not=fitted.why_not(),
        criterion=selection.CRITERION,
        triples=tuple(TripleNote(**dataclasses.asdict(triple)) for triple in found.triples),
        distances=tuple(_floats(row) for row in found.distances),
        library=found.policies,
        selected_apart=three,
        library_apart=everybody,
        distance=MeasureNote(**dataclasses.asdict(measured.distance)),
        effective_styles=MeasureNote(**dataclasses.asdict(measured.effective_styles)),
        trained_by=trained_by,
        selected_by=selected_by,
        commit=commit,
    )
    return Analysis(summary, sample, fitted)


def _styles(
    cast: Cast, table: BoutTable, sample: StyleSample, fitted: Components, found: Selection
) -> list[PolicyStyle]:
    """Return everybody's style: the selected, the warm start, the rest of the library, others."""
    rest = [label for label in cast.library if label not in found.chosen.policies]
    parts = dict.fromkeys(found.chosen.policies, "selected")
    parts |= {WARM_START: "warm_start"} if WARM_START in sample.policies else {}
    parts |= dict.fromkeys(rest, "library")
    parts |= dict.fromkeys((name for name in cast.others if name in sample.policies), "other")
    means, spreads = sample.means(), sample.spreads()
    projected = fitted.project(sample.features)
    styles: list[PolicyStyle] = []
    for label, part in parts.items():
        k = sample.policies.index(label)
        own = projected[sample.policy == k]
        reference = cast.protagonists[label]
        played = [_bouts(table, opponent, reference) for opponent in cast.opponents.values()]
        styles.append(
            PolicyStyle(
                label=label,
                reference=reference,
                part=part,
                round=cast.rounds.get(label, 0),
                bouts=len(own),
                score=float(table.score[np.concatenate(played)].mean()),
                mean=_floats(means[k]),
                spread=_floats(spreads[k]),
                components=_floats(own.mean(axis=0)),
                component_spread=_floats(own.std(axis=0, ddof=1)),
            )
        )
    return styles


def _separability(sample: StyleSample, generator: np.random.Generator) -> SeparabilityNote:
    found = separability.separability(sample, generator)
    unseen = None if found.by_opponent is None else _accuracy(found.by_opponent)
    return SeparabilityNote(
        policies=found.policies,
        bouts=found.bouts,
        chance=found.chance,
        random_folds=_accuracy(found.random_folds),
        linear=_accuracy(found.linear),
        by_opponent=unseen,
    )


def _accuracy(found: separability.Accuracy) -> AccuracyNote:
    return AccuracyNote(
        share=found.share,
        low=found.low,
        high=found.high,
        folds=found.folds,
        confusion=tuple(tuple(int(count) for count in row) for row in found.confusion),
    )


def _floats(values: NDArray[np.float64]) -> tuple[float, ...]:
    return tuple(float(value) for value in values)
