"""Keeps one lease: asks for work, renews it in time, and says when it has ended."""

from typing import Any

import msgspec
import structlog

from shared.bus.base import Bus, NoAnswer, Pending, Refused
from shared.clock import Clock
from shared.messages.league import Lease, LeaseRenewal, LeaseRequest, LeaseStatus
from shared.messages.topics import LEASE, RENEWAL, SCHEDULE

log = structlog.get_logger()

RETRY_SECONDS = 0.2
"""Between two requests for work, or two tries of a renewal."""


class LeaseKeeper:
    """The claim of one actor on its work."""

    def __init__(
        self, bus: Bus, clock: Clock, num_envs: int, rollout_steps: int, timeout: float
    ) -> None:
        """Hold nothing yet.

        Args:
            bus: where the league answers.
            clock: decides when to renew.
            num_envs: bouts this actor plays in parallel.
            rollout_steps: control steps of its rollouts.
            timeout: seconds to wait for an answer.
        """
        self.lease: Lease | None = None
        self.waiting_for = ""
        """Why there is no work, in a few words."""
        self._bus = bus
        self._clock = clock
        self._num_envs = num_envs
        self._rollout_steps = rollout_steps
        self._timeout = timeout
        self._schedule = bus.subscribe(SCHEDULE)
        self._requested: Pending[Lease] | None = None
        self._renewing: Pending[LeaseStatus] | None = None
        self._ask_at = clock.now()
        self._renew_at = 0.0
        self._expires_at = 0.0

    @property
    def quiet(self) -> bool:
        """Return whether no answer is awaited."""
        return self._requested is None and self._renewing is None

    @property
    def is_free(self) -> bool:
        """Return whether there is neither work nor a request for it."""
        return self.lease is None and self._requested is None

    def tick(self) -> bool:
        """Ask, renew or take an answer; return whether anything was done."""
        did = self._follow_schedule()
        if self.lease is None:
            return self._seek() or did
        return self._keep(self.lease) or did

    def drop(self, why: str, wait: float = 0.0) -> None:
        """Give the lease up, and ask for another after ``wait`` seconds."""
        if self.lease is not None:
            log.info("lease_dropped", lease=self.lease.lease, why=why)
        self.lease = None
        self._renewing = None
        self._ask_at = self._clock.now() + wait

    def _follow_schedule(self) -> bool:
        """Leave a stage as soon as the league has, without waiting for a renewal to say so."""
        did = False
        while (schedule := self._schedule.take()) is not None:
            did = True
            played = self.lease.stage if self.lease else None
            if played is not None and (
                schedule.stage is None or schedule.stage.index > played.index
            ):
                self.drop("stage over")
        return did

    def _seek(self) -> bool:
        if self._requested is None:
            if self._clock.now() < self._ask_at:
                return False
            request = LeaseRequest(
                actor=self._bus.name, boot=self._bus.boot, num_envs=self._num_envs,
                rollout_steps=self._rollout_steps,
            )  # fmt: skip
            self._requested = self._bus.ask(LEASE, request, self._timeout)
            return True
        answer = self._requested.take()
        if answer is None:
            self.waiting_for = "league: a lease"
            return False
        self._requested = None
        now = self._clock.now()
        self._ask_at = now + RETRY_SECONDS
        if isinstance(answer, NoAnswer | Refused) or answer.kind == "none":
            self.waiting_for = f"league: {answer.reason or 'no work now'}"
            return False
        self.lease = answer
        self.waiting_for = ""
        self._extend(answer.expires_in)
        log.info("lease_taken", lease=answer.lease, kind=answer.kind)
        return True

    def _keep(self, lease: Lease) -> bool:
        now = self._clock.now()
        if now >= self._expires_at:
            self.drop("lapsed")
            return True
        if self._renewing is None:
            if now < self._renew_at:
                return False
            renewal = LeaseRenewal(actor=self._bus.name, boot=self._bus.boot, lease=lease.lease)
            self._renewing = self._bus.ask(RENEWAL, renewal, self._timeout)
            return True
        answer = self._renewing.take()
        if answer is None:
            return False
        self._renewing = None
        if isinstance(answer, NoAnswer | Refused):
            self._renew_at = now + RETRY_SECONDS
        elif answer.alive:
            self._extend(answer.expires_in)
            self.lease = msgspec.structs.replace(lease, window=answer.window)
        else:
            self.drop("ended")
        return True

    def _extend(self, seconds: float) -> None:
        now = self._clock.now()
        self._expires_at = now + seconds
        self._renew_at = now + seconds / 3.0

    def state(self) -> dict[str, Any]:
        """Return JSON values from which ``restore`` continues; only when ``quiet``."""
        return {
            "lease": msgspec.to_builtins(self.lease),
            "ask_at": self._ask_at,
            "renew_at": self._renew_at,
            "expires_at": self._expires_at,
        }

    def restore(self, values: dict[str, Any]) -> None:
        """Continue from what ``state`` returned."""
        self.lease = msgspec.convert(values["lease"], Lease | None)
        self._ask_at = float(values["ask_at"])
        self._renew_at = float(values["renew_at"])
        self._expires_at = float(values["expires_at"])
