"""The extended model as a file moves as the extended model does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.errors import IdentificationError
from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.catalogue import effects
from shared.identification.conclusion.model_file import ModelFile, model_file
from shared.identification.dataset.types import Dataset, Float64, ModelSource
from shared.identification.fitting.parameters import base_parameters
from shared.identification.verdict import Cause, Verdict
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import Measured, load_parameters
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from tests.integration.identify_job.arms import cause, pendulum_dataset, pr2_dataset, verdict_of


def moved(dataset: Dataset, verdict: Verdict | None = None) -> Float64:
    """Return what an arm logs, float64[T, J]: as its model is, or extended by a verdict."""
    subject = subject_of(dataset, capacity=1)
    known = {each.name: each for each in effects()}
    base = {each.name: each for each in base_parameters(subject)}
    causes = () if verdict is None else verdict.causes

    def enter(row: Row) -> None:
        for value in () if verdict is None else verdict.base:
            base[value.name].change(row, value.extended)
        for each in causes:
            numbers = {each.quantity: each.value, **each.others}
            quantities = known[each.effect].quantities(subject, each.where)
            values = np.array([numbers[quantity.name] for quantity in quantities])
            known[each.effect].enter(row, each.where, values)

    structure = tuple(
        edit for each in causes for edit in known[each.effect].structure(subject, each.where)
    )
    return Rollouts(subject.plant, structure, 1).run([(enter, recorded_of(dataset)[0])])[0].q


def written(folder: Path, file: ModelFile, dataset: Dataset) -> Dataset:
    """Return the data set with the file for its model."""
    path = folder / file.name
    path.write_text(file.text)
    source = dataset.source
    if source.kind == "pr2":
        return replace(dataset, source=replace(source, parameters=path))
    return replace(dataset, source=ModelSource("mjcf", path, tracked=source.tracked))


PR2_CAUSES = (
    cause("command_latency", "", "delay", 0.03),
    cause("torque_bias", "shoulder_lift", "torque", 2.5),
    cause("joint_spring", "elbow_flex", "stiffness", 3.0, rest=-1.0),
    cause("nonlinear_viscous", "elbow_flex", "quadratic", 0.8),
    cause("torque_saturation", "shoulder_pan", "inverse_limit", 0.5),
)


@pytest.mark.parametrize("named", [*PR2_CAUSES, None], ids=lambda c: c.effect if c else "base")
def test_the_file_of_a_pr2_moves_as_its_extended_model(tmp_path: Path, named: Cause | None) -> None:
    dataset = pr2_dataset(tmp_path)
    verdict = verdict_of(dataset, *([named] if named else []))
    file = model_file(dataset, verdict)
    assert all(each.is_carried for each in file.carried)
    plain, wanted = moved(dataset), moved(dataset, verdict)
    found = moved(written(tmp_path, file, dataset))
    assert np.abs(wanted - plain).max() > 5e-3
    np.testing.assert_allclose(found, wanted, atol=1e-6)


def test_of_a_payload_on_a_balanced_arm_the_file_has_the_inertia_and_says_so(
    tmp_path: Path,
) -> None:
    dataset = pr2_dataset(tmp_path)
    payload = cause("payload", "", "mass", 0.4)
    file = model_file(dataset, verdict_of(dataset, payload))
    assert [each.is_carried for each in file.carried] == [False]
    assert "its weight the file cannot hold" in file.carried[0].sentence
    with_it = load_parameters(written(tmp_path, file, dataset).source.parameters)
    without = load_parameters(
        written(tmp_path, model_file(dataset, verdict_of(dataset)), dataset).source.parameters
    )
    assert with_it.extensions != without.extensions or with_it.bat.mass > without.bat.mass


def test_train_and_play_load_the_file_of_a_pr2(tmp_path: Path) -> None:
    dataset = pr2_dataset(tmp_path)
    file = model_file(dataset, verdict_of(dataset, *PR2_CAUSES))
    path = written(tmp_path, file, dataset).source.parameters
    nominal, extended = (
        FencingModel.build(SimConfig()),
        FencingModel.build(SimConfig(model=str(path))),
    )
    assert extended.hash != nominal.hash
    assert extended.parameters.command.delay == 0.03


def test_what_is_measured_wrongly_is_said_and_moves_nothing(tmp_path: Path) -> None:
    dataset = pr2_dataset(tmp_path)
    file = model_file(dataset, verdict_of(dataset, cause("tracker_latency", "", "delay", 0.02)))
    path = tmp_path / file.name
    path.write_text(file.text)
    assert load_parameters(path).measurement == (
        Measured(effect="tracker_latency", where="", values={"delay": 0.02}),
    )
    assert "not how the arm moves" in file.carried[0].sentence
    without = model_file(dataset, verdict_of(dataset))
    np.testing.assert_allclose(
        moved(written(tmp_path, file, dataset)), moved(written(tmp_path, without, dataset))
    )


def test_a_torque_law_is_left_out_and_said_so(tmp_path: Path) -> None:
    dataset = pr2_dataset(tmp_path)
    law = cause("load_friction", "elbow_flex", "share", 0.3, bend=1e-3)
    file = model_file(dataset, verdict_of(dataset, law))
    assert [each.is_carried for each in file.carried] == [False]
    assert "cannot hold it" in file.carried[0].sentence
    assert file.text == model_file(dataset, verdict_of(dataset)).text


PENDULUM_CAUSES = (
    cause("coulomb_friction", "elbow", "level", 0.1, bend=0.0),
    cause("torque_bias", "shoulder", "torque", 0.3),
    cause("payload", "", "mass", 0.3),
    cause("joint_elasticity", "elbow", "compliance", 0.05),
)


@pytest.mark.parametrize("named", PENDULUM_CAUSES, ids=lambda c: c.effect)
def test_the_file_of_an_mjcf_moves_as_its_extended_model(tmp_path: Path, named: Cause) -> None:
    dataset = pendulum_dataset(tmp_path)
    verdict = verdict_of(dataset, named)
    file = model_file(dataset, verdict)
    assert file.name == "model.xml"
    assert file.carried[0].is_carried
    if named.effect == "joint_elasticity":  # a joint that the log has not
        assert "a joint was added" in file.carried[0].sentence
        assert "elbow/series" in file.text
        return
    plain, wanted = moved(dataset), moved(dataset, verdict)
    found = moved(written(tmp_path, file, dataset))
    assert np.abs(wanted - plain).max() > 5e-3
    np.testing.assert_allclose(found, wanted, atol=1e-6)


@pytest.mark.parametrize("details", [{}, {"bend": 1e-3}])
def test_of_friction_that_bends_the_file_has_its_level_and_says_so(
    tmp_path: Path, details: dict[str, float]
) -> None:
    """A verdict from before friction could bend has no such number."""
    dataset = pendulum_dataset(tmp_path)
    level = cause("coulomb_friction", "elbow", "level", 0.1, **details)
    file = model_file(dataset, verdict_of(dataset, level))
    told = file.carried[0]
    assert told.is_carried
    assert told.sentence.endswith("its bend the file cannot hold" if details else "friction loss")
    at_once = cause("coulomb_friction", "elbow", "level", 0.1, bend=0.0)
    assert file.text == model_file(dataset, verdict_of(dataset, at_once)).text


def test_the_file_of_an_mjcf_keeps_what_the_original_has(tmp_path: Path) -> None:
    dataset = pendulum_dataset(tmp_path)
    text = model_file(dataset, verdict_of(dataset)).text
    assert 'name="encoder"' in text
    assert "riposte" not in text


def test_a_verdict_of_another_arm_is_refused(tmp_path: Path) -> None:
    other = verdict_of(pr2_dataset(tmp_path))
    with pytest.raises(IdentificationError, match="which this arm has not"):
        model_file(pendulum_dataset(tmp_path), other)
    stranger = verdict_of(pendulum_dataset(tmp_path), cause("gremlins", "", "count", 3.0))
    with pytest.raises(IdentificationError, match="gremlins"):
        model_file(pendulum_dataset(tmp_path), stranger)
