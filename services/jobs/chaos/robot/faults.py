"""Faults of a match: of its processes, its clocks, its messages, its disk and its cable."""

import signal
from collections.abc import Callable
from functools import partial

from services.jobs.chaos.clock import step
from services.jobs.chaos.damage import fill, flip_bytes
from services.jobs.chaos.far_host import CUT_SECONDS, DELAY, LOSS, LOSSY_SECONDS
from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.robot.far_match import FarMatch
from services.jobs.chaos.robot.lies import LIES
from services.jobs.chaos.robot.match import Match
from services.jobs.chaos.robot.stand_in import stand_in
from services.jobs.chaos.signals import SLOW_SECONDS, kill, slow_down, stop
from shared.errors import RiposteError
from shared.messages.play import PlayerRequest
from shared.messages.topics import PLAYER
from shared.styles.bundle import load_bundle, shipped_bundle

EVERYBODY = ("router-0", "robot-io-0", "policy-antagonist", "policy-protagonist", "referee-0")
JUMP_SECONDS = 3.0
"""How long a clock is wrong."""
STAND_IN_SECONDS = 8.0
FULL_SECONDS = 8.0
"""How long a disk is full."""
A_BOUT_IS = "a bout is"
"""How a policy's refusal begins while somebody fences."""


def _kill(name: str, number: signal.Signals = signal.SIGKILL) -> Callable[[Match, Chance], Blow]:
    return lambda match, _chance: kill(match, name, number)


def _kill_policy(match: Match, chance: Chance) -> Blow:
    return kill(match, chance.one_of(("policy-antagonist", "policy-protagonist")))


def _stop(match: Match, chance: Chance) -> Blow:
    return stop(match, chance.one_of(EVERYBODY), chance.stop_seconds)


def _slow_down(match: Match, chance: Chance) -> Blow:
    return slow_down(match, chance.one_of(EVERYBODY))


def _jump(match: Match, chance: Chance) -> Blow:
    """Step the clock of one process, and back after a while, as its clock service would."""
    name = chance.one_of(EVERYBODY)
    seconds = float(chance.generator.choice((-3600.0, 3600.0)))
    pid = match.until(lambda: match.is_up(name) and match.pid(name), UP_SECONDS)
    at = match.clock.now()
    has_jumped = pid is not None and step(match.clocks, pid, seconds)
    try:
        match.rest(JUMP_SECONDS)
    finally:
        if pid is not None:
            step(match.clocks, pid, -seconds)
    over = match.clock.now()
    return Blow(name, at, over, over if has_jumped else None, f"{seconds:+g} s")


def _misbehave(match: Match, chance: Chance, *, conduct: str) -> Blow:
    with stand_in(match, chance, conduct) as policy:
        at = match.clock.now()
        match.rest(STAND_IN_SECONDS)
        over = match.clock.now()
    match.rest(0.5)  # it says at its end what it did
    return Blow(policy.name, at, over, over, policy.conduct_said())


def _corrupt_snapshot(match: Match, chance: Chance) -> Blow:
    """Have a policy asked to play on as a snapshot whose bytes have changed on the disk."""
    bundle = load_bundle(shipped_bundle())
    digest = chance.one_of(tuple(sorted(player.sha256 for player in bundle.bundle.players)))
    path = match.folder / "snapshots" / f"{digest}.safetensors"
    path.parent.mkdir(exist_ok=True)
    path.write_bytes((bundle.folder / path.name).read_bytes())
    where = flip_bytes(path, chance)
    at = match.clock.now()
    match.shut()
    reply = match.ask_until(
        PLAYER, PlayerRequest(player=f"sha256:{digest}"),
        lambda reply: not reply.reason.startswith(A_BOUT_IS), agent="protagonist",
    )  # fmt: skip
    path.unlink()
    over = match.clock.now()
    if reply is not None and reply.accepted:
        raise RiposteError(f"a policy plays a snapshot with changed {where}: {reply.player}")
    kind = "corrupt snapshot"
    return Blow(
        "policy-protagonist", at, over, over if reply else None, where,
        told={kind: 1}, refused={kind: int(reply is not None)},
    )  # fmt: skip


