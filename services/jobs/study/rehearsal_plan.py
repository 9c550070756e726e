"""What a rehearsal is made with: settings of the services, people, seed; kept beside its data."""

from pathlib import Path
from typing import Any, Final

import msgspec
import tomli_w

from services.jobs.study.players import seats_of
from services.robot_io.config import RobotIoConfig, SafetyConfig
from services.study.config import StudyConfig
from shared.config import toml
from shared.config.site import load_section, raw_sections
from shared.errors import ConfigError
from shared.game.rules import RuleBook
from shared.runtime.files import atomic_write
from shared.sim.config import SimConfig
from shared.study.people.population import Population
from shared.study.protocol import Protocol

FILE: Final = "rehearsal.toml"
BARE: Final = ('game.camping="once"',)
"""Without a site file: the real robot's twin behind its gate, and the camping rule of the paper's
prose, under which its heuristic is a strong player (docs/players.md)."""
_SECTIONS: Final = ("robot_io", "safety", "sim", "game", "study", "people")


class RehearsalPlan(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """All that the data of a rehearsal depend on, besides the code."""

    seed: int
    is_archived: bool
    """Whether every bout is archived and drawn, as in a live study."""
    robot_io: RobotIoConfig
    safety: SafetyConfig
    sim: SimConfig
    game: RuleBook
    study: StudyConfig
    people: Population
    players: dict[str, str]
    """What the protocol calls a player -> what the policy loads."""


def make_plan(
    protocol: Protocol, site: Path | None, words: tuple[str, ...], seed: int, *, is_archived: bool
) -> RehearsalPlan:
    """Return the plan that a command line asks for, its players loaded once.

    Args:
        protocol: of the study.
        site: site file of the services; None: the real robot's twin.
        words: ``section.key=value``, also of ``people``.
        seed: of the study.
        is_archived: whether bouts are archived.

    Raises:
        ConfigError: a section, key or value is no good.
        SnapshotError: a player cannot be had.
    """
    own = tuple(word for word in words if word.partition(".")[0] == "people")
    rest = tuple(word for word in words if word not in own)
    for word in rest:
        if word.partition(".")[0] not in _SECTIONS:
            raise ConfigError(f"{word!r} says nothing of {', '.join(_SECTIONS)}")
    words = (*(BARE if site is None else ()), *rest, 'robot_io.tracker="mouse"')
    return RehearsalPlan(
        seed=seed,
        is_archived=is_archived,
        robot_io=load_section(site, "robot_io", RobotIoConfig, words),
        safety=load_section(site, "safety", SafetyConfig, words),
        sim=load_section(site, "sim", SimConfig, words),
        game=load_section(site, "game", RuleBook, words),
        study=load_section(site, "study", StudyConfig, words),
        people=_population(own),
        players={name: seat.player for name, seat in seats_of(protocol, site, words).items()},
    )


def write_plan(folder: Path, plan: RehearsalPlan) -> None:
    """Keep a plan in the study's folder.

    Raises:
        ConfigError: another one is there: its data and new ones would not belong together.
        RiposteError: it cannot be written.
    """
    text = tomli_w.dumps(msgspec.to_builtins(plan)).encode()
    path = folder / FILE
    if path.exists() and path.read_bytes() != text:
        raise ConfigError(
            f"{path} says that this study was begun with other settings: give the same ones, or "
            "a new --out"
        )
    atomic_write(path, text)


def read_plan(folder: Path) -> tuple[RehearsalPlan, bytes]:
    """Return the plan in a study's folder, and the bytes that say it.

    Raises:
        ConfigError: there is none, or it is damaged.
    """
    path = folder / FILE
    try:
        data = path.read_bytes()
        return toml.decode(data, RehearsalPlan), data
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror or error}") from error
    except ValueError as error:
        raise ConfigError(f"{path} is no rehearsal: {error}") from error


def _population(words: tuple[str, ...]) -> Population:
    """Return the population that ``people.key=value`` ask for.

    Raises:
        ConfigError: a key or value is no good.
    """
    # a section of a rehearsal and of no site, so it is read under the name of another one
    bare = tuple("study." + word.partition(".")[2] for word in words)
    table: dict[str, Any] = raw_sections(None, ("study",), bare).get("study", {})
    try:
        return msgspec.convert(table, Population)
    except msgspec.ValidationError as error:
        raise ConfigError(f"people: {error}") from error
