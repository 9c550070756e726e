"""Decides whether a rollout may be learned from; nothing in it is taken on trust."""

import dataclasses
import enum
import math

import numpy as np

from services.learner.played import Played
from shared.bus.ranges import LARGEST
from shared.messages.league import LeaseSummary, Stage
from shared.messages.texts import LONGEST_NAME
from shared.messages.training import ACTION_DIM, MOST_WORLDS, Agent, Rollout

_LOG_PROB_TOLERANCE = 1e-2
_STD_RANGE = (1e-4, 100.0)
_FARTHEST = 1e6
"""Of any number to learn from: squares of larger ones would soon be infinite."""


class Decision(enum.Enum):
    """What to do with a rollout."""

    LEARN = "learn"
    DROP = "drop"
    """It will never be of use: answer so."""
    LATER = "later"
    """What would decide it has not arrived here yet: let the actor ask again."""


@dataclasses.dataclass(frozen=True)
class Ruling:
    """A decision and its reason in one line."""

    decision: Decision
    reason: str = ""
    is_fault: bool = False
    """Somebody got something wrong; a rollout that merely came late is nobody's fault."""


LEARN = Ruling(Decision.LEARN)


def _drop(reason: str) -> Ruling:
    return Ruling(Decision.DROP, reason, is_fault=True)


def check_provenance(
    rollout: Rollout,
    agent: Agent,
    stage: Stage | None,
    leases: dict[str, LeaseSummary],
    model: str,
) -> Ruling:
    """Return whether a rollout comes from a bout that the league knows.

    Args:
        rollout: as it arrived, its arrays already of the registered shapes and finite.
        agent: who learns here.
        stage: of the league's schedule; None between stages.
        leases: by name, alive or ended a moment ago.
        model: hash of the simulator model of this run.
    """
    if not 0 <= rollout.sequence <= LARGEST:
        return _drop(f"sequence {rollout.sequence} is no count")
    if len(rollout.boot) > LONGEST_NAME:
        return _drop(
            f"boot has {len(rollout.boot)} characters, at most {LONGEST_NAME} are expected"
        )
    if rollout.agent != agent:
        return _drop(f"it is for the {rollout.agent}, this learner is the {agent}'s")
    if rollout.model != model:
        return _drop(f"model {rollout.model[:12]} is not this run's {model[:12]}")
    now = -1 if stage is None else stage.index
    if rollout.stage > now:
        return Ruling(Decision.LATER, f"stage {rollout.stage} is not known here yet")
    if stage is None or rollout.stage < now or stage.agent != agent:
        return Ruling(Decision.DROP, f"stage {rollout.stage} is over")
    lease = leases.get(rollout.lease)
    if lease is None:
        return Ruling(Decision.LATER, f"unknown bout: lease {rollout.lease} is not known here yet")
    if lease.boot and rollout.boot != lease.boot:
        return _drop(f"wrong boot: lease {lease.lease} is of another process of {lease.actor}")
    for field in ("actor", "agent", "stage", "opponent", "seed"):
        if (found := getattr(rollout, field)) != (wanted := getattr(lease, field)):
            what = "mixed opponents" if field == "opponent" else f"wrong {field}"
            return _drop(f"{what}: {found} in the rollout, {wanted} in lease {lease.lease}")
    return LEARN


def check_version(rollout: Rollout, current: int, oldest: int) -> Ruling:
    """Return whether the version that acted is new enough.

    Args:
        rollout: the rollout.
        current: this learner's version.
        oldest: the oldest version that is still accepted.
    """
    if rollout.policy_version > current:
        return Ruling(Decision.LATER, f"version {rollout.policy_version} is not made here yet")
    if rollout.policy_version < oldest:
        return Ruling(
            Decision.DROP,
            f"stale: version {rollout.policy_version}, now {current}, oldest {oldest}",
        )
    return LEARN


def check_contents(rollout: Rollout, bout_steps: int) -> Ruling:
    """Return whether a rollout is consistent in itself.

    Args:
        rollout: the rollout.
        bout_steps: control steps of a bout.
    """
    steps, worlds = rollout.rewards.shape
    if steps == 0 or worlds == 0:
        return _drop(f"empty: {steps} steps of {worlds} bouts")
    if not 0 <= rollout.worlds <= MOST_WORLDS:
        return _drop(f"{rollout.worlds} bouts side by side; at most {MOST_WORLDS} are")
    if len(np.unique(rollout.bouts)) != worlds or rollout.bouts.min() < 0:
        return _drop("a bout stands in two worlds, or has a negative number")
    last = rollout.first_step.astype(np.int64) + steps
    if rollout.first_step.min() < 0 or last.max() > bout_steps:
        return _drop(f"a bout runs outside its {bout_steps} steps")
    if not np.array_equal(rollout.truncated, last == bout_steps):
        return _drop("truncated does not say which bouts ran out of time")
    low, high = _STD_RANGE
    if rollout.stds.min() < low or rollout.stds.max() > high:
        return _drop(f"standard deviations are outside {low} .. {high}")
    for field in ("obs", "last_obs", "actions", "means", "rewards"):
        if np.abs(getattr(rollout, field)).max() > _FARTHEST:
            return _drop(f"{field} has a value beyond +-{_FARTHEST:g}")
    noise = (rollout.actions - rollout.means) / rollout.stds
    expected = -0.5 * np.einsum("tni,tni->tn", noise, noise) - (
        float(np.sum(np.log(rollout.stds))) + 0.5 * ACTION_DIM * math.log(2.0 * math.pi)
    )
    if np.abs(expected - rollout.log_probs).max() > _LOG_PROB_TOLERANCE:
        return _drop("log probabilities are not those of the actions")
    return LEARN


def check_new(rollout: Rollout, played: Played) -> Ruling:
    """Return whether a rollout is of play that no other rollout was of.

    What was played is remembered while the lease lives and this process does.

    Args:
        rollout: its contents already checked.
        played: what was handed over before under the same lease.
    """
    if (known := played.known(rollout)) is None:
        return LEARN
    bout, step = known
    return _drop(f"replayed: bout {bout} from step {step} on was handed over before")
