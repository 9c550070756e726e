"""Joining a running job from any machine: which run is on, and what it is played by.

``riposte actor --connect tls/HOST:7447 --certificates DIR`` needs no more than that: the run is
heard on the bus, its settings come from its league, its players' snapshots as they are needed. The
one folder it writes to is a scratch folder of its own, gone when it leaves in order; what killed
ones have left behind, the next one on its machine removes, but for the newest.
"""

import argparse
import dataclasses
import re
import secrets
import socket
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import tomli_w

from services.actor.scratch import Scratch, remove_stale
from shared.bus.base import Bus, NoAnswer, Refused
from shared.bus.config import BusConfig
from shared.bus.runs import find_run
from shared.bus.zenoh import open_zenoh
from shared.clock import Clock
from shared.config import toml
from shared.config.site import SECTIONS, raw_sections
from shared.errors import ConfigError
from shared.messages.league import RunSettings, SettingsRequest
from shared.messages.topics import SCHEDULE, SETTINGS
from shared.runtime.files import atomic_write
from shared.runtime.serve import ServeArgs, parse_args, plain_loop
from shared.runtime.service import Health, Ticking
from shared.runtime.stop import stop_on_signals

Tables = dict[str, dict[str, Any]]

LISTEN_SECONDS = 2.5
"""A league says every second where its run stands."""
ASK_SECONDS = 2.0
"""For one answer of the league."""
GIVE_UP_SECONDS = 3600.0
"""Without a router for so long, an actor that nobody watches over ends."""
SAME = ("sim", "game", "action", "reward")
"""Sections in which an actor must not differ from its run."""


def is_joining(argv: Sequence[str]) -> bool:
    """Return whether the command line leaves out the folder of the run, so that it is elsewhere."""
    return _given(argv).run is None


@dataclasses.dataclass(frozen=True)
class Joined:
    """A way into a run."""

    argv: tuple[str, ...]
    """Command line of the service."""
    scratch: "Scratch"

    def leave(self) -> None:
        """Remove the scratch folder."""
        self.scratch.remove()


def join(argv: Sequence[str], clock: Clock) -> Joined | None:
    """Return the way into the run that is on, once there is one; None when told to stop before.

    Raises:
        BusError: no router answers.
        ConfigError: the command line, the site file or the certificates are wrong, several runs
            are on, or the run cannot be played here.
    """
    given, args = _given(argv), parse_args("actor", argv)
    name = given.name or f"actor-{_host()}-{secrets.token_hex(3)}"
    cfg = args.section("bus", BusConfig).with_endpoints(connect=args.connect)
    with stop_on_signals() as stop:
        run_id = given.run_id or _find_run(cfg, name, clock, stop)
        settings = _ask_settings(cfg, name, clock, run_id, stop) if run_id else None
    if settings is None or stop.is_set():
        return None
    remove_stale()
    scratch = Scratch()
    try:
        site = scratch.path / "site.toml"
        model = scratch.path / "model.toml" if settings.model else None
        tables = merged(settings, raw_sections(args.site, SECTIONS), model)
        if model is not None:
            atomic_write(model, settings.model.encode())
        atomic_write(site, tomli_w.dumps(tables).encode())
    except BaseException:
        scratch.remove()
        raise
    _say(f"{name}: joins {run_id} at {', '.join(cfg.routers)} (log in {scratch.path}/logs)")
    return Joined(_argv(args, site, name, scratch.path, run_id), scratch)


def merged(settings: RunSettings, own: Tables, model: Path | None) -> Tables:
    """Return the sections to play by: the run's, and of this machine what may differ.

    Args:
        settings: of the run.
        own: sections of this machine's site file.
        model: where the run's model file is put here; None when the run has none.

    Raises:
        ConfigError: the league said something else than sections.
    """
    try:
        said: dict[str, Any] = toml.parse(settings.toml)
    except ValueError as error:
        raise ConfigError(f"the settings of the run are not TOML: {error}") from error
    if wrong := [name for name in said if name not in (*SAME, "actor")]:
        raise ConfigError(f"the settings of the run have [{wrong[0]}], which is not theirs to say")
    if any(not isinstance(table, dict) for table in said.values()):
        raise ConfigError("the settings of the run are values, not sections")
    told = cast(Tables, said)
    tables = {name: dict(table) for name, table in own.items() if name not in SAME}
    tables |= {name: told[name] for name in SAME if name in told}
    tables["actor"] = told.get("actor", {}) | own.get("actor", {})
    if model is not None:
        tables.setdefault("sim", {})["model"] = str(model)
    return tables


