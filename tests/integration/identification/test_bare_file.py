"""A model file that knows links and nothing of drives: what they do is named, joint by joint.

The recordings are what such an arm would log, by inverse dynamics: nothing is simulated there.
"""

from pathlib import Path

import pytest

from shared.identification.find import identify
from shared.identification.verdict import Verdict
from tests.arms import JOINTS
from tests.geared import DAMPING, FRICTION, ROTOR, problem_of_geared


def _sizes(verdict: Verdict, effect: str) -> dict[str, float]:
    return {each.where: each.value for each in verdict.causes if each.effect == effect}


@pytest.mark.timeout(400)
def test_friction_dampers_and_rotors_of_every_joint_are_named(tmp_path: Path):
    verdict = identify(problem_of_geared(tmp_path, is_bare=True).dataset).verdict
    assert verdict.verdict == "named", verdict.sentence
    assert len(verdict.causes) == 3 * len(JOINTS), verdict.sentence
    assert _sizes(verdict, "coulomb_friction") == pytest.approx(FRICTION, rel=0.02)
    assert _sizes(verdict, "viscous_friction") == pytest.approx(DAMPING, rel=0.02)
    assert _sizes(verdict, "rotor_inertia") == pytest.approx(ROTOR, rel=0.02)


@pytest.mark.slow
def test_what_the_tool_carries_is_named_beside_them(tmp_path: Path):
    dataset, steps = problem_of_geared(tmp_path, load=1.5).dataset, tmp_path / "steps"
    verdict = identify(dataset, resume_folder=steps).verdict
    assert verdict.verdict == "named", verdict.sentence
    assert _sizes(verdict, "coulomb_friction") == pytest.approx(FRICTION, rel=0.02)
    assert _sizes(verdict, "payload") == pytest.approx({"": 1.5}, rel=0.02)
    assert len(verdict.causes) == len(JOINTS) + 1, verdict.sentence
    assert identify(dataset, resume_folder=steps).verdict.causes == verdict.causes
