"""Drives that push too much, too little or with a ripple: by hand arithmetic."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.cogging import EFFECT as COGGING
from shared.identification.catalogue.inertia_error import EFFECT as INERTIA
from shared.identification.catalogue.joint_spring import EFFECT as SPRING
from shared.identification.catalogue.thermal_derating import EFFECT as THERMAL
from shared.identification.catalogue.thermal_derating import MEMORY
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.torque_saturation import EFFECT as SATURATION
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.plant import mjcf
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from tests.arms import make_plant, make_subject, recorded, replay, still

_RAIL = """<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
<worldbody><body><joint name="cart" type="{kind}" axis="0 0 1" {joint}/>
<inertial pos="0 0 0" mass="2" diaginertia="2 2 2"/></body></worldbody>
<actuator><{drive} name="cart" joint="cart"/></actuator></mujoco>"""
"""2 kg, or 2 kg m^2."""


def _cart(folder: Path, kind: str = "hinge", joint: str = "", kp: float = 0.0) -> Subject:
    drive = f'position kp="{kp}" kv="{kp / 2}"' if kp else "motor"
    path = folder / "cart.xml"
    path.write_text(_RAIL.format(kind=kind, joint=joint, drive=drive))
    control = "position" if kp else "torque"
    return make_subject(mjcf(path, control, ["cart"], ["cart"], ""))


def _accelerations(q: Float64) -> Float64:
    return np.diff(q[:, 0], 2) / 1e-4


@pytest.mark.parametrize("kind", ["hinge", "slide"])
def test_a_bias_pushes_always_the_same(tmp_path: Path, kind: str) -> None:
    subject = _cart(tmp_path, kind)
    found = replay(subject, recorded([0.4], 1.0, [0.3]), BIAS, "cart", [-1.0])
    np.testing.assert_allclose(_accelerations(found.q), -0.3, rtol=1e-6)
    assert BIAS.quantities(subject, "cart")[0].unit == ("N m" if kind == "hinge" else "N")


def test_a_bias_moves_the_rest_of_a_spring_that_the_model_has(tmp_path: Path) -> None:
    subject = _cart(tmp_path, joint='stiffness="10" springref="0.1" damping="8"')
    found = replay(subject, recorded([0.0], 12.0, [0.1]), BIAS, "cart", [2.0])
    assert found.q[-1, 0] == pytest.approx(0.1 + 2.0 / 10.0, abs=1e-4)


def test_a_spring_pulls_towards_its_rest(tmp_path: Path) -> None:
    subject = _cart(tmp_path, kp=90.0)
    found = replay(subject, recorded([0.5], 6.0, [0.5]), SPRING, "cart", [10.0, -0.5])
    # 90 (0.5 - q) = 10 (q + 0.5)
    assert found.q[-1, 0] == pytest.approx(0.4, abs=1e-5)


def test_springs_and_biases_at_one_joint_add_up(tmp_path: Path) -> None:
    subject = _cart(tmp_path, joint='stiffness="3" springref="0.2"')

    def enter(row: Row) -> None:
        SPRING.enter(row, "cart", np.array([2.0, -0.3]))
        BIAS.enter(row, "cart", np.array([0.5]))
        SPRING.enter(row, "cart", np.array([1.0, 0.4]))

    found = subject.nominal.run([(enter, recorded([0.0], 0.05, [0.1]))])[0]
    torque = 3.0 * 0.1 + 2.0 * -0.4 + 0.5 + 1.0 * 0.3
    assert _accelerations(found.q)[0] == pytest.approx(torque / 2.0, rel=1e-2)


def test_cogging_has_its_period_and_its_phase(tmp_path: Path) -> None:
    subject = _cart(tmp_path)
    ripples = 12.0
    for q in (0.0, 0.1, math.pi / 12.0, 0.4):
        found = replay(subject, recorded([0.0], 0.04, [q]), COGGING, "cart", [0.3, -0.2, ripples])
        torque = 0.3 * math.cos(ripples * q) - 0.2 * math.sin(ripples * q)
        assert _accelerations(found.q)[0] == pytest.approx(torque / 2.0, abs=2e-3)


def test_cogging_of_a_sliding_joint_is_counted_per_metre(tmp_path: Path) -> None:
    subject = _cart(tmp_path, "slide")
    for q, share in ((0.0, 1.0), (0.025, -1.0), (0.05, 1.0)):
        found = replay(subject, recorded([0.0], 0.04, [q]), COGGING, "cart", [0.4, 0.0, 20.0])
        assert _accelerations(found.q)[0] == pytest.approx(share * 0.2, abs=5e-3)


def test_a_saturated_drive_never_gives_more_than_its_limit(tmp_path: Path) -> None:
    subject = _cart(tmp_path)
    for asked, given in ((1.0, 1.0), (3.0, 2.0), (-3.0, -2.0)):
        found = replay(subject, recorded([asked], 0.5, [0.0]), SATURATION, "cart", [0.5])
        np.testing.assert_allclose(_accelerations(found.q), given / 2.0, rtol=1e-6)


def test_saturation_does_not_lift_the_models_own_limit(tmp_path: Path) -> None:
    subject = _cart(tmp_path, joint='actuatorfrcrange="-1 4"')
    for asked, given in ((3.0, 2.0), (-3.0, -1.0)):
        found = replay(subject, recorded([asked], 0.5, [0.0]), SATURATION, "cart", [0.5])
        np.testing.assert_allclose(_accelerations(found.q), given / 2.0, rtol=1e-6)


def test_derating_grows_with_what_the_drive_has_done(tmp_path: Path) -> None:
    subject = _cart(tmp_path)
    loss, torque = 0.05, 2.0
    found = replay(subject, recorded([torque], 10.0, [0.0]), THERMAL, "cart", [loss])
    at = 0.01 * np.arange(1, 999)
    heat = torque**2 * MEMORY * (1.0 - np.exp(-at / MEMORY))
    wanted = torque / (1.0 + loss * heat) / 2.0
    np.testing.assert_allclose(_accelerations(found.q), wanted, rtol=2e-3)
    assert wanted[-1] < 0.4 * wanted[0]


def test_a_drive_is_as_warm_as_the_torques_before_made_it(tmp_path: Path) -> None:
    subject = _cart(tmp_path)
    whole = recorded([2.0], 6.0, [0.0])
    first = replay(subject, whole, THERMAL, "cart", [0.05])
    later = replace(
        recorded([2.0], 1.0, [0.0]),
        command=Signal(whole.command.at - 4.0, whole.command.values),
    )
    second = replay(subject, later, THERMAL, "cart", [0.05])
    np.testing.assert_allclose(
        _accelerations(second.q), _accelerations(first.q)[400:498], rtol=5e-3
    )


def test_a_servo_is_as_warm_as_what_was_asked_of_it_to_move_as_it_did(tmp_path: Path) -> None:
    subject = _cart(tmp_path, joint='stiffness="5" damping="0.5"', kp=20.0)
    at = np.arange(0.0, 8.0, 0.01)
    wanted = Signal(at, 0.6 + 0.3 * np.sin(2.0 * at)[:, None])
    loss = 0.006

    def enter(row: Row) -> None:
        row.field("dof_armature")[0] += 0.5  # as a base that was fitted
        row.field("dof_damping")[0] += 2.0
        THERMAL.enter(row, "cart", np.array([loss]))

    whole = replace(recorded([0.6], 8.0, [0.0]), command=wanted)
    first = subject.nominal.run([(enter, whole)])[0].q
    begin = 600
    part = replace(
        recorded([0.6], 1.5, first[begin].tolist()),
        command=Signal(at - 6.0, wanted.values),
        logged_q=Signal(whole.joints_at - 6.0, first),
        initial_qd=(first[begin + 1] - first[begin - 1]) / 0.02,
    )
    second = subject.nominal.run([(enter, part)])[0].q
    loss = 0.0
    cold = subject.nominal.run([(enter, part)])[0].q
    expected = first[begin : begin + len(second)]
    apart = np.abs(cold - expected).max()
    assert apart > 0.02
    np.testing.assert_allclose(second, expected, atol=0.05 * apart)


def test_derating_needs_a_history(tmp_path: Path) -> None:
    subject = _cart(tmp_path)
    assert THERMAL.places(subject) == ("cart",)
    assert THERMAL.places(replace(subject, duration=1.0)) == ()


def test_a_heavier_link_weighs_more_on_the_joints_before_it(tmp_path: Path) -> None:
    subject = make_subject(make_plant(tmp_path))
    assert INERTIA.places(subject) == ("pan", "lift")  # the tool's link is the payload's
    held = recorded([0.0, 0.0, 0.0], 3.0)
    plain, heavy = replay(subject, held), replay(subject, held, INERTIA, "lift", [0.5])
    # 0.5 kg more at 0.2 m: 0.981 N m on a servo of 200 N m/rad, of which friction may hold 0.1
    assert (heavy.q - plain.q)[-1, 1] == pytest.approx(0.981 / 200.0, abs=0.1 / 200.0)
    assert (heavy.q - plain.q)[-1, 2] == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize("effect", [BIAS, COGGING, SATURATION, SPRING, THERMAL])
def test_drives_show_only_at_joints_that_move(tmp_path: Path, effect: Effect) -> None:
    subject = make_subject(make_plant(tmp_path))
    assert effect.places(subject) == ("pan", "lift", "elbow")
    assert effect.places(still(subject, "lift")) == ("lift",)
