"""The actor: asks for a lease, plays it, hands rollouts and results over, asks again."""

from typing import Any

import structlog
from numpy.typing import NDArray

from services.actor.collector import Collector, Results, Segment
from services.actor.config import ActorConfig
from services.actor.cutting import cut, parts_of
from services.actor.evaluation import Evaluation
from services.actor.frames import WORLD, FrameSampler
from services.actor.leasing import LeaseKeeper
from services.actor.opponents import Opponents
from services.actor.policies import LearningPolicies, LearningPolicy
from services.actor.reports import Reports
from shared.bus.base import Bus
from shared.bus.delivery import Outbox
from shared.clock import Clock
from shared.errors import SnapshotError
from shared.game.reward import RewardConfig
from shared.messages.league import Lease, Stage
from shared.messages.topics import FRAMES, ROLLOUT
from shared.messages.training import AGENTS, Agent, Receipt, Rollout
from shared.policy.players import Player
from shared.policy.snapshot import Fit
from shared.runtime.rate import Rate
from shared.runtime.service import Health
from shared.sim.env import FencingEnv

log = structlog.get_logger()

Arrays = dict[str, NDArray[Any]]

UNPLAYABLE_SECONDS, MOST_UNPLAYABLE_SECONDS = 1.0, 60.0
"""Before the next request for work when a lease could not be played; twice as long each time."""
_MOSTLY_IDLE = 4
"""Times as many worlds as an evaluation has bouts."""


