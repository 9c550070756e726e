"""`riposte ratings RUN`: the standings of a run's tournament, from its ledger or its table."""

import argparse
import dataclasses
import sys
from collections.abc import Sequence
from pathlib import Path

import msgspec

from services.jobs.runs import state_of
from services.jobs.settings import Settings
from services.jobs.tournament.files import TABLE_FILE
from services.jobs.tournament.results import plan_of, standings_of, table_of
from services.jobs.tournament.words import standings_text
from shared.errors import ConfigError
from shared.styles.bouts import BoutTable, load


def main(argv: Sequence[str]) -> int:
    """Print the ratings of a tournament, finished or not; return the exit code."""
    parser = argparse.ArgumentParser(
        prog="riposte ratings", description="Rate the players of a run's tournament."
    )
    parser.add_argument(
        "run", type=Path, metavar="RUN", help="folder of the run, of a tournament, or its table"
    )
    parser.add_argument("--json", action="store_true", help="print ratings and equilibrium as JSON")
    found = parser.parse_args(argv)
    standings = standings_of(bouts_of(found.run))
    if found.json:
        made = {
            "ratings": dataclasses.asdict(standings.ratings),
            "nash": dataclasses.asdict(standings.nash) if standings.nash is not None else None,
            "labels": standings.table.provenance.labels,
        }
        print(msgspec.json.encode(made).decode())
    else:
        print(standings_text(standings))
    return 0


def bouts_of(path: Path) -> BoutTable:
    """Return the bouts of a tournament: of its ledger where there is one, else of its table.

    Raises:
        RiposteError: there is none, or it is damaged.
        ConfigError: no bout has been played.
    """
    if path.is_file():
        table = load(path)
    else:
        folder = path / "tournament" if (path / "tournament").is_dir() else path
        if (folder / "league.sqlite").exists():
            state = state_of(folder)
            if not state.is_tournament:
                raise ConfigError(
                    f"{path} has no tournament yet; play one with: riposte tournament {path}"
                )
            table = table_of(state, plan_of(folder, state), Settings.load(folder / "config.toml"))
        else:
            table = load(folder / TABLE_FILE)
    if not len(table):
        raise ConfigError(f"{path} has no bouts yet; play them with: riposte tournament {path}")
    return table


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
