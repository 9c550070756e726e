"""``python -m services.jobs.study.rehearsal_session DIR N``: the session of one simulated person.

robot_io with the twin behind its gate, policy, referee, recorder and the study's own service, the
ones that a live study runs, in one process and on a clock that is moved as fast as they work.
"""

import argparse
import datetime
import logging
import shutil
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import structlog
from msgspec.structs import replace

from services.jobs.study.rehearsal_desk import Desk
from services.jobs.study.rehearsal_person import RehearsalPerson
from services.jobs.study.rehearsal_plan import RehearsalPlan, read_plan
from services.jobs.virtual_site import HOP, VirtualSite
from services.policy.config import PolicyConfig
from services.recorder.config import RecorderConfig
from services.study.answering import Answering
from services.study.course import Terms
from services.study.opening import plan_of
from services.study.service import Study, asks_of
from shared.clock import ManualClock
from shared.errors import RiposteError, StudyError
from shared.policy.action import ActionConfig
from shared.sim.arena import arena_of, target_of
from shared.study.allocation import participant_name
from shared.study.folder import Study as StudyFolder
from shared.study.folder import open_study
from shared.study.journal import Journal
from shared.study.people.population import draw
from shared.study.recorded import write_session

FIRST_DAY: Final = datetime.datetime(2026, 1, 5, 9, 0, tzinfo=datetime.UTC)
"""When the first simulated person comes; a day later comes the next one. Nobody came."""
LONGEST: Final = 4 * 3600.0
"""Of a session (s); one that goes on for longer has got stuck."""
LEAP: Final = 0.5
"""A tick while a heart rate is measured and the robot cannot move: nobody needs the bat (s)."""
SETTLING: Final = 1.0
"""After a bout and before one, for which no ticks are left out (s)."""


class Rehearsal:
    """A participant, everybody that serves them, and the time."""

    def __init__(self, study: StudyFolder, number: int, plan: RehearsalPlan, data: bytes) -> None:
        """Start everybody; whatever was there of this session is begun anew.

        Args:
            study: the study's folder.
            number: of the participant, from 1.
            plan: settings and people.
            data: the bytes that say the plan.

        Raises:
            RiposteError: a file cannot be written, or a setting is no good.
        """
        name = participant_name(number)
        cfg = replace(plan.study, participant=name, players=tuple(plan.players.items()))
        session = plan_of(study, cfg, data)
        folder = study.session_folder(name)
        shutil.rmtree(folder, ignore_errors=True)
        day = FIRST_DAY + datetime.timedelta(days=number - 1)
        clock = ManualClock(day.timestamp())
        traits = draw(plan.people, number, plan.seed)
        arena, target = arena_of(plan.sim, ActionConfig()), target_of(plan.sim)
        self.person = RehearsalPerson(traits, arena, target, plan.seed, clock)
        journal = Journal(folder, clock)
        recorder = RecorderConfig(live=False, file=plan.is_archived, archive=plan.is_archived)
        policy = PolicyConfig(protagonist="scripted:static", seed=1000 * plan.seed + number)
        self.site = VirtualSite(
            folder, plan.robot_io, plan.safety, plan.sim, rules=plan.game, policy=policy,
            heart=self.person, recorder=recorder, clock=clock, players=plan.players.values(),
        )  # fmt: skip
        self.person.join(self.site.join("page"))
        asks = asks_of(journal)
        terms = Terms(countdown=cfg.countdown, score_seconds=cfg.score_seconds)
        self.study = Study(
            session, folder, terms, journal, asks, None, lambda: write_session(study, name),
            self.site.join("study", "study"), clock,
        )  # fmt: skip
        self.session = self.study.session
        self.desk = Desk(self.session, Answering(self.session), asks, traits, plan.seed, clock)
        self._began_at = clock.now()
        self._busy_at = clock.now()

    def tick(self) -> None:
        """Go on by one tick, a long one where nothing has to be judged."""
        self._lead()
        now = self.site.clock.now()
        if self._is_busy():
            self._busy_at = now
        is_short = now - self._busy_at < SETTLING
        seconds = 0.0 if is_short else LEAP if self._is_at_rest() else HOP
        self.site.tick(self.person, self.study, self.desk, seconds=seconds)

    def run(self) -> None:
        """Walk the whole session.

        Raises:
            StudyError: it got stuck; says where.
        """
        while not self.session.is_over:
            self.tick()
            if self.site.clock.now() - self._began_at > LONGEST:
                raise StudyError(f"the rehearsal got stuck: {self.study.health().state}, "
                                 f"waiting for {self.study.health().waiting_for!r}")  # fmt: skip

    def close(self) -> None:
        """Let everybody go."""
        self.study.close()
        self.site.close()

    def _lead(self) -> None:
        """Have the person sit or walk, as the step says."""
        step = self.session.step
        kind = step.kind if step is not None else ""
        self.person.is_walking = kind == "baseline" and step is not None and "walk" in step.id
        self.person.is_sitting = kind not in ("warm_up", "game", "rest", "explore")

    def _is_at_rest(self) -> bool:
        session = self.session
        is_measuring = session.step is not None and session.step.kind == "baseline"
        is_timed = session.moment.stage == "timer"
        return is_measuring and is_timed and session.heard.mode == "disarmed"

    def _is_busy(self) -> bool:
        moment = self.session.moment
        is_near = moment.stage == "countdown" and moment.until - self.site.clock.now() < SETTLING
        return self.person.is_playing or is_near or moment.stage == "starting"


def main(argv: Sequence[str] | None = None) -> int:
    """Rehearse one participant; return the exit code."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("number", type=int)
    found = parser.parse_args(argv)
    structlog.configure(wrapper_class=structlog.make_filtering_bound_logger(logging.ERROR))
    try:
        plan, data = read_plan(found.folder)
        rehearsal = Rehearsal(open_study(found.folder), found.number, plan, data)
        try:
            rehearsal.run()
        finally:
            rehearsal.close()
    except RiposteError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
