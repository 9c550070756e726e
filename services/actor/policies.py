"""The newest policy of each learner, as announced."""

import dataclasses

import structlog

from shared.bus.base import Bus
from shared.errors import SnapshotError
from shared.messages.topics import POLICY
from shared.messages.training import AGENTS, Agent, PolicyAnnouncement
from shared.policy.mlp import GaussianPolicy
from shared.policy.snapshot import Fit, unpack

log = structlog.get_logger()


@dataclasses.dataclass(frozen=True)
class LearningPolicy:
    """A version of the learning side."""

    policy: GaussianPolicy
    version: int
    digest: str


class LearningPolicies:
    """Follows both learners; a policy that does not fit is said and not used."""

    def __init__(self, bus: Bus, fit: Fit) -> None:
        """Listen.

        Args:
            bus: where policies are announced.
            fit: what they must be made for.
        """
        self.last_error = ""
        self._fit = fit
        self._subscriptions = [bus.subscribe(POLICY, agent=agent) for agent in AGENTS]
        self._newest: dict[Agent, LearningPolicy] = {}

    def get(self, agent: Agent) -> LearningPolicy | None:
        """Return the newest policy of an agent, None before the first."""
        return self._newest.get(agent)

    @property
    def versions(self) -> dict[str, int]:
        """Return the newest version of each agent."""
        return {agent: learning.version for agent, learning in self._newest.items()}

    def tick(self) -> bool:
        """Take what was announced; return whether there was anything."""
        did = False
        for subscription in self._subscriptions:
            while (announcement := subscription.take()) is not None:
                did = True
                self._take(announcement)
        return did

    def _take(self, announcement: PolicyAnnouncement) -> None:
        try:
            snapshot = unpack(announcement.payload.tobytes(), announcement.snapshot)
            snapshot.check_fits(self._fit)
        except SnapshotError as error:
            self.last_error = str(error)
            log.error("policy_refused", agent=announcement.agent, reason=str(error))
            return
        self._newest[announcement.agent] = LearningPolicy(
            GaussianPolicy(snapshot.weights), announcement.policy_version, snapshot.digest
        )
