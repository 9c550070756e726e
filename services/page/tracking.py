"""The page's pointer as a tracker: what goes to robot_io, how often, and when it is lost."""

import secrets
from collections import OrderedDict
from collections.abc import Callable

import numpy as np

from services.page.hand import Hand
from services.page.protocol import Pointer
from shared.messages.play import BatStates, TrackerPose

PERIOD = 0.008
"""From one pose to the next, whether the mouse moves or not (s)."""
SILENCE = 0.1
"""A page that was silent for so long has lost the mouse (s)."""
LOST_PERIOD = 0.1
"""A lost bat is said to be lost so often (s)."""
REMEMBERED = 256
"""Poses whose origin is remembered."""


def new_source() -> str:
    """Return an identity that no page had before."""
    return secrets.token_hex(8)


class PointerTracker:
    """Turns what a page says into poses at a steady pace; knows no bus."""

    def __init__(self, hand: Hand, now: float, name: Callable[[], str] = new_source) -> None:
        """Wait for a page.

        Args:
            hand: what holds the bat.
            now: by the service's clock (s).
            name: gives each page an identity.
        """
        self._hand = hand
        self._name = name
        self._source = ""
        self._session = 0
        self._sequence = -1
        self._heard_at = -np.inf
        self._sent_at = now
        self._wants: int | None = None
        """The page's sequence in the pose to be sent."""
        self._is_lost = True
        self._origins: OrderedDict[int, int] = OrderedDict()

    @property
    def is_lost(self) -> bool:
        """Return whether no page says where the mouse is."""
        return self._is_lost

    def hear(self, pointer: Pointer, now: float) -> None:
        """Take what a page says; a new page is a new tracker."""
        if pointer.session != self._session:
            self._session = pointer.session
            self._source, self._sequence = self._name(), -1
            self._origins.clear()
        self._heard_at = now
        self._wants = pointer.sequence
        if pointer.is_valid:
            self._hand.want(pointer.tip, pointer.roll)
        self._is_lost = not pointer.is_valid

    def lose(self) -> None:
        """Take it that the page has gone."""
        self._is_lost = True

    def due(self, now: float, *, is_fresh: bool) -> TrackerPose | None:
        """Return the pose to publish now, if one is due.

        Args:
            now: by the service's clock (s).
            is_fresh: whether the page has just said something, which does not wait.
        """
        if not self._source:
            return None
        if now - self._heard_at > SILENCE:
            self._is_lost = True
        passed = now - self._sent_at
        if self._is_lost:
            if passed < LOST_PERIOD and not is_fresh:
                return None
            pose = self._hand.pose()
        else:
            if passed < PERIOD and not is_fresh:
                return None
            pose = self._hand.step(passed)
        self._sent_at = now
        self._sequence += 1
        if self._wants is not None:
            self._origins[self._sequence] = self._wants
            if len(self._origins) > REMEMBERED:
                self._origins.popitem(last=False)
        return TrackerPose(
            sequence=self._sequence, source=self._source, pose=pose, is_valid=not self._is_lost
        )

    def echo(self, states: BatStates) -> int:
        """Return the page's sequence in these bat states; -1 where it is in none of them."""
        if states.tracker_source != self._source:
            return -1
        return self._origins.get(states.tracker_sequence, -1)
