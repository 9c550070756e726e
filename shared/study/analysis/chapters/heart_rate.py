"""Heart rate: peaks against resting and walking, and how sections of each level were described.

The heart-rate level of a section is its mean peak over its games, divided by the person's mean rate
while walking (paper, appendix).
"""

import dataclasses
import datetime

import numpy as np
from numpy.typing import NDArray

from shared.study.analysis.chapter import (
    Cell,
    Chapter,
    Picture,
    Table,
    estimate_words,
    p_words,
    percent_text,
)
from shared.study.analysis.finding import Estimate, Finding, missing_text
from shared.study.analysis.games import Games, each, mean_of
from shared.study.analysis.intervals import resampled
from shared.study.analysis.paired import Named, paired
from shared.study.analysis.questionnaires import choice_items, chosen
from shared.study.tables import Tables
from shared.telemetry.study_figures import adjective_panels, heart_panel

Floats = NDArray[np.float64]
RAISED = 1.2
"""Peak over walking from which a heart rate counts as clearly raised (paper: 20 % to 58 %)."""
EDGES = (1.0, 1.2, 1.4)
LEVELS = (
    "low, up to 100 %",
    "medium, 100 to 120 %",
    "high, 120 to 140 %",
    "ultra-high, over 140 %",
)


@dataclasses.dataclass(frozen=True)
class Beats:
    """Heart rates of a study (1/min); NaN where nothing was measured."""

    resting: Floats
    """float64[n], mean while seated."""
    walking: Floats
    """float64[n], mean while walking."""
    peaks: Floats
    """float64[n, S, G], largest in each game that counts."""
    left_out: tuple[str, ...]

    @property
    def levels(self) -> Floats:
        """Return float64[n, S], mean peak of each section over walking."""
        return mean_of(self.peaks) / self.walking[:, None]


def heart_rate_chapter(
    tables: Tables, games: Games, generator: np.random.Generator
) -> Chapter | None:
    """Return what hearts did, None where none was measured."""
    beats = beats_of(tables, games)
    if not np.isfinite(beats.peaks).any():
        return None
    shares = _shares(beats, generator)
    tests = _tests(beats)
    levels = _level_table(beats)
    adjectives = _adjectives(tables, games, beats)
    says = _words(shares, tests, beats)
    pictures = [Picture(
        lambda: heart_panel(_by_section(beats), EDGES),
        "Peak heart rate of each game over the person's walking heart rate, by section; the lines "
        "are the limits of the heart-rate levels.",
    )]  # fmt: skip
    felt: list[Table] = []
    if adjectives is not None:
        options, panels = adjectives
        felt.append(_felt_table(options, panels))
        pictures.append(Picture(
            lambda: adjective_panels(panels, options),
            "Share of sections that were described by each adjective, by the section's "
            "heart-rate level.",
        ))  # fmt: skip
    return Chapter(
        key="heart-rate",
        title="Heart rate",
        says=(*says, *beats.left_out),
        headlines=len(says),
        findings=(*tests, *shares),
        tables=(levels, *felt, _people_table(beats, games)),
        pictures=tuple(pictures),
    )


def beats_of(tables: Tables, games: Games) -> Beats:
    """Return baselines and peaks; what was measured without contact to the skin is left out."""
    n = len(games.people)
    index = {person: k for k, person in enumerate(games.people)}
    peaks = np.full(games.by_section.shape, np.nan)
    baselines: dict[tuple[int, str], list[tuple[str, float]]] = {}
    counted = _counted_attempts(tables, games)
    bad = 0
    names = ("participant", "bpm", "contact", "step", "section", "game", "attempt", "wall")
    for person, bpm, contact, step, section, game, attempt, wall in each(tables.heart_rate, *names):
        if person not in index:
            continue
        if not contact or not bpm > 0.0:
            bad += 1
            continue
        k = index[person]
        if step.startswith("baseline-"):
            baselines.setdefault((k, step), []).append((wall, bpm))
        elif section and game and counted.get((k, section - 1, game - 1)) == attempt:
            at = (k, section - 1, game - 1)
            peaks[at] = np.fmax(peaks[at], bpm)

    lasts = {f"baseline-{one.name}": one.seconds for one in tables.protocol.baseline}

    def mean(step: str) -> Floats:
        rows = [_latest(baselines.get((k, step), []), lasts.get(step, 0.0)) for k in range(n)]
        return np.array([np.mean(r) if r else np.nan for r in rows], np.float64)

    resting, walking = mean("baseline-resting"), mean("baseline-walking")
    played = np.isfinite(games.by_section)
    return Beats(
        resting=resting,
        walking=walking,
        peaks=peaks,
        left_out=(
            *missing_text(bad, "heart rates", "no contact to the skin, or not above zero"),
            *missing_text(int((played & ~np.isfinite(peaks)).sum()), "games", "no heart rate"),
            *missing_text(int(np.isnan(resting).sum()), "people", "no resting baseline"),
            *missing_text(int(np.isnan(walking).sum()), "people", "no walking baseline"),
        ),
    )


