"""What the command line of `riposte train` asks for: folder, settings, phases."""

import argparse
import datetime
import operator
from collections.abc import Sequence
from pathlib import Path

from services.jobs.runs import LEDGER, state_of
from services.jobs.settings import BUDGETS, Settings
from services.league.events import RunStarted
from services.league.ledger import open_read_only
from services.league.rounds import phase_one_done
from services.league.sampling import SAMPLERS
from services.league.schedule import next_event
from shared.errors import ConfigError
from shared.runtime.serve import run_id_of

PAPER_ROUNDS = 6
PHASES = ("one", "two", "all")
SAVED = "config.toml"
"""In a run's folder: the settings that it began with."""


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the words of a command line, checked against each other.

    Raises:
        ConfigError: two of them do not go together.
    """
    parser = argparse.ArgumentParser(
        prog="riposte train", description="Train two fencers on this machine, with a report."
    )
    parser.add_argument("site", nargs="?", type=Path, metavar="SITE", help="site file (TOML)")
    parser.add_argument(
        "--phase", choices=PHASES,
        help="one: train a pair from nothing (the default); two: go on with the run in --out, "
        "from its pair; all: both, then tournament and styles",
    )  # fmt: skip
    parser.add_argument(
        "--rounds", type=int, metavar="N", help=f"rounds of phase two (the paper's {PAPER_ROUNDS})"
    )
    parser.add_argument(
        "--sampler", choices=SAMPLERS, help="how phase two draws opponents (uniform, the paper's)"
    )
    parser.add_argument("--budget", choices=tuple(BUDGETS), help="how long (the site file's)")
    parser.add_argument("--actors", type=int, metavar="N", help="actor processes")
    parser.add_argument("--seed", type=int, metavar="S", help="of everything random")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the run")
    parser.add_argument("--resume", action="store_true", help="continue the run in --out")
    parser.add_argument("--serial", action="store_true", help="one process, same seed same bits")
    parser.add_argument("--view", action="store_true", help="open the live view in a browser")
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="SECTION.KEY=VALUE",
        help="over the site file; may be repeated",
    )  # fmt: skip
    found = parser.parse_args(argv)
    if found.rounds is not None and found.phase not in ("two", "all"):
        raise ConfigError(f"--rounds {found.rounds} needs --phase two or --phase all")
    if found.rounds is not None and found.rounds < 1:
        raise ConfigError(f"--rounds is {found.rounds}; phase two needs at least 1")
    if found.phase == "two":
        found.resume = True
    return found


def folder_of(found: argparse.Namespace) -> tuple[Path, str]:
    """Return the run's folder and its name on the bus.

    Raises:
        ConfigError: there is none to resume.
    """
    if found.out is not None:
        folder: Path = found.out
    elif found.resume:
        folder = Path("runs/latest")
        if not folder.exists():
            raise ConfigError("there is no run to resume in runs/latest; name it with --out DIR")
        folder = folder.resolve()
    else:
        stamp = datetime.datetime.now().strftime("%Y%m%d-%H%M%S")
        folder = Path("runs") / f"train-{stamp}"
    return folder, run_of(folder)


def run_of(folder: Path) -> str:
    """Return the name of the run in a folder: its ledger's, whatever the folder is called by now.

    Raises:
        LedgerError: the ledger is damaged, or another program's.
    """
    if (folder / LEDGER).exists():
        with open_read_only(folder / LEDGER) as ledger:
            for entry in ledger.replay():
                if isinstance(entry.event, RunStarted):
                    return entry.event.run
                break
    return run_id_of(folder)


def settings_of(found: argparse.Namespace, folder: Path) -> Settings:
    """Return the settings: those the run began with when resuming, else site file and flags.

    Raises:
        ConfigError: names the value, what was expected and where it stands.
    """
    site: Path | None = found.site
    saved = folder / SAVED
    if found.resume and saved.exists():
        if site is not None:
            raise ConfigError(f"--resume continues with {saved}; leave the site file out")
        site = saved
    overrides = _overrides(found)
    settings = Settings.load(site, overrides)
    if found.phase in ("two", "all") and settings.league.rounds == 0:
        return Settings.load(site, [*overrides, f"league.rounds={PAPER_ROUNDS}"])
    return settings


def _overrides(found: argparse.Namespace) -> list[str]:
    overrides = list(BUDGETS[found.budget]) if found.budget else []
    if found.actors is not None:
        overrides.append(f"train.actors={found.actors}")
    if found.seed is not None:
        overrides.append(f"train.seed={found.seed}")
    if found.phase == "one":
        overrides.append("league.rounds=0")
    if found.rounds is not None:
        overrides.append(f"league.rounds={found.rounds}")
    if found.sampler is not None:
        overrides.append(f'league.sampler="{found.sampler}"')
    return [*overrides, *found.overrides]


def check_folder(found: argparse.Namespace, folder: Path, settings: Settings) -> None:
    """Refuse to mix two runs, and to begin phase two without a pair.

    Raises:
        ConfigError: there is a run and ``--resume`` is not asked for, or the other way round; the
            run has not come to the end of phase one; or it was learned by other settings.
    """
    has_run = (folder / "league.sqlite").exists()
    if found.phase == "two":
        _check_pair(folder, settings, has_run=has_run)
    elif has_run and not found.resume:
        raise ConfigError(
            f"{folder} holds a run already; continue it with --resume, or choose another --out"
        )
    elif found.resume and not has_run:
        raise ConfigError(f"{folder} holds no run to resume; leave --resume out to start one")
    if has_run and (folder / SAVED).exists():
        _check_same_task(Settings.load(folder / SAVED), settings, folder)


def _check_same_task(before: Settings, now: Settings, folder: Path) -> None:
    """Refuse to go on with policies in another game, another simulator or other networks."""
    for name in ("sim", "game", "action", "learner.hidden_dims", "learner.activation"):
        value = operator.attrgetter(name)
        if value(before) != value(now):
            raise ConfigError(
                f"{name} cannot change when a run goes on: what {folder} "
                f"has learned goes with what its {SAVED} says; start another run with another --out"
            )


def _check_pair(folder: Path, settings: Settings, *, has_run: bool) -> None:
    if not has_run:
        raise ConfigError(
            f"--phase two goes on from the pair of a run, and {folder} holds none; "
            f"train one first with: riposte train --out {folder}"
        )
    state = state_of(folder)
    if not phase_one_done(settings.league, state) or state.warm_start() is None:
        raise ConfigError(
            f"phase one of {folder} is not finished ({len(state.stages)} of "
            f"{2 * settings.league.iterations} stages begun); "
            f"finish it with: riposte train --resume --out {folder}"
        )


def is_over(folder: Path, settings: Settings) -> bool:
    """Return whether the run in a folder has done all that its settings ask for."""
    if not (folder / "league.sqlite").exists():
        return False
    state = state_of(folder)
    return state.finished and next_event(settings.league, state) is None
