"""Friction at joints: each kind brakes as its signature says."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.asymmetric_friction import EFFECT as ASYMMETRIC
from shared.identification.catalogue.coulomb_friction import EFFECT as COULOMB
from shared.identification.catalogue.coupled_wrist import EFFECT as COUPLED
from shared.identification.catalogue.load_friction import EFFECT as LOAD
from shared.identification.catalogue.nonlinear_viscous import EFFECT as NONLINEAR
from shared.identification.catalogue.stribeck_friction import EFFECT as STRIBECK
from shared.identification.catalogue.viscous_friction import EFFECT as VISCOUS
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.plant import mjcf
from shared.sim.plant.replay import Reports
from tests.arms import make_plant, make_subject, recorded, replay, still

_TURNTABLE = """<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
<worldbody><body><joint name="turn" axis="0 0 1" {joint}/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
<actuator><{drive}/></actuator></mujoco>"""
_INERTIA = 0.1


def _turntable(folder: Path, joint: str = "") -> Subject:
    """Return 0.1 kg m^2 about one axis without weight, driven by torques."""
    path = folder / "turntable.xml"
    path.write_text(_TURNTABLE.format(joint=joint, drive='motor name="turn" joint="turn"'))
    return make_subject(mjcf(path, "torque", ["turn"], ["turn"], ""))


def _speeds(reports: Reports) -> Float64:
    return np.diff(reports.q[:, 0]) / 0.01


def _after(
    subject: Subject, torque: float, seconds: float, effect: Effect | None = None, *values: float
) -> Float64:
    """Return the turntable's speeds from rest under a constant torque (rad/s)."""
    recording = recorded([torque], seconds, [0.0])
    return _speeds(replay(subject, recording, effect, "turn", values))


def test_coulomb_friction_takes_its_level_off_the_torque_at_any_speed(tmp_path: Path) -> None:
    speeds = _after(_turntable(tmp_path), 0.5, 1.0, COULOMB, 0.2)
    # (0.5 - 0.2) N m on 0.1 kg m^2 are 3 rad/s^2, early and late
    np.testing.assert_allclose(np.diff(speeds) / 0.01, 3.0, rtol=2e-3)


def test_coulomb_friction_holds_what_is_below_its_level(tmp_path: Path) -> None:
    reports = replay(_turntable(tmp_path), recorded([0.19], 2.0, [0.0]), COULOMB, "turn", [0.2])
    assert np.abs(reports.q).max() < 2e-4  # 0.95 rad without


def test_bristles_hold_what_friction_does_and_slide_as_it_does(tmp_path: Path) -> None:
    subject = _turntable(tmp_path)
    for bend in (1e-7, 1e-5, 1e-3):  # the first are far too stiff for a step
        held = replay(subject, recorded([0.1], 2.0, [0.0]), COULOMB, "turn", [0.2, bend])
        assert 0.0 < np.abs(held.q).max() < 4.0 * bend + 3e-5
        speeds = _after(subject, 0.5, 1.0, COULOMB, 0.2, bend)
        np.testing.assert_allclose(np.diff(speeds)[20:] / 0.01, 3.0, rtol=2e-3)


def test_a_joint_moves_a_little_before_bristles_let_it_slide(tmp_path: Path) -> None:
    subject, bend = _turntable(tmp_path, 'damping="0.5"'), 5e-3

    def rising(at: Float64) -> Float64:
        return np.minimum(0.05 * at, 0.15)[:, None]  # so slowly that the damping does little

    q = replay(subject, recorded(rising, 4.0, [0.0]), COULOMB, "turn", [0.2, bend]).q[:, 0]
    # dz/dq = (1 - z) / bend, where 0.2 z is the torque
    assert q[-1] == pytest.approx(-bend * np.log(1.0 - 0.15 / 0.2), rel=0.1)


def test_coulomb_and_viscous_friction_sit_only_where_the_model_has_none(tmp_path: Path) -> None:
    bare = _turntable(tmp_path)
    assert COULOMB.places(bare) == VISCOUS.places(bare) == ("turn",)
    rubbed = _turntable(tmp_path, 'frictionloss="0.1" damping="0.1"')
    assert COULOMB.places(rubbed) == VISCOUS.places(rubbed) == ()


def test_viscous_friction_ends_in_torque_over_damping(tmp_path: Path) -> None:
    speeds = _after(_turntable(tmp_path), 0.5, 4.0, VISCOUS, 0.2)
    assert speeds[-1] == pytest.approx(2.5, rel=1e-3)  # time constant 0.5 s


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_nonlinear_friction_is_odd_and_ends_in_the_root_of_torque(
    tmp_path: Path, sign: float
) -> None:
    speeds = _after(_turntable(tmp_path), sign * 0.5, 4.0, NONLINEAR, 0.125)
    assert speeds[-1] == pytest.approx(sign * 2.0, rel=1e-3)  # 0.125 * 2^2 = 0.5