def _latest(rows: list[tuple[str, float]], seconds: float) -> list[float]:
    """Return the rates of the last so many seconds: a baseline that was interrupted began anew."""
    if not rows:
        return []
    walls = [datetime.datetime.fromisoformat(wall) for wall, _ in rows]
    begin = max(walls) - datetime.timedelta(seconds=seconds)
    return [bpm for wall, (_, bpm) in zip(walls, rows, strict=True) if wall >= begin]


def _counted_attempts(tables: Tables, games: Games) -> dict[tuple[int, int, int], int]:
    index = {person: k for k, person in enumerate(games.people)}
    names = ("participant", "section", "game", "attempt", "outcome", "is_recorded")
    return {
        (index[person], section - 1, game - 1): attempt
        for person, section, game, attempt, outcome, is_recorded in each(tables.games, *names)
        if person in index and is_recorded and outcome == "finished"
    }


def _shares(beats: Beats, generator: np.random.Generator) -> list[Finding]:
    found: list[Finding] = []
    for what, ratios, least in (
        ("peak above resting", beats.peaks / beats.resting[:, None, None], 1.0),
        ("peak above walking", beats.peaks / beats.walking[:, None, None], 1.0),
        ("peak 20 % or more above walking", beats.peaks / beats.walking[:, None, None], RAISED),
    ):
        rows = ratios.reshape(len(ratios), -1)
        there = np.isfinite(rows)
        kept = there.any(axis=1)
        if not kept.any():
            continue
        above = np.where(there, rows > least if least == 1.0 else rows >= least, False)
        counts = np.stack([above.sum(axis=1), there.sum(axis=1)], axis=1)[kept].astype(np.float64)
        share = resampled(counts, _ratio, generator, "share of games")
        found.append(
            Finding(
                question=f"share of games with {what}",
                test="share, people resampled",
                n=int(counts[:, 1].sum()),
                unit="games",
                estimate=share,
                left_out=missing_text(int((~there).sum()), "games", "no peak or no baseline"),
                note="the interval resamples whole people, whose games hang together",
            )
        )
    return found


def _ratio(rows: Floats) -> Floats:
    return rows[:, :, 0].sum(axis=1) / rows[:, :, 1].sum(axis=1)


def _tests(beats: Beats) -> list[Finding]:
    peaks = mean_of(beats.peaks.reshape(len(beats.peaks), -1))
    return [
        paired(peaks, baseline, Named(f"mean peak - {name} (1/min)"))
        for name, baseline in (("resting", beats.resting), ("walking", beats.walking))
    ]


def _words(shares: list[Finding], tests: list[Finding], beats: Beats) -> list[str]:
    said: list[str] = []
    values = {s.question: s.estimate for s in shares if s.estimate is not None}
    parts = [f"{q.removeprefix('share of games with peak ')} in {_share_words(e)}"
             for q, e in values.items()]  # fmt: skip
    if parts:
        largest = float(np.nanmax(beats.peaks / beats.walking[:, None, None])) - 1.0
        said.append(f"The peak heart rate of a game was {', '.join(parts)} of games; the largest "
                    f"was {percent_text(largest)} above walking.")  # fmt: skip
    said += [
        f"People's {test.question.removesuffix(' (1/min)')} is "
        f"{estimate_words(test.estimate)} beats a minute ({p_words(test)})."
        for test in tests
        if test.p is not None and test.estimate is not None
    ]
    return said


