"""Injects what is planned into one run of the job after another, until nothing is left."""

import contextlib
import os
import secrets
import shutil
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from services.jobs.chaos.books import Toll
from services.jobs.chaos.faults import Blow, Chance, Fault
from services.jobs.chaos.job import Job, JobEnded
from services.jobs.chaos.records import Injection, JobEnd, Records
from services.jobs.chaos.timeline import WINDOW
from shared.clock import Clock
from shared.runtime.build import commit

FULL_SECONDS = 300.0
"""Longest wait for the rate to be full again."""
PAUSE = (0.3, 2.0)
"""Random pause before a fault (s)."""
MARGIN_SECONDS = 15.0
"""A fault needs so much more of the run than it lasts."""

Say = Callable[[str], None]


class Plan:
    """Which faults are still to be injected: in rounds, each round in an order of its own."""

    def __init__(
        self, faults: Sequence[Fault[Any]], times: int, records: Records, seed: int
    ) -> None:
        """Plan what the records do not have yet."""
        generator = np.random.default_rng([seed, sum(records.counts.values())])
        done = records.counts
        rounds = [
            [fault for fault in faults if done[fault.name] <= number] for number in range(times)
        ]
        self._left = [one[int(at)] for one in rounds for at in generator.permutation(len(one))]

    def __len__(self) -> int:
        """Return how many are left."""
        return len(self._left)

    def put_back(self, fault: Fault[Any]) -> None:
        """Plan it once more."""
        self._left.insert(0, fault)

    def next(self, seconds: float) -> Fault[Any] | None:
        """Take the next that fits into a run that goes on for so long, None where none does."""
        for index, fault in enumerate(self._left):
            if fault.seconds + MARGIN_SECONDS <= seconds:
                return self._left.pop(index)
        return None


class Campaign:
    """Runs of the job and what is done to them."""

    def __init__(
        self, site: str, make: Callable[[Path, int], Job], folder: Path, records: Records,
        plan: Plan, clock: Clock, say: Say, *, seed: int, stop_seconds: float, is_kept: bool,
    ) -> None:  # fmt: skip
        """Prepare.

        Args:
            site: how the names of its runs begin.
            make: prepares the run in a folder, with a seed.
            folder: of the runs.
            records: where injections are kept.
            plan: what is to be injected.
            clock: of the watching.
            say: tells a person how it goes.
            seed: of the moments and choices.
            stop_seconds: how long SIGSTOP lasts.
            is_kept: leave the folders of runs that have ended.
        """
        self._site = site
        self._is_kept = is_kept
        self._make = make
        self._folder = folder
        self._records = records
        self._plan = plan
        self._clock = clock
        self._say = say
        self._seed = seed
        number = sum(records.counts.values())
        self._chance = Chance(np.random.default_rng([seed, number, 1]), stop_seconds)

    def run(self, is_asked_to_stop: Callable[[], bool]) -> None:
        """Inject everything, unless somebody asks to stop; then the run can be taken up again."""
        while len(self._plan) and not is_asked_to_stop():
            name = self._records.unfinished(self._site)
            resume = bool(name) and (self._folder / name / "league.sqlite").exists()
            if not resume:
                name = f"{self._site}-{len(self._records.jobs)}-{secrets.token_hex(3)}"
            job = self._make(self._folder / name, self._seed + len(self._records.jobs))
            try:
                self._run(job, name, is_asked_to_stop, resume=resume)
            finally:
                job.close()
            if not self._is_kept and not is_asked_to_stop():
                shutil.rmtree(job.folder)

    def _run(
        self, job: Job, name: str, is_asked_to_stop: Callable[[], bool], *, resume: bool
    ) -> None:
        job.start(resume=resume)
        self._say(f"{name} begins")
        before = Toll()
        with contextlib.suppress(JobEnded):
            job.settle()
            before = job.books.toll
            while not is_asked_to_stop():
                job.ready()
                fault = self._plan.next(job.seconds_left)
                if fault is None:
                    break
                injection = self._inject(job, name, fault, before)
                if injection is None:  # it was over before it could be seen to recover
                    self._plan.put_back(fault)
                    break
                before = job.books.toll
                self._records.add(injection)
                self._say(line_of(injection, self._records))
        if is_asked_to_stop():
            job.interrupt()
            return
        self._say(f"{name}: waiting for its end, {job.updates_left} updates")
        code = job.finish()
        end = JobEnd(
            job=name,
            seconds=self._clock.now() - job.began_at,
            exit_code=code,
            finished=job.finished,
            toll=job.books.toll,
            unsafe=job.unsafe,
            commit=commit(),
        )
        self._records.end(end)
        state = "finished" if end.finished else f"ENDED with exit code {code}"
        self._say(f"{name} {state}, {job.books.size} acknowledged names compared, {end.toll}")

    def _inject(self, job: Job, name: str, fault: Fault[Any], before: Toll) -> Injection | None:
        job.rest(float(self._chance.generator.uniform(*PAUSE)))
        at, full, unsafe, stalled = job.clock.now(), None, job.unsafe, job.stalled
        blow = Blow("", at, at, None)
        try:
            blow = fault.strike(job, self._chance)
            full = self._wait_until_full(job, blow)
            blow = job.after(blow)
        except JobEnded as error:
            job.poll()
            if job.finished:
                return None
            blow = replace(blow, note=f"the run ended: {error}")
        if full is not None:
            job.timeline.note_calm(full, job.clock.now())
        job.poll()
        injection = injection_of(job, name, fault, blow, full, job.books.toll.since(before))
        return msgspec.structs.replace(
            injection, unsafe=job.unsafe - unsafe, stalled=job.stalled - stalled,
            load=os.getloadavg()[0] / len(os.sched_getaffinity(0)),
        )  # fmt: skip

    def _wait_until_full(self, job: Job, blow: Blow) -> float | None:
        if blow.back_at is None:
            return None
        back = blow.back_at
        return job.until(lambda: job.timeline.full_from(back, job.clock.now()), FULL_SECONDS)


def injection_of(
    job: Job, name: str, fault: Fault[Any], blow: Blow, full: float | None, toll: Toll
) -> Injection:
    """Return the record of a fault."""
    lasted = blow.over_at - blow.struck_at
    return Injection(
        fault=fault.name,
        job=name,
        victim=blow.victim,
        at=blow.struck_at - job.began_at,
        lasted=lasted,
        back=None if blow.back_at is None else blow.back_at - blow.over_at,
        full=None if full is None else full - blow.over_at,
        base=job.timeline.base,
        during=job.timeline.rate(blow.struck_at, blow.over_at) if lasted >= WINDOW else None,
        toll=toll,
        names=job.books.size,
        commands=job.commands,
        told=blow.told,
        refused=blow.refused,
        note=blow.note,
    )


def line_of(injection: Injection, records: Records) -> str:
    """Return an injection in one line."""
    full = "NOT back" if injection.full is None else f"full after {injection.full:.1f} s"
    harm = "" if injection.toll.is_none else f" HARM {injection.toll}"
    count = records.counts[injection.fault]
    if injection.stalled:
        full += f" (the machine stood still for {injection.stalled:.0f} s)"
    what = f"{injection.fault} {count}: {injection.victim or 'nobody'}"
    return f"  {what}, {full}{harm} {injection.note}".rstrip()
