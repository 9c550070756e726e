"""The reproduction report of a run of both phases: what the paper reports, and what was found.

Gathers the ledger, the tournament, the styles and the best responses of a run into
``reproduction.json`` and ``reproduction.html``. A part that has not been made yet is named with
the command that makes it.
"""

from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from services.jobs.report.summary import Summary
from services.jobs.reproduction.claims import claims_of
from services.jobs.reproduction.draws import Draw, fit_of, replay
from services.jobs.reproduction.page import page
from services.jobs.reproduction.parts import (
    Draws,
    Missing,
    Pipeline,
    Reproduction,
    Stage,
    Stretch,
)
from services.jobs.reproduction.sources import (
    exploitability_part,
    styles_part,
    tournament_part,
)
from services.jobs.runs import LEDGER, state_of
from services.league.config import LeagueConfig
from services.league.history import RunState
from services.league.ledger import open_read_only
from shared.errors import RiposteError
from shared.messages.training import AGENTS
from shared.runtime.files import atomic_write

JSON = "reproduction.json"
HTML = "reproduction.html"


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
    with open_read_only(folder / LEDGER) as ledger:
        state, draws = replay(ledger.replay())
    cfg = state.config or LeagueConfig()
    missing: list[Missing] = []
    tournament = tournament_part(folder, state, missing)
    styles = styles_part(folder, missing)
    exploited = exploitability_part(folder, state, missing)
    stages = stage_times(folder, summary, state)
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


def stage_times(folder: Path, summary: Summary, state: RunState) -> tuple[Stage, ...]:
    """Return how long each stage took, by the ledgers, and by ``pipeline.json`` what came after."""
    start_ns = state.stages[0].started_at_ns - state.started_at_ns
    found = [Stage(name="start of the processes", seconds=start_ns / 1e9)]
    found += [
        Stage(
            name=f"phase one, iteration {number}",
            seconds=sum(s.seconds for s in summary.stages if s.iteration == number),
        )
        for number in sorted({stage.iteration for stage in summary.stages})
    ]
    if summary.evaluation_seconds:
        found.append(Stage(name="evaluation of phase one", seconds=summary.evaluation_seconds))
    found += [Stage(name=f"round {r.round}", seconds=r.seconds) for r in summary.rounds]
    after = _pipeline_times(folder / "pipeline.json")
    if not any(stage.name == "tournament" for stage in after):
        found += _tournament_time(folder / "tournament")
    return (*found, *after)


def _pipeline_times(path: Path) -> tuple[Stage, ...]:
    """Return the stages after training, of a run begun with its whole pipeline."""
    try:
        return msgspec.json.decode(path.read_bytes(), type=Pipeline).stages
    except (OSError, ValueError, RecursionError):
        return ()


def _tournament_time(folder: Path) -> list[Stage]:
    """Return how long a tournament took, by its own ledger; nothing where there is none."""
    try:
        state = state_of(folder)
    except RiposteError:
        return []  # its table of bouts is there or is named as missing
    if state.evaluation_started_at_ns is None:
        return []
    end_ns = state.evaluation_done_at_ns or state.last_at_ns
    seconds = (end_ns - state.evaluation_started_at_ns) / 1e9
    return [Stage(name="tournament", seconds=seconds)]
