"""A rotor that the model lacks takes torque for speeding up, and for nothing else."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.rotor_inertia import EFFECT
from shared.sim.plant.plant import mjcf
from tests.arms import make_subject, recorded, replay

_TURNTABLE = """<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
<worldbody><body><joint name="turn" axis="0 0 1" damping="0.25" armature="{armature}"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
<actuator><motor name="turn" joint="turn"/></actuator></mujoco>"""


def _turntable(folder: Path, armature: float = 0.0) -> Subject:
    path = folder / "turntable.xml"
    path.write_text(_TURNTABLE.format(armature=armature))
    return make_subject(mjcf(path, "torque", ["turn"], ["turn"], ""))


def test_it_slows_the_start_and_not_the_end(tmp_path: Path):
    reports = replay(_turntable(tmp_path), recorded([0.5], 9.0, [0.0]), EFFECT, "turn", [0.3])
    speeds = np.diff(reports.q[:, 0]) / 0.01
    assert speeds[:10].mean() / 0.05 == pytest.approx(0.5 / 0.4, rel=0.05)  # rad/s^2
    assert speeds[-1] == pytest.approx(2.0, rel=0.01)  # time constant 1.6 s


def test_it_sits_where_the_model_has_none_and_may_be_all_that_the_drive_speeds_up(tmp_path: Path):
    bare = _turntable(tmp_path)
    assert EFFECT.places(bare) == ("turn",)
    (inertia,) = EFFECT.quantities(bare, "turn")
    assert inertia.unit == "kg m^2"
    assert inertia.high == pytest.approx(5.0 / 4.0)
    assert EFFECT.places(_turntable(tmp_path, 0.01)) == ()
