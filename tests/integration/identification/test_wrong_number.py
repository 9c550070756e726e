"""A number of the model file is wrong at one joint: the base could have it, and it is named."""

import re
from dataclasses import replace
from pathlib import Path

import pytest

from shared.identification.conclusion.model_file import model_file
from shared.identification.dataset.types import Dataset
from shared.identification.find import identify
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe

pytestmark = pytest.mark.timeout(400)

_SAYS = 0.25
"""Times what the arm has, that the file says."""
_JOINT = re.compile(r'<joint name="elbow".*/>')
_ARMATURE = re.compile(r'(?<=armature=")[^"]*')


def with_wrong_rotor(folder: Path) -> tuple[Dataset, float, float]:
    """Return recordings of an arm, what its file says of the elbow's rotor, and what it has."""
    recipe = Recipe(arm="arm3", seconds=2.4, train=2, test=2, seed=9121)
    dataset, truth = simulated(recipe)
    assert dataset.source.path is not None
    text = dataset.source.path.read_text()
    nominal = armature_of(text)
    wrong = _SAYS * nominal
    path = folder / "arm3.xml"
    path.write_text(_JOINT.sub(lambda found: _ARMATURE.sub(f"{wrong:g}", found[0]), text))
    source = replace(dataset.source, path=path)
    return replace(dataset, source=source), wrong, nominal * truth.base["armature"][2]


def armature_of(text: str) -> float:
    """Return what a model file says of the elbow's rotor (kg m^2)."""
    (joint,) = _JOINT.findall(text)
    (armature,) = _ARMATURE.findall(joint)
    return float(armature)


def test_a_number_of_the_file_that_is_wrong_at_one_joint_is_named(tmp_path: Path) -> None:
    dataset, says, has = with_wrong_rotor(tmp_path)
    verdict = identify(dataset).verdict
    (cause,) = verdict.causes
    assert (cause.effect, cause.where, cause.quantity) == ("rotor_inertia", "elbow", "difference")
    assert cause.interval.low < has - says < cause.interval.high, verdict.sentence
    assert verdict.held_out.extended < verdict.held_out.base_fit
    assert "armature elbow" not in {each.name for each in verdict.base}
    assert "rotor_inertia" not in verdict.ruled_out
    assert armature_of(model_file(dataset, verdict).text) == pytest.approx(
        says + cause.value, rel=1e-3
    )


def test_an_effect_that_is_left_out_is_not_named_of_the_file_either(tmp_path: Path) -> None:
    dataset, _, _ = with_wrong_rotor(tmp_path)
    verdict = identify(dataset, without=("rotor_inertia",)).verdict
    assert not verdict.causes, verdict.sentence
    assert "armature elbow" in verdict.sentence
