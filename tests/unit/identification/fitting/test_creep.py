"""Joints that creep where friction holds them."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.creep import creep_of
from shared.identification.fitting.parameters import enter_base
from shared.sim.hidden.arms import ARMS
from shared.sim.plant.row import Row
from tests.arms import make_plant, make_subject, recorded

_COMMAND = (0.5, 0.3, -0.5)


def test_what_friction_holds_sticks_and_at_one_creeps_as_mujocos_own_does(tmp_path: Path):
    subject = make_subject(make_plant(tmp_path))
    (creep,) = creep_of(subject)

    def held(x: float) -> np.ndarray:
        def enter(row: Row) -> None:
            enter_base((creep,), np.array([x]), row)

        return subject.nominal.entered(enter, recorded(_COMMAND)).field("dof_solimp")[:, :2]

    assert held(0.0).min() >= 0.999
    assert held(1.0) == pytest.approx(np.full_like(held(1.0), 0.9), abs=1e-3)


@pytest.mark.parametrize("arm", ["torque2", "pr2"])
def test_an_arm_without_friction_or_held_by_its_tool_has_none_that_creeps(arm: str):
    assert creep_of(make_subject(ARMS[arm].make())) == ()
