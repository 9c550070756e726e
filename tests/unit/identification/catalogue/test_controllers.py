"""Controllers that do more than a model file's servos: by hand arithmetic."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.command_filter import EFFECT as FILTER
from shared.identification.catalogue.command_filter import smoothed
from shared.identification.catalogue.dead_band import EFFECT as DEAD_BAND
from shared.identification.catalogue.integral_action import EFFECT as INTEGRAL
from shared.identification.catalogue.velocity_feedforward import EFFECT as FEEDFORWARD
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.plant import mjcf
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from tests.arms import make_plant, make_subject, recorded, replay, still

_RAIL = """<mujoco><compiler angle="radian"/><option timestep="0.002" gravity="0 0 0"/>
<worldbody><body><joint name="cart" type="slide" axis="0 0 1" {joint}/>
<inertial pos="0 0 0" mass="2" diaginertia="2 2 2"/></body></worldbody>
<actuator><position name="cart" joint="cart" kp="90" kv="45" gear="{gear}"/></actuator></mujoco>"""
"""2 kg behind a spring-damper."""
CONTROLLERS = [FILTER, INTEGRAL, FEEDFORWARD, DEAD_BAND]


def _cart(folder: Path, joint: str = "", gear: float = 1.0) -> Subject:
    path = folder / "cart.xml"
    path.write_text(_RAIL.format(joint=joint, gear=gear))
    return make_subject(mjcf(path, "position", ["cart"], ["cart"], ""))


def _ramp(at: Float64) -> Float64:
    return 0.3 * at[:, None]


def _entered(subject: Subject, effect: Effect, place: str, size: float, what: Recorded) -> Row:
    seen: list[Row] = []

    def enter(row: Row) -> None:
        effect.enter(row, place, np.array([size]))
        seen.append(row)

    Rollouts(subject.plant, (), 1).run([(enter, what)])
    return seen[0]


def test_an_integral_takes_up_what_a_spring_pulls(tmp_path: Path) -> None:
    subject = _cart(tmp_path, 'stiffness="10"')
    # 90 (0.5 - 0.45) = 10 * 0.45: at rest, and nothing is wound up.
    found = replay(subject, recorded([0.5], 8.0, [0.45]), INTEGRAL, "cart", [2.0])
    at: Float64 = np.arange(0.0, 8.0, 0.01)
    left = 0.05 * np.exp(-2.0 * at * 90.0 / (90.0 + 10.0))
    # It is late by the time that the servo itself takes, 45 / 100 s.
    np.testing.assert_allclose(found.q[300:, 0], (0.5 - left)[300:], atol=2e-3)
    assert found.q[-1, 0] == pytest.approx(0.5, abs=1e-4)


def test_what_is_wound_up_at_the_start_is_what_holds_the_arm_there(tmp_path: Path) -> None:
    subject = _cart(tmp_path, 'stiffness="10"')
    found = replay(subject, recorded([0.5], 3.0, [0.5]), INTEGRAL, "cart", [2.0])
    np.testing.assert_allclose(found.q[:, 0], 0.5, atol=1e-6)


def test_an_integral_of_next_to_nothing_has_wound_up_next_to_nothing(tmp_path: Path) -> None:
    subject = _cart(tmp_path, 'stiffness="10"')
    held = recorded([0.5], 3.0, [0.5])
    plain = replay(subject, held).q
    found = replay(subject, held, INTEGRAL, "cart", [1e-4]).q
    assert np.abs(plain[-1] - 0.5) > 0.02
    np.testing.assert_allclose(found, plain, atol=2e-4)


def test_an_integral_counts_its_error_behind_a_gear(tmp_path: Path) -> None:
    subject = _cart(tmp_path, 'stiffness="10"', gear=2.0)
    # 4 * 90 (0.5 - q) = 10 q
    start = 360.0 * 0.5 / 370.0
    found = replay(subject, recorded([1.0], 6.0, [start]), INTEGRAL, "cart", [1.0])
    assert found.q[-1, 0] == pytest.approx(
        0.5 - (0.5 - start) * np.exp(-5.94 * 360 / 370), abs=2e-4
    )


@pytest.mark.parametrize("gear", [1.0, 2.0])
def test_beyond_a_dead_band_a_servo_begins_from_its_edge(tmp_path: Path, gear: float) -> None:
    subject = _cart(tmp_path, 'stiffness="10"', gear=gear)
    stiffness = 90.0 * gear**2
    held = recorded([0.5 * gear], 6.0, [0.3])
    found = replay(subject, held, DEAD_BAND, "cart", [0.02])
    # stiffness (0.5 - 0.02 - q) = 10 q
    assert found.q[-1, 0] == pytest.approx(stiffness * 0.48 / (stiffness + 10.0), abs=1e-5)


def test_within_a_dead_band_a_joint_stays_where_it_is(tmp_path: Path) -> None:
    subject = _cart(tmp_path)
    found = replay(subject, recorded([0.5], 2.0, [0.49]), DEAD_BAND, "cart", [0.02])
    np.testing.assert_allclose(found.q[:, 0], 0.49, atol=2e-6)
    assert subject.control == "position"
    assert [each.unit for each in DEAD_BAND.quantities(subject, "cart")] == ["m"]


def test_a_dead_band_that_is_less_at_one_joint_is_taken_off_that_of_all(tmp_path: Path) -> None:
    subject = make_subject(make_plant(tmp_path))
    sagging = recorded([0.0, 0.0, 0.0], 2.0, [0.0, 0.02, 0.0])

    def without_lift(row: Row) -> None:
        DEAD_BAND.enter(row, "", np.array([0.01]))
        DEAD_BAND.enter(row, "lift", np.array([-0.01]))

    def apart(row: Row) -> None:
        for place in ("pan", "elbow"):
            DEAD_BAND.enter(row, place, np.array([0.01]))

    def taken_back(row: Row) -> None:
        DEAD_BAND.enter(row, "elbow", np.array([0.01]))
        DEAD_BAND.enter(row, "elbow", np.array([-0.01]))

    one, other, none = Rollouts(subject.plant, (), 3).run(
        [(without_lift, sagging), (apart, sagging), (taken_back, sagging)]
    )
    np.testing.assert_allclose(one.q, other.q, atol=1e-12)
    np.testing.assert_array_equal(none.q, replay(subject, sagging).q)
    assert np.abs(one.q - none.q).max() > 1e-3


def test_an_integral_of_one_joint_adds_to_that_of_all(tmp_path: Path) -> None:
    subject = make_subject(make_plant(tmp_path))
    sagging = recorded([0.0, 0.0, 0.0], 2.0, [0.0, 0.02, 0.0])

    def apart(row: Row) -> None:
        INTEGRAL.enter(row, "", np.array([2.0]))
        INTEGRAL.enter(row, "lift", np.array([3.0]))

    def together(row: Row) -> None:
        for place, rate in (("pan", 2.0), ("lift", 5.0), ("elbow", 2.0)):
            INTEGRAL.enter(row, place, np.array([rate]))

    def taken_back(row: Row) -> None:
        INTEGRAL.enter(row, "", np.array([2.0]))
        INTEGRAL.enter(row, "", np.array([-2.0]))

    one, other, none = Rollouts(subject.plant, (), 3).run(
        [(apart, sagging), (together, sagging), (taken_back, sagging)]
    )
    np.testing.assert_allclose(one.q, other.q, atol=1e-12)
    np.testing.assert_array_equal(none.q, replay(subject, sagging).q)
    assert np.abs(one.q - none.q).max() > 1e-3


def test_fed_forward_a_servo_follows_a_ramp_without_lag(tmp_path: Path) -> None:
    subject = _cart(tmp_path, 'damping="9"')
    ramp = recorded(_ramp, 4.0, [0.0])
    late = replay(subject, ramp)
    led = replay(subject, ramp, FEEDFORWARD, "cart", [1.0])
    at = np.arange(0.0, 4.0, 0.01)
    held = 0.3 * 0.005  # a command is half its period old, on average
    # Behind a ramp by (45 + 9) / 90 of its speed.
    assert 0.3 * at[380] - late.q[380, 0] == pytest.approx(0.3 * 0.6 + held, abs=1e-3)
    assert 0.3 * at[380] - led.q[380, 0] == pytest.approx(held, abs=1e-3)


def test_a_share_that_is_less_at_one_joint_is_taken_off_that_of_all(tmp_path: Path) -> None:
    subject = make_subject(make_plant(tmp_path))

    def moving(at: Float64) -> Float64:
        return np.stack([0.8 * at, 0.4 * at, 0.2 * at], axis=1)

    row = _entered(subject, FEEDFORWARD, "", 1.0, recorded(moving))
    added = row.command.values[50] - moving(np.array([0.5]))[0]
    # (10 + 0.5) / 200 and (10 + 0.2) / 200 of the speed
    np.testing.assert_allclose(added, [0.8 * 0.0525, 0.4 * 0.0525, 0.2 * 0.051])
    FEEDFORWARD.enter(row, "lift", np.array([-1.0]))
    added = row.command.values[50] - moving(np.array([0.5]))[0]
    np.testing.assert_allclose(added, [0.8 * 0.0525, 0.0, 0.2 * 0.051], atol=1e-12)


def test_a_filter_comes_closer_by_the_same_share_each_time() -> None:
    at: Float64 = np.arange(0.0, 1.0, 0.01)
    step = Signal(at, np.where(at < 0.195, 0.0, 1.0)[:, None])
    found = smoothed(step, 0.1, 0.002, 1.0)
    middles = found.at[200:300] + 0.001
    np.testing.assert_allclose(
        found.values[200:300, 0], 1.0 - np.exp(-(middles - 0.2) / 0.1), atol=1e-4
    )
    assert not found.values[found.at < 0.199].any()


def test_a_filter_of_no_time_is_none() -> None:
    at: Float64 = np.arange(0.0, 1.0, 0.01)
    command = Signal(at, np.sin(5.0 * at)[:, None])
    found = smoothed(command, 1e-5, 0.002, 0.99)
    middles = found.at[:-1]
    np.testing.assert_allclose(found.values[:-1], command.held(middles), atol=1e-3)


@pytest.mark.parametrize("effect", CONTROLLERS, ids=lambda each: each.name)
def test_controllers_are_where_positions_are_told(tmp_path: Path, effect: Effect) -> None:
    servos = make_subject(make_plant(tmp_path))
    motors = make_subject(make_plant(tmp_path, "torque"))
    assert "" in effect.places(servos)
    assert effect.places(motors) == ()


@pytest.mark.parametrize("effect", [INTEGRAL, FEEDFORWARD, DEAD_BAND], ids=lambda each: each.name)
def test_of_one_joint_that_moves_all_of_them_are_not_told_apart(
    tmp_path: Path, effect: Effect
) -> None:
    subject = still(make_subject(make_plant(tmp_path)), "lift")
    assert effect.places(subject) == ("lift",)
