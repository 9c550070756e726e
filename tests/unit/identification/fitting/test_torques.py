"""What a motion takes and what it got leads near the truth from a file that is far off."""

from pathlib import Path

import pytest

from shared.identification.fitting.space import Space
from shared.identification.fitting.torques import by_torques
from tests.arms import JOINTS
from tests.geared import DAMPING, FRICTION, ROTOR, candidates, problem_of_geared


def test_friction_rotors_and_dampers_are_found_from_stand_ins(tmp_path: Path):
    problem = problem_of_geared(tmp_path)
    frictions = candidates(problem, "coulomb_friction")
    space = Space(problem, frictions)
    z = by_torques(space)
    base = {each.name: each.value(x) for each, x in zip(problem.parameters, z, strict=False)}
    found = dict(zip([each.place for each in frictions], space.values(z), strict=True))
    for joint in JOINTS:
        assert found[joint][0] == pytest.approx(FRICTION[joint], rel=0.1)
        assert base[f"armature {joint}"] == pytest.approx(ROTOR[joint], rel=0.1)
        assert base[f"damping {joint}"] == pytest.approx(DAMPING[joint], rel=0.1)
        assert base[f"mass {joint}"] == pytest.approx(
            next(each.nominal for each in problem.parameters if each.name == f"mass {joint}"),
            rel=0.1,
        )


def test_where_the_file_has_nothing_of_the_kind_all_of_it_is_found_as_causes(tmp_path: Path):
    problem = problem_of_geared(tmp_path, is_bare=True)
    lacks = candidates(problem, "coulomb_friction", "viscous_friction", "rotor_inertia")
    assert len(lacks) == 9
    space = Space(problem, lacks)
    found = dict(zip([each.label for each in lacks], space.values(by_torques(space)), strict=True))
    for joint in JOINTS:
        assert found[f"coulomb_friction {joint}"][0] == pytest.approx(FRICTION[joint], rel=0.1)
        assert found[f"viscous_friction {joint}"][0] == pytest.approx(DAMPING[joint], rel=0.1)
        assert found[f"rotor_inertia {joint}"][0] == pytest.approx(ROTOR[joint], rel=0.1)