def _share_words(share: Estimate) -> str:
    text = percent_text(share.value)
    if share.low is None or share.high is None:
        return text
    return f"{text} (95 %: {percent_text(share.low)} to {percent_text(share.high)})"


def _level_of(levels: Floats) -> NDArray[np.int64]:
    """Return which level each is: an edge belongs to the level below it."""
    return np.searchsorted(np.array(EDGES), levels, side="left")


def _level_table(beats: Beats) -> Table:
    levels = beats.levels
    there = levels[np.isfinite(levels)]
    counts = np.bincount(_level_of(there), minlength=len(LEVELS))
    rows: list[tuple[Cell, ...]] = [
        (name, int(count), percent_text(count / len(there)) if len(there) else "-")
        for name, count in zip(LEVELS, counts, strict=True)
    ]
    return Table(
        name="heart_rate_levels",
        title="Sections by heart-rate level",
        columns=("level (mean peak / walking)", "sections", "share"),
        rows=tuple(rows),
        note=f"{len(there)} sections with a peak and a walking baseline; "
        f"{levels.size - len(there)} without are left out.",
    )


def _adjectives(
    tables: Tables, games: Games, beats: Beats
) -> tuple[list[str], list[tuple[str, list[float]]]] | None:
    """Return the options of the first question of several, and their shares by level."""
    items = choice_items(tables.protocol, is_several=True)
    for _, item in items:
        found = {at: options for at, options in chosen(tables, item.id).items() if at[1]}
        if not found:
            continue
        levels = beats.levels
        sections: list[list[list[str]]] = [[] for _ in LEVELS]
        for (person, section), options in found.items():
            if person in games.people and section <= levels.shape[1]:
                level = levels[games.people.index(person), section - 1]
                if np.isfinite(level):
                    sections[int(_level_of(np.array([level]))[0])].append(options)
        panels = [
            (f"{name} (n = {len(chosen_in)})",
             [sum(option in options for options in chosen_in) / len(chosen_in)
              for option in item.options])
            for name, chosen_in in zip(LEVELS, sections, strict=True)
            if chosen_in
        ]  # fmt: skip
        return (list(item.options), panels) if panels else None
    return None


def _felt_table(options: list[str], panels: list[tuple[str, list[float]]]) -> Table:
    return Table(
        name="adjectives_by_level",
        title="Adjectives by heart-rate level",
        columns=("adjective", *(title for title, _ in panels)),
        rows=tuple(
            (option, *(percent_text(shares[k]) for _, shares in panels))
            for k, option in enumerate(options)
        ),
        note="Share of the sections at a level that were described so.",
        is_folded=True,
    )


def _by_section(beats: Beats) -> list[Floats]:
    ratios = beats.peaks / beats.walking[:, None, None]
    found: list[Floats] = []
    for section in range(ratios.shape[1]):
        values = ratios[:, section].ravel()
        found.append(values[np.isfinite(values)])
    return found


def _people_table(beats: Beats, games: Games) -> Table:
    def cell(value: float, places: int = 1) -> float | None:
        return None if not np.isfinite(value) else round(float(value), places)

    peaks = mean_of(beats.peaks.reshape(len(beats.peaks), -1))
    rows: list[tuple[Cell, ...]] = [
        (person, cell(beats.resting[k]), cell(beats.walking[k]), cell(peaks[k]),
         *(cell(level, 3) for level in beats.levels[k]))
        for k, person in enumerate(games.people)
    ]  # fmt: skip
    sections = range(1, beats.levels.shape[1] + 1)
    return Table(
        name="heart_rate_people",
        title="Heart rate of each person (1/min), and level of each section",
        columns=("participant", "resting", "walking", "mean peak",
                 *(f"level of section {k}" for k in sections)),
        rows=tuple(rows),
        is_folded=True,
    )  # fmt: skip
