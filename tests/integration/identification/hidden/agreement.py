"""How far the hidden implementation of an effect and the catalogue's are apart."""

from dataclasses import dataclass, replace

import numpy as np

from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.catalogue import effects
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.noise import NoiseLevels
from shared.identification.hidden.recipe import Recipe, Wish
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import pose_error, sampled_poses

USUAL = NoiseLevels()
SILENT = NoiseLevels(
    encoder=0.0, tracker_position=0.0, tracker_rotation=0.0, drift_position=0.0,
    drift_rotation=0.0, torque=0.0, initial=0.0,
)  # fmt: skip


@dataclass(frozen=True)
class Agreement:
    """Root mean squares over all recordings, in units of the usual sensors' noise."""

    effect: float
    """What the effect changes."""
    apart: float
    """What the two implementations change differently; time steps do not count."""

    @property
    def share(self):
        return self.apart / self.effect


def agreement(arm, name, place, size, seed=4, *, nothing=None):
    """Hide an effect without any noise in a robot of the model file; replay it both ways.

    What the effect changes is told from a robot without it or, where ``nothing`` is given, from
    one in which it has that size, next to nothing: a hidden drive has its controller beside the
    arm, which alone is more of a change than a drive that is slightly warm.
    """
    recipe = Recipe(
        arm=arm, seed=seed, spread=0.0, noise=SILENT, has_shares=False, seconds=3.0, train=2,
        test=1, wishes=(Wish(name, place, size),),
    )  # fmt: skip
    dataset, truth = simulated(recipe)
    wishes = () if nothing is None else (Wish(name, place, nothing),)
    plain, _ = simulated(replace(recipe, wishes=wishes))
    found = truth.effect[0]
    subject = subject_of(dataset)
    effect = next(each for each in effects() if each.name == name)
    where = found.where
    told = {each.name: each.value for each in found.quantities}
    values = np.array(
        [told.get(each.name, each.probe) for each in effect.quantities(subject, where)]
    )  # what the truth does not tell of, as the screen has it
    structure = effect.structure(subject, where)
    rollouts = Rollouts(subject.plant, structure, 8) if structure else subject.nominal
    recorded = recorded_of(dataset)
    usual = [
        replace(each, initial_q=other.initial_q)
        for each, other in zip(recorded, plain.trajectories, strict=True)
    ]
    without = subject.nominal.run([(lambda row: None, each) for each in usual])
    within = rollouts.run(
        [(lambda row: effect.enter(row, where, values), each) for each in recorded]
    )
    hidden, found = [], []
    for logged, usual, one, other in zip(
        dataset.trajectories, plain.trajectories, within, without, strict=True
    ):
        kept = np.isin(usual.joints_at, logged.joints_at)
        pose = sampled_poses(usual.tracker_at, usual.tracker, logged.tracker_at)
        hidden += _changes(logged.q, usual.q[kept], logged.tracker, pose)
        found += _changes(one.q, other.q, one.tracker, other.tracker)
    change = np.concatenate(hidden)
    return Agreement(_rms(change), _rms(change - np.concatenate(found)))


def _changes(q, usual_q, pose, usual_pose):
    return [
        ((q - usual_q) / USUAL.encoder).ravel(),
        (pose_error(pose, usual_pose) / USUAL.tracker).ravel(),
    ]


def _rms(values):
    return float(np.sqrt(np.mean(values**2)))
