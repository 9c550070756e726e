"""`riposte tournament RUN`: everybody of a run against everybody of the other side.

A tournament is a league run of its own, in ``RUN/tournament``, whose ledger begins with the plan:
router, league and actors play it, nobody learns. What has been played is in the ledger, so it
goes on where it was stopped. Which bouts are played follows from the seed and the pairing.
"""

import argparse
import contextlib
import os
import shlex
import sys
import threading
from collections.abc import Generator, Mapping, Sequence
from pathlib import Path

import msgspec
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from services.jobs.runs import LEDGER, check_run, state_of
from services.jobs.settings import Settings
from services.jobs.tournament.files import PAGE_FILE, TABLE_FILE, write_results
from services.jobs.tournament.plan import Plan, Pools, batch_size, check_asked
from services.jobs.tournament.results import PLAN_FILE
from services.jobs.tournament.words import standings_text
from services.jobs.train.processes import StopAsked, listen_words, run_processes
from services.league.events import RunStarted
from services.league.history import RunState
from services.league.ledger import Ledger
from services.supervisor import ProcessSpec, service_command
from shared.bus.base import Bus
from shared.clock import Clock, SystemClock
from shared.errors import ConfigError
from shared.messages.topics import PROGRESS
from shared.policy.players import SCRIPTED_PLAYERS, SCRIPTED_PREFIX
from shared.policy.snapshot import Fit
from shared.runtime.build import commit
from shared.runtime.files import RunLock, atomic_write, require_free_space
from shared.runtime.logging import configure_logging
from shared.runtime.stop import stop_on_signals
from shared.sim.model import FencingModel

MOST_BOUTS = 100_000
BATCH = 256
"""Most bouts that an actor plays at once."""
FREE_BYTES = 64 << 20
LINE_SECONDS = 5.0
"""Between two lines where there is no terminal."""
EXIT_INTERRUPTED = 130


def main(argv: Sequence[str]) -> int:
    """Play a tournament, or what is left of it; return the exit code."""
    found = _parse(argv)
    run: Path = found.run
    check_run(run)
    folder: Path = found.out or run / "tournament"
    with RunLock(folder):
        require_free_space(folder, FREE_BYTES)
        state = _begun(folder)
        if state is None:
            state = _begin(found, run, folder)
        else:
            _check_continued(found, folder, state)
        configure_logging(
            folder / "logs" / "tournament.jsonl",
            bound={"service": "tournament", "run_id": state.run},
        )
        if not state.finished:
            with stop_on_signals(deadline=180.0) as stop:
                again = shlex.join(["riposte", "tournament", *_words(run, found.out)])
                try:
                    _play(folder, state, _actors(found.actors, state), stop, again)
                except StopAsked:
                    print(f"\nstopped; continue with: {again}")
                    return EXIT_INTERRUPTED
        standings, summary = write_results(folder)
    if found.json:
        print(msgspec.json.encode(summary).decode())
    else:
        print(standings_text(standings))
        print(f"\n{folder / PAGE_FILE} shows it; the bouts are in {folder / TABLE_FILE}")
    return 0


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="riposte tournament",
        description="Play every antagonist of a run against every protagonist.",
    )
    parser.add_argument("run", type=Path, metavar="RUN", help="folder of the run")
    parser.add_argument("--bouts", type=int, metavar="N", help="of each pairing (the run's, 100)")
    parser.add_argument("--actors", type=int, metavar="N", help="processes (one per core)")
    parser.add_argument("--seed", type=int, metavar="S", help="of everything random (0)")
    parser.add_argument(
        "--players", nargs="+", default=[], metavar="REF",
        help="more players: scripted:NAME, sha256:HASH of the run, or a snapshot file",
    )  # fmt: skip
    parser.add_argument(
        "--against", choices=("library", "scripted"), default="library",
        help="library: the run's own players; scripted: every scripted player as well",
    )  # fmt: skip
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder (RUN/tournament)")
    parser.add_argument("--json", action="store_true", help="print the standings as JSON")
    found = parser.parse_args(argv)
    for option, value, low, high in (
        ("--bouts", found.bouts, 1, MOST_BOUTS),
        ("--actors", found.actors, 1, 256),
        ("--seed", found.seed, 0, 2**31 - 1),
    ):
        if value is not None and not low <= value <= high:
            raise ConfigError(f"{option} is {value}; allowed are {low} to {high}")
    return found


def _words(run: Path, out: Path | None) -> list[str]:
    return [str(run), *(["--out", str(out)] if out is not None else [])]


# -- beginning and continuing -----------------------------------------------------------------


def _begun(folder: Path) -> RunState | None:
    """Return what has been played in a folder, None where nothing was begun.

    Raises:
        ConfigError: there is a run of another kind.
    """
    if not (folder / LEDGER).exists():
        return None
    state = state_of(folder)
    if not state.position:  # stopped while it was made
        return None
    if not state.is_tournament:
        raise ConfigError(f"{folder} holds a run, not a tournament; choose another folder")
    return state


