"""The course of play: countdown, bout, rest, rematch, and the bouts that were fenced."""

from collections.abc import Callable
from typing import Literal

import msgspec
import structlog

from services.page.config import PERSON, PageConfig
from services.page.hearing import Hearing
from services.page.protocol import BoutAsk
from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.messages.play import (
    PlayerReply,
    PlayerRequest,
    PlayReply,
    PlayRequest,
    RefereeState,
)
from shared.messages.topics import BOUT, PLAYER
from shared.messages.training import AGENTS, Agent

OPERATOR = "a person at the page"
ASK_SECONDS = 3.0
"""Longest wait for the referee or a policy."""
MAX_RESULTS = 50
READY_MODES = ("ramping", "armed", "holding")
"""Modes of the gate in which a bout may begin."""

Step = Literal["idle", "countdown", "bout", "rest"]

log = structlog.get_logger()


class Result(msgspec.Struct, frozen=True, kw_only=True):
    """A bout that was fenced to its end."""

    bout: str
    opponent: str
    """Name in the list of players, or the reference."""
    score: float
    attack_steps: int
    penalty_steps: int
    camping_steps: int
    number: int
    """Counts the bouts from 1."""


Tell = Callable[[str, bool, list[str]], None]
"""Tells the page what came of a wish: about what, whether it was done, lines of why not."""


