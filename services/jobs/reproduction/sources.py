"""What other commands left in a run's folder for the reproduction report.

Each part is None, or empty, where it is not there or cannot be read; then ``missing`` says what to
do about it.
"""

import json
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from services.jobs.reproduction.parts import (
    Cell,
    Exploited,
    Held,
    Missing,
    Rated,
    Score,
    Styles,
    Tournament,
)
from services.league.history import RunState
from shared.errors import RiposteError
from shared.messages.training import AGENTS

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from services.jobs.styles.summary import AccuracyNote, MeasureNote
    from shared.styles.bouts import BoutTable
    from shared.styles.payoff import Payoff

COVERAGE = (0.025, 0.975)
KEPT = 3
"""Components of the paper."""
STATIC = "scripted:static"
HEURISTIC = "scripted:heuristic"
RETREATING = "scripted:heuristic-retreating"
BASELINES = (STATIC, HEURISTIC, RETREATING)
INSTALL = "pip install 'riposte[styles]'"


def tournament_part(folder: Path, state: RunState, missing: list[Missing]) -> Tournament | None:
    """Return what was played, None when nothing was."""
    command = f"riposte tournament {folder}"
    path = folder / "tournament" / "bouts.parquet"
    if not path.exists():
        missing.append(Missing(part="tournament", command=command))
        return None
    try:
        from shared.styles.bouts import load

        return tournament_of(load(path), state)
    except ImportError as error:
        missing.append(Missing(part="tournament", command=INSTALL, reason=str(error)))
    except RiposteError as error:
        missing.append(Missing(part="tournament", command=command, reason=str(error)))
    return None


def tournament_of(table: "BoutTable", state: RunState) -> Tournament:
    """Return the numbers of a table of bouts."""
    from shared.styles.payoff import payoff_of

    generator = np.random.default_rng(state.seed)
    payoff = payoff_of(table, generator)
    library = state.library()
    own = {ref for _, *pair in library for ref in pair}
    cells = [
        Cell(
            antagonist=table.label(one),
            protagonist=table.label(two),
            bouts=int(payoff.bouts[i, k]),
            score=Score(
                mean=float(payoff.mean[i, k]), low=float(payoff.low[i, k]),
                high=float(payoff.high[i, k]), count=int(payoff.bouts[i, k]),
            ),
            camping_share=float(payoff.camping_share[i, k]),
        )
        for i, one in enumerate(payoff.antagonists)
        for k, two in enumerate(payoff.protagonists)
        if payoff.bouts[i, k]
    ]  # fmt: skip
    met = [i for i, one in enumerate(payoff.antagonists) if one in own]
    least = [int(payoff.bouts[met, k].sum()) for k, p in enumerate(payoff.protagonists) if p in own]
    rules = table.provenance.game
    camping = abs(rules.camping_award) * float(table.camping_steps.sum())
    moved = camping + abs(rules.point) * float(table.attack_steps.sum())
    moved += abs(rules.penalty) * float(table.penalty_steps.sum())
    scripted = [i for i, one in enumerate(payoff.antagonists) if _is_person(one)]
    played = [
        p for k, p in enumerate(payoff.protagonists) if scripted and payoff.bouts[scripted, k].all()
    ]
    wanted = [p for p in (*BASELINES, *(ref for _, _, ref in library)) if p in played]
    return Tournament(
        bouts=len(table),
        least_bouts=min(least, default=0),
        antagonists=tuple(table.label(ref) for ref in payoff.antagonists),
        protagonists=tuple(table.label(ref) for ref in payoff.protagonists),
        cells=tuple(cells),
        camping_share=camping / moved if moved else 0.0,
        ratings=_ratings(payoff, table, generator),
        scripted=tuple(table.label(payoff.antagonists[i]) for i in scripted),
        held=tuple(_held(payoff, table, scripted, ref, played) for ref in wanted),
        baselines=tuple(table.label(ref) for ref in BASELINES if ref in played),
    )


def _is_person(reference: str) -> bool:
    """Return whether an antagonist is scripted and moves."""
    return reference.startswith("scripted:") and reference != STATIC


def _held(
    payoff: "Payoff", table: "BoutTable", scripted: list[int], ref: str, played: list[str]
) -> Held:
    """Return what the scripted antagonists score against a protagonist, and against baselines."""

    def means(protagonist: str) -> "tuple[float, NDArray[np.float64]]":
        k = payoff.protagonists.index(protagonist)
        resampled = payoff.resampled[:, scripted, k].mean(axis=1)
        return float(payoff.mean[scripted, k].mean()), resampled

    mean, resampled = means(ref)
    own = payoff.protagonists.index(ref)
    count = int(payoff.bouts[scripted, own].sum())

    def below(baseline: str) -> Score | None:
        if baseline not in played or ref in BASELINES:
            return None
        theirs, redrawn = means(baseline)
        return _score(theirs - mean, redrawn - resampled, count)

    return Held(
        protagonist=table.label(ref), score=_score(mean, resampled, count),
        below_static=below(STATIC), below_heuristic=below(HEURISTIC),
        below_retreating=below(RETREATING),
        camping_points=float(payoff.camping_points[scripted, own].mean()),
    )  # fmt: skip


