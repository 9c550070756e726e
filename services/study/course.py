"""What comes next in a session: a pure function of the step, of what was heard, and of the time.

Nothing here knows the bus, the journal or a page: `Session` carries out what is decided here.
"""

import math
import re
from collections.abc import Iterable
from pathlib import PurePath
from typing import Final, Literal

import msgspec

from services.study.hearing import Heard
from shared.messages.play import RefereeState
from shared.study.steps import GAME_KINDS, Step

Stage = Literal[
    "idle", "ready", "countdown", "starting", "playing", "score", "timer", "form"
]  # fmt: skip
"""Of a step: not begun; waits for what a game needs; ...; a timer runs; somebody fills it in."""
Outcome = Literal["finished", "void"]

ON: Final = ("running", "paused")
MOVING: Final = ("ramping", "armed", "holding")
PLAYED: Final = (*GAME_KINDS, "explore")
"""Kinds of steps in which the referee judges a bout."""
FORMS: Final = ("consent", "instruction", "questionnaire", "ranking", "debrief")
"""Kinds that last until somebody says that they are done."""
PAUSED: Final = "paused by the researcher"
"""The referee's reason of a pause that is the session's."""
STATIC: Final = "scripted:static"
"""Who plays while a person explores: nobody."""
UNHEARD_SECONDS: Final = 5.0
"""A bout that was asked for and of which the referee says nothing for so long, is none (s)."""
PLAYER: Final = "this section's player"
"""What the researcher reads in place of a player's name."""
_HASH: Final = re.compile(r"(sha256:)?\b[0-9a-f]{12,64}\b")
"""Of a snapshot, whole or shortened as messages do."""
AGAIN_SECONDS: Final = 1.0
"""From a request that was refused to the next try (s)."""


class Moment(msgspec.Struct, frozen=True, kw_only=True):
    """What the runner knows of the step that is on, beyond the journal; a crash forgets it."""

    stage: Stage = "idle"
    since: float = -math.inf
    """When the stage began (s)."""
    until: float = math.inf
    """When its timer is over (s)."""
    is_asked: bool = False
    """A person has asked for the step to begin."""
    is_waiting: bool = False
    """An answer of the policy or the referee is under way."""
    retry_at: float = -math.inf
    """When to ask again what was refused (s)."""
    loaded: str = ""
    """The player that the policy was asked to be, and is."""
    reference: str = ""
    """The same, exact: ``sha256:HASH`` or ``scripted:NAME``."""
    bout: str = ""
    """Name of the bout of this attempt."""
    is_seen: bool = False
    """The referee has spoken of it."""
    trouble: str = ""
    """Why the last try came to nothing."""
    is_paused: bool = False
    """A person has stopped the session for a while."""
    doom: str = ""
    """Why the bout that is on is to be ended; empty where it is not."""


class Terms(msgspec.Struct, frozen=True, kw_only=True):
    """What does not change in a session."""

    countdown: float = 3.0
    """Before a game (s)."""
    score_seconds: float = 5.0
    """How long the score is shown after it (s)."""
    needs_recorder: bool = True
    """Whether games that count wait for a recorder."""
    has_heart_rate: bool = True
    """Whether a baseline in which no heart rate was heard is measured again."""


class Wait(msgspec.Struct, frozen=True, tag=True):
    """Do nothing; ``why`` is for people, empty where it goes on by itself."""

    why: str = ""


class Begin(msgspec.Struct, frozen=True, tag=True):
    """Begin the step, at a stage that may have a timer (s)."""

    stage: Stage
    seconds: float = math.inf


class Turn(msgspec.Struct, frozen=True, tag=True):
    """Go to another stage of the step."""

    stage: Stage
    seconds: float = math.inf


class Load(msgspec.Struct, frozen=True, tag=True):
    """Ask the policy to be another player."""

    player: str


class Start(msgspec.Struct, frozen=True, tag=True):
    """Start the bout."""


class Steer(msgspec.Struct, frozen=True, tag=True):
    """Have the referee pause, resume or abandon a bout."""

    action: Literal["pause", "resume", "abandon"]
    bout: str
    reason: str


class End(msgspec.Struct, frozen=True, tag=True):
    """The bout is over."""

    outcome: Outcome
    reason: str
    state: RefereeState | None = None
    """What the referee said last of it; None where it said nothing."""


class Finish(msgspec.Struct, frozen=True, tag=True):
    """The step is done."""


Action = Wait | Begin | Turn | Load | Start | Steer | End | Finish


def next_action(
    step: Step, moment: Moment, heard: Heard, now: float, terms: Terms, *, is_auto: bool
) -> Action:
    """Return what is to be done now.

    Args:
        step: the one that is on.
        moment: where in it the session is.
        heard: what is known of the others.
        now: the monotonic clock (s).
        terms: of the session.
        is_auto: whether the step begins without a person's word.
    """
    said = heard.referee
    if said is not None and said.phase in ON and said.bout != moment.bout:
        if moment.is_waiting or now < moment.retry_at:
            return Wait("another bout to end")
        return Steer("abandon", said.bout, "it is no game of the study's present step")
    if moment.stage in ("starting", "playing"):
        return _playing(step, moment, heard, now)
    if moment.is_paused:
        return Wait("the researcher to go on")
    if moment.stage == "idle":
        return _idle(step, moment, is_auto=is_auto)
    if moment.stage == "ready":
        return _ready(step, moment, heard, now, terms)
    if moment.stage == "form":
        return Wait("the participant")
    if moment.stage == "countdown" and lacks_of(step, heard, terms):
        return Turn("ready")
    if now < moment.until:
        return Wait()
    if moment.stage == "countdown":
        return Start()
    rate = heard.beats_per_minute
    if step.rest_below and rate is not None and rate >= step.rest_below:
        return Wait(f"a heart rate below {step.rest_below:g} /min (now {rate:.0f})")
    return Finish()


