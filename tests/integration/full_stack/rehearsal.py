"""``python -m tests.integration.full_stack.rehearsal``: a lab without a robot, to rehearse in.

Sets up the doubles and prints what to type in two other terminals; then does what is typed here to
the robot, the tracker and the strap.
"""

import argparse
import shlex
import sys
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from tests.integration.full_stack.doubles import Lab, lab, lacks
from tests.integration.training.training import ROOT

ROBOT = ("press", "release", "wireless", "unwire", "halt", "reset")
HELP = f"{', '.join(ROBOT)} (the robot), lose, find (the tracker), drop (the strap), status, quit"


def main(argv: Sequence[str] | None = None, lines: Iterable[str] | None = None) -> int:
    """Run the doubles until ``quit`` or the end of the input; return the exit code.

    Args:
        argv: the command line.
        lines: what a person types; standard input if None.
    """
    parser = argparse.ArgumentParser(
        prog="python -m tests.integration.full_stack.rehearsal",
        description=f"A lab without a robot, a Vive, a strap or a loudspeaker. Then type: {HELP}.",
    )
    parser.add_argument("--bouts", type=int, default=3, metavar="N", help="of the match (3)")
    found = parser.parse_args(argv)
    if lacking := lacks():
        sys.stderr.write(f"{lacking}\n")
        return 2
    with lab() as around:
        say(instructions(around, found.bouts))
        try:
            listen(around, sys.stdin if lines is None else lines)
        except KeyboardInterrupt:
            say("")
    return 0


def instructions(around: Lab, bouts: int) -> str:
    """Return what a person types elsewhere; the first command is one for any POSIX shell."""
    program = Path(sys.executable).with_name("riposte")
    settings = " ".join(f"--set {shlex.quote(setting)}" for setting in around.settings)
    variables = " ".join(
        f"{name}={shlex.quote(value)}" for name, value in around.environment.items()
    )
    return "\n".join(
        (
            "Start the match in a second terminal:",
            f"  cd {shlex.quote(str(ROOT))} && env {variables} \\",
            f"    {program} play deploy/robot.toml --bouts {bouts} --no-browser {settings}",
            "Look, and arm the robot, in a third:",
            f"  cd {shlex.quote(str(ROOT))} && {program} robot check && {program} robot arm",
            f"Type here: {HELP}",
        )
    )


def listen(around: Lab, lines: Iterable[str]) -> None:
    """Do what is typed until ``quit``."""
    acts: dict[str, Callable[[], None]] = {
        "lose": lambda: around.lose_tracker(is_lost=True),
        "find": lambda: around.lose_tracker(is_lost=False),
        "drop": around.bluez.drop,
        "status": lambda: say(f"{around.robot.ask()}; {around.beats} heart beats"),
    }
    for line in lines:
        word = line.strip()
        if word == "quit":
            return
        if word in ROBOT:
            around.robot.tell(word)
        elif word in acts:
            acts[word]()
        elif word:
            say(f"{word} is not known; known are: {HELP}")


def say(text: str) -> None:
    """Write a line to the person at the terminal."""
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
