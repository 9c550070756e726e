"""What a command line of `riposte play` asks for: everything read and checked before a start."""

import argparse
import contextlib
import datetime
from collections.abc import Sequence
from pathlib import Path

import msgspec
import tomli_w

from services.jobs.play.config import PlayConfig
from services.jobs.play.seats import PERSON, TRACKERS, Seat, missing_library, seat_of
from services.jobs.site import section_types
from services.page.config import PageConfig
from services.policy.config import PolicyConfig
from services.policy.loading import Loader
from services.robot_io.config import RobotIoConfig
from shared.bus.config import BusConfig
from shared.bus.ports import free_port
from shared.config.site import dump, load_section, load_site
from shared.errors import ConfigError, SnapshotError
from shared.policy.action import ActionConfig
from shared.policy.snapshot import Fit
from shared.runtime.serve import run_id_of
from shared.sim.arena import arena_of
from shared.sim.config import SimConfig
from shared.styles.bundle import load_bundle, shipped_bundle

RUNS = Path("runs")
SUMMARY = "summary.json"
LAPTOP: tuple[str, ...] = (
    "robot_io.twin_filter=1.0",
    "robot_io.twin_delay=0.0",
    "robot_io.twin_force=30.0",
    "safety.game_speed=1.0",
    "safety.acceleration=20.0",
    "safety.turn_speed=4.0",
    "safety.turn_acceleration=60.0",
    "safety.state_hold=0.2",
    "safety.state_trip=0.5",
    "safety.command_trip=2.0",
    "safety.force_trip=100.0",
    "safety.force_seconds=0.5",
    "safety.tracking_trip=0.3",
    "safety.tracking_seconds=1.0",
    "safety.effort_trip=1.0",
    "safety.effort_seconds=1.0",
)
"""Over the defaults where no site file is given, as in deploy/play.toml: the robot that policies
were trained on, which answers faster than the real one; nobody can be hurt by a simulated one."""
HEURISTICS = (
    ("Heuristic", "scripted:heuristic"),
    ("Heuristic, not camping", "scripted:heuristic-retreating"),
    ("Guard", "scripted:guard"),
)
"""Scripted protagonists to choose from on the page."""