def _fill_disk(match: Match, _chance: Chance) -> Blow:
    filler = match.folder.parent / "filler"
    at = match.clock.now()
    fill(filler)
    try:
        match.rest(FULL_SECONDS)
    finally:
        filler.unlink()
    over = match.clock.now()
    up = all(match.is_up(name) for name in EVERYBODY)
    recorder = "" if match.is_up("recorder-0") else "without a recorder"
    return Blow("every process of the match", at, over, over if up else None, recorder)


def _cut(match: FarMatch, chance: Chance) -> Blow:
    with stand_in(match, chance, "honest", match.far) as policy:
        at = match.clock.now()
        with match.far.cut():
            match.rest(CUT_SECONDS)
        over = match.clock.now()
    return Blow(policy.name, at, over, over)


def _delay(match: FarMatch, chance: Chance) -> Blow:
    with stand_in(match, chance, "honest", match.far) as policy:
        at = match.clock.now()
        with match.far.slowed() as note:
            match.rest(LOSSY_SECONDS)
        over = match.clock.now()
    return Blow(policy.name, at, over, over, note)


FAULTS: tuple[Fault[Match], ...] = (
    Fault("robot-kill-policy", "kill -9", "one of two policies", _kill_policy),
    Fault("robot-kill-referee", "kill -9", "referee", _kill("referee-0")),
    Fault("robot-kill-robot-io", "kill -9", "robot_io", _kill("robot-io-0")),
    Fault("robot-kill-router", "kill -9", "router of the match", _kill("router-0")),
    Fault(
        "robot-restart-router", "told to end (SIGTERM), started again", "router of the match",
        _kill("router-0", signal.SIGTERM),
    ),
    Fault(
        "robot-stop", "SIGSTOP for 30 s, then SIGCONT", "any process of the match", _stop,
        seconds=30.0,
    ),
    Fault(
        "robot-slow", f"runs a tenth of the time for {SLOW_SECONDS:g} s",
        "any process of the match", _slow_down, seconds=SLOW_SECONDS,
    ),
    Fault(
        "robot-clock-jump", f"wall clock an hour off for {JUMP_SECONDS:g} s",
        "any process of the match", _jump, seconds=JUMP_SECONDS,
    ),
    Fault(
        "robot-corrupt-snapshot", "asked to play a snapshot with 8 bytes changed",
        "the robot's policy", _corrupt_snapshot,
    ),
    Fault(
        "robot-unreliable-messages",
        f"for {STAND_IN_SECONDS:g} s a policy in its place: 10 % lost, 30 % twice, 30 % late, "
        "30 % reordered", "all that the robot's policy sends",
        partial(_misbehave, conduct="unreliable"), seconds=STAND_IN_SECONDS,
    ),
    Fault(
        "robot-lying-policy",
        f"for {STAND_IN_SECONDS:g} s a policy in its place that lies in {len(LIES)} ways",
        "robot_io", partial(_misbehave, conduct="lying"), seconds=STAND_IN_SECONDS,
    ),
)  # fmt: skip
DISK_FAULTS: tuple[Fault[Match], ...] = (
    Fault(
        "robot-disk-full", f"no byte free for {FULL_SECONDS:g} s", "every process of the match",
        _fill_disk, seconds=FULL_SECONDS,
    ),
    Fault("robot-kill-recorder", "kill -9", "recorder of the match", _kill("recorder-0")),
    Fault(
        "robot-slow-consumer", f"runs a tenth of the time for {SLOW_SECONDS:g} s",
        "recorder of the match", lambda match, _chance: slow_down(match, "recorder-0"),
        seconds=SLOW_SECONDS,
    ),
)  # fmt: skip
"""In a match that is recorded, on a small disk."""
HOST_FAULTS: tuple[Fault[FarMatch], ...] = (
    Fault(
        "robot-network-cut", f"cable pulled for {CUT_SECONDS:g} s, then plugged in again",
        "the host of the robot's policy", _cut, seconds=CUT_SECONDS,
    ),
    Fault(
        "robot-network-slow", f"{1e3 * DELAY:.0f} ms more each way and {100 * LOSS:.0f} % of "
        f"packets lost for {LOSSY_SECONDS:g} s", "the host of the robot's policy", _delay,
        seconds=LOSSY_SECONDS,
    ),
)  # fmt: skip
ALL = (*FAULTS, *DISK_FAULTS, *HOST_FAULTS)
