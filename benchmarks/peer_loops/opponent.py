"""Writes the snapshot of an untrained protagonist: ``python -m benchmarks.peer_loops.opponent F``.

Its card fits the default game, so that every loop may load it.
"""

import sys
from pathlib import Path

from services.jobs.settings import Settings
from services.learner.checkpoint import Meta
from services.learner.ppo import PolicyOptimiser
from services.learner.signing import RunFacts, sign
from shared.policy.snapshot import Fit
from shared.sim.model import FencingModel


def main() -> None:
    """Write the file that the command line names."""
    settings = Settings.load(None)
    model = FencingModel.build(settings.sim).hash
    facts = RunFacts(
        run="peers", seed=1, rules=settings.game,
        fit=Fit.of(settings.action, settings.sim.control_timestep, model),
    )  # fmt: skip
    meta = Meta(
        run="peers", agent="protagonist", seed=1, policy_version=0, stage=-1, total_samples=0,
        applied="{}", rollouts=(), metrics=None,
    )  # fmt: skip
    weights = PolicyOptimiser(settings.learner, seed=1).weights()
    snapshot = sign(settings.learner, facts, meta, weights)
    Path(sys.argv[1]).write_bytes(snapshot.payload)


if __name__ == "__main__":
    main()
