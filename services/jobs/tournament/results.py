"""The results of a tournament, rebuilt from its ledger: table of bouts, payoff, ratings."""

import dataclasses
from collections.abc import Sequence
from pathlib import Path

import msgspec
import numpy as np

from services.jobs.settings import Settings
from services.jobs.tournament.plan import Plan
from services.league.history import RunState
from shared.errors import LedgerError
from shared.styles.bouts import BoutTable, Provenance
from shared.styles.features import FEATURES
from shared.styles.payoff import Payoff, payoff_of
from shared.styles.ratings import Estimate, Nash, Rating, Ratings, nash_of, ratings_of

PLAN_FILE = "plan.json"


@dataclasses.dataclass(frozen=True)
class Standings:
    """What the bouts say."""

    table: BoutTable
    payoff: Payoff
    ratings: Ratings
    nash: Nash | None
    """None while a pairing has no bouts."""


CELL_NUMBERS = (
    "mean", "low", "high", "attack_points", "penalty_points", "camping_points", "camping_share",
    "in_target_share",
)  # fmt: skip


class Player(msgspec.Struct, frozen=True, kw_only=True):
    """One player in ``tournament.json``."""

    player: str
    label: str
    bouts: int
    win_share: float
    elo: Estimate
    nash_weight: Estimate | None
    exploitability: Estimate | None
    """Points a bout."""
    best_response: str | None


class Cell(msgspec.Struct, frozen=True, kw_only=True):
    """One pairing in ``tournament.json``."""

    antagonist: str
    protagonist: str
    bouts: int
    mean: float
    low: float
    high: float
    """95 % interval of the mean."""
    wins: int
    attack_points: float
    penalty_points: float
    camping_points: float
    camping_share: float
    in_target_share: float


class Summary(msgspec.Struct, frozen=True, kw_only=True):
    """``tournament.json``: the standings as numbers."""

    schema: int = 1
    run: str
    seed: int
    model: str
    commit: str
    bouts: int
    bouts_planned: int
    actor_seconds: float
    """Summed over the actors, from the grant of each lease to its results."""
    steps_per_s: float
    """World steps in one of those seconds."""
    antagonist_advantage: Estimate
    """Elo points."""
    value: Estimate | None
    """Points a bout when both sides play their Nash mixtures."""
    antagonists: tuple[Player, ...]
    protagonists: tuple[Player, ...]
    """Strongest first."""
    pairings: tuple[Cell, ...]


def plan_of(folder: Path, state: RunState) -> Plan:
    """Return the plan of a tournament; without its file the names are short."""
    try:
        return msgspec.json.decode((folder / PLAN_FILE).read_bytes(), type=Plan)
    except (OSError, ValueError, RecursionError):
        pairs = list(state.evaluations)
        return Plan(
            run=state.run,
            antagonists=tuple(dict.fromkeys(one for one, _ in pairs)),
            protagonists=tuple(dict.fromkeys(two for _, two in pairs)),
            labels={},
            bouts=max((record.planned for record in state.evaluations.values()), default=0),
            commit="",
        )


