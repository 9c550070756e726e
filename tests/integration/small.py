"""A whole run that is over in a second: two stages of three updates, 16 evaluation bouts."""

SMALL = (
    "actor.num_envs=8",
    "actor.rollout_steps=20",
    "game.bout_steps=80",
    "learner.batch_samples=640",
    "learner.warm_up_samples=640",
    "learner.hidden_dims=[16,16]",
    "learner.minibatches=4",
    "league.antagonist_updates=3",
    "league.protagonist_updates=3",
    "league.iterations=1",
    "league.evaluation_bouts=8",
    "league.convergence_min_updates=0",
)
"""Over the default settings; starting and stopping processes comes on top."""
