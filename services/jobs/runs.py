"""What a folder says of the run in it."""

from pathlib import Path

from services.league.history import RunState
from services.league.ledger import open_read_only
from shared.errors import ConfigError

LEDGER = "league.sqlite"


def check_run(folder: Path) -> None:
    """Refuse a folder that holds no run.

    Raises:
        ConfigError: it has no ledger.
    """
    if not (folder / LEDGER).exists():
        raise ConfigError(f"{folder} holds no run (no {LEDGER}); give the folder of a run")


def state_of(folder: Path) -> RunState:
    """Return what the ledger of a folder says, also while its run goes on.

    Raises:
        ConfigError: the folder holds no run.
        LedgerError: its ledger is damaged, or another program's, or being made.
    """
    check_run(folder)
    with open_read_only(folder / LEDGER) as ledger:
        return RunState.fold(ledger.replay())
