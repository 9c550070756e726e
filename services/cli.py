"""`riposte`: one subcommand for each service and each job, imported only when it is called."""

import importlib
import os
import sys
from collections.abc import Callable, Sequence
from typing import NamedTuple

from shared.errors import RiposteError


class Command(NamedTuple):
    """A subcommand: ``main(argv) -> exit code`` in ``services.<module>``."""

    name: str
    module: str
    about: str


JOBS = (
    Command("play", "jobs.play.command", "fence against the robot, or watch two policies do it"),
    Command("robot", "jobs.robot.command", "check, arm, disarm or reset the robot"),
    Command("train", "jobs.train.command", "train two fencers on this machine, with a report"),
    Command("study", "jobs.study.command", "run a study with people, and what follows from it"),
    Command("tournament", "jobs.tournament.command", "everybody of a run against everybody"),
    Command("ratings", "jobs.tournament.ratings", "rate the players of a run's tournament"),
    Command("status", "jobs.status", "who runs, and who waits for whom"),
    Command("watch", "jobs.watch", "look at a run while it goes"),
    Command("report", "jobs.report.command", "write a run's HTML report"),
    Command("bench", "jobs.bench", "measure against the limit, in one run"),
    Command("doctor", "jobs.doctor.command", "check this machine and say what to do"),
    Command("chaos", "jobs.chaos.command", "what faults of every kind cost a running job"),
    Command("styles", "jobs.styles.command", "how protagonists move, and the three to send"),
    Command("identify", "jobs.identify.command", "what the simulation gets wrong, and why"),
    Command("export", "jobs.export", "a trained policy as ONNX, for other runtimes"),
    Command("sim", "jobs.sim", "export the two-robot model as MJCF"),
    Command("certs", "jobs.certs.command", "certificates, for a bus across machines"),
    Command("up", "jobs.up", "start and keep alive the processes a site file lists"),
)
SERVICES = (
    Command("router", "router.__main__", "the bus's meeting point"),
    Command("league", "league.__main__", "schedule, opponents, ledger"),
    Command("learner", "learner.__main__", "one agent's PPO"),
    Command("actor", "actor.__main__", "plays bouts in simulation"),
    Command("recorder", "recorder.__main__", "writes and shows what happens"),
    Command("policy", "policy.__main__", "plays one side of a live bout"),
    Command("referee", "referee.__main__", "scores a live bout"),
    Command("robot-io", "robot_io.__main__", "moves a robot, through the safety gate"),
    Command("page", "page.__main__", "a live bout in a browser, and its mouse"),
    Command("metrics", "metrics.__main__", "what the processes say, for Prometheus"),
)
COMMANDS = {command.name: command for command in (*JOBS, *SERVICES)}

EXTRAS = {
    "torch": "train",
    "rsl_rl": "train",
    "tensordict": "train",
    "matplotlib": "train",
    "sklearn": "styles",
    "scipy": "robot",
    "onnx": "styles",
    "gymnasium": "env",
    "pettingzoo": "env",
    "cma": "identify",
    "websockets": "play",
    "sounddevice": "play",
    "rosbags": "robot",
    "apsw": "robot",
    "openvr": "robot",
    "bleak": "robot",
    "cryptography": "certs",
}
"""Import name of an optional library: the extra that installs it."""

EXIT_BAD_INPUT = 2
EXIT_INTERRUPTED = 130


def main(argv: Sequence[str] | None = None) -> int:
    """Run one command line; return the exit code."""
    try:
        code = _main(list(sys.argv[1:] if argv is None else argv))
        sys.stdout.flush()
    except BrokenPipeError:  # `riposte status | head`: nobody reads on
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return 0
    return code


def _main(words: list[str]) -> int:
    if not words or words[0] in ("-h", "--help", "help"):
        print(_help())
        return 0 if words else EXIT_BAD_INPUT
    if words[0] in ("-V", "--version"):
        from shared.runtime.service import version

        print(f"riposte {version()}")
        return 0
    command = COMMANDS.get(words[0])
    if command is None:
        from shared.config.site import nearest

        return _say(f"unknown command {words[0]!r}; {nearest(words[0], COMMANDS)}")
    return _run(command, words[1:])


def _run(command: Command, argv: Sequence[str]) -> int:
    from shared.runtime.process import limit_threads

    limit_threads()  # before the command is imported, and numpy with it
    try:
        if command in JOBS:
            from shared.runtime.logging import configure_logging

            configure_logging(None)  # services and long jobs add their log file
        entry: Callable[[Sequence[str]], int] = importlib.import_module(
            f"services.{command.module}"
        ).main
        return entry(argv)
    except RiposteError as error:
        return _say(f"{command.name}: {error}")
    except ModuleNotFoundError as error:
        missing = (error.name or "").partition(".")[0]
        if missing not in EXTRAS:
            raise
        extra = EXTRAS[missing]
        return _say(f"{command.name} needs {missing}: pip install 'riposte[{extra}]'")
    except KeyboardInterrupt:
        _say(f"{command.name}: interrupted")
        return EXIT_INTERRUPTED


def _say(text: str) -> int:
    print(f"riposte: {text}", file=sys.stderr)
    return EXIT_BAD_INPUT


def _help() -> str:
    lines = ["usage: riposte COMMAND [ARGUMENTS]     riposte COMMAND --help", ""]
    for title, commands in (("jobs", JOBS), ("services, each one process", SERVICES)):
        lines.append(f"{title}:")
        lines += [f"  {command.name:<10} {command.about}" for command in commands]
        lines.append("")
    return "\n".join([*lines, "riposte --version prints the version."])


if __name__ == "__main__":
    sys.exit(main())
