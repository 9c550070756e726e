"""What a segment of bouts becomes before it is sent or learned from, without a bus."""

from services.actor.collector import Segment
from shared.messages.training import Rollout
from shared.policy.mlp import GaussianPolicy


def rollout_of(
    segment: Segment, policy: GaussianPolicy, model: str, opponent: str = "sha256:" + "b" * 64
) -> Rollout:
    """Return the antagonist's rollout that an actor would send.

    Args:
        segment: as collected.
        policy: that acted.
        model: hash of the simulator model.
        opponent: player reference of the other side.
    """
    return Rollout(
        agent="antagonist", actor="actor-0", boot="b" * 16, sequence=0, lease="lease", stage=0,
        policy_version=1, snapshot="a" * 64, opponent=opponent, model=model, seed=0,
        bouts=segment.bouts, first_step=segment.first_step, obs=segment.obs,
        last_obs=segment.last_obs, actions=segment.actions, means=segment.means,
        stds=policy.std, log_probs=segment.log_probs, rewards=segment.rewards,
        truncated=segment.truncated,
    )  # fmt: skip
