"""Faults that come with somebody who joins: an unreliable actor, a lying one."""

import signal
import sys
from collections import Counter

from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import Job, JobEnded
from services.jobs.chaos.lies import LIES, POLICY_LIE

STAY_SECONDS = 8.0
LEAVE_SECONDS = 20.0
ANSWERED_SECONDS = 10.0
LIES_TOLD = len(LIES) + 1
"""Each lie once before the liar leaves: but for the truth told twice, and two damaged policies."""


def guest_command(job: Job, conduct: str, name: str, seed: int) -> list[str]:
    """Return the command line of a guest that joins the run."""
    place = job.endpoint
    command = [sys.executable, "-P", "-m", "services.jobs.chaos.guest", conduct, str(seed)]
    command += [str(job.folder / "config.toml"), "--name", name, "--run", str(job.folder)]
    command += ["--run-id", place.run, "--connect", place.connect]
    return [*command, "--set", "actor.acknowledge_timeout=3.0"]


def _host(job: Job, chance: Chance, conduct: str, *, is_told: bool) -> Blow:
    """Let a guest in, and see it off again."""
    seed = int(chance.generator.integers(2**31))
    name = f"actor-{conduct}-{seed:08x}"
    told, refused = job.books.told.copy(), job.books.refused.copy()
    policies = job.books.policies_refused
    acknowledged = len(job.books.acknowledged)
    guest = job.let_in(guest_command(job, conduct, name, seed))
    is_up = job.until(lambda: name in job.up, UP_SECONDS)
    at = job.clock.now()
    try:
        job.rest(STAY_SECONDS)
        if is_told:
            job.until(lambda: (job.books.told - told).total() >= LIES_TOLD, UP_SECONDS)
            job.until(lambda: _unanswered(job, told, refused) <= 0, ANSWERED_SECONDS)
    except JobEnded:
        guest.kill()
        raise
    guest.send_signal(signal.SIGTERM)
    ended = job.until(lambda: guest.poll() is not None, LEAVE_SECONDS)
    over = job.clock.now()
    if not ended:
        guest.kill()
    lies, answers = job.books.told - told, job.books.refused - refused
    if job.books.policies_refused > policies:  # actors say so in their logs, not to the liar
        answers[POLICY_LIE] = lies[POLICY_LIE]
    note = f"{len(job.books.acknowledged) - acknowledged} rollouts acknowledged meanwhile"
    return Blow(
        name, at, over, over if is_up else None, note,
        dict(lies), dict(answers),
    )  # fmt: skip


def _unanswered(job: Job, told: Counter[str], refused: Counter[str]) -> int:
    """Return how many lies have no answer yet; a damaged policy never gets one."""
    lies = job.books.told - told
    answered = (job.books.refused - refused).total() + (job.books.believed).total()
    return lies.total() - answered - lies[POLICY_LIE]


def _unreliable(job: Job, chance: Chance) -> Blow:
    return _host(job, chance, "unreliable", is_told=False)


def _lying(job: Job, chance: Chance) -> Blow:
    return _host(job, chance, "lying", is_told=True)


FAULTS: tuple[Fault[Job], ...] = (
    Fault(
        "unreliable-messages",
        "a third actor: 10 % lost, 10 % of answers lost, 30 % twice, 30 % late, 30 % reordered",
        "all that it sends", _unreliable, seconds=15.0,
    ),
    Fault(
        "lying-actor", "a third actor sends 16 kinds of forged and damaged messages",
        "learner, league, actors", _lying, seconds=25.0,
    ),
)  # fmt: skip
