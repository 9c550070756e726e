"""A learner that leaves PPO out: ``python -m benchmarks.scaling.untaught services.learner ...``.

Everything else is the real process: intake, checks, checkpoints, reports, acknowledgements,
announcements. So its intake can be loaded as far as the bus goes, and what it costs be told from
what PPO costs.
"""

import sys
from collections.abc import Sequence

from services.learner import __main__ as command
from services.learner import service
from services.learner.ppo import PolicyOptimiser, UpdateStats
from shared.messages.training import Rollout


class Untaught(PolicyOptimiser):
    """Weights that never change."""

    def warm_up(self, rollouts: Sequence[Rollout]) -> None:
        """Teach nothing."""

    def update(
        self, rollouts: Sequence[Rollout], learning_rate: float | None = None
    ) -> UpdateStats:
        """Teach nothing; return how many samples there were."""
        return UpdateStats(
            samples=sum(rollout.rewards.size for rollout in rollouts), reward_mean=0.0,
            value_loss=0.0, surrogate_loss=0.0, entropy=0.0, approx_kl=0.0, clip_fraction=0.0,
            explained_variance=0.0, action_std=self.cfg.initial_std,
        )  # fmt: skip


def main() -> int:
    """Run the learner that the rest of the command line asks for."""
    service.PolicyOptimiser = Untaught
    return command.main(sys.argv[2:])


if __name__ == "__main__":
    sys.exit(main())
