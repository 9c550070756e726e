"""What both pages show, made anew from where the session stands."""

import datetime

from services.study.answering import Answering, sections_to_rank
from services.study.course import PLAYED
from services.study.forms import items_of
from services.study.hearing import Heard
from services.study.session import Session
from services.study.view import (
    BoutView,
    Course,
    GameView,
    GateView,
    HeartView,
    NoteView,
    ParticipantView,
    ResearcherView,
    Screen,
    ServiceView,
    StepView,
    TrackerView,
)
from shared.study.events import Event, Noted
from shared.study.steps import Step

MOST_NOTES = 100
RESTING, WALKING = "baseline-resting", "baseline-walking"
"""Ids of the steps whose heart rate is drawn as a line."""


def course_of(session: Session) -> Course:
    """Return in one word how the session stands."""
    state = session.progress.state
    if state == "new":
        return "new"
    if state == "aborted":
        return "aborted"
    if state == "ended":
        return "ended"
    return "paused" if session.progress.is_paused else "running"


def screen_of(session: Session) -> Screen:
    """Return what the participant's page is about."""
    if session.is_over:
        return "thanks"
    if (step := session.step) is None:
        return "welcome"
    stage = session.moment.stage
    if step.kind in ("consent", "questionnaire", "ranking", "rest"):
        return step.kind
    if step.kind == "debrief":
        return "thanks"
    if step.kind in PLAYED and stage != "idle":
        screens: dict[str, Screen] = {
            "countdown": "countdown", "starting": "playing", "playing": "playing", "score": "score",
        }  # fmt: skip
        return screens.get(stage, "waiting")
    if step.kind == "game" or session.progress.is_paused:
        return "waiting"
    return "text"


def seconds_left(session: Session, now: float) -> float | None:
    """Return what is left of the timer that runs, None without one (s)."""
    moment, step = session.moment, session.step
    if step is None:
        return None
    if moment.stage in ("countdown", "timer", "score") or step.kind == "explore":
        left = moment.until - now
        return max(left, 0.0) if left < float("inf") else None
    said = session.heard.referee
    if moment.stage in ("starting", "playing"):
        played = said.seconds if said is not None and said.bout == moment.bout else 0.0
        return max(step.seconds - played, 0.0)
    return None


def researcher_view(
    session: Session, answering: Answering, *, now: float, recent: tuple[float | None, ...],
    services: tuple[tuple[str, bool, str], ...], warnings: tuple[str, ...],
    is_participant_here: bool,
) -> ResearcherView:  # fmt: skip
    """Return everything on the researcher's page."""
    plan, heard = session.plan, session.heard
    step = session.step
    steps = tuple(_step_view(session, each) for each in plan.steps)
    at = plan.steps.index(step) if step is not None else 0
    if session.progress.state == "ended":
        at = len(steps)
    return ResearcherView(
        study=plan.protocol.title,
        participant=plan.participant,
        course=course_of(session),
        steps=steps,
        at=at,
        waiting_for="the researcher to begin" if course_of(session) == "new" else session.waits_for,
        seconds_left=seconds_left(session, now),
        screen=screen_of(session),
        is_participant_here=is_participant_here,
        bout=_bout_view(heard),
        heart=_heart_view(session, recent),
        tracker=_tracker_view(heard),
        gate=_gate_view(heard, answering),
        services=tuple(
            ServiceView(name=name, is_alive=is_alive, state=state)
            for name, is_alive, state in services
        ),
        may=answering.may_researcher(),
        games=_games(session, answering),
        notes=tuple(_note_view(event) for event in session.progress.notes[-MOST_NOTES:]),
        warnings=warnings,
    )