def test_nonlinear_friction_may_weaken_with_speed_but_not_drive(tmp_path: Path) -> None:
    subject = _turntable(tmp_path, 'damping="0.5"')
    lowest = NONLINEAR.quantities(subject, "turn")[0].low
    assert lowest == pytest.approx(-0.5)  # used up at 1 rad/s, the joint's speed
    torque = 0.1
    speeds = _after(subject, torque, 4.0, NONLINEAR, -0.4)
    # 0.5 v - 0.4 v^2 = 0.1 has the roots 0.25 and 1
    assert speeds[-1] == pytest.approx(0.25, rel=2e-3)


@pytest.mark.parametrize(("sign", "speed"), [(1.0, 1.0), (-1.0, 5.0 / 3.0)])
def test_asymmetric_friction_adds_one_way_what_it_takes_the_other(
    tmp_path: Path, sign: float, speed: float
) -> None:
    subject = _turntable(tmp_path, 'damping="0.4"')
    speeds = _after(subject, sign * 0.5, 4.0, ASYMMETRIC, 0.1)
    assert speeds[-1] == pytest.approx(sign * speed, rel=1e-3)  # 0.5 / (0.4 + 0.1), / (0.4 - 0.1)


def test_stribeck_friction_sticks_up_to_its_sum_with_coulomb(tmp_path: Path) -> None:
    subject = _turntable(tmp_path, 'frictionloss="0.2"')
    held = replay(subject, recorded([0.28], 1.0, [0.0]), STRIBECK, "turn", [0.1, 0.2, 0.0])
    assert np.abs(held.q).max() < 2e-4
    slid = replay(subject, recorded([0.32], 1.0, [0.0]), STRIBECK, "turn", [0.1, 0.2, 0.0])
    assert slid.q[-1, 0] > 0.1


def test_stribeck_friction_falls_with_speed_as_its_curve(tmp_path: Path) -> None:
    subject = _turntable(tmp_path)
    excess, falloff, torque = 0.1, 0.5, 0.12
    speeds = _after(subject, torque, 3.0, STRIBECK, excess, falloff, 0.0)
    middle = 0.5 * (speeds[1:] + speeds[:-1])
    wanted = (torque - excess * np.exp(-((middle / falloff) ** 2))) / _INERTIA
    np.testing.assert_allclose(np.diff(speeds) / 0.01, wanted, atol=0.01)
    assert np.diff(speeds)[-1] / np.diff(speeds)[0] == pytest.approx(6.0, rel=0.1)


def test_load_friction_is_a_share_of_what_the_drive_gives(tmp_path: Path) -> None:
    subject = _turntable(tmp_path)
    for torque in (0.5, 1.0):
        speeds = _after(subject, torque, 0.5, LOAD, 0.2, 0.0)
        np.testing.assert_allclose(np.diff(speeds) / 0.01, 0.8 * torque / _INERTIA, rtol=2e-3)


def test_a_wrists_motor_rubs_on_both_joints_at_once(tmp_path: Path) -> None:
    subject = make_subject(make_plant(tmp_path, has_gravity=False))
    assert COUPLED.places(subject) == ("elbow",)

    def both(way: float):
        def command(at: Float64) -> Float64:
            ramp = 0.5 * at
            return np.stack([0.0 * at, ramp, way * ramp], axis=1)

        return recorded(command, 1.0)

    for way, values in ((1.0, (0.4, 0.0)), (-1.0, (0.0, 0.4))):
        plain = replay(subject, both(way))
        rubbed = replay(subject, both(way), COUPLED, "elbow", values)
        # 0.4 N m against a servo of 200 N m/rad
        lag = (plain.q - rubbed.q)[-1]
        np.testing.assert_allclose(lag[1:], [2e-3, way * 2e-3], rtol=0.02)
        other = replay(subject, both(-way), COUPLED, "elbow", values)
        still_there = (replay(subject, both(-way)).q - other.q)[-1]
        assert np.abs(still_there).max() < 1e-3  # that motor hardly turns


@pytest.mark.parametrize("effect", [ASYMMETRIC, LOAD, NONLINEAR, STRIBECK])
def test_friction_shows_only_at_joints_that_move(tmp_path: Path, effect: Effect) -> None:
    subject = make_subject(make_plant(tmp_path))
    assert effect.places(subject) == ("pan", "lift", "elbow")
    assert effect.places(still(subject, "lift")) == ("lift",)
    assert effect.places(replace(subject, travel=np.zeros(3))) == ()
