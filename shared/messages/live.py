"""What is shown live: the health of the services, the progress of a run, a sampled bout."""

from typing import Annotated

from shared.messages.message import Array, ArraySpec, Message


class ServiceStatus(Message, frozen=True, kw_only=True):
    """One process says how it is, every second."""

    role: str
    name: str
    boot: str
    pid: int
    host: str
    """Name of the machine."""
    state: str
    """What it does now, in a few words."""
    waiting_for: str = ""
    """Whom or what it waits for; empty when it does not."""
    waiting_seconds: float = 0.0
    rates: dict[str, float] = {}
    """Per second, by name with unit: ``samples_per_s``."""
    counters: dict[str, int] = {}
    """Since the process started."""
    cpu_seconds: float = 0.0
    rss_bytes: int = 0
    last_error: str = ""
    version: str = ""
    """Of Riposte."""
    commit: str = ""
    """Of the source it runs, ``+`` after it when files differ; empty outside a checkout."""
    policies: dict[str, int] = {}
    """By agent, the newest policy version that it has."""


class Progress(Message, frozen=True, kw_only=True):
    """Where a training run stands, from the league, every second."""

    run: str
    stage: int
    stages: int
    phase: str
    iteration: int
    agent: str
    """Who learns; empty during evaluation."""
    update: int
    max_updates: int
    total_samples: int
    score_mean: float
    """Antagonist's mean score over the latest complete bouts of this stage; 0 when none."""
    score_low: float
    score_high: float
    """95 % interval of that mean."""
    score_bouts: int
    """How many bouts that is."""
    evaluations_done: int = 0
    evaluations_total: int = 0
    samples_per_s: float = 0.0
    policy_lag_mean: float = 0.0
    approx_kl: float = 0.0
    explained_variance: float = 0.0
    dropped_rollouts: int = 0
    eta_seconds: float = -1.0
    """Negative when unknown."""
    message: str = ""
    """The latest event worth a line."""
    round: int = 0
    """Round of phase two, from 1; 0 in phase one."""
    rounds: int = 0
    iterations: int = 0
    """Of this phase."""
    opponent: str = ""
    """Name of whom the learner meets."""


class BoutFrames(Message, frozen=True, kw_only=True):
    """F sampled instants of one bout, for viewers; may be lost."""

    actor: str
    lease: str
    bout: int
    antagonist: str
    protagonist: str
    model: str
    steps: Annotated[Array, ArraySpec("int32", ("F",))]
    """Control steps since the bout began."""
    positions: Annotated[Array, ArraySpec("float32", ("F", "B", 3))]
    """World position (m) of each body, in the model's body order."""
    quaternions: Annotated[Array, ArraySpec("float32", ("F", "B", 4))]
    """World orientation of each body, w x y z."""
    joints: Annotated[Array, ArraySpec("float32", ("F", 2, 7))]
    """Joint angles (rad), antagonist first."""
    score: Annotated[Array, ArraySpec("float32", ("F",))]
    """Antagonist's score so far."""
    in_target: Annotated[Array, ArraySpec("bool", ("F", 2))]
    """Antagonist's and protagonist's bat inside the target."""
    contact: Annotated[Array, ArraySpec("bool", ("F",))]
