"""Limits of a model file's drives that are lower than the arm's are found, and no others."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.torque_saturation import EFFECT as SATURATION
from shared.identification.dataset.types import Dataset, ModelSource
from shared.identification.fitting.drive_limits import low_limits
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.sim.plant.row import Row
from tests.measured import Enter, measure, nothing, problem_of


def weak_lift(dataset: Dataset, limit: float) -> Dataset:
    """Return a data set whose model file has another limit for the lift's drive (N m)."""
    path = dataset.source.path
    assert path is not None
    own = 'name="lift" joint="lift" kp="200" kv="10"'
    text = path.read_text()
    assert own in text
    weak = path.with_name(f"weak_{limit:g}.xml")
    weak.write_text(text.replace(own, f'{own} forcerange="-{limit} {limit}"'))
    return replace(dataset, source=ModelSource("mjcf", weak, tracked="tool"))


def based(folder: Path, limit: float, enter: Enter = nothing) -> Fit:
    """Return the base's fit to an arm that holds its lift with 5 N m and more."""
    dataset = measure(folder, np.random.default_rng(0), enter, seconds=3.0)
    space = Space(problem_of(weak_lift(dataset, limit)))
    return polish(space, np.zeros(space.size), space.problem.of("train"), steps=2)


def test_a_limit_that_the_arm_does_not_have_is_found(tmp_path: Path):
    assert low_limits(based(tmp_path, 4.0)) == ("lift",)


@pytest.mark.parametrize("limit", [20.0, 200.0])
def test_a_limit_that_is_not_reached_is_not(tmp_path: Path, limit: float):
    assert low_limits(based(tmp_path, limit)) == ()


def test_nor_is_one_that_the_arm_has(tmp_path: Path):
    def weak(row: Row) -> None:
        SATURATION.enter(row, "lift", np.array([1.0 / 4.0]))

    assert low_limits(based(tmp_path, 4.0, weak)) == ()