class Actor:
    """Plays what the league leases it; keeps nothing else."""

    def __init__(
        self,
        cfg: ActorConfig,
        reward_cfg: RewardConfig,
        env: FencingEnv,
        fit: Fit,
        bus: Bus,
        clock: Clock,
    ) -> None:
        """Join the bus; work begins with the first tick.

        Args:
            cfg: sizes and periods.
            reward_cfg: scales of the reward.
            env: the worlds; their number is ``cfg.num_envs``.
            fit: what a policy must be made for to play here.
            bus: this process's end of the bus.
            clock: decides when to ask again.

        Raises:
            ValueError: if a bout is no whole number of rollouts.
        """
        if env.rules.bout_steps % cfg.rollout_steps:
            raise ValueError(
                f"rollout_steps ({cfg.rollout_steps}) must divide the bout's "
                f"{env.rules.bout_steps} steps"
            )
        self._cfg = cfg
        self._reward_cfg = reward_cfg
        self._env = env
        self._bus = bus
        self._clock = clock
        self._opponents = Opponents(bus, clock, fit, env.arena, cfg.opponent_cache, cfg.ask_timeout)
        self._rollouts: dict[Agent, Outbox[Rollout, Receipt]] = {
            agent: Outbox(
                bus, ROLLOUT, clock, window=1, timeout=cfg.acknowledge_timeout, agent=agent
            )
            for agent in AGENTS
        }
        self._reports = Reports(bus, clock, cfg.ask_timeout, env.model.hash)
        self._policies = LearningPolicies(bus, fit)
        self._frames = FrameSampler(env, clock, cfg.frame_period, cfg.frame_steps)
        self._parts = parts_of(cfg.rollout_steps, cfg.num_envs)
        """Rollouts that what is played at a time goes out as."""
        self._keeper = LeaseKeeper(bus, clock, cfg.num_envs, cfg.rollout_steps, cfg.ask_timeout)
        self._playing = ""
        """Name of the lease that collector or evaluation belong to."""
        self._collector: Collector | None = None
        self._evaluation: Evaluation | None = None
        self._few: FencingEnv | None = None
        """Worlds for evaluations of few bouts, once there was one."""
        self._unplayable_seconds = UNPLAYABLE_SECONDS
        self._rollout_sequence = 0
        self._resume: tuple[Arrays, dict[str, Any]] | None = None
        self.paused = False
        """Keep up with everybody, but play nothing and take on nothing (serial mode, around a
        cut)."""
        self._samples = Rate(clock)
        self._waiting = ""
        self._waiting_since = clock.now()
        self._last_error = ""
        self._counters = {
            "rollouts_acknowledged": 0,
            "rollouts_dropped": 0,
            "bouts": 0,
            "leases": 0,
            "steps": 0,
        }

    @property
    def num_envs(self) -> int:
        """Return how many bouts are played in parallel."""
        return self._env.num_envs

    # -- the loop ---------------------------------------------------------------------------

    def tick(self) -> bool:
        """Do one piece of work: at most one rollout, or as many steps of an evaluation."""
        if self.paused:
            self._reports.flush()
        did = self._pump()
        did |= self._policies.tick()
        if not (self.paused and self._keeper.is_free):
            did |= self._keeper.tick()
        lease = self._keeper.lease
        if lease is None or lease.lease != self._playing:
            self._forget()
        if lease is None:
            self._wait_for(self._keeper.waiting_for or "league: a lease")
            return did
        if self._collector is None and self._evaluation is None:
            if self.paused and lease.stage is None:
                return did
            return self._start(lease) or did
        return (not self.paused and self._play(lease)) or did

    def _pump(self) -> bool:
        """Hand over what is due, and count what was answered."""
        did = False
        for outbox in self._rollouts.values():
            for rollout, receipt in outbox.pump():
                did = True
                self._account(rollout.name, receipt.accepted, receipt.reason)
            for rollout, reason in outbox.take_refused():
                self._account(rollout.name, accepted=False, reason=reason)
        did |= self._reports.tick()
        return did

    def _account(self, name: str, accepted: bool, reason: str) -> None:
        """Count an answered rollout."""
        if accepted:
            self._counters["rollouts_acknowledged"] += 1
            log.info("rollout_acknowledged", name=name)
        else:
            self._counters["rollouts_dropped"] += 1
            log.info("rollout_dropped", name=name, reason=reason)

    # -- the lease --------------------------------------------------------------------------

    def _forget(self) -> None:
        """Stop what was being played; what was handed over stays in the outboxes."""
        self._reports.flush()
        self._playing = ""
        self._collector = None
        self._evaluation = None
        self._frames.abandon()

    def _start(self, lease: Lease) -> bool:
        """Begin to play the lease once both players are here."""
        try:
            if lease.stage is not None:
                started = self._start_training(lease, lease.stage)
            else:
                started = self._start_evaluation(lease)
        except SnapshotError as error:
            self._last_error = str(error)
            log.error("lease_refused", lease=lease.lease, reason=str(error))
            self._keeper.drop("unplayable", wait=self._unplayable_seconds)
            self._unplayable_seconds = min(2 * self._unplayable_seconds, MOST_UNPLAYABLE_SECONDS)
            return False
        if started:
            self._unplayable_seconds = UNPLAYABLE_SECONDS
            self._playing = lease.lease
            self._counters["leases"] += 1
        return started

    def _start_training(self, lease: Lease, stage: Stage) -> bool:
        opponent = self._player(stage.opponent, stochastic=lease.stochastic)
        if opponent is None:
            return False
        if self._policies.get(stage.agent) is None:
            self._wait_for(f"learner {stage.agent}: its first policy")
            return False
        self._frames.watch(self._env)
        self._collector = Collector(
            self._env,
            AGENTS.index(stage.agent),
            opponent,
            self._cfg.rollout_steps,
            stage.score_weight,
            stage.shaping_weight,
            self._reward_cfg,
            lease.seed,
        )
        if self._resume is not None:
            self._collector.restore(*self._resume)
            self._resume = None
        return True

    def _start_evaluation(self, lease: Lease) -> bool:
        players = [
            self._player(reference, lease.stochastic)
            for reference in (lease.antagonist, lease.protagonist)
        ]
        antagonist, protagonist = players
        if antagonist is None or protagonist is None:
            return False
        env = self._env_for(lease.bouts)
        self._frames.watch(env)
        self._evaluation = Evaluation(env, (antagonist, protagonist), lease.bouts, lease.seed)
        return True

    def _env_for(self, bouts: int) -> FencingEnv:
        """Return worlds for an evaluation: of its own, where it would leave most of them idle.

        An actor on a graphics card has thousands, an evaluation some hundred bouts.
        """
        if bouts * _MOSTLY_IDLE > self._env.num_envs:
            return self._env
        if self._few is None or self._few.num_envs != bouts:
            self._few = self._env.others(bouts)
        return self._few

    def _player(self, reference: str, stochastic: bool) -> Player | None:
        player = self._opponents.get(reference, stochastic)
        if player is None:
            self._wait_for(f"league: snapshot {reference[:19]} {self._opponents.last_failure}")
        return player

    # -- playing ----------------------------------------------------------------------------

    def _play(self, lease: Lease) -> bool:
        """Play one rollout, or a stretch of an evaluation."""
        if self._reports.full:
            self._wait_for(f"league: {self._reports.outstanding} results unacknowledged")
            return False
        if self._evaluation is not None:
            results = self._evaluation.advance(self._cfg.rollout_steps, self._frames.on_step)
            self._count_steps(self._cfg.rollout_steps * self._evaluation.num_envs)
            self._show(lease, WORLD, (lease.antagonist, lease.protagonist))
            if results is not None:
                self._report(lease, results, (lease.antagonist, lease.protagonist))
                self._keeper.drop("done")
            return True
        if self._collector is None or lease.stage is None:
            return False
        return self._collect(lease, lease.stage, self._collector)

    def _collect(self, lease: Lease, stage: Stage, collector: Collector) -> bool:
        outbox = self._rollouts[stage.agent]
        outbox.window = lease.window * self._parts
        if outbox.unacknowledged > outbox.window - self._parts:
            self._wait_for(
                f"learner {stage.agent}: {outbox.unacknowledged} rollouts unacknowledged"
            )
            return False
        learning = self._policies.get(stage.agent)
        assert learning is not None  # the lease was not started without one
        segment = collector.collect(learning.policy, self._frames.on_step)
        self._count_steps(self._cfg.rollout_steps * self.num_envs)
        for part in cut(segment, self._parts):
            outbox.put(self._rollout(lease, stage, learning, part))
            self._rollout_sequence += 1
        own = f"sha256:{learning.digest}"
        pair = (own, stage.opponent) if stage.agent == "antagonist" else (stage.opponent, own)
        self._show(lease, int(segment.bouts[WORLD]), pair)
        if segment.results is not None:
            self._report(lease, segment.results, pair)
        return True

    def _rollout(
        self, lease: Lease, stage: Stage, learning: LearningPolicy, segment: Segment
    ) -> Rollout:
        return Rollout(
            agent=stage.agent,
            actor=self._bus.name,
            boot=self._bus.boot,
            sequence=self._rollout_sequence,
            lease=lease.lease,
            stage=stage.index,
            policy_version=learning.version,
            snapshot=learning.digest,
            opponent=stage.opponent,
            model=self._env.model.hash,
            seed=lease.seed,
            bouts=segment.bouts,
            first_step=segment.first_step,
            obs=segment.obs,
            last_obs=segment.last_obs,
            actions=segment.actions,
            means=segment.means,
            stds=learning.policy.std,
            log_probs=segment.log_probs,
            rewards=segment.rewards,
            truncated=segment.truncated,
            worlds=self.num_envs,
        )

    def _report(self, lease: Lease, results: Results, players: tuple[str, str]) -> None:
        """Hand finished bouts to the league."""
        self._counters["bouts"] += len(results.bouts)
        self._reports.add(lease, players, results)

    def _show(self, lease: Lease, bout: int, players: tuple[str, str]) -> None:
        frames = self._frames.take(self._bus.name, lease.lease, bout, players)
        if frames is not None:
            self._bus.publish(FRAMES, frames, name=self._bus.name)

    def _count_steps(self, count: int) -> None:
        self._counters["steps"] += count
        self._samples.add(count)
        self._waiting = ""

    def _wait_for(self, what: str) -> None:
        if not self._waiting:
            self._waiting_since = self._clock.now()
        self._waiting = what

    # -- serial mode ------------------------------------------------------------------------

    @property
    def quiet(self) -> bool:
        """Return whether nothing is under way between this actor and anybody, nor half done."""
        return not (
            any(outbox.unacknowledged for outbox in self._rollouts.values())
            or self._reports.outstanding
            or not self._keeper.quiet
            or self._evaluation
        )

    @property
    def ready(self) -> bool:
        """Return whether its training lease can be played on, if it has one."""
        lease = self._keeper.lease
        return lease is None or lease.stage is None or self._collector is not None

    def state(self) -> tuple[Arrays, dict[str, Any]]:
        """Return arrays and JSON values from which ``restore`` continues; only when ``quiet``."""
        arrays: Arrays = {}
        values: dict[str, Any] = {
            "keeper": self._keeper.state(),
            "rollout_sequence": self._rollout_sequence,
            "result_sequence": self._reports.sequence,
            "collector": None,
        }
        if self._collector is not None:
            arrays, values["collector"] = self._collector.state()
        return arrays, values

    def restore(self, arrays: Arrays, values: dict[str, Any]) -> None:
        """Continue from what ``state`` returned, once the players of the lease are here again."""
        self._keeper.restore(values["keeper"])
        self._rollout_sequence = int(values["rollout_sequence"])
        self._reports.sequence = int(values["result_sequence"])
        if values["collector"] is not None:
            self._resume = (arrays, values["collector"])

    # -- how it is --------------------------------------------------------------------------

    def health(self) -> Health:
        """Return how this actor is."""
        lease = self._keeper.lease
        if lease is None:
            state = "without a lease"
        elif lease.stage is not None:
            state = f"{lease.lease}: {lease.stage.agent} learns v {lease.stage.opponent[:19]}"
        else:
            state = f"{lease.lease}: {lease.antagonist[:15]} v {lease.protagonist[:15]}"
        waited = self._clock.now() - self._waiting_since if self._waiting else 0.0
        return Health(
            state=state,
            waiting_for=self._waiting,
            waiting_seconds=waited,
            rates={"steps_per_s": self._samples.per_second()},
            counters={**self._counters, "opponents_cached": len(self._opponents)},
            last_error=self._last_error or self._reports.last_error or self._policies.last_error,
            policies=self._policies.versions,
        )

    def close(self) -> None:
        """Hand over what is finished; what is not acknowledged is played again by somebody."""
        self._reports.flush()
