"""`riposte study`: each subcommand is a module beside this one, imported when it is called."""

import importlib
from collections.abc import Callable, Sequence
from typing import NamedTuple

from shared.config.site import nearest
from shared.errors import ConfigError


class Subcommand(NamedTuple):
    """``main(argv) -> exit code`` in ``services.jobs.study.<name>``."""

    name: str
    about: str


SUBCOMMANDS = (
    Subcommand("new", "make a study's folder from a protocol"),
    Subcommand("check", "check a protocol, or a study with all its data"),
    Subcommand("allocate", "draw who meets the conditions in which order"),
    Subcommand("run", "run one participant's session, from the welcome to the debrief"),
    Subcommand("withdraw", "delete everything of a participant"),
    Subcommand("export", "write the tables as CSV, blinded unless asked otherwise"),
    Subcommand("simulate", "rehearse a whole study with simulated people, and analyse it"),
    Subcommand("analyse", "every statistic of a study: a report, JSON and CSV tables"),
    Subcommand("power", "how many people a difference of learning needs"),
)
EXIT_BAD_INPUT = 2


def main(argv: Sequence[str]) -> int:
    """Run a subcommand of ``riposte study``; return the exit code."""
    if not argv or argv[0] in ("-h", "--help", "help"):
        print(_help())
        return 0 if argv else EXIT_BAD_INPUT
    names = [subcommand.name for subcommand in SUBCOMMANDS]
    if argv[0] not in names:
        raise ConfigError(f"unknown subcommand {argv[0]!r}; {nearest(argv[0], names)}")
    run: Callable[[Sequence[str]], int] = importlib.import_module(
        f"services.jobs.study.{argv[0]}"
    ).main
    return run(argv[1:])


def _help() -> str:
    lines = ["usage: riposte study SUBCOMMAND [ARGUMENTS]     riposte study SUBCOMMAND --help", ""]
    lines += [f"  {each.name:<10} {each.about}" for each in SUBCOMMANDS]
    return "\n".join([*lines, "", "docs/study.md leads from the ethics form to the tables."])
