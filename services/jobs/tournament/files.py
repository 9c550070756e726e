"""What a tournament leaves in its folder, all of it written from the ledger."""

from pathlib import Path

import msgspec

from services.jobs.runs import state_of
from services.jobs.settings import Settings
from services.jobs.tournament.page import tournament_page
from services.jobs.tournament.results import (
    Standings,
    Summary,
    plan_of,
    standings_of,
    summarise,
    table_of,
)
from shared.runtime.files import atomic_write
from shared.styles.bouts import save
from shared.telemetry.tournament_recording import Bars, write_recording

TABLE_FILE = "bouts.parquet"
PAGE_FILE = "tournament.html"
SUMMARY_FILE = "tournament.json"
RECORDING_FILE = "tournament.rrd"


def write_results(folder: Path) -> tuple[Standings, Summary]:
    """Write table, summary, page and recording of a tournament, all from its ledger.

    Raises:
        RiposteError: there is no tournament, its ledger is damaged, or a file cannot be written.
    """
    state = state_of(folder)
    site = folder / "config.toml"
    table = table_of(state, plan_of(folder, state), Settings.load(site))
    standings = standings_of(table)
    summary = summarise(standings, state)
    save(table, folder / TABLE_FILE)
    indented = msgspec.json.format(msgspec.json.encode(summary), indent=1)
    atomic_write(folder / SUMMARY_FILE, indented)
    page = tournament_page(standings, summary, site.read_text(encoding="utf-8"))
    atomic_write(folder / PAGE_FILE, page.encode())
    record(standings, folder / RECORDING_FILE)
    return standings, summary


def record(standings: Standings, path: Path) -> None:
    """Write the standings as a Rerun recording."""
    table, payoff, ratings = standings.table, standings.payoff, standings.ratings
    write_recording(
        path,
        payoff.mean,
        tuple(map(table.label, payoff.antagonists)),
        tuple(map(table.label, payoff.protagonists)),
        [
            Bars(agent, [(table.label(r.player), r.elo.value, r.elo.low, r.elo.high) for r in pool])
            for agent, pool in (
                ("antagonist", ratings.antagonists),
                ("protagonist", ratings.protagonists),
            )
        ],
    )
