"""One session: carries out what `next_action` decides, each event in the journal before it counts.

The journal and this object's ``Moment`` are all the state there is; a runner that is killed begins
at the journal's last event. Times that ran in a step begin anew, but for a rest's.
"""

import math

import structlog
from msgspec.structs import replace

from services.study.course import (
    AGAIN_SECONDS,
    ON,
    Action,
    Begin,
    End,
    Finish,
    Load,
    Moment,
    Start,
    Steer,
    Terms,
    Turn,
    Wait,
    next_action,
    unnamed,
)
from services.study.errands import Errands
from services.study.hearing import Heard
from services.study.heart import Window
from services.study.plan import SessionPlan
from shared.clock import Clock
from shared.messages.play import PlayRequest, RefereeState
from shared.study.events import (
    Event,
    GameEnded,
    GameStarted,
    Measured,
    Outcome,
    SessionEnded,
    StepBegan,
    StepDone,
    What,
)
from shared.study.journal import Journal
from shared.study.progress import follow, is_game, replay
from shared.study.steps import Step

MOST_ACTIONS = 8
"""Done in one tick."""
LONGEST_BOUT = 600.0
"""What the referee judges in one piece (s); an exploration may take several."""
KILLED = "the runner of the study was killed during it"
UNMEASURED = "no heart rate was measured: begin again, or skip it with a reason"

log = structlog.get_logger()


