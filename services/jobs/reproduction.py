"""The reproduction report of a run of both phases: what the paper reports, and what was found.

Gathers the ledger, the tournament, the styles and the best responses of a run into
``reproduction.json`` and ``reproduction.html``. A part that has not been made yet is named with
the command that makes it.
"""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import numpy as np

from services.jobs.draws import Draw, fit_of, replay
from services.jobs.reproduction_claims import claims_of
from services.jobs.reproduction_page import page
from services.jobs.reproduction_parts import (
    Cell,
    Draws,
    Exploited,
    Held,
    Missing,
    Rated,
    Reproduction,
    Score,
    Stage,
    Stretch,
    Styles,
    Tournament,
)
from services.jobs.summary import Summary
from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.ledger import open_read_only
from shared.errors import RiposteError
from shared.messages.training import AGENTS
from shared.runtime.files import atomic_write

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from services.jobs.styles_summary import AccuracyNote, MeasureNote
    from shared.styles.bouts import BoutTable
    from shared.styles.payoff import Payoff

JSON = "reproduction.json"
HTML = "reproduction.html"
COVERAGE = (0.025, 0.975)
KEPT = 3
"""Components of the paper."""
STATIC = "scripted:static"
HEURISTIC = "scripted:heuristic"
BASELINES = (STATIC, HEURISTIC)
INSTALL = "pip install 'riposte[styles]'"


def write(folder: Path, summary: Summary, config: str) -> Reproduction | None:
    """Write both files of a run and return what is in them; None when it has no round.

    Args:
        folder: of the run.
        summary: of the run.
        config: resolved configuration, TOML.

    Raises:
        RiposteError: the ledger or a file beside it is damaged, or nothing can be written.
    """
    if not summary.rounds:
        return None
    found = gather(folder, summary)
    atomic_write(folder / JSON, msgspec.json.format(msgspec.json.encode(found), indent=1))
    atomic_write(folder / HTML, page(found, summary, config).encode())
    return found


def gather(folder: Path, summary: Summary) -> Reproduction:
    """Return all parts of the report that have been made."""
    with open_read_only(folder / "league.sqlite") as ledger:
        state, draws = replay(ledger.replay())
    cfg = state.config or LeagueConfig()
    missing: list[Missing] = []
    tournament = _tournament(folder, state, missing)
    styles = _styles(folder, missing)
    exploited = _exploitability(folder, state, missing)
    stages = stage_times(folder, summary)
    found = Reproduction(
        run=summary.run,
        seed=state.seed,
        sampler=cfg.sampler,
        iterations=max((s.iteration for s in summary.stages), default=0),
        round_iterations=cfg.round_iterations,
        round_updates=(cfg.round_antagonist_updates, cfg.round_protagonist_updates),
        rounds=len(state.library()),
        rounds_planned=cfg.rounds,
        stretches=stretches(summary),
        draws=draws_of(draws, state.seed),
        tournament=tournament,
        styles=styles,
        exploitability=exploited,
        stages=stages,
        seconds=sum(stage.seconds for stage in stages),
        claims=(),
        missing=tuple(missing),
    )
    return msgspec.structs.replace(found, claims=claims_of(found, summary, state))


def stretches(summary: Summary) -> tuple[Stretch, ...]:
    """Return how far the score follows whoever learns, by iteration of phase one and by round.

    In phase one from the last tenth of each stage's bouts, in a round from the second half of its
    iterations.
    """
    found: list[Stretch] = []
    for number in range(1, max((s.iteration for s in summary.stages), default=0) + 1):
        last = {s.agent: s.last.mean for s in summary.stages if s.iteration == number and s.last}
        if len(last) == len(AGENTS):
            found.append(_stretch(f"phase one, iteration {number}", *(last[a] for a in AGENTS)))
    for played in summary.rounds:
        half = max(turn.iteration for turn in played.turns) / 2
        late = [t for t in played.turns if t.iteration > half]
        sides = [
            [t.score for t in late if t.agent == agent and t.score is not None] for agent in AGENTS
        ]
        if all(sides):
            means = [float(np.mean(side)) for side in sides]
            found.append(_stretch(f"round {played.round}", *means))
    return tuple(found)