class Course:
    """Follows the bouts and asks for their steps."""

    def __init__(self, cfg: PageConfig, bus: Bus, heard: Hearing, tell: Tell) -> None:
        """Wait for a click.

        Args:
            cfg: players and times.
            bus: this process's end of the bus.
            heard: what the bus said last.
            tell: tells the page what came of a wish.
        """
        self._cfg = cfg
        self._bus = bus
        self._heard = heard
        self._tell = tell
        self._players = dict(cfg.players)
        self.chosen = cfg.players[0][0]
        """Name of the protagonist of the next bout."""
        self.results: list[Result] = []
        self.step: Step = "idle"
        self._until = 0.0
        self._count = 0
        self._named: dict[Agent, str] = {}
        """Who the policies said they are, for the bout to come."""
        self._opponents: dict[str, str] = {}
        """By bout: the name that was chosen."""
        self._asked_players: dict[Agent, Pending[PlayerReply]] = {}
        self._asked_bout: Pending[PlayReply] | None = None
        self._seen = ("", "")

    @property
    def is_led(self) -> bool:
        """Return whether a study leads, and nobody is named."""
        return self._cfg.is_led

    @property
    def sides(self) -> tuple[Agent, ...]:
        """Return the sides that a policy plays."""
        return sides_of(self._cfg)

    def left(self, now: float) -> float:
        """Return how long the countdown or the rest still goes (s)."""
        return max(self._until - now, 0.0) if self.step in ("countdown", "rest") else 0.0

    def choose(self, name: str) -> None:
        """Take another protagonist for the next bout, and have it loaded to see that it can."""
        if name not in self._players:
            self._tell("player", False, [f"there is no player {name[:40]!r} in the list"])
        elif self.step in ("countdown", "bout"):
            self._tell("player", False, ["players change between bouts only"])
        else:
            self.chosen = name
            self._ask_player("protagonist")

    def ask(self, ask: BoutAsk, now: float) -> None:
        """Do what a click asks for, or say why not."""
        state = self._heard.referee
        is_on = state is not None and state.phase in ("running", "paused")
        if ask.action == "start":
            if is_on or self.step in ("countdown", "bout"):
                self._tell("bout", False, ["a bout is on: abandon it first"])
            elif lacks := self._lacks(now):
                self._tell("bout", False, lacks)
            else:
                self.step, self._until = "countdown", now + self._cfg.countdown
                self._named.clear()
                for side in self.sides:
                    self._ask_player(side)
        elif self.step == "countdown":
            self._stop_countdown([] if ask.action == "abandon" else ["the countdown was stopped"])
        elif not is_on or state is None:
            self._tell("bout", False, ["no bout is on"])
        else:
            reason = f"{ask.action} by {OPERATOR}"
            self._ask_referee(PlayRequest(action=ask.action, bout=state.bout, reason=reason))

    def tick(self, now: float) -> bool:
        """Go on; return whether the list of results has grown."""
        self._hear_players()
        self._hear_referee()
        if self.step == "countdown" and now >= self._until and not self._asked_players:
            if set(self._named) == set(self.sides):
                self._start()
            else:
                self._stop_countdown(["a policy does not answer"])
        if self.step == "rest" and now >= self._until:
            self.step = "idle"
        return self._follow(now)

    def _lacks(self, now: float) -> list[str]:
        if missing := self._heard.missing(now):
            return [f"waiting for {', '.join(missing)}"]
        lacks: list[str] = []
        if (gate := self._heard.gate) is None or gate.mode not in READY_MODES:
            lacks.append("the robot is not armed: arm it first")
        bats = self._heard.bats
        if bats is not None and not bats.is_valid[0]:
            lacks.append("your bat is not tracked: move the mouse over the scene")
        return lacks

    def _stop_countdown(self, lines: list[str]) -> None:
        self.step = "idle"
        self._asked_players.clear()
        self._tell("bout", not lines, lines)

    def _start(self) -> None:
        self._count += 1
        bout = f"page-{self._bus.boot[:8]}-{self._count}"
        self._opponents = {bout: self.chosen}
        antagonist = self._named.get("antagonist", PERSON)
        self.step = "bout"
        self._ask_referee(
            PlayRequest(
                action="start", bout=bout, antagonist=antagonist,
                protagonist=self._named["protagonist"],
            )
        )  # fmt: skip

    def _ask_player(self, side: Agent) -> None:
        is_ours = side == "protagonist"
        player = self._players[self.chosen] if is_ours else self._cfg.antagonist
        self._asked_players[side] = self._bus.ask(
            PLAYER, PlayerRequest(player=player), ASK_SECONDS, agent=side
        )

    def _ask_referee(self, request: PlayRequest) -> None:
        if self._asked_bout is not None:
            self._tell("bout", False, ["the referee has not answered yet"])
            return
        self._asked_bout = self._bus.ask(BOUT, request, ASK_SECONDS)

    def _hear_players(self) -> None:
        for side in list(self._asked_players):
            reply = self._asked_players[side].take()
            if reply is None:
                continue
            del self._asked_players[side]
            if isinstance(reply, PlayerReply) and reply.accepted:
                self._named[side] = reply.player
                continue
            reason = reply.reason or "refused without a reason"
            if self.step == "countdown":
                self._stop_countdown([f"the {side} cannot play: {reason}"])
            else:
                self._tell("player", False, [reason])

    def _hear_referee(self) -> None:
        if self._asked_bout is None or (reply := self._asked_bout.take()) is None:
            return
        self._asked_bout = None
        if isinstance(reply, Refused | NoAnswer) or not reply.accepted:
            if self.step == "bout" and not self._is_on:
                self.step = "idle"
            self._tell("bout", False, [reply.reason])

    @property
    def _is_on(self) -> bool:
        state = self._heard.referee
        return state is not None and state.phase in ("running", "paused")

    def _follow(self, now: float) -> bool:
        """Notice what the referee says, whoever started the bout."""
        state = self._heard.referee
        if state is None or (state.bout, state.phase) == self._seen:
            return False
        was, self._seen = self._seen, (state.bout, state.phase)
        if state.phase in ("running", "paused"):
            self.step = "bout"
        elif state.phase == "finished" and was[0] == state.bout:
            self._note(state)
            self.step, self._until = "rest", now + self._cfg.rest
            return True
        elif self.step == "bout":
            self.step = "idle"
        return False

    def _note(self, state: RefereeState) -> None:
        number = self.results[-1].number + 1 if self.results else 1
        result = Result(
            bout=state.bout,
            opponent=self._opponents.get(state.bout, state.protagonist),
            score=state.score,
            attack_steps=state.attack_steps,
            penalty_steps=state.penalty_steps,
            camping_steps=state.camping_steps,
            number=number,
        )
        self.results = [*self.results, result][-MAX_RESULTS:]
        score = state.score if state.is_recorded else None
        log.info("bout_fenced", bout=state.bout, opponent=result.opponent, score=score)


def sides_of(cfg: PageConfig) -> tuple[Agent, ...]:
    """Return the sides that a policy plays."""
    return AGENTS if cfg.antagonist != PERSON else ("protagonist",)
