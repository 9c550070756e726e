"""A policy that plays the robot for a while in the place of the match's own."""

import contextlib
import signal
import subprocess
import sys
from collections.abc import Generator
from pathlib import Path

import msgspec

from services.jobs.chaos.far_host import CONNECT, FarHost
from services.jobs.chaos.faults import UP_SECONDS, Chance
from services.jobs.chaos.robot.match import Match
from services.jobs.chaos.signals import send
from shared.errors import RiposteError

OWN = "policy-protagonist"
BOTH_SECONDS = 0.5
"""Both answer for so long before the match's own is stopped, so that the robot goes on."""
LEAVE_SECONDS = 10.0


class _Said(msgspec.Struct):
    """What a line of its log is looked at for."""

    event: str = ""
    did: dict[str, int] = {}


class StandIn:
    """A policy that joined."""

    def __init__(self, name: str, log: Path) -> None:
        self.name = name
        self._log = log

    def conduct_said(self) -> str:
        """Return what it says at its end that it did, in words; empty where it does not."""
        lines = self._log.read_text().splitlines() if self._log.exists() else []
        for line in reversed(lines):
            said = msgspec.json.decode(line, type=_Said)
            if said.event == "conduct":
                return ", ".join(f"{count} x {what}" for what, count in said.did.items() if count)
        return ""


@contextlib.contextmanager
def stand_in(
    match: Match, chance: Chance, conduct: str, far: FarHost | None = None
) -> Generator[StandIn]:
    """Let a policy in and stop the match's own, until the context ends.

    Args:
        match: that goes on.
        chance: of the moments.
        conduct: how it behaves: one of ``guest.CONDUCTS``.
        far: the host that it runs on; None: this one.

    Raises:
        RiposteError: it does not come up.
    """
    seed = int(chance.generator.integers(2**31))
    name = f"policy-{conduct}-{seed:08x}"
    place = match.endpoint
    command = [sys.executable, "-P", "-m", "services.jobs.chaos.robot.guest", conduct, str(seed)]
    command += [str(match.folder / "config.toml"), "--name", name, "--run", str(match.folder)]
    command += ["--run-id", place.run, "--agent", "protagonist"]
    command += ["--connect", CONNECT if far else place.connect]
    guest = far.start(command, match) if far else match.let_in(command)
    pid: int | None = None
    try:
        if not match.until(lambda: name in match.up, UP_SECONDS):
            raise RiposteError(f"{name} does not come up: see {match.folder.with_suffix('.out')}")
        match.rest(BOTH_SECONDS)
        pid = match.until(lambda: match.is_up(OWN) and match.pid(OWN), UP_SECONDS)
        if pid is not None:
            send(pid, signal.SIGSTOP)
        yield StandIn(name, match.folder / "logs" / f"{name}.jsonl")
    finally:
        if pid is not None:
            send(pid, signal.SIGCONT)
        guest.send_signal(signal.SIGTERM)
        with contextlib.suppress(subprocess.TimeoutExpired):
            guest.wait(LEAVE_SECONDS)
        guest.kill()