class Session:
    """Walks the steps of one participant."""

    def __init__(
        self, plan: SessionPlan, journal: Journal, errands: Errands, clock: Clock, terms: Terms
    ) -> None:  # fmt: skip
        """Go on where the journal ends.

        Args:
            plan: steps, players and names.
            journal: held by this process.
            errands: to policy, referee and gate.
            clock: times countdowns and rests.
            terms: what does not change.

        Raises:
            StudyError: the journal is none of this plan's.
            RiposteError: it cannot be written.
        """
        self.plan = plan
        self.errands = errands
        self.terms = terms
        self.moment = Moment()
        self.heard = Heard()
        self.waits_for = ""
        """Why nothing happens, for people; empty while it goes on by itself."""
        self.window = Window()
        """The baseline that is measured."""
        self.ending: tuple[Outcome, str, str] | None = None
        """What a person said of the game that is on: how it counts, why, and the ask's id."""
        self.ended_asks: list[str] = []
        """Asks about the game that was on, done by now."""
        self._asked_player = ""
        """Whom the policy was asked to be last, as the protocol calls it."""
        self._journal = journal
        self._clock = clock
        self.progress = replay(journal.events)
        if journal.events and self.progress.state != "ended":
            self._resume()

    @property
    def step(self) -> Step | None:
        """Return the step that is on; None before the session and after it."""
        if self.progress.state != "going":
            return None
        return self.progress.current(self.plan.steps)

    @property
    def is_over(self) -> bool:
        """Return whether nothing is left to do."""
        return self.progress.state in ("ended", "aborted")

    @property
    def is_bout_on(self) -> bool:
        """Return whether a bout of this session goes on."""
        said = self.heard.referee
        return said is not None and said.phase in ON and said.bout == self.moment.bout

    @property
    def events(self) -> tuple[Event, ...]:
        """Return all events so far."""
        return self._journal.events

    def write(self, what: What, step: str = "", ask: str = "") -> None:
        """Put an event into the journal, then let it count.

        Raises:
            RiposteError: it could not be written, and has not happened.
        """
        event = self._journal.write(what, step, ask)
        follow(self.progress, event)
        log.info("study_event", kind=event.kind, step=step, number=event.number)

    def tick(self, heard: Heard) -> bool:
        """Take answers and do what is due; return whether anything was done."""
        self.heard = heard
        self.window.add(heard.beats)
        did = self._take_answers()
        said = heard.referee
        if said is not None and self.moment.bout and said.bout == self.moment.bout:
            self.moment = replace(self.moment, is_seen=True)
        for _ in range(MOST_ACTIONS):
            if (action := self._next()) is None or isinstance(action, Wait):
                self.waits_for = action.why if isinstance(action, Wait) else ""
                break
            self._do(action)
            did = True
        return did

    def is_auto(self, step: Step) -> bool:
        """Return whether a step begins by itself: games that follow one another, once each."""
        is_first_try = step.id not in self.progress.games
        return step.kind == "game" and step.game > 1 and is_first_try

    def start_over(self, trouble: str = "") -> None:
        """Go back to where a person lets the step begin.

        The policy is told whom to play before each game: it may have been restarted meanwhile.
        """
        self.moment = Moment(
            trouble=trouble, is_paused=self.progress.is_paused, since=self._clock.now()
        )

    def finish(self, step: Step, reason: str = "", ask: str = "") -> None:
        """The step is over; after the last one the session is."""
        if step.kind == "baseline" and self.moment.stage == "timer":
            self._measure(step)
        self.write(StepDone(reason=reason), step.id, ask)
        self.start_over()
        if self.progress.current(self.plan.steps) is None:
            self.write(SessionEnded())

    def doom(self, outcome: Outcome, reason: str, ask: str) -> None:
        """Have the bout that is on ended, and remember how a person wants it to count."""
        self.ending = (outcome, reason, ask)
        self.moment = replace(self.moment, doom=reason)

    # -- resuming ---------------------------------------------------------------------------

    def _resume(self) -> None:
        self.plan.check(self.progress)
        self.write(self.plan.resumed)
        if (running := self.progress.running) is not None:
            game = next(step for step in self.plan.steps if step.id == running[0])
            self.write(game_ended(self, game, "void", KILLED, None), game.id)
            self.moment = replace(self.moment, trouble=KILLED)
        self.moment = replace(self.moment, is_paused=self.progress.is_paused)
        step = self.step
        if step is not None and self._is_complete(step):
            self.finish(step)  # what it is for was written, and its end was not
        if self.step is None and self.progress.state == "going":
            self.write(SessionEnded())

    def _is_complete(self, step: Step) -> bool:
        """Return whether the journal has what a step is for."""
        progress = self.progress
        if step.kind == "consent":
            return progress.has_consent
        is_played = progress.finished(step.id) is not None
        known = (progress.answers, progress.rankings, progress.baselines)
        return is_played or any(step.id in one for one in known)

    # -- deciding and doing -----------------------------------------------------------------

    def _next(self) -> Action | None:
        step = self.step
        if step is None:
            said = self.heard.referee
            is_free = not self.moment.is_waiting and self._clock.now() >= self.moment.retry_at
            if said is not None and said.phase in ON and is_free:
                return Steer("abandon", said.bout, "no session is on")
            return None
        return next_action(
            step, self.moment, self.heard, self._clock.now(), self.terms,
            is_auto=self.is_auto(step),
        )  # fmt: skip

    def _do(self, action: Action) -> None:
        now = self._clock.now()
        step = self.step
        match action:
            case Steer(action=what, bout=bout, reason=reason):
                self.errands.bout(PlayRequest(action=what, bout=bout, reason=reason))
                self.moment = replace(self.moment, is_waiting=True)
            case Load(player=player):
                self.errands.load(self.plan.players.get(player, player))
                self._asked_player = player
                self.moment = replace(self.moment, is_waiting=True)
            case _ if step is None:
                pass
            case Begin(stage=stage, seconds=seconds):
                self._begin(step, stage == "timer")
                until = now + self._left(step, seconds)
                self.moment = replace(self.moment, stage=stage, since=now, until=until, trouble="")
            case Turn(stage=stage, seconds=seconds):
                loaded = "" if stage == "ready" else self.moment.loaded
                self.moment = replace(
                    self.moment, stage=stage, since=now, until=now + seconds, loaded=loaded
                )
            case Start():
                self._start(step, now)
            case End():
                self._end(step, action, now)
            case Finish() if self._is_unmeasured(step):
                self.start_over(UNMEASURED)
            case Finish():
                self.finish(step)
            case Wait():
                pass

    def _begin(self, step: Step, is_timed: bool) -> None:
        is_again = self.progress.begun == step.id
        if not is_again or (is_timed and step.kind == "baseline"):
            self.write(StepBegan(), step.id)
        if step.kind == "baseline":
            self.window = Window(began_at=self._clock.now())

    def _left(self, step: Step, seconds: float) -> float:
        """Return what is left of a timer; a rest goes on while nobody runs the session."""
        if step.kind != "rest":
            return seconds
        began = next(
            event for event in reversed(self.events)
            if event.step == step.id and isinstance(event.what, StepBegan)
        )  # fmt: skip
        passed = 1e-9 * (self._clock.wall_ns() - began.wall_ns)
        return min(max(seconds - passed, 0.0), seconds)

    def _start(self, step: Step, now: float) -> None:
        attempt = self.progress.next_attempt(step.id)
        seconds = step.seconds
        until = self.moment.until
        if is_game(step):
            bout = f"{step.id}-a{attempt}"
            started = GameStarted(
                attempt=attempt, bout=bout, policy=self.moment.reference, seconds=seconds,
                speed=step.speed,
            )  # fmt: skip
            self.write(started, step.id)
        else:  # an exploration, perhaps its second piece
            until = now + seconds if math.isinf(until) else until
            seconds = min(max(until - now, 1.0), LONGEST_BOUT)
            bout = f"{step.id}-e{len(self.events)}-{round(until - now)}"
        request = PlayRequest(
            action="start", bout=bout, antagonist=self.plan.antagonist,
            protagonist=self.moment.reference, seconds=seconds,
            speed=step.speed if is_game(step) else 0.0, is_recorded=step.is_recorded,
        )  # fmt: skip
        self.errands.bout(request)
        self.moment = replace(
            self.moment, stage="starting", since=now, until=until, bout=bout, is_waiting=True,
            is_seen=False,
        )  # fmt: skip

    def _end(self, step: Step, end: End, now: float) -> None:
        if not is_game(step):
            self._end_exploration(step, end, now)
            return
        outcome: Outcome = end.outcome
        reason, ask = end.reason, ""
        if self.ending is not None:
            outcome, reason, ask = self.ending
            self.ending = None
        self.write(game_ended(self, step, outcome, reason, end.state), step.id, ask)
        if ask:
            self.ended_asks.append(ask)
        if outcome == "finished":
            until = now + self.terms.score_seconds
            self.moment = replace(self.moment, stage="score", since=now, until=until, bout="")
        else:
            self.start_over(reason)

    def _end_exploration(self, step: Step, end: End, now: float) -> None:
        if self.ending is not None:
            _, reason, ask = self.ending
            self.ending = None
            self.finish(step, reason, ask)
            self.ended_asks.append(ask)
        elif end.outcome == "void":
            self.start_over(end.reason)
        elif now < self.moment.until - 1.0:
            self.moment = replace(self.moment, stage="ready", bout="")
        else:
            self.finish(step)

    def _is_unmeasured(self, step: Step) -> bool:
        """Return whether a baseline that is over heard nothing of a sensor that should be there."""
        return step.kind == "baseline" and not self.window.beats and self.terms.has_heart_rate

    def _measure(self, step: Step) -> None:
        window = self.window
        seconds = self._clock.now() - window.began_at
        measured = Measured(
            seconds=seconds, beats=window.beats, beats_per_minute=window.beats_per_minute
        )
        self.write(measured, step.id)

    # -- answers ----------------------------------------------------------------------------

    def _take_answers(self) -> bool:
        player, bout = self.errands.take_player(), self.errands.take_bout()
        now = self._clock.now()
        step = self.step
        if player is not None:
            self.moment = replace(self.moment, is_waiting=False)
            if player.is_accepted:
                self.moment = replace(
                    self.moment, loaded=self._asked_player, reference=player.player, trouble=""
                )
            else:
                asked = self._asked_player
                names = (asked, self.plan.players.get(asked, ""), player.player)
                why = unnamed(" ".join(player.lines), names)  # the log has the policy's words
                log.warning("player_refused", player=asked, reasons=list(player.lines))
                self.moment = replace(self.moment, trouble=why, retry_at=now + AGAIN_SECONDS)
        if bout is not None:
            self._take_bout(step, is_accepted=bout.is_accepted, is_known=bout.is_known,
                            reason=" ".join(bout.lines), now=now)  # fmt: skip
        return player is not None or bout is not None

    def _take_bout(
        self, step: Step | None, *, is_accepted: bool, is_known: bool, reason: str, now: float
    ) -> None:
        self.moment = replace(self.moment, is_waiting=False)
        if self.moment.stage == "starting" and step is not None:
            if is_accepted:
                self.moment = replace(self.moment, stage="playing")
            elif is_known:
                self._end(step, End("void", f"the referee refused: {reason}"), now)
        else:
            self.moment = replace(self.moment, retry_at=now + AGAIN_SECONDS)


def game_ended(
    session: Session, step: Step, outcome: Outcome, reason: str, state: RefereeState | None
) -> GameEnded:
    """Return the end of the attempt that runs, with what the referee said last of it.

    Of a warm-up game no verdict is kept: the participant's page shows it, and that is all.
    """
    running = session.progress.running
    assert running is not None, f"no game of {step.id} runs"
    start = running[1].start
    ended = GameEnded(
        attempt=start.attempt, bout=start.bout, policy=start.policy, outcome=outcome,
        reason=reason, archive=f"bouts/{start.bout}" if step.is_recorded else "",
    )  # fmt: skip
    if state is None or not step.is_recorded:
        return ended
    return replace(
        ended,
        score=state.score,
        attack_steps=state.attack_steps,
        penalty_steps=state.penalty_steps,
        camping_steps=state.camping_steps,
        steps=state.step,
        seconds=state.seconds,
    )