def play_until_finished(
    service: Ticking, bus: Bus, clock: Clock, args: ServeArgs, stop: threading.Event
) -> None:
    """Tick until ``stop`` is set or the league says that the run is finished."""
    plain_loop(_UntilFinished(service, bus, stop), bus, clock, args, stop)


class _UntilFinished:
    """A service that ends with its run."""

    def __init__(self, service: Ticking, bus: Bus, stop: threading.Event) -> None:
        self._service = service
        self._schedule = bus.subscribe(SCHEDULE)
        self._stop = stop

    def tick(self) -> bool:
        while (schedule := self._schedule.take()) is not None:
            if schedule.finished:
                self._stop.set()
        return self._service.tick()

    def health(self) -> Health:
        return self._service.health()

    def close(self) -> None:
        self._schedule.close()


def _find_run(cfg: BusConfig, name: str, clock: Clock, stop: threading.Event) -> str:
    """Return the run that is on, once there is one; empty when told to stop before."""
    where = ", ".join(cfg.routers)
    told = False
    while not stop.is_set():
        if run := find_run(cfg, name, clock, "actor", SCHEDULE, LISTEN_SECONDS):
            return run
        if not told:
            told = True
            _say(f"{name}: no run is on at {where} yet; waits for one")
    return ""


def _ask_settings(
    cfg: BusConfig, name: str, clock: Clock, run_id: str, stop: threading.Event
) -> RunSettings | None:
    """Return what the league says to play by, once it answers; None when told to stop before.

    Raises:
        ConfigError: it will not say.
    """
    bus = open_zenoh(cfg, name, clock, run_id, "actor")
    told = False
    try:
        while not stop.is_set():
            pending = bus.ask(SETTINGS, SettingsRequest(actor=name), ASK_SECONDS)
            while (answer := pending.take()) is None:
                bus.wait(ASK_SECONDS)
            if isinstance(answer, RunSettings):
                return answer
            if isinstance(answer, Refused) and not answer.retry:
                raise ConfigError(f"the league of {run_id} does not say what to play by: {answer}")
            if isinstance(answer, NoAnswer) and not told:
                told = True
                _say(f"{name}: waits for the league of {run_id}: {answer.reason}")
            stop.wait(0.2)
    finally:
        bus.close()
    return None


def _argv(args: ServeArgs, site: Path, name: str, scratch: Path, run_id: str) -> tuple[str, ...]:
    words = [str(site), "--name", name, "--run", str(scratch), "--run-id", run_id]
    words += [word for endpoint in args.connect for word in ("--connect", endpoint)]
    overrides = args.overrides
    if args.site is None:
        overrides = (f"bus.give_up_seconds={GIVE_UP_SECONDS}", *overrides)
    words += [word for override in overrides for word in ("--set", override)]
    return tuple(words)


def _given(argv: Sequence[str]) -> argparse.Namespace:
    """Return what the command line itself says of folder, run and name; None where nothing."""
    parser = argparse.ArgumentParser(add_help=False, allow_abbrev=False)
    for option in ("--run", "--run-id", "--name"):
        parser.add_argument(option)
    return parser.parse_known_args(argv)[0]


def _host() -> str:
    plain = re.sub(r"[^A-Za-z0-9]+", "-", socket.gethostname().partition(".")[0]).strip("-")
    return plain[:32] or "host"


def _say(text: str) -> None:
    sys.stderr.write(f"{text}\n")
    sys.stderr.flush()