def table_of(state: RunState, plan: Plan, settings: Settings) -> BoutTable:
    """Return the bouts in a ledger, ordered by pairing and number: whoever played them, whenever.

    Raises:
        LedgerError: its bouts have no features.
    """
    records = list(state.evaluations.values())
    one = {ref: k for k, ref in enumerate(plan.antagonists)}
    two = {ref: k for k, ref in enumerate(plan.protagonists)}
    for record in records:
        if len(record.features) != record.done:
            raise LedgerError(
                f"the ledger of {state.run} has bouts without features: an older Riposte played "
                "them; play the tournament anew in another folder"
            )
        if record.antagonist not in one or record.protagonist not in two:
            raise LedgerError(
                f"{PLAN_FILE} does not name {record.antagonist[:19]} v {record.protagonist[:19]} "
                f"of the ledger of {state.run}; remove the file to go by the ledger alone"
            )
    orders = [np.argsort(np.array(record.number, np.int64)) for record in records]

    def column(values: Sequence[Sequence[float]], dtype: type[np.generic]) -> np.ndarray:
        parts = [np.asarray(v, dtype)[order] for v, order in zip(values, orders, strict=True)]
        return np.concatenate([np.zeros(0, dtype), *parts])

    def players(of: dict[str, int], name: str) -> np.ndarray:
        return np.concatenate(
            [np.zeros(0, np.int32)]
            + [np.full(record.done, of[getattr(record, name)], np.int32) for record in records]
        )

    features = np.array(
        [
            record.features[k]
            for record, order in zip(records, orders, strict=True)
            for k in order.tolist()
        ],
        np.float32,
    )
    return BoutTable(
        antagonists=plan.antagonists,
        protagonists=plan.protagonists,
        antagonist=players(one, "antagonist"),
        protagonist=players(two, "protagonist"),
        bout=column([record.number for record in records], np.int32),
        seed=column([record.seed for record in records], np.int64),
        score=column([record.score for record in records], np.float32),
        attack_steps=column([record.attack_steps for record in records], np.int32),
        penalty_steps=column([record.penalty_steps for record in records], np.int32),
        camping_steps=column([record.camping_steps for record in records], np.int32),
        features=features.reshape(-1, 2, len(FEATURES)),
        provenance=Provenance(
            run=plan.run,
            seed=state.seed,
            model=state.model,
            control_timestep=settings.sim.control_timestep,
            game=settings.game,
            labels=plan.labels,
            commit=plan.commit,
        ),
    )


def standings_of(table: BoutTable) -> Standings:
    """Return payoff and ratings; the same bouts give the same numbers."""
    generator = np.random.default_rng(table.provenance.seed)
    payoff = payoff_of(table, generator)
    return Standings(
        table=table,
        payoff=payoff,
        ratings=ratings_of(payoff, generator),
        nash=nash_of(payoff) if payoff.is_complete else None,
    )


def summarise(standings: Standings, state: RunState) -> Summary:
    """Return the standings as ``tournament.json`` has them."""
    table, payoff, nash = standings.table, standings.payoff, standings.nash
    in_nash = () if nash is None else (*nash.antagonists, *nash.protagonists)
    places = {place.player: place for place in in_nash}

    def player(rating: Rating) -> Player:
        place = places.get(rating.player)
        return Player(
            player=rating.player,
            label=table.label(rating.player),
            bouts=rating.bouts,
            win_share=rating.win_share,
            elo=rating.elo,
            nash_weight=place.weight if place is not None else None,
            exploitability=place.exploitability if place is not None else None,
            best_response=place.best_response if place is not None else None,
        )

    def cell(i: int, j: int) -> Cell:
        return Cell(
            antagonist=payoff.antagonists[i],
            protagonist=payoff.protagonists[j],
            bouts=int(payoff.bouts[i, j]),
            wins=int(payoff.wins[i, j]),
            **{name: float(getattr(payoff, name)[i, j]) for name in CELL_NUMBERS},
        )

    seconds = sum(
        (record.ended_at_ns - record.granted_at_ns) / 1e9
        for record in state.leases.values()
        if record.end_reason == "completed"
    )
    steps = table.provenance.game.bout_steps * len(table)
    return Summary(
        run=table.provenance.run,
        seed=table.provenance.seed,
        model=table.provenance.model,
        commit=table.provenance.commit,
        bouts=len(table),
        bouts_planned=state.evaluation_total,
        actor_seconds=seconds,
        steps_per_s=steps / seconds if seconds > 0 else 0.0,
        antagonist_advantage=standings.ratings.antagonist_advantage,
        value=nash.value if nash is not None else None,
        antagonists=tuple(player(rating) for rating in standings.ratings.antagonists),
        protagonists=tuple(player(rating) for rating in standings.ratings.protagonists),
        pairings=tuple(
            cell(i, j)
            for i in range(len(payoff.antagonists))
            for j in range(len(payoff.protagonists))
            if payoff.bouts[i, j]
        ),
    )