def _score(mean: float, resampled: "NDArray[np.float64]", count: int) -> Score:
    low, high = np.quantile(resampled, COVERAGE)
    return Score(mean=mean, low=float(low), high=float(high), count=count)


def _ratings(
    payoff: "Payoff", table: "BoutTable", generator: np.random.Generator
) -> tuple[Rated, ...]:
    from shared.styles.ratings import ratings_of

    found = ratings_of(payoff, generator)
    return tuple(
        Rated(
            agent=agent, player=table.label(rating.player), elo=float(rating.elo.value),
            low=float(rating.elo.low), high=float(rating.elo.high), win_share=rating.win_share,
        )
        for agent, pool in zip(AGENTS, (found.antagonists, found.protagonists), strict=True)
        for rating in pool
    )  # fmt: skip


def styles_part(folder: Path, missing: list[Missing]) -> Styles | None:
    """Return what ``riposte styles`` found, None when it has not been asked."""
    path = folder / "styles" / "styles.json"
    command = f"riposte styles {folder}"
    try:
        from services.jobs.styles.summary import StylesSummary

        found = msgspec.json.decode(path.read_bytes(), type=StylesSummary)
    except FileNotFoundError:
        missing.append(Missing(part="styles", command=command))
        return None
    except ImportError as error:
        missing.append(Missing(part="styles", command=INSTALL, reason=str(error)))
        return None
    except (OSError, ValueError, RecursionError) as error:
        reason = f"{path} cannot be read ({error})"
        missing.append(Missing(part="styles", command=command, reason=reason))
        return None
    if len(found.information) < KEPT or len(found.information_of_bouts) < KEPT:
        reason = f"{path} has fewer than {KEPT} numbers of components"
        missing.append(Missing(part="styles", command=command, reason=reason))
        return None
    apart = found.selected_apart
    unseen = apart.by_opponent
    bouts = apart.bouts
    return Styles(
        policies=len(found.library),
        information=found.information[KEPT - 1],
        information_of_bouts=found.information_of_bouts[KEPT - 1],
        why_not=found.why_not,
        selected=tuple(policy.label for policy in found.of_part("selected")),
        accuracy=_with_interval(apart.random_folds.share, apart.random_folds, bouts),
        accuracy_unseen=None if unseen is None else _with_interval(unseen.share, unseen, bouts),
        chance=apart.chance,
        distance=_with_interval(found.distance.value, found.distance, len(found.library)),
        effective_styles=_with_interval(
            found.effective_styles.value, found.effective_styles, len(found.library)
        ),
    )


def _with_interval(mean: float, note: "AccuracyNote | MeasureNote", count: int) -> Score:
    return Score(mean=mean, low=note.low, high=note.high, count=count)


def exploitability_part(
    folder: Path, state: RunState, missing: list[Missing]
) -> tuple[Exploited, ...]:
    """Return the best responses to the warm start and each round's protagonist.

    Of several budgets the largest counts. The interval is the range over the seeds.
    """
    warm = state.warm_start()
    names = {warm[1]: (0, "warm start")} if warm else {}
    names |= {ref: (number, f"round {number}") for number, _, ref in state.library()}
    command = f"python -m benchmarks.learning exploitability --runs {folder}"
    by_player: dict[str, dict[int, list[float]]] = {}
    for path in sorted((folder / "exploitability").glob("*.json")):
        try:
            kept = json.loads(path.read_bytes())
            opponent, score = str(kept["opponent"]), float(kept["score"])
            budget = int(kept["budget"])
        except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            reason = f"{path} is no best response ({error}): delete it"
            missing.append(Missing(part="exploitability", command=command, reason=reason))
            return ()
        by_player.setdefault(opponent, {}).setdefault(budget, []).append(score)
    found: list[Exploited] = []
    for ref, (number, name) in names.items():
        if ref not in by_player:
            continue
        samples, scores = max(by_player[ref].items())
        score = Score(
            mean=float(np.mean(scores)), low=min(scores), high=max(scores), count=len(scores)
        )
        found.append(
            Exploited(name=name, round=number, score=score, highest=max(scores), samples=samples)
        )
    if not found:
        missing.append(Missing(part="exploitability", command=command))
    return tuple(found)