class Plan(msgspec.Struct, frozen=True, kw_only=True):
    """A match, ready to be started."""

    folder: Path
    run: str
    """Its name on the bus."""
    settings: str
    """The resolved site file (TOML)."""
    antagonist: Seat
    protagonist: Seat
    bouts: int
    """0: until it is stopped."""
    play: PlayConfig
    bus: BusConfig
    page: PageConfig
    link: str
    """``twin`` or ``pr2``."""

    @property
    def is_armed_by_typing(self) -> bool:
        """Return whether typing the command arms: a simulated robot, where no page does it."""
        return self.link == "twin" and self.starts_bouts

    @property
    def has_page(self) -> bool:
        """Return whether there is a page: where a person plays."""
        return self.antagonist.is_person

    @property
    def starts_bouts(self) -> bool:
        """Return whether the bouts follow each other by themselves; else the page starts them."""
        if self.antagonist.is_person:
            return self.antagonist.label != "mouse" and self.bouts > 0
        return True


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Return the words of a command line."""
    parser = argparse.ArgumentParser(
        prog="riposte play",
        description="Fence against the robot: with the mouse on a page, or let two policies play.",
        epilog="SNAPSHOT: the file of one, RUN:protagonist or RUN:antagonist, sha256:HASH.",
    )
    parser.add_argument(
        "site", nargs="?", type=Path, metavar="SITE", help="site file (TOML); none: a simulated PR2"
    )
    parser.add_argument(
        "--protagonist", metavar="WHO",
        help="the robot: heuristic, scripted:NAME, style-1 (of the bundle; the default), SNAPSHOT",
    )  # fmt: skip
    parser.add_argument(
        "--antagonist", metavar="WHO",
        help="who plays against it: mouse (the default), vive, heuristic, scripted:NAME, SNAPSHOT",
    )  # fmt: skip
    parser.add_argument("--bouts", type=int, metavar="N", help="end after so many (none: Ctrl-C)")
    parser.add_argument("--port", type=int, metavar="N", help="of the page (8765, or a free one)")
    parser.add_argument("--out", type=Path, metavar="DIR", help="folder of the match")
    parser.add_argument("--no-browser", action="store_true", help="only print the page's address")
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    parser.add_argument(
        "--set", action="append", default=[], dest="overrides", metavar="SECTION.KEY=VALUE",
        help="over the site file; may be repeated",
    )  # fmt: skip
    return parser.parse_args(argv)


def plan_of(found: argparse.Namespace) -> Plan:
    """Return the match that the words ask for; starts and writes nothing.

    Raises:
        ConfigError: a value, a port or a folder cannot be used.
        SnapshotError: a player is not there or does not fit; names the field.
        ModuleNotFoundError: an optional library is missing.
    """
    site: Path | None = found.site
    words = [*(() if site is not None else LAPTOP), *found.overrides, *_flags(found)]
    link, tracker = _robot(site, words)
    if link != "twin" and site is None:
        raise ConfigError(
            f"robot_io.link is {link!r}, a real robot: its limits stand in a site file; "
            "name one, such as deploy/robot.toml"
        )
    play = load_section(site, "play", PlayConfig, words)
    folder = _folder(found.out)
    who = play.antagonist or (tracker if tracker in TRACKERS else TRACKERS[0])
    antagonist, protagonist = _seats(site, words, who, play.protagonist, folder)
    if link != "twin" and not antagonist.is_person:
        raise ConfigError(
            f"--antagonist {antagonist.label} is a second simulated robot, and robot_io.link is "
            f"{link!r}: opposite a real robot say vive, mouse or replay"
        )
    if (library := missing_library(antagonist, link)) is not None:
        raise ModuleNotFoundError(f"No module named {library!r}", name=library)
    cfg = load_section(site, "page", PageConfig, words)
    is_chosen = found.port is not None or cfg.port != PageConfig().port
    page = _page(cfg, antagonist, protagonist, is_chosen=is_chosen)
    words += _assignments(antagonist, protagonist, page)
    sections = load_site(site, section_types(), words)
    bus = sections["bus"]
    assert isinstance(bus, BusConfig)
    return Plan(
        folder=folder,
        run=run_id_of(folder),
        settings=dump(sections),
        antagonist=antagonist,
        protagonist=protagonist,
        bouts=play.bouts,
        play=play,
        bus=bus,
        page=page,
        link=link,
    )


def override(key: str, value: object) -> str:
    """Return a setting as it stands on a command line."""
    return f"{key}={tomli_w.dumps({'value': value}).partition('=')[2].strip()}"


def _flags(found: argparse.Namespace) -> list[str]:
    given = {
        "play.protagonist": found.protagonist,
        "play.antagonist": found.antagonist,
        "play.bouts": found.bouts,
        "page.port": found.port,
    }
    return [override(key, value) for key, value in given.items() if value is not None]


def _folder(out: Path | None) -> Path:
    """Return the folder of the match.

    Raises:
        ConfigError: it holds something already.
    """
    if out is None:
        stamp = datetime.datetime.now().strftime("%Y%m%d-%H%M%S")
        return RUNS / f"play-{stamp}"
    for name in (SUMMARY, "league.sqlite"):
        if (out / name).exists():
            raise ConfigError(f"{out} holds a run already ({name}): choose another --out")
    return out


def _robot(site: Path | None, words: Sequence[str]) -> tuple[str, str]:
    """Return which robot it is, and the tracker that the site file names."""
    tracker = ""
    with contextlib.suppress(ConfigError):  # a link that does not go with the default tracker
        tracker = load_section(site, "robot_io", RobotIoConfig, words).tracker
    words = [*words, override("robot_io.tracker", "mouse"), override("robot_io.replay", "")]
    return load_section(site, "robot_io", RobotIoConfig, words).link, tracker


def _seats(
    site: Path | None, words: Sequence[str], antagonist: str, protagonist: str, folder: Path
) -> tuple[Seat, Seat]:
    """Return both sides, antagonist first."""
    sim = load_section(site, "sim", SimConfig, words)
    action = load_section(site, "action", ActionConfig, words)
    policy = load_section(site, "policy", PolicyConfig, words)
    fit = Fit.of(action, sim.control_timestep, policy.model or None)
    arena = arena_of(sim, action)

    def seat(text: str, loader: Loader) -> Seat:
        try:
            return seat_of(text, loader, RUNS)
        except SnapshotError as error:
            raise SnapshotError(f"{loader.agent}: {error}") from None

    return (
        seat(antagonist, Loader("antagonist", fit, arena, folder)),
        seat(protagonist, Loader("protagonist", fit, arena, folder)),
    )


def _page(
    cfg: PageConfig, antagonist: Seat, protagonist: Seat, *, is_chosen: bool
) -> PageConfig:  # fmt: skip
    """Return the page's settings: a port that is free, and whom one can play against.

    Raises:
        ConfigError: the port that was asked for is in use.
    """
    if antagonist.is_person and cfg.port:
        port = free_port(cfg.port)
        if port != cfg.port and is_chosen:
            raise ConfigError(
                f"page.port: {cfg.port} is in use by another program; stop it, name another port, "
                "or leave it out to get a free one"
            )
        cfg = msgspec.structs.replace(cfg, port=port)
    players = cfg.players
    if players == PageConfig().players:
        players = _players(protagonist)
    return msgspec.structs.replace(
        cfg,
        pointer=antagonist.label == "mouse",
        antagonist=PERSON if antagonist.is_person else antagonist.reference,
        players=players,
    )


def _players(chosen: Seat) -> tuple[tuple[str, str], ...]:
    """Return the protagonists to choose from on the page, the chosen one first."""
    scripted = {player: name for name, player in HEURISTICS}
    players = {scripted.get(chosen.player, chosen.label): chosen.player}
    try:
        loaded = load_bundle(shipped_bundle())
    except SnapshotError:  # there is somebody to play against all the same
        pass
    else:
        for player in loaded.bundle.players:
            path = loaded.folder / f"{player.sha256}.safetensors"
            players.setdefault(player.name, str(path))
    for name, player in HEURISTICS:
        if player != chosen.player:
            players.setdefault(name, player)
    return tuple(players.items())


def _assignments(antagonist: Seat, protagonist: Seat, page: PageConfig) -> list[str]:
    """Return what the seats mean to the processes, as overrides."""
    players = [list(pair) for pair in page.players]
    tracker = antagonist.label if antagonist.is_person else "policy"
    values: dict[str, object] = {
        "robot_io.tracker": tracker,
        "policy.protagonist": protagonist.player,
        "page.port": page.port,
        "page.antagonist": page.antagonist,
        "page.players": players,
        "page.pointer": page.pointer,
    }
    if tracker != "replay":
        values["robot_io.replay"] = ""
    if not antagonist.is_person:
        values["policy.antagonist"] = antagonist.player
    return [override(key, value) for key, value in values.items()]
