"""An arm that torques push which nobody knows is judged by the torques that are missing."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.fit import Fit
from shared.identification.fitting.space import Space
from shared.identification.fitting.torques import by_torques
from shared.identification.search.astray import astray, counted_by_torque, leads_astray, no_more
from tests.arms import JOINTS
from tests.geared import FRICTION, SENSED, candidates, problem_of_geared

DRIVES = ("coulomb_friction", "viscous_friction", "rotor_inertia")


def test_what_an_arm_without_rotors_leaves_says_nothing_of_noise(tmp_path: Path):
    problem = problem_of_geared(tmp_path, is_bare=True)
    read = replace(problem.noise, joints=np.full(len(JOINTS), 1e-5))
    space = Space(replace(problem, noise=read), candidates(problem, *DRIVES))
    wild = replace(problem.noise, joints=np.full(len(JOINTS), 20.0))
    assert no_more(wild, space).joints.max() < 5e-3
    calm = replace(problem.noise, joints=np.full(len(JOINTS), 1e-6))
    assert no_more(calm, space).joints == pytest.approx(calm.joints)


def test_where_torques_push_an_arm_that_nobody_knows_neither_weight_nor_friction_hides_them(
    tmp_path: Path,
):
    problem = problem_of_geared(tmp_path, is_sensed=True)
    space = Space(problem, candidates(problem, "coulomb_friction"))
    light = by_torques(space)
    heavy, stuck = light.copy(), light.copy()
    for index, parameter in enumerate(problem.parameters):
        if parameter.name.startswith("armature"):
            heavy[index] = np.log(0.3 / parameter.nominal)  # where an arm goes on as it began
    stuck[space.base_size :] *= 20.0
    noise = astray(space)
    pushed = Space(replace(problem, noise=noise), space.candidates)
    train = problem.of("train")

    def left(space: Space, z: np.ndarray) -> float:
        return float(np.mean(space.problem.vector([space.variant(z)], train) ** 2))

    assert noise.is_torque
    assert noise.torque is not None
    assert "torque" in counted_by_torque(noise)
    assert counted_by_torque(problem.noise) == ""
    for wrong in (heavy, stuck):
        worse = left(space, wrong) / left(space, light)
        assert left(pushed, wrong) / left(pushed, light) > 3.0 * worse
        assert leads_astray(Fit.at(space, wrong, train))
    assert not leads_astray(Fit.at(space, light, train))
    sizes = [values[0] for values in pushed.values(light)]
    assert sizes == pytest.approx([SENSED * FRICTION[joint] for joint in JOINTS], rel=0.3)
