"""`riposte robot`: what a person does to the robot: check, arm, disarm, reset, and more."""

import argparse
import contextlib
import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, get_args

import msgspec

from services.jobs.plain import printable
from services.jobs.status import OPEN_SECONDS, add_bus_arguments, read_endpoint
from services.jobs.who import operator
from shared.bus.base import Bus, NoAnswer, Refused
from shared.clock import Clock, SystemClock
from shared.errors import ConfigError, RiposteError
from shared.messages.play import GateReply, GateRequest
from shared.messages.topics import ARM
from shared.runtime.serve import ServeArgs, certificates_override, open_site_bus, run_id_of

Action = Literal["check", "arm", "disarm", "reset"]
ABOUT = {
    "check": "everything that must be so before the robot is armed, as a list",
    "arm": "let the robot move; somebody must hold its run stop",
    "disarm": "shut the gate: the robot stays where it is",
    "reset": "after a trip: back to disarmed, once the robot is in order",
    "play-programme": "a programme of riposte identify excite: riposte robot play-programme --help",
    "calibrate": "where a Vive's base stations stand: riposte robot calibrate --help",
}
PLAYED = Path("runs/latest-play")
"""The newest match of `riposte play`."""
UP = Path("runs/latest")
"""The run of `riposte up`."""
ANSWER_SECONDS = 3.0
EXIT_REFUSED = 1


def main(argv: Sequence[str] | None = None) -> int:
    """Do what a person asks; return 1 when robot_io will not."""
    words = list(sys.argv[1:] if argv is None else argv)
    if words[:1] == ["calibrate"]:
        from services.jobs.robot import calibrate  # scipy, of the extra `robot`

        return calibrate.main(words[1:])
    if words[:1] == ["play-programme"]:
        from services.jobs.robot import play_programme  # the simulator, to check places with

        return play_programme.main(words[1:])
    found = _parse(words)
    clock = SystemClock()
    with contextlib.closing(open_site_bus(place(found), clock)) as bus:
        reply = ask(bus, clock, found.action)
    if found.json:
        print(json.dumps(msgspec.to_builtins(reply)))
    else:
        print("\n".join(map(printable, lines(found.action, reply))))
    return 0 if reply.accepted else EXIT_REFUSED


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="riposte robot",
        description="What a person does to the robot of a match or a site.",
        epilog="\n".join(f"{name:<14} {about}" for name, about in ABOUT.items()),
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("action", choices=get_args(Action), metavar="|".join(get_args(Action)))
    place_arguments(parser)
    parser.add_argument("--json", action="store_true", help="one JSON object")
    return parser.parse_args(argv)


def place_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what is needed to find robot_io: see ``place``."""
    add_bus_arguments(parser, run=None, about=f"{PLAYED}, or {UP}")


def place(found: argparse.Namespace) -> ServeArgs:
    """Return where robot_io is: in the match that goes on, else where the site file says.

    Raises:
        ConfigError: nothing says where.
    """
    folder: Path | None = found.run
    if folder is None:
        folder = PLAYED if (PLAYED / "endpoint.json").exists() else UP
    connect, run_id = tuple(found.connect), str(found.run_id)
    certificates = found.certificates
    goes_on = (folder / "endpoint.json").exists()
    if not connect and not goes_on and found.site is None:
        raise ConfigError(
            f"nothing goes on in {folder} (no endpoint.json): start riposte play, name its folder "
            "with --run DIR, or name the site file that riposte up runs"
        )
    if not connect and goes_on:
        endpoint = read_endpoint(folder)
        connect, run_id = (endpoint.connect,), run_id or endpoint.run
        certificates = certificates or endpoint.certificates
    return ServeArgs(
        role="robot",
        site=found.site,
        name=f"robot-{os.getpid()}",
        run=folder,
        run_id=run_id or run_id_of(folder),
        connect=connect,
        overrides=(
            f"bus.open_seconds={OPEN_SECONDS}",
            *certificates_override(certificates),
        ),
    )


def ask(bus: Bus, clock: Clock, action: Action) -> GateReply:
    """Ask robot_io in the name of whoever sits here.

    Raises:
        RiposteError: it does not answer.
    """
    pending = bus.ask(ARM, GateRequest(action=action, operator=operator()), ANSWER_SECONDS)
    deadline = clock.now() + ANSWER_SECONDS
    while (answer := pending.take()) is None and clock.now() < deadline:
        bus.wait(0.1)
    if answer is None or isinstance(answer, NoAnswer | Refused):
        reason = answer.reason if answer is not None else f"nothing within {ANSWER_SECONDS:g} s"
        raise RiposteError(
            f"no robot_io answers ({reason}); start one with riposte play or riposte up SITE"
        )
    return answer


def lines(action: Action, reply: GateReply) -> list[str]:
    """Return an answer as a person reads it."""
    if action == "check":
        made = [f"✓ {what}" for what in reply.passed] + [f"✗ {why}" for why in reply.reasons]
        count = len(reply.reasons)
        words = "it may be armed" if not count else f"{count} of {len(made)} not in order"
        return [*made, f"robot {reply.mode}: {words}"]
    if reply.accepted:
        return [f"robot {reply.mode}"]
    return [f"robot {reply.mode}, {action} refused:", *(f"✗ {why}" for why in reply.reasons)]


if __name__ == "__main__":
    sys.exit(main())
