"""What ``reproduction.json`` holds: plain numbers, one struct for each part of the report."""

from typing import Any

import msgspec


class Frozen(msgspec.Struct, frozen=True, kw_only=True):
    """Base of what is in ``reproduction.json``."""


class Score(Frozen, frozen=True, kw_only=True):
    """Points a bout, or what the field says, with a 95 % interval."""

    mean: float
    low: float
    high: float
    count: int
    """Bouts (or updates, or rounds) it is the mean of."""


class Stretch(Frozen, frozen=True, kw_only=True):
    """An iteration of phase one, or a round of phase two: how far the score follows who learns."""

    name: str
    swing: float
    """Score where the antagonist had just learned minus where the protagonist had (points a
    bout)."""
    level: float
    """Their mean."""


class Draws(Frozen, frozen=True, kw_only=True):
    """Which opponents one round drew, or all rounds together."""

    round: int
    """0 for all rounds."""
    draws: int
    distinct: int
    """Different versions among them."""
    warm_starts: int
    """How often the warm start, the oldest version, was drawn."""
    warm_starts_expected: float
    by_age: tuple[int, ...]
    """Draws by fifth of the history, oldest first; scripted anchors last."""
    by_age_expected: tuple[float, ...]
    statistic: float | None
    """Pearson's chi-square over the fifths; None where no draw had a choice."""
    p: float | None
    replayed: int
    """Draws that the sampler repeats when asked again."""
    points: tuple[tuple[str, int, int], ...] = ()
    """Of one round: who learned, iteration from 1, place of the opponent in the history from 0,
    the warm start."""


class Cell(Frozen, frozen=True, kw_only=True):
    """One pairing of the tournament."""

    antagonist: str
    protagonist: str
    bouts: int
    score: Score
    camping_share: float


class Rated(Frozen, frozen=True, kw_only=True):
    """One player's Elo rating."""

    agent: str
    player: str
    elo: float
    low: float
    high: float
    win_share: float


class Held(Frozen, frozen=True, kw_only=True):
    """What the scripted antagonists score against one protagonist, each counted alike."""

    protagonist: str
    score: Score
    below_static: Score | None
    """Static's score minus this: points taken off by this protagonist."""
    below_heuristic: Score | None
    below_retreating: Score | None = None
    """Than the heuristic that leaves the target before it is paid for."""
    camping_points: float = 0.0
    """Of ``score``, points a bout that were paid for the protagonist's camping."""


class Tournament(Frozen, frozen=True, kw_only=True):
    """What was played between the library's players, and others."""

    bouts: int
    least_bouts: int
    """Bouts of one protagonist of the library against antagonists of the library, at least."""
    antagonists: tuple[str, ...]
    protagonists: tuple[str, ...]
    cells: tuple[Cell, ...]
    camping_share: float
    """Of all points given and taken in all bouts."""
    ratings: tuple[Rated, ...]
    scripted: tuple[str, ...]
    """Scripted antagonists."""
    held: tuple[Held, ...]
    """The baselines first, then the library's protagonists."""
    baselines: tuple[str, ...]
    """Names of those protagonists that are baselines."""


class Styles(Frozen, frozen=True, kw_only=True):
    """What ``riposte styles`` found."""

    policies: int
    information: float
    """Share of the policies' variance in three components."""
    information_of_bouts: float
    """The same for components of single bouts."""
    why_not: str
    selected: tuple[str, ...]
    accuracy: Score
    """Share of the selected three's bouts given to the right one, on folds drawn at random."""
    accuracy_unseen: Score | None
    """The same with one opponent's bouts held out at a time."""
    chance: float
    distance: Score
    """Mean distance of two policies, in standard deviations from bout to bout."""
    effective_styles: Score


class Exploited(Frozen, frozen=True, kw_only=True):
    """Best responses to one protagonist."""

    name: str
    round: int
    """0 for the warm start."""
    score: Score
    highest: float
    samples: int
    """Budget of each."""


class Stage(Frozen, frozen=True, kw_only=True):
    """A stage of the pipeline and how long it took."""

    name: str
    seconds: float


class Pipeline(Frozen, frozen=True, kw_only=True):
    """What of ``pipeline.json`` matters here: the stages after training."""

    stages: tuple[Stage, ...] = ()


class Claim(Frozen, frozen=True, kw_only=True):
    """What the paper, or a goal of this reproduction, says; what was found; whether they agree."""

    about: str
    expected: str
    found: str
    holds: bool | None
    """None: not known yet."""
    source: str
    """``paper`` or ``goal``."""


class Missing(Frozen, frozen=True, kw_only=True):
    """A part that has not been made, and the command that makes it."""

    part: str
    command: str
    reason: str = ""


class Reproduction(Frozen, frozen=True, kw_only=True):
    """The whole report."""

    schema: int = 1
    run: str
    seed: int
    sampler: str
    iterations: int
    """Of phase one."""
    round_iterations: int
    round_updates: tuple[int, int]
    """Of the antagonist, of the protagonist, in one iteration."""
    rounds: int
    """Played out."""
    rounds_planned: int
    stretches: tuple[Stretch, ...]
    draws: tuple[Draws, ...]
    """All rounds together first, then each."""
    tournament: Tournament | None
    styles: Styles | None
    exploitability: tuple[Exploited, ...]
    stages: tuple[Stage, ...]
    seconds: float
    claims: tuple[Claim, ...]
    missing: tuple[Missing, ...]
    details: dict[str, Any] = {}
