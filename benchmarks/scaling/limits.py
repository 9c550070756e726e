"""What holds a run back, in the order in which more and more actors meet it."""

import dataclasses
import inspect
import itertools
import json
import math

from benchmarks.scaling.model import (
    RENEWALS,
    Coefficients,
    Job,
    Site,
    actors_at_limit,
    broadcast,
    learner_thread,
)
from benchmarks.scaling.words import number, table
from services.learner.config import LearnerConfig
from shared.bus.config import BusConfig, router_json
from shared.bus.delivery import Applied, Outbox
from shared.messages.topics import LEASES
from shared.messages.training import ACTION_DIM, OBS_DIM

GIGABIT = 117e6
"""Bytes a second of payload."""
TEN_GIGABIT = 1.17e9
CENTRAL = 16.0
"""Cores of a central machine in the tables."""
RETRY_SECONDS: float = inspect.signature(Outbox).parameters["max_retry_delay"].default
BOOTS: int = inspect.signature(Applied).parameters["max_boots"].default
SESSIONS: int = json.loads(router_json(BusConfig()))["transport"]["unicast"]["max_sessions"]
STEPS = LearnerConfig().epochs * LearnerConfig().minibatches


def _parameters(inputs: int, outputs: int) -> int:
    """Return the weights and biases of a network of the default widths."""
    widths = (inputs, *LearnerConfig().hidden_dims, outputs)
    return sum((before + 1) * after for before, after in itertools.pairwise(widths))


GRADIENT_BYTES = 4 * (_parameters(OBS_DIM, ACTION_DIM) + ACTION_DIM + _parameters(OBS_DIM, 1))
"""Of actor, its standard deviations and critic."""


def limits(cost: Coefficients) -> str:
    """Return the table of what holds a run back, in the order in which actors meet it."""
    job = Job()
    thread = 1.0 / learner_thread(cost, job)
    fed_by = thread * cost.actor_s
    useful = (1 + job.max_lag) * job.batch_samples // job.rollout_samples
    rollout = cost.rollout_bytes * job.rollout_samples
    retried = rollout / RETRY_SECONDS
    far = Site(cores=CENTRAL, actor_cores=math.inf, link=GIGABIT)
    wide = dataclasses.replace(far, link=TEN_GIGABIT)
    tree = dataclasses.replace(far, relays=32)
    half = {
        site.link: actors_at_limit(cost, site, job, "link, out") for site in (far, wide)
    }  # fmt: skip
    of_league = actors_at_limit(cost, far, job, "league's thread")
    rows = (
        (
            "the learner's one thread", f"{number(thread)} samples/s, from {fed_by:.1f} actors on",
            "PPO and intake take turns on it",
            "several learner processes an agent, each with a part of the rollouts, gradients "
            f"summed by `torch.distributed` (gloo; {GRADIENT_BYTES / 1e3:.0f} kB a step, "
            f"{STEPS} steps a version): 8 of them at most {number(8 * thread)} samples/s",
        ),
        (
            "rollouts that come too late",
            f"{useful} actors at {job.rollout_samples} samples a rollout and "
            f"{job.batch_samples} a batch",
            "more rollouts are under way than two batches hold; the others are turned away and "
            f"sent again whole, soon every {RETRY_SECONDS:g} s, {number(retried / 1e6)} MB/s an "
            f"actor: {number(GIGABIT / retried)} such actors fill 1 Gbit/s",
            "a batch that grows with the actors (`learner.batch_samples`; "
            f"{number(job.for_actors(1000).batch_samples)} samples for 1,000 actors), rollouts of "
            "fewer bouts, or learners that fetch rollouts when they have room",
        ),
        (
            "policies, sent to everybody",
            f"{half[GIGABIT]:,} actors take half of 1 Gbit/s, {half[TEN_GIGABIT]:,} half of "
            "10 Gbit/s",
            "both policies go to every actor every second, "
            f"{number(2e-3 * cost.policy_bytes)} kB an actor for any number of them",
            "routers in a tree, one for each machine of actors (32 of them: "
            f"{number(broadcast(cost, tree, job, 5000)[0] / 1e6)} MB/s from the central one for "
            "5,000 actors)",
        ),
        (
            "the league's one thread",
            f"half full at {of_league:,} actors, "
            f"{number(of_league * RENEWALS / job.lease_seconds)} renewals a second",
            "renewals, and what each answer looks through",
            "longer leases (`league.lease_seconds`)",
        ),
        (
            "numbers in the code",
            f"{BOOTS:,} actor processes, restarts counted, in a learner's record of what was "
            f"learned from; {SESSIONS:,} sessions at a router; "
            f"{int(LEASES.max_bytes / cost.lease_bytes):,} leases in the list of them",
            "beyond the first, a rollout repeated by an actor that was silent longest could count "
            "twice",
            "a record that grows; routers in a tree",
        ),
        (
            "processor cores for actors",
            f"{number(1e6 * cost.actor_s)} us a sample: 8 learners need {8 * fed_by:.0f} cores",
            "physics on CPUs",
            "actors on a GPU (`actor.backend = 'warp'`): 523,923 samples/s of one beside an H200",
        ),
    )  # fmt: skip
    return table(("Limit", "Reached at", "Because", "Removed by"), rows)
