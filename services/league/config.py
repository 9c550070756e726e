"""Settings of the league, section ``[league]`` of a site file."""

import msgspec

from services.league.sampling import Rule, Sampler
from shared.config.ranges import check_range
from shared.errors import SnapshotError
from shared.policy.players import scripted_player


class LeagueConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """Schedule of both phases, the evaluation, and the leases.

    Phase two is the paper's: ``rounds`` rounds, in each both fencers start again from the end of
    phase one, and ``round_iterations`` times first the antagonist, then the protagonist makes a
    few updates against one opponent drawn from what the other side has left in this round. The
    reward is the game score alone.

    Five updates are 800 steps of 128 bouts that begin side by side all over the 20 s: longer than
    any exchange of blows, and four fifths of what is played is learned from although the first
    batch of a stage has to be waited for. 6 rounds x 35 iterations x 2 sides x 5 updates are 43
    million samples, 16 minutes at the 45,000 samples/s of two cores.
    """

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
    rounds: int = 0
    """Rounds of phase two; 0 ends the run with phase one. The paper has 6."""
    round_iterations: int = 35
    """Iterations of a round, as in the paper."""
    round_antagonist_updates: int = 5
    """PPO updates of the antagonist in one iteration of a round."""
    round_protagonist_updates: int = 5
    """PPO updates of the protagonist in one iteration of a round."""
    sampler: Sampler = "uniform"
    """How phase two draws an opponent from the history of the other side: any version with the
    same probability (``uniform``, the paper), the newest (``latest``), any of the newest few
    (``window``), rather those that the learner does badly against (``pfsp``), or always the warm
    start (``fixed``)."""
    sampler_window: int = 8
    """Newest versions that ``window`` draws from."""
    pfsp_power: float = 2.0
    """Exponent of ``pfsp``: an opponent weighs (1 - win rate) to this power."""
    antagonist_anchors: tuple[str, ...] = ()
    """Scripted antagonists, such as ``scripted:static``, in the pool for ever; the paper has none
    and draws from history alone."""
    protagonist_anchors: tuple[str, ...] = ()
    """Scripted protagonists in the pool for ever."""
    anchor_share: float = 0.1
    """Probability that a draw falls on one of them, when there are any."""
    points_per_reward: float = 10.0
    """Points of the game in one unit of reward; `riposte train` fills it in from [reward]."""
    batch_rollouts: int = 4
    """Rollouts in one update of a learner; the window of a serial run."""
    batch_samples: int = 20480
    """Samples in one update of a learner, or in its warm-up if that is more; sizes the window of
    the actors."""
    lease_seconds: float = 10.0
    """A lease lapses after this long without a renewal (s)."""
    ended_lease_seconds: float = 5.0
    """How long an ended lease stays in the schedule, so that late rollouts are told why (s)."""

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ValueError: a value is out of its range; says which, and what is allowed.
        """
        check_range("league.seed", self.seed, 0, 2**63 - 1)
        check_range("league.iterations", self.iterations, 1, 100)
        check_range("league.antagonist_updates", self.antagonist_updates, 1, 1_000_000)
        check_range("league.protagonist_updates", self.protagonist_updates, 1, 1_000_000)
        check_range("league.convergence_min_updates", self.convergence_min_updates, 0, 1_000_000)
        check_range("league.convergence_window", self.convergence_window, 1, 100_000)
        check_range("league.convergence_tolerance", self.convergence_tolerance, 0.0, 1e6)
        check_range("league.evaluation_bouts", self.evaluation_bouts, 0, 100_000)
        check_range("league.rounds", self.rounds, 0, 1000)
        check_range("league.round_iterations", self.round_iterations, 1, 10_000)
        check_range("league.round_antagonist_updates", self.round_antagonist_updates, 1, 1_000_000)
        check_range(
            "league.round_protagonist_updates", self.round_protagonist_updates, 1, 1_000_000
        )
        check_range("league.sampler_window", self.sampler_window, 1, 100_000)
        check_range("league.pfsp_power", self.pfsp_power, 0.0, 100.0)
        check_range("league.anchor_share", self.anchor_share, 0.0, 1.0)
        check_range("league.points_per_reward", self.points_per_reward, 1e-6, 1e6)
        for name in ("antagonist_anchors", "protagonist_anchors"):
            _check_scripted(name, getattr(self, name))
        check_range("league.batch_rollouts", self.batch_rollouts, 1, 4096)
        check_range("league.batch_samples", self.batch_samples, 1, 2**40)
        check_range("league.lease_seconds", self.lease_seconds, 0.5, 3600.0)
        check_range("league.ended_lease_seconds", self.ended_lease_seconds, 0.0, 600.0)
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
                check_range(f"league.{name}", weight, 0.0, 1e6)
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

    @property
    def rule(self) -> Rule:
        """Return how phase two draws."""
        return Rule(self.sampler, self.sampler_window, self.pfsp_power, self.anchor_share)


def weight_of(weights: tuple[float, ...], iteration: int) -> float:
    """Return the weight of an iteration (from 1), the last one given for all after it."""
    return weights[min(iteration, len(weights)) - 1]


def _check_scripted(name: str, players: tuple[str, ...]) -> None:
    for player in players:
        try:
            scripted_player(player)
        except SnapshotError as error:
            raise ValueError(f"league.{name}: {error}") from None
