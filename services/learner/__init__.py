"""One agent's PPO: rollouts in, policy versions out.

Answers ``learner/{agent}/rollout``; asks ``league/version``; publishes ``learner/{agent}/policy``;
reads ``league/schedule`` and ``league/leases``. The only room with torch and rsl_rl.
"""
