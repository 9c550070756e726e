"""A small geared arm under torques: its file is without the friction and rotors of its drives."""

import re
from pathlib import Path

import numpy as np

from shared.identification.arm.subject import subject_of
from shared.identification.catalogue import effects
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Split, Trajectory
from shared.identification.effect import Candidate
from shared.identification.fitting.base import floor_from_base
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import noise_of
from shared.identification.search.screen import candidates_of
from shared.sim.plant.inverse import inverse_dynamics
from shared.sim.plant.plant import Plant, mjcf
from shared.sim.plant.rollouts import Rollouts
from tests.arms import JOINTS, write_arm

FRICTION = {"pan": 2.0, "lift": 1.5, "elbow": 0.8}
"""(N m)."""
ROTOR = {"pan": 1.0, "lift": 0.8, "elbow": 0.3}
"""(kg m^2)."""
DAMPING = {"pan": 3.0, "lift": 2.0, "elbow": 1.0}
"""(N m s/rad)."""
_RATES = {"slow": (1.1, 1.4, 1.7), "fast": (2.3, 2.9, 3.1), "away": (1.9, 2.2, 2.6)}
"""Of each joint's sine (rad/s); the last recording is held out."""
_SPREAD, _ABOUT = np.array([0.6, 0.5, 0.7]), np.array([0.0, 0.2, -0.8])
"""(rad)."""


SENSED = 0.1
"""Of that friction, what sensors beyond the gears see; and none of rotors and dampers."""
_OFF = 0.08
"""Of a joint's torque, what such a sensor is off by, in slow waves."""


def problem_of_geared(
    folder: Path,
    load: float = 0.0,
    is_bare: bool = False,
    is_sensed: bool = False,
    push: float = 0.0,
) -> Problem:
    """Return recordings of 4 s, read to 0.02 mrad, none repeated.

    Args:
        folder: for the model file.
        load: at the tool, that the file does not have (kg).
        is_bare: whether the file has neither armature nor damping, either.
        is_sensed: whether torques are those of sensors beyond the gears, not of motors.
        push: what pushes the first joint all the time (N m).
    """
    path = write_arm(folder, "torque")
    text = re.sub(r'frictionloss="[^"]*"', "", path.read_text())
    if is_bare:
        text = re.sub(r'(damping|armature)="[^"]*"', "", text)
    path.write_text(text)
    plant = mjcf(path, "torque", JOINTS, JOINTS, "tool")
    recordings = tuple(
        _recording(plant, load, name, rates, is_sensed, push) for name, rates in _RATES.items()
    )
    dataset = Dataset(
        folder, ModelSource("mjcf", path), "torque", JOINTS, JOINTS, recordings, (), ""
    )
    subject = subject_of(dataset)
    noise = noise_of(dataset, BLOCK, subject.starts, subject.nominal)
    problem = Problem(subject, dataset, base_parameters(subject), noise)
    return Problem(subject, dataset, problem.parameters, floor_from_base(Space(problem)))


def candidates(problem: Problem, *names: str) -> tuple[Candidate, ...]:
    """Return what is looked for, of effects by name."""
    chosen = [each for each in effects() if each.name in names]
    return candidates_of(chosen, problem.subject, frozenset())[0]


def _recording(
    plant: Plant, load: float, name: str, rates: tuple[float, ...], is_sensed: bool, push: float
) -> Trajectory:
    """Return a motion and the torques that it takes of the arm as it is."""
    at: Float64 = np.arange(0.0, 4.0, 0.005)
    phase = at[:, None] * np.array(rates) + np.array([0.3, 1.2, 2.0])
    swung = _SPREAD * np.sin(phase)
    q, qdd = _ABOUT + swung, -(np.array(rates) ** 2) * swung
    qd = _SPREAD * np.array(rates) * np.cos(phase)
    model = Rollouts(plant, (), 1).model
    for joint in JOINTS:
        dof = int(model.joint(plant.mj_joint(joint)).dofadr[0])
        model.dof_frictionloss[dof] = FRICTION[joint] * (SENSED if is_sensed else 1.0)
        model.dof_armature[dof] = 0.0 if is_sensed else ROTOR[joint]
        model.dof_damping[dof] = 0.0 if is_sensed else DAMPING[joint]
    tool = int(model.body(plant.tool_body).id)
    grown = 1.0 + load / model.body_mass[tool]
    model.body_mass[tool] *= grown
    model.body_inertia[tool] *= grown
    torque = inverse_dynamics(plant, model, q, qd, qdd)
    torque[:, 0] -= push
    if is_sensed:
        wave = np.sin(at[:, None] * np.array([5.3, 6.1, 7.7]) + rates[0])
        torque = torque + _OFF * torque.std(axis=0) * wave
    read = 2e-5 * np.round(q / 2e-5)
    split: Split = "test" if name == "away" else "train"
    return Trajectory(name, split, "", q[0], qd[0], at, torque, at, read)