def _begin(found: argparse.Namespace, run: Path, folder: Path) -> RunState:
    """Write snapshots, settings, plan, and last of all the ledger; return its state."""
    state = state_of(run)
    bouts = found.bouts or Settings.load(run / "config.toml").train.tournament_bouts
    settings = Settings.load(
        run / "config.toml",
        (
            f"train.seed={found.seed or 0}",
            f"actor.num_envs={batch_size(bouts, BATCH)}",
            "actor.frame_period=0.0",
        ),
    )
    model = FencingModel.build(settings.sim)
    pools = Pools(run, Fit.of(settings.action, model.cfg.control_timestep, model.hash))
    pools.add_library(state)
    if found.against == "scripted":
        pools.add_scripted()
    for reference in found.players:
        pools.add(reference)
    plan = pools.plan(state.run, bouts, commit())
    (folder / "snapshots").mkdir(parents=True, exist_ok=True)
    for digest, payload in pools.payloads.items():
        atomic_write(folder / "snapshots" / f"{digest}.safetensors", payload)
    atomic_write(folder / "config.toml", settings.to_toml().encode())
    atomic_write(folder / PLAN_FILE, msgspec.json.encode(plan))
    return begin_ledger(folder, plan, settings)


def begin_ledger(folder: Path, plan: Plan, settings: Settings) -> RunState:
    """Write the two events that a tournament begins with and return the state."""
    ledger = Ledger(folder / LEDGER)
    try:
        start = RunStarted(
            run=f"{plan.run}-tournament",
            seed=settings.league.seed,
            serial=False,
            config=settings.league,
        )
        return RunState.fold(ledger.append([start, plan.event], SystemClock().wall_ns()))
    finally:
        ledger.close()


def _check_continued(found: argparse.Namespace, folder: Path, state: RunState) -> None:
    """Refuse to continue with other options than it was begun with."""
    planned = max(record.planned for record in state.evaluations.values())
    check_asked(state, [("--bouts", found.bouts, planned), ("--seed", found.seed, state.seed)])
    players = {ref for pair in state.evaluations for ref in pair}
    scripted = {SCRIPTED_PREFIX + name for name in SCRIPTED_PLAYERS}
    if found.against == "scripted" and (absent := scripted - players):
        raise ConfigError(
            f"this tournament was begun without {min(absent)}; leave --against out to continue "
            "it, or choose another folder with --out"
        )
    if missing := [ref for ref in found.players if ":" in ref and ref not in players]:
        raise ConfigError(
            f"this tournament was begun without {missing[0]}; leave --players out to continue "
            "it, or choose another folder with --out"
        )


def _actors(asked: int | None, state: RunState) -> int:
    """Return how many actors to start: no more than there are pairings left."""
    left = sum(record.done < record.planned for record in state.evaluations.values())
    return max(1, min(asked or len(os.sched_getaffinity(0)), left))


# -- playing ----------------------------------------------------------------------------------


def _play(folder: Path, state: RunState, actors: int, stop: threading.Event, again: str) -> None:
    """Run the processes until every bout is played."""
    settings = Settings.load(folder / "config.toml")

    def specs(endpoint: str) -> list[ProcessSpec]:
        def spec(role: str, name: str) -> ProcessSpec:
            connect = () if role == "router" else (endpoint,)
            command = service_command(
                role, name=name, run=folder, site=folder / "config.toml", run_id=state.run,
                connect=connect,
            )  # fmt: skip
            extra = listen_words(settings.bus, endpoint) if role == "router" else ()
            return ProcessSpec(name, (*command, *extra))

        made = [spec("router", "router-0"), spec("league", "league-0")]
        return made + [spec("actor", f"actor-{index}") for index in range(actors)]

    run_processes(
        "tournament",
        specs,
        lambda bus, clock: _display(bus, clock, state),
        settings.bus,
        folder,
        state.run,
        stop,
        again=again,
    )


@contextlib.contextmanager
def _display(bus: Bus, clock: Clock, state: RunState) -> "Generator[TournamentDisplay]":
    display = TournamentDisplay(bus, clock, state)
    try:
        with display.bar:
            yield display
    finally:
        display.close()


class TournamentDisplay:
    """How many bouts are played and how long the rest takes; a line now and then in a log."""

    def __init__(
        self, bus: Bus, clock: Clock, state: RunState, console: Console | None = None
    ) -> None:
        self._progress = bus.subscribe(PROGRESS)
        self._clock = clock
        self._console = console if console is not None else Console()
        self._begin = clock.now()
        self._line_at = self._begin
        self._done_before = self._done = state.evaluation_done
        self._total = state.evaluation_total
        self.bar = Progress(
            TextColumn("bout {task.completed:,.0f} of {task.total:,.0f}"),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("· Ctrl-C stops in order", style="dim"),
            console=self._console,
            transient=True,
            disable=not self._console.is_terminal,
        )
        self._task = self.bar.add_task("bouts", total=self._total, completed=self._done)

    def tick(self, restarts: Mapping[str, int]) -> None:
        """Take what the league said and show it."""
        while (progress := self._progress.take()) is not None:
            self._done = progress.evaluations_done
            self.bar.update(self._task, completed=self._done)
        now = self._clock.now()
        if not self._console.is_terminal and now >= self._line_at:
            self._line_at = now + LINE_SECONDS
            self.say(self.line(now))

    def line(self, now: float) -> str:
        """Return where it stands in a line."""
        text = f"{self._done:,} of {self._total:,} bouts"
        played, elapsed = self._done - self._done_before, now - self._begin
        if played > 0:
            left = (self._total - self._done) * elapsed / played
            text += f", {played / elapsed:.1f} a second, {left:.0f} s left"
        return text

    def say(self, text: str) -> None:
        """Show an event."""
        self._console.print(text, soft_wrap=True, markup=False, highlight=False)

    def close(self) -> None:
        """Stop listening."""
        self._progress.close()


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
