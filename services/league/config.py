"""Settings of the league, section ``[league]`` of a site file."""

import msgspec


class LeagueConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Schedule of phase one, its evaluation, and the leases."""

    seed: int = 0
    """Seed of the run; every lease's seed follows from it."""
    iterations: int = 2
    """Iterations of phase one; in each the antagonist learns first, then the protagonist."""
    antagonist_updates: int = 100
    """Most PPO updates of the antagonist in one stage."""
    protagonist_updates: int = 160
    """Most PPO updates of the protagonist in one stage."""
    score_weights: tuple[float, ...] = (1.0,)
    """Factor of the game score in the reward, by iteration; the last one holds for the rest."""
    shaping_weights: tuple[float, ...] = (0.4,)
    """Factor of the continuous reward, by iteration; the last one holds for the rest."""
    convergence_min_updates: int = 120
    """A stage is not called converged before this many updates; 0 never ends a stage early."""
    convergence_window: int = 20
    """Updates in each of the two adjacent windows whose mean scores are compared."""
    convergence_tolerance: float = 10.0
    """Points a bout by which the newer window must be better for the learner to go on."""
    opponent_stochastic: bool = True
    """Let the opponent of a training stage sample its actions instead of taking their mean: one
    that always moves alike teaches nothing about any other."""
    evaluation_bouts: int = 128
    """Complete bouts of each pairing of the final evaluation; 0 skips the evaluation."""
    evaluation_stochastic: bool = False
    """Sample the actions in evaluations instead of taking their mean."""
    batch_rollouts: int = 4
    """Rollouts in one update of a learner; sizes the window of the actors."""
    lease_seconds: float = 10.0
    """A lease lapses after this long without a renewal (s)."""
    ended_lease_seconds: float = 5.0
    """How long an ended lease stays in the schedule, so that late rollouts are told why (s)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        _check("seed", self.seed, 0, 2**63 - 1)
        _check("iterations", self.iterations, 1, 100)
        _check("antagonist_updates", self.antagonist_updates, 1, 1_000_000)
        _check("protagonist_updates", self.protagonist_updates, 1, 1_000_000)
        _check("convergence_min_updates", self.convergence_min_updates, 0, 1_000_000)
        _check("convergence_window", self.convergence_window, 1, 100_000)
        _check("convergence_tolerance", self.convergence_tolerance, 0.0, 1e6)
        _check("evaluation_bouts", self.evaluation_bouts, 0, 100_000)
        _check("batch_rollouts", self.batch_rollouts, 1, 4096)
        _check("lease_seconds", self.lease_seconds, 0.5, 3600.0)
        _check("ended_lease_seconds", self.ended_lease_seconds, 0.0, 600.0)
        for name in ("score_weights", "shaping_weights"):
            weights: tuple[float, ...] = getattr(self, name)
            if not weights:
                raise ValueError(f"league.{name} is empty; give one number, or one per iteration")
            if len(weights) > self.iterations:
                raise ValueError(
                    f"league.{name} has {len(weights)} numbers for {self.iterations} iterations; "
                    "give at most one per iteration"
                )
            for weight in weights:
                _check(name, weight, 0.0, 1e6)
        for iteration in range(1, self.iterations + 1):
            if (
                weight_of(self.score_weights, iteration)
                == 0.0
                == weight_of(self.shaping_weights, iteration)
            ):
                raise ValueError(
                    f"league.score_weights and league.shaping_weights are both 0 in iteration "
                    f"{iteration}; there would be no reward"
                )


def weight_of(weights: tuple[float, ...], iteration: int) -> float:
    """Return the weight of an iteration (from 1), the last one given for all after it."""
    return weights[min(iteration, len(weights)) - 1]


def _check(name: str, value: float, low: float, high: float) -> None:
    if not low <= value <= high:  # also refuses NaN
        raise ValueError(f"league.{name} is {value}; allowed are {low:g} to {high:g}")
