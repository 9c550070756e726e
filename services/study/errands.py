"""Requests under way: to the policy, the referee and the gate; one of each at a time."""

from typing import Literal

import msgspec

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.messages.play import (
    GateReply,
    GateRequest,
    PlayerReply,
    PlayerRequest,
    PlayReply,
    PlayRequest,
)
from shared.messages.topics import ARM, BOUT, PLAYER

ASK_SECONDS = 3.0
"""Longest wait for an answer."""
OPERATOR = "the researcher at the study's page"

GateAction = Literal["arm", "disarm", "reset", "check"]


class Answered(msgspec.Struct, frozen=True, kw_only=True):
    """What came of a request."""

    is_accepted: bool
    is_known: bool = True
    """False: nobody answered, and it may have happened all the same."""
    lines: tuple[str, ...] = ()
    """Why not; of the gate everything that stands in the way."""
    player: str = ""
    """Who plays now (of the policy)."""
    mode: str = ""
    """Of the gate."""


class Errands:
    """Asks, and is asked later what came of it."""

    def __init__(self, bus: Bus) -> None:
        """Take this process's end of the bus."""
        self._bus = bus
        self._player: Pending[PlayerReply] | None = None
        self._bout: Pending[PlayReply] | None = None
        self._gate: Pending[GateReply] | None = None

    @property
    def is_gate_busy(self) -> bool:
        """Return whether the gate has not answered yet."""
        return self._gate is not None

    def load(self, player: str) -> None:
        """Ask the policy to be another player."""
        asked = PlayerRequest(player=player)
        self._player = self._bus.ask(PLAYER, asked, ASK_SECONDS, agent="protagonist")

    def bout(self, request: PlayRequest) -> None:
        """Ask the referee for the next step of a bout."""
        self._bout = self._bus.ask(BOUT, request, ASK_SECONDS)

    def gate(self, action: GateAction) -> None:
        """Do at the gate what a person asks for."""
        asked = GateRequest(action=action, operator=OPERATOR)
        self._gate = self._bus.ask(ARM, asked, ASK_SECONDS)

    def take_player(self) -> Answered | None:
        """Return what the policy answered, once."""
        if self._player is None or (reply := self._player.take()) is None:
            return None
        self._player = None
        if isinstance(reply, PlayerReply):
            lines = (reply.reason,) if reply.reason else ()
            return Answered(is_accepted=reply.accepted, lines=lines, player=reply.player)
        return _unanswered(reply)

    def take_bout(self) -> Answered | None:
        """Return what the referee answered, once."""
        if self._bout is None or (reply := self._bout.take()) is None:
            return None
        self._bout = None
        if isinstance(reply, PlayReply):
            lines = (reply.reason,) if reply.reason else ()
            return Answered(is_accepted=reply.accepted, lines=lines)
        return _unanswered(reply)

    def take_gate(self) -> Answered | None:
        """Return what the gate answered, once."""
        if self._gate is None or (reply := self._gate.take()) is None:
            return None
        self._gate = None
        if isinstance(reply, GateReply):
            return Answered(is_accepted=reply.accepted, lines=reply.reasons, mode=reply.mode)
        return _unanswered(reply)


def _unanswered(reply: Refused | NoAnswer) -> Answered:
    is_known = isinstance(reply, Refused)
    return Answered(is_accepted=False, is_known=is_known, lines=(reply.reason,))
