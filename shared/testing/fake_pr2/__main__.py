"""``python -m shared.testing.fake_pr2``: a PR2 to talk to where there is none."""

import argparse
import sys
from collections.abc import Callable, Iterable, Sequence

from shared.errors import RiposteError
from shared.testing.fake_pr2.config import FakePr2Config
from shared.testing.fake_pr2.fake import FakePr2

HELP = "press, release, wireless, unwire, halt, reset, status, quit"


def main(argv: Sequence[str] | None = None, lines: Iterable[str] | None = None) -> int:
    """Run a fake PR2 until ``quit`` or the end of the input; return the exit code.

    Args:
        argv: the command line.
        lines: what a person types; standard input if None.
    """
    parser = argparse.ArgumentParser(
        prog="python -m shared.testing.fake_pr2",
        description=f"A fake PR2 on a ROS master of its own. Then type: {HELP}.",
    )
    parser.add_argument("--port", type=int, default=11311, help="of the ROS master; 0: a free one")
    parser.add_argument(
        "--no-auto-restart", action="store_true",
        help="nothing resets the motors after a released run stop",
    )  # fmt: skip
    parser.add_argument(
        "--set-up", action="store_true",
        help="set up r_cart as docs/robot.md says, so that robot_io can be armed",
    )  # fmt: skip
    args = parser.parse_args(argv)
    try:
        fake = FakePr2(FakePr2Config(port=args.port, auto_restart=not args.no_auto_restart))
    except (RiposteError, ValueError) as error:
        sys.stderr.write(f"{error}\n")
        return 2
    with fake:
        if args.set_up:
            fake.set_up()
        _say(f"ROS_MASTER_URI={fake.master_uri}")
        try:
            _listen(fake, sys.stdin if lines is None else lines)
        except KeyboardInterrupt:
            _say("")
    return 0


def _listen(fake: FakePr2, lines: Iterable[str]) -> None:
    acts: dict[str, Callable[[], None]] = {
        "press": fake.press_run_stop,
        "release": fake.release_run_stop,
        "wireless": fake.press_wireless_stop,
        "unwire": fake.release_wireless_stop,
        "halt": fake.halt_motors,
        "reset": fake.reset_motors,
        "status": lambda: _say(_status(fake)),
    }
    for line in lines:
        word = line.strip()
        if word == "quit":
            return
        if word in acts:
            acts[word]()
        elif word:
            _say(f"{word} is not known; known are: {HELP}")


def _status(fake: FakePr2) -> str:
    x, y, z = fake.tool()[:3]
    motors = "halted" if fake.is_halted else "on"
    return (
        f"tool at ({x:.3f}, {y:.3f}, {z:.3f}) m, motors {motors}, running: "
        f"{', '.join(fake.running()) or 'nothing'}, {fake.cycles_lost} ms lost"
    )


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
