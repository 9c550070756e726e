"""Torques that a motion takes and did not get, as residuals."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.lacking import shows
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.space import Space
from tests.arms import JOINTS
from tests.geared import DAMPING, FRICTION, ROTOR, candidates, problem_of_geared

TRUTH = {"coulomb_friction": FRICTION, "viscous_friction": DAMPING, "rotor_inertia": ROTOR}


def _by_torque(problem: Problem) -> Problem:
    noise = replace(problem.noise, torque=np.ones(len(JOINTS)), start_doubt=None)
    return replace(problem, noise=noise)


def test_the_arm_as_it_is_lacks_nothing_and_without_friction_it_lacks_that(tmp_path: Path):
    problem = _by_torque(problem_of_geared(tmp_path, is_bare=True))
    space = Space(problem, candidates(problem, *TRUTH))
    right = np.zeros(space.size)
    for each in space.candidates:
        quantity = each.effect.quantities(problem.subject, each.place)[0]
        right[space.where(each).start] = TRUTH[each.effect.name][each.place] / quantity.probe
    smooth = right.copy()
    for each in space.candidates:
        if each.effect.name == "coulomb_friction":
            smooth[space.where(each)] = 0.0
    segments = problem.of("test")
    own, other = problem.residuals([space.variant(z) for z in (right, smooth)], segments)
    for segment, torque in zip(segments, own, strict=True):
        assert torque.shape == problem.shape_of(segment)
    lacks = np.concatenate(own)
    rubs = np.concatenate(other) - lacks
    moves = np.abs(lacks) < 0.3  # where a joint turns round friction is smeared over 0.1 s
    assert moves.mean() > 0.9
    assert np.sqrt(np.mean(lacks[moves] ** 2)) < 0.05
    for joint, name in enumerate(JOINTS):
        assert np.median(np.abs(rubs[:, joint])) == pytest.approx(FRICTION[name], rel=0.02)


@pytest.mark.parametrize(
    ("name", "is_shown"),
    [
        ("coulomb_friction", True),
        ("payload", True),
        ("command_latency", True),
        ("load_friction", True),
        ("torque_bias", True),
        ("nonlinear_viscous", True),
        ("torque_gain", False),
        ("torque_saturation", False),
        ("encoder_scale", False),
        ("joint_elasticity", False),
        ("thermal_derating", False),
        ("external_contact", False),
    ],
)
def test_torques_tell_of_what_acts_at_once_and_not_of_readings_or_what_gives(
    tmp_path: Path, name: str, is_shown: bool
):
    problem = problem_of_geared(tmp_path)
    found = candidates(problem, name)
    assert found
    recorded = problem.segments[0].recorded
    assert {shows(problem.subject, each, recorded) for each in found} == {is_shown}