def lacks_of(step: Step, heard: Heard, terms: Terms) -> list[str]:
    """Return everything that a bout of this step has to wait for, as people say it."""
    lacks = missing(heard, needs_recorder=terms.needs_recorder and step.is_recorded)
    if heard.gate is not None and heard.mode != "armed" and step.kind != "explore":
        lacks.append(_unarmed(heard.gate.mode, heard.gate.reason))
    return lacks


def missing(heard: Heard, *, needs_recorder: bool) -> list[str]:
    """Return which process is not there, and whether the participant's bat is not tracked."""
    lacks: list[str] = []
    if heard.gate is None:
        lacks.append("robot_io")
    if heard.referee is None:
        lacks.append("the referee")
    if not heard.has_policy:
        lacks.append("the policy")
    if needs_recorder and not heard.has_recorder:
        lacks.append("the recorder")
    if heard.gate is not None and not heard.is_tracked:
        lacks.append("the participant's bat to be tracked")
    return lacks


def player_of(step: Step) -> str:
    """Return whom the policy is asked to be in a step."""
    return STATIC if step.kind == "explore" else step.player


def unnamed(text: str, names: Iterable[str]) -> str:
    """Return a text in which no player is named, for people who must not know who plays.

    Args:
        text: such as why a player could not be loaded.
        names: what the player may be called in it: words, references or paths.
    """
    known = {name for name in names if name}
    known |= {name.rpartition(":")[2] for name in known}
    known |= {PurePath(name).stem for name in known}
    for name in sorted(known, key=len, reverse=True):
        text = re.sub(rf"(?<!\w){re.escape(name)}(?!\w)", PLAYER, text)
    return _HASH.sub(PLAYER, text)


def _unarmed(mode: str, reason: str) -> str:
    if mode == "ramping":
        return "the robot to be up to speed"
    words = "the robot to go on" if mode == "holding" else "a person to arm the robot"
    if mode == "tripped":
        words = "a person to reset and arm the robot"
    return f"{words} ({mode}: {reason})" if reason else f"{words} ({mode})"


def _idle(step: Step, moment: Moment, *, is_auto: bool) -> Action:
    if step.kind in FORMS:
        return Begin("form")
    if step.kind == "rest":
        return Begin("timer", step.seconds)
    if not (is_auto or moment.is_asked):
        why = f"the researcher to begin {step.title!r}"
        return Wait(f"{why} (before: {moment.trouble})" if moment.trouble else why)
    if step.kind == "baseline":
        return Begin("timer", step.seconds)
    return Begin("ready")


def _ready(step: Step, moment: Moment, heard: Heard, now: float, terms: Terms) -> Action:
    if lacks := lacks_of(step, heard, terms):
        return Wait(", ".join(lacks))
    if moment.is_waiting:
        return Wait("the policy")
    if moment.loaded != player_of(step):
        if now < moment.retry_at:
            return Wait(f"the policy to be {PLAYER}: {moment.trouble}")
        return Load(player_of(step))
    return Start() if step.kind == "explore" else Turn("countdown", terms.countdown)


def _playing(step: Step, moment: Moment, heard: Heard, now: float) -> Action:
    """Follow a bout that was asked for to its end."""
    said = heard.referee
    if moment.stage == "starting" and moment.is_waiting:
        return Wait("the referee")
    if said is None:
        return End("void", "the referee died")
    if said.bout != moment.bout:
        if moment.is_seen:
            return End("void", "the referee was restarted")
        if now - moment.since > UNHEARD_SECONDS:
            return End("void", "the referee never said that it began")
        return Wait("the referee")
    if said.phase not in ON:
        is_over = said.phase == "finished"
        return End("finished" if is_over else "void", said.reason, said)
    if moment.is_waiting or now < moment.retry_at:
        return Wait()
    if why := moment.doom or _unmoved(step, heard):
        return Steer("abandon", said.bout, why)
    is_ours = said.reason == PAUSED
    if moment.is_paused and not is_ours:
        return Steer("pause", said.bout, PAUSED)
    if is_ours and not moment.is_paused:
        return Steer("resume", said.bout, "the session goes on")
    return Wait("the researcher to go on" if is_ours else said.reason)


def _unmoved(step: Step, heard: Heard) -> str:
    """Return why the robot cannot play any more in a game; empty where it can, or need not."""
    if step.kind == "explore":
        return ""
    if heard.gate is None:
        return "robot_io is silent"
    if not heard.has_policy:  # restarted, it would play on as somebody else
        return "the policy died"
    if heard.mode not in MOVING:
        return f"the robot is {heard.mode}: {heard.gate.reason}"
    return ""
