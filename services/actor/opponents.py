"""Opponents by reference: scripted ones built, snapshots fetched once and kept by hash."""

from collections import OrderedDict
from typing import TypeVar

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.clock import Clock
from shared.messages.league import SnapshotReply, SnapshotRequest
from shared.messages.topics import SNAPSHOT
from shared.policy.mlp import GaussianPolicy
from shared.policy.players import SCRIPTED_PREFIX, Player, SnapshotPlayer, scripted_player
from shared.policy.scripted.sight import Arena
from shared.policy.snapshot import Fit, digest_of, reference_of, unpack

X = TypeVar("X")

RETRY_DELAY = 0.5
"""Seconds between a fetch that failed and the next."""
MOST_FETCHES = 8
"""Fetches remembered at once; a lease needs two. Those that nobody waits for leave, oldest first:
their lease ended before the answer came."""


class Opponents:
    """A bounded cache of frozen policies, filled from the league."""

    def __init__(
        self, bus: Bus, clock: Clock, fit: Fit, arena: Arena, capacity: int, timeout: float
    ) -> None:
        """Make an empty cache.

        Args:
            bus: where the league answers.
            clock: spaces the retries.
            fit: what a policy must be made for.
            arena: what a scripted player has to know.
            capacity: policies kept; the least recently used one leaves.
            timeout: seconds to wait for the league's answer.
        """
        self._bus = bus
        self._clock = clock
        self._fit = fit
        self._arena = arena
        self._capacity = capacity
        self._timeout = timeout
        self._policies: OrderedDict[str, GaussianPolicy] = OrderedDict()
        self._pending: dict[str, Pending[SnapshotReply]] = {}
        self._not_before: dict[str, float] = {}
        self.last_failure = ""
        """Why the latest fetch failed; empty after one that did not."""

    def __len__(self) -> int:
        """Return how many policies are kept."""
        return len(self._policies)

    @property
    def fetches(self) -> int:
        """Return how many fetches are remembered: under way, or failed and to be tried again."""
        return len(self._pending.keys() | self._not_before.keys())

    def get(self, reference: str, stochastic: bool) -> Player | None:
        """Return the player, or None while it is being fetched.

        Raises:
            SnapshotError: if the reference names nobody, or the policy does not fit.
        """
        if reference.startswith(SCRIPTED_PREFIX):
            return scripted_player(reference, self._arena)
        digest = digest_of(reference)
        if digest in self._policies:
            self._policies.move_to_end(digest)
            return SnapshotPlayer(self._policies[digest], stochastic)
        self._fetch(digest)
        if digest not in self._policies:
            return None
        return SnapshotPlayer(self._policies[digest], stochastic)

    def _fetch(self, digest: str) -> None:
        """Ask for a snapshot, or take the answer."""
        pending = self._pending.get(digest)
        if pending is None:
            if self._clock.now() >= self._not_before.get(digest, float("-inf")):
                _remember(
                    self._pending,
                    digest,
                    self._bus.ask(
                        SNAPSHOT, SnapshotRequest(snapshot=reference_of(digest)), self._timeout
                    ),
                )
            return
        answer = pending.take()
        if answer is None:
            return
        del self._pending[digest]
        if isinstance(answer, NoAnswer | Refused) or not answer.found:
            self.last_failure = f"snapshot {digest[:12]}: {answer.reason}"
            _remember(self._not_before, digest, self._clock.now() + RETRY_DELAY)
            return
        snapshot = unpack(answer.payload.tobytes(), digest)
        snapshot.check_fits(self._fit)
        self.last_failure = ""
        self._not_before.pop(digest, None)
        self._policies[digest] = GaussianPolicy(snapshot.weights)
        while len(self._policies) > self._capacity:
            self._policies.popitem(last=False)


def _remember(kept: dict[str, X], digest: str, value: X) -> None:
    """Enter a value as the newest, and let the oldest beyond the number kept leave."""
    kept.pop(digest, None)
    kept[digest] = value
    while len(kept) > MOST_FETCHES:
        del kept[next(iter(kept))]