def participant_view(session: Session, answering: Answering, *, now: float) -> ParticipantView:
    """Return everything on the participant's page; no condition is in it."""
    step, screen = session.step, screen_of(session)
    plan = session.plan
    steps = plan.steps
    done = sum(each.id in session.progress.done for each in steps)
    common = ParticipantView(
        screen=screen,
        session=f"{plan.participant}-{plan.session}",
        title=plan.protocol.title,
        done=done,
        total=len(steps),
        sections=len(plan.protocol.section),
        is_paused=session.progress.is_paused,
        language=plan.protocol.language,
    )
    if step is None:
        return common
    said = session.heard.referee
    shown = {"never": (), "after": ("score",), "always": ("score", "playing")}
    is_of_this_game = screen == "score" or (said and said.bout == session.moment.bout)
    has_score = is_of_this_game and screen in shown[plan.protocol.game.score]
    form = screen in ("questionnaire", "ranking")
    protocol = plan.protocol
    asked = protocol.instrument_named(step.instrument) if form else None
    return ParticipantView(
        screen=screen,
        session=common.session,
        step=step.id,
        title=step.title,
        text=step.text,
        statements=protocol.consent.statements if screen == "consent" else (),
        items=items_of(asked, sections_to_rank(session)) if asked is not None else (),
        is_paged=asked is not None and asked.is_paged,
        seconds_left=seconds_left(session, now),
        seconds=session.terms.countdown if screen == "countdown" else step.seconds,
        score=said.score if has_score and said is not None else None,
        section=step.section,
        sections=common.sections,
        game=step.game,
        games=_games_of(session, step),
        done=done,
        total=len(steps),
        is_recorded=step.is_recorded,
        is_paused=session.progress.is_paused,
        may=answering.may_participant(),
        language=protocol.language,
    )


def _games_of(session: Session, step: Step) -> int:
    return sum(
        each.kind == step.kind and each.section == step.section for each in session.plan.steps
    ) if step.game else 0  # fmt: skip


def _step_view(session: Session, step: Step) -> StepView:
    return StepView(
        id=step.id, kind=step.kind, title=step.title, section=step.section, game=step.game,
        condition=session.plan.label(step), seconds=step.seconds, is_recorded=step.is_recorded,
    )  # fmt: skip


def _bout_view(heard: Heard) -> BoutView | None:
    said = heard.referee
    if said is None or not said.bout:
        return None
    return BoutView(
        bout=said.bout, phase=said.phase, seconds=said.seconds, score=said.score,
        attack_steps=said.attack_steps, penalty_steps=said.penalty_steps,
        camping_steps=said.camping_steps, reason=said.reason,
    )  # fmt: skip


def _heart_view(session: Session, recent: tuple[float | None, ...]) -> HeartView:
    heart, baselines = session.heard.heart, session.progress.baselines
    seated, walking = baselines.get(RESTING), baselines.get(WALKING)
    return HeartView(
        beats_per_minute=session.heard.beats_per_minute,
        has_contact=heart.contact if heart is not None else True,
        source=heart.source if heart is not None else "",
        recent=recent,
        walking=walking.beats_per_minute if walking is not None else None,
        seated=seated.beats_per_minute if seated is not None else None,
    )


def _tracker_view(heard: Heard) -> TrackerView | None:
    if heard.lost_seconds == float("inf") and not heard.is_tracked:
        return TrackerView(is_tracked=False) if heard.gate is not None else None
    lost = 0.0 if heard.is_tracked else heard.lost_seconds
    return TrackerView(is_tracked=heard.is_tracked, lost_seconds=lost)


def _gate_view(heard: Heard, answering: Answering) -> GateView:
    if heard.gate is None:
        return GateView(in_the_way=answering.in_the_way)
    return GateView(mode=heard.gate.mode, reason=heard.gate.reason, in_the_way=answering.in_the_way)


def _games(session: Session, answering: Answering) -> tuple[GameView, ...]:
    return tuple(
        GameView(
            step=step.id,
            section=step.section,
            game=step.game,
            attempt=attempt.number,
            outcome=attempt.outcome,
            is_recorded=step.is_recorded,
            score=attempt.end.score if attempt.end is not None else None,
            condition=session.plan.label(step),
            reason=attempt.reason,
            may=tuple(
                action for action in answering.may_of(step, attempt)
                if action == "void" or action == "repeat"
            ),
        )
        for step in session.plan.steps
        for attempt in session.progress.games.get(step.id, ())
        if attempt.outcome != "running"
    )  # fmt: skip


def _note_view(event: Event) -> NoteView:
    assert isinstance(event.what, Noted)
    at = datetime.datetime.fromtimestamp(event.wall_ns // 10**9).astimezone()
    return NoteView(at=f"{at:%H:%M:%S}", step=event.step, text=event.what.text)
