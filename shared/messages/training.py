"""What actors and learners say to each other."""

from typing import Annotated, Literal

from shared.messages.message import Array, ArraySpec, Bytes, Message

Agent = Literal["antagonist", "protagonist"]
AGENTS: tuple[Agent, Agent] = ("antagonist", "protagonist")

OBS_DIM = 27
"""Own bat pose and velocity (13), other bat pose and velocity (13), time (1)."""
ACTION_DIM = 6
"""Offset of the tool: translation (3) and rotation (3), each in units of its bound."""
MOST_WORLDS = 4096
"""Bouts that one actor may play side by side."""


class Rollout(Message, frozen=True, kw_only=True):
    """T control steps of N parallel bouts, the learning side acted by one policy version.

    A rollout never straddles two bouts: a bout ends only at the end of a rollout.
    """

    agent: Agent
    """The side that learns from it."""
    actor: str
    """Name of the actor process."""
    boot: str
    """Identity of that process's run; with ``sequence`` it names the rollout for ever."""
    sequence: int
    """Counts the rollouts of one boot from 0."""
    lease: str
    """The lease it was played under."""
    stage: int
    """Index of the league's stage."""
    policy_version: int
    """Version of the learning policy that acted."""
    snapshot: str
    """Content hash of that version."""
    opponent: str
    """Player reference of the other side, the same for every step and bout in here."""
    model: str
    """Hash of the simulator model."""
    seed: int
    """Seed of the lease."""
    bouts: Annotated[Array, ArraySpec("int64", ("N",))]
    """Number of the bout in each world, counted within the lease."""
    first_step: Annotated[Array, ArraySpec("int32", ("N",))]
    """Control step of each bout (0..1999) at the first row."""
    obs: Annotated[Array, ArraySpec("float32", ("T", "N", OBS_DIM))]
    last_obs: Annotated[Array, ArraySpec("float32", ("N", OBS_DIM))]
    """The true observation after the last row, the terminal one where a bout ended."""
    actions: Annotated[Array, ArraySpec("float32", ("T", "N", ACTION_DIM))]
    """As sampled, unclipped."""
    means: Annotated[Array, ArraySpec("float32", ("T", "N", ACTION_DIM))]
    """Mean of the Gaussian each action was drawn from."""
    stds: Annotated[Array, ArraySpec("float32", (ACTION_DIM,))]
    """Its standard deviation."""
    log_probs: Annotated[Array, ArraySpec("float32", ("T", "N"))]
    rewards: Annotated[Array, ArraySpec("float32", ("T", "N"))]
    truncated: Annotated[Array, ArraySpec("bool", ("N",))]
    """The bout in this world reached its time limit with the last row."""
    worlds: int = 0
    """Bouts that the actor plays side by side: more than N where they go out as several rollouts; 0
    where these are all."""

    @property
    def name(self) -> str:
        """Return the name under which this rollout is acknowledged and recorded."""
        return f"{self.boot}:{self.sequence}"


class Receipt(Message, frozen=True, kw_only=True):
    """The answer to an acknowledged message: it is durable, or it never will be."""

    accepted: bool
    reason: str = ""
    """Why it was dropped, in one line; empty when accepted."""


class PolicyAnnouncement(Message, frozen=True, kw_only=True):
    """The newest policy of a learner, re-sent every second until the next one."""

    agent: Agent
    policy_version: int
    stage: int
    snapshot: str
    """Content hash of ``payload``."""
    payload: Annotated[Bytes, ArraySpec("uint8", ("B",))]
    """The snapshot file (safetensors)."""


class UpdateMetrics(Message, frozen=True, kw_only=True):
    """What one PPO update did; every number is over the update's own samples."""

    samples: int
    """Samples of this update."""
    total_samples: int
    """Samples this agent has learned from since the run began."""
    reward_mean: float
    """Mean reward of one control step."""
    value_loss: float
    surrogate_loss: float
    entropy: float
    approx_kl: float
    """Mean KL(behavior || updated policy)."""
    clip_fraction: float
    explained_variance: float
    policy_lag_mean: float
    """Mean of current version minus the version that acted."""
    learning_rate: float
    action_std: float
    """Mean standard deviation over the six action dimensions."""
    wait_seconds: float
    """Time spent waiting for rollouts before this update."""
    update_seconds: float
    """Time spent in this update."""


class VersionReport(Message, frozen=True, kw_only=True):
    """A learner's new version, asked of the league to be entered in the ledger."""

    agent: Agent
    policy_version: int
    stage: int
    snapshot: str
    payload: Annotated[Bytes, ArraySpec("uint8", ("B",))]
    rollouts: tuple[str, ...]
    """Names of the rollouts this version was made from; empty for version 0."""
    metrics: UpdateMetrics | None = None


class VersionReceipt(Message, frozen=True, kw_only=True):
    """The league's answer to a version report."""

    accepted: bool
    """False when the ledger holds another snapshot under this version."""
    latest_version: int
    """Newest version of this agent in the ledger."""
    stage: int
    """The stage now; another than the report's when that one has ended. -1 when all are done."""
    learned_elsewhere: tuple[str, ...] = ()
    """The rollouts behind other versions of this agent, from the reported one on: what a learner
    that lost its newest checkpoint must not learn from again. ``boot:first-last`` of their names'
    numbers."""
    reason: str = ""
