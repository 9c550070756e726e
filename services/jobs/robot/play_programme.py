"""`riposte robot play-programme`: take the robot along a programme of `riposte identify excite`.

It runs against a site of router, robot_io, referee and recorder, without a policy, such as
`riposte up deploy/programme.toml`. A person arms the robot; every command passes the safety gate;
disarming, a trip and Ctrl-C end it, and the robot stays where it is.
"""

import argparse
import contextlib
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from services.jobs.robot.command import place, place_arguments
from services.jobs.robot.playable import check_playable
from services.jobs.robot.player import ASK_SECONDS, Player
from services.jobs.who import operator
from shared.bus.base import Bus
from shared.clock import Clock, SystemClock
from shared.config.site import nearest
from shared.errors import ConfigError
from shared.identification.excitation.reading import PosePlan, Stretch, read_programme
from shared.runtime.serve import open_site_bus
from shared.runtime.stop import stop_on_signals

WAIT_SECONDS = 0.01
LINE_SECONDS = 5.0
"""Between two lines of progress within a recording."""
EXIT_STOPPED = 1
EXIT_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Play a programme; return 0 when every recording came to its end."""
    found = _parse(sys.argv[1:] if argv is None else argv)
    plan = read_programme(found.programme)
    stretches = chosen(plan, found.only)
    where = place(found)
    site = where.site
    if site is None and (where.run / "config.toml").exists():
        site = where.run / "config.toml"
    check_playable(plan, site)
    seconds = sum(each.seconds for each in stretches)
    say(f"{len(stretches)} recordings, {seconds:.0f} s of motion, {plan.reference[:22]}")
    clock = SystemClock()
    with stop_on_signals() as stop, contextlib.closing(open_site_bus(where, clock)) as bus:
        player = Player(
            plan, stretches, found.countdown, operator(), found.patience, bus, clock, say
        )
        with contextlib.closing(player):
            line_at = clock.now()
            while not player.is_over and not stop.is_set():
                player.tick()
                if player.step == "playing" and clock.now() - line_at >= LINE_SECONDS:
                    line_at = clock.now()
                    say(f"  {player.name}: {100 * player.share:.0f} %")
                bus.wait(WAIT_SECONDS)
            is_whole = player.step == "done"
            problem = player.problem or ("" if is_whole else "interrupted")
            shut(player, problem or "the programme is over", bus, clock)
    if found.json:
        print(json.dumps({"played": player.played, "problem": problem}))
    if not is_whole:
        left = [each.name for each in stretches if each.name not in player.played]
        say(f"stopped: {problem}; the robot is disarmed and stays where it is")
        say(f"to go on: --only {' '.join(left)}")
        return EXIT_INTERRUPTED if not player.problem else EXIT_STOPPED
    say(
        f"all played; a data set of it: riposte identify from-bouts {where.run} OUT "
        f"--programme {plan.folder}"
    )
    return 0


def say(text: str) -> None:
    """Tell the person."""
    print(text, file=sys.stderr, flush=True)


def chosen(plan: PosePlan, only: Sequence[str]) -> list[Stretch]:
    """Return the recordings to play, in the programme's order.

    Raises:
        ConfigError: the programme has no recording of such a name.
    """
    names = [each.name for each in plan.stretches]
    for name in only:
        if name not in names:
            raise ConfigError(f"--only {name}: {nearest(name, names)}")
    return [each for each in plan.stretches if not only or each.name in only]


def shut(player: Player, reason: str, bus: Bus, clock: Clock) -> None:
    """Have the gate shut, and wait for it for a moment."""
    pending = player.stop(reason)
    deadline = clock.now() + ASK_SECONDS
    while pending.take() is None and clock.now() < deadline:
        bus.wait(WAIT_SECONDS)


def _parse(argv: Sequence[str]) -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="riposte robot play-programme",
        description="Takes the robot of a running site along a programme that riposte identify "
        "excite designed, for the recorder to write down. A person arms it.",
    )
    parser.add_argument(
        "programme", type=Path, metavar="PROGRAMME", help="folder that identify excite wrote"
    )
    place_arguments(parser)
    parser.add_argument(
        "--only", nargs="+", default=[], metavar="NAME", help="play these recordings of it"
    )
    parser.add_argument(
        "--countdown", type=float, default=3.0, metavar="S",
        help="before each recording (%(default)s s)",
    )  # fmt: skip
    parser.add_argument(
        "--patience", type=float, default=300.0, metavar="S",
        help="longest wait for somebody to arm the robot (%(default)s s)",
    )  # fmt: skip
    parser.add_argument("--json", action="store_true", help="end with one JSON object")
    found = parser.parse_args(argv)
    if not 0.0 <= found.countdown <= 60.0:
        parser.error(f"--countdown is {found.countdown:g}; allowed are 0 to 60 s")
    return found


if __name__ == "__main__":
    sys.exit(main())
