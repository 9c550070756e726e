"""Faults of processes: killed, told to end, stopped, slowed down."""

import contextlib
import os
import signal
from collections.abc import Callable

from services.jobs.chaos.faults import UP_SECONDS, Blow, Chance, Fault
from services.jobs.chaos.job import Job

SLOW_SECONDS = 10.0
SLOW_PERIOD = 0.5
SLOW_SHARE = 0.1
"""Of a slowed process's time in which it runs."""
EVERYBODY = (
    "router-0", "league-0", "learner-antagonist", "learner-protagonist", "actor-0", "actor-1",
    "recorder-0",
)  # fmt: skip


def kill(job: Job, name: str, number: signal.Signals = signal.SIGKILL) -> Blow:
    """Kill a process and wait until it has been started again and is up."""
    pid = job.until(lambda: job.is_up(name) and job.pid(name), UP_SECONDS)
    at = job.clock.now()
    if pid is not None:
        send(pid, number)
    is_up = job.until(lambda: job.is_up(name, but=pid), UP_SECONDS)
    return Blow(name, at, at, job.clock.now() if is_up else None)


def stop(job: Job, name: str, seconds: float) -> Blow:
    """Let a process stand still for a while, as a debugger or a swapping machine does."""
    pid = job.until(lambda: job.is_up(name) and job.pid(name), UP_SECONDS)
    at = job.clock.now()
    try:
        if pid is not None:
            send(pid, signal.SIGSTOP)
        job.rest(seconds)
    finally:
        if pid is not None:
            send(pid, signal.SIGCONT)
    over = job.clock.now()
    # It may find its session gone and end; then it is started again.
    job.rest(1.0)
    is_up = job.until(lambda: job.is_up(name), UP_SECONDS)
    is_same = job.pid(name) == pid
    note = "" if is_same else "ended by itself and was started again"
    return Blow(name, at, over, over if is_same and is_up else job.clock.now(), note)


def slow_down(job: Job, name: str) -> Blow:
    """Let a process run a tenth of the time."""
    pid = job.until(lambda: job.is_up(name) and job.pid(name), UP_SECONDS)
    at = job.clock.now()
    try:
        while pid is not None and job.clock.now() < at + SLOW_SECONDS:
            send(pid, signal.SIGSTOP)
            job.rest((1.0 - SLOW_SHARE) * SLOW_PERIOD)
            send(pid, signal.SIGCONT)
            job.rest(SLOW_SHARE * SLOW_PERIOD)
    finally:
        if pid is not None:
            send(pid, signal.SIGCONT)
    over = job.clock.now()
    return Blow(name, at, over, over)


def send(pid: int, number: signal.Signals) -> None:
    """Send a signal to a process that may have ended."""
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, number)


def _kill(name: str) -> Callable[[Job, Chance], Blow]:
    return lambda job, _chance: kill(job, name)


def _kill_learner(job: Job, _chance: Chance) -> Blow:
    return kill(job, job.learner)


def _kill_other_learner(job: Job, _chance: Chance) -> Blow:
    learners = ("learner-antagonist", "learner-protagonist")
    return kill(job, learners[job.learner == learners[0]])


def _kill_actor(job: Job, chance: Chance) -> Blow:
    return kill(job, chance.one_of(("actor-0", "actor-1")))


def _stop(job: Job, chance: Chance) -> Blow:
    return stop(job, chance.one_of(EVERYBODY), chance.stop_seconds)


def _restart_router(job: Job, _chance: Chance) -> Blow:
    return kill(job, "router-0", signal.SIGTERM)


def _slow_recorder(job: Job, _chance: Chance) -> Blow:
    return slow_down(job, "recorder-0")


FAULTS: tuple[Fault[Job], ...] = (
    Fault("kill-router", "kill -9", "router", _kill("router-0")),
    Fault("kill-league", "kill -9", "league", _kill("league-0")),
    Fault("kill-learner", "kill -9", "the learner that learns", _kill_learner),
    Fault("kill-other-learner", "kill -9", "the learner that waits", _kill_other_learner),
    Fault("kill-actor", "kill -9", "one of two actors", _kill_actor),
    Fault("kill-recorder", "kill -9", "recorder", _kill("recorder-0")),
    Fault("restart-router", "told to end (SIGTERM), started again", "router", _restart_router),
    Fault(
        "stop", "SIGSTOP for 30 s, then SIGCONT", "any process of the run", _stop, seconds=30.0
    ),
    Fault(
        "slow-consumer", f"runs a tenth of the time for {SLOW_SECONDS:g} s", "recorder",
        _slow_recorder, seconds=SLOW_SECONDS,
    ),
)  # fmt: skip