def _stretch(name: str, antagonist: float, protagonist: float) -> Stretch:
    swing = antagonist - protagonist
    return Stretch(name=name, swing=swing, level=(antagonist + protagonist) / 2)


def draws_of(draws: Sequence[Draw], seed: int) -> tuple[Draws, ...]:
    """Return how all draws, then each round's, compare with the sampler."""
    generator = np.random.default_rng(seed)
    rounds = sorted({one.round for one in draws})
    return tuple(
        _draws(number, [one for one in draws if number in (0, one.round)], generator)
        for number in (0, *rounds)
    )


def _draws(number: int, draws: Sequence[Draw], generator: np.random.Generator) -> Draws:
    test = fit_of(draws, generator)
    return Draws(
        round=number,
        draws=len(draws),
        distinct=len({(one.round, one.agent, one.place) for one in draws}),
        warm_starts=sum(one.place == 0 for one in draws),
        warm_starts_expected=float(sum(one.probabilities[0] for one in draws)),
        by_age=test.observed if test else (),
        by_age_expected=test.expected if test else (),
        statistic=test.statistic if test else None,
        p=test.p if test else None,
        replayed=sum(one.is_replayed for one in draws),
        points=tuple((d.agent, d.iteration, d.place) for d in draws) if number else (),
    )


def _tournament(folder: Path, state: RunState, missing: list[Missing]) -> Tournament | None:
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
    count = int(payoff.bouts[scripted, payoff.protagonists.index(ref)].sum())

    def below(baseline: str) -> Score | None:
        if baseline not in played or ref in BASELINES:
            return None
        theirs, redrawn = means(baseline)
        return _score(theirs - mean, redrawn - resampled, count)

    return Held(
        protagonist=table.label(ref), score=_score(mean, resampled, count),
        below_static=below(STATIC), below_heuristic=below(HEURISTIC),
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


def _styles(folder: Path, missing: list[Missing]) -> Styles | None:
    """Return what ``riposte styles`` found, None when it has not been asked."""
    path = folder / "styles" / "styles.json"
    command = f"riposte styles {folder}"
    try:
        from services.jobs.styles_summary import StylesSummary

        found = msgspec.json.decode(path.read_bytes(), type=StylesSummary)
    except FileNotFoundError:
        missing.append(Missing(part="styles", command=command))
        return None
    except ImportError as error:
        missing.append(Missing(part="styles", command=INSTALL, reason=str(error)))
        return None
    except (OSError, msgspec.MsgspecError, UnicodeDecodeError) as error:
        reason = f"{path} cannot be read ({error})"
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


def _exploitability(folder: Path, state: RunState, missing: list[Missing]) -> tuple[Exploited, ...]:
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
            opponent, budget, score = kept["opponent"], kept["budget"], float(kept["score"])
        except (OSError, ValueError, KeyError, TypeError) as error:
            reason = f"{path} is no best response ({error}): delete it"
            missing.append(Missing(part="exploitability", command=command, reason=reason))
            return ()
        by_player.setdefault(str(opponent), {}).setdefault(int(budget), []).append(score)
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


def stage_times(folder: Path, summary: Summary) -> tuple[Stage, ...]:
    """Return how long each stage took, training from the ledger."""
    found = [
        Stage(
            name=f"phase one, iteration {number}",
            seconds=sum(s.seconds for s in summary.stages if s.iteration == number),
        )
        for number in sorted({stage.iteration for stage in summary.stages})
    ]
    if summary.evaluation_seconds:
        found.append(Stage(name="evaluation of phase one", seconds=summary.evaluation_seconds))
    found += [Stage(name=f"round {r.round}", seconds=r.seconds) for r in summary.rounds]
    return tuple(found)
