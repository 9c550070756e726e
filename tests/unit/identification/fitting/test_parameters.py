"""The base's coordinates: what they stand for, and that they leave no trace."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.joint_elasticity import EFFECT as ELASTICITY
from shared.identification.fitting.parameters import (
    base_parameters,
    bends,
    enter_base,
    loose_parameters,
)
from shared.sim.hidden.arms import ARMS
from shared.sim.plant.plant import mjcf
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from tests.arms import JOINTS, make_plant, make_subject, recorded, write_arm

_COMMAND = (0.5, 0.3, -0.5)


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm")))


def test_every_joint_has_numbers_of_its_own(subject: Subject):
    names = [each.name for each in base_parameters(subject)]
    words = ("damping", "armature", "friction_loss", "kp", "kv", "mass")
    assert sorted(names) == sorted(f"{word} {joint}" for word in words for joint in JOINTS)


def test_nought_is_nominal_and_one_a_factor_e_or_the_scale(subject: Subject):
    for each in base_parameters(subject):
        assert each.value(0.0) == each.nominal
        assert each.low <= 0.0 <= each.high
        expected = np.e * each.nominal if each.is_factor else each.nominal + each.scale
        assert each.value(1.0) == pytest.approx(expected)
        assert each.value(each.low) >= 0.0


def test_links_bend_by_standard_deviations_and_nothing_else_does(subject: Subject):
    parameters = base_parameters(subject)
    x = np.full(len(parameters) + 2, 0.25)  # two of causes, after those of the base
    found = dict(zip([each.name for each in parameters], bends(parameters, x), strict=True))
    assert {name for name, bend in found.items() if bend} == {f"mass {joint}" for joint in JOINTS}
    assert found["mass elbow"] == pytest.approx(2.5)


def test_frictions_bounds_are_none_at_all_and_far_more_than_the_file_says(subject: Subject):
    found = [each for each in base_parameters(subject) if each.name.startswith("friction_loss")]
    assert [each.value(each.low) for each in found] == [0.0, 0.0, 0.0]
    assert all(each.value(each.high) > 20.0 * each.nominal for each in found)
    assert [each.nominal for each in found] == pytest.approx([0.1, 0.1, 0.05])


def test_values_go_where_they_belong(subject: Subject):
    parameters = base_parameters(subject)
    x = np.full(len(parameters), 0.1)
    row = subject.nominal.entered(lambda row: enter_base(parameters, x, row), recorded(_COMMAND))
    model, factor = subject.nominal.model, np.exp(0.1)
    assert row.field("dof_damping") == pytest.approx(factor * model.dof_damping)
    assert row.field("dof_frictionloss") == pytest.approx(1.1 * model.dof_frictionloss)
    assert row.field("actuator_gainprm")[:, 0] == pytest.approx([200.0 * factor] * 3)
    assert row.field("actuator_biasprm")[:, 1] == pytest.approx([-200.0 * factor] * 3)
    assert row.field("actuator_biasprm")[:, 2] == pytest.approx([-10.0 * factor] * 3)
    fore = model.body("fore").id
    assert row.field("body_mass")[fore] == pytest.approx(0.5 * factor)
    assert row.field("body_inertia")[fore] == pytest.approx(factor * model.body_inertia[fore])


def test_values_go_to_their_joint_also_behind_one_that_an_effect_added(subject: Subject):
    bends = Rollouts(subject.plant, ELASTICITY.structure(subject, "pan"), 1)
    damping = next(each for each in base_parameters(subject) if each.name == "damping elbow")
    row = bends.entered(
        lambda row: enter_base((damping,), np.ones(1), row), recorded(_COMMAND, 0.1)
    )
    dofs = {name: int(bends.model.joint(name).dofadr[0]) for name in (*JOINTS, "pan/series")}
    assert dofs["elbow"] == 3  # 2 in the arm as it is
    changed = row.fields["dof_damping"] != bends.model.dof_damping
    assert changed.nonzero()[0].tolist() == [dofs["elbow"]]


def test_a_base_that_was_entered_leaves_no_trace(subject: Subject):
    parameters = base_parameters(subject)
    x = np.full(len(parameters), 0.3)

    def enter(row: Row) -> None:
        enter_base(parameters, x, row)

    def leave(row: Row) -> None:
        enter_base(parameters, np.zeros(len(parameters)), row)

    one = recorded(_COMMAND, seconds=0.5)
    before, changed, after, again = (
        subject.nominal.run([(entry, one)])[0].q for entry in (leave, enter, leave, enter)
    )
    assert np.array_equal(before, after)
    assert np.array_equal(changed, again)
    assert np.abs(changed - before).max() > 1e-3


def test_a_link_of_two_joints_has_one_mass(tmp_path: Path):
    path = write_arm(tmp_path)
    one_body = path.read_text().replace('<body name="upper" >', "").replace(
        '<inertial pos="0.2 0 0" mass="1.0" diaginertia="0.002 0.015 0.015"/>', ""
    )  # fmt: skip
    path.write_text(one_body.replace("</body>", "", 1))
    subject = make_subject(mjcf(path, "position", JOINTS, JOINTS, "tool"))
    names = [each.name for each in base_parameters(subject)]
    assert [name for name in names if name.startswith("mass")] == ["mass pan", "mass elbow"]


def test_gains_are_called_after_the_joint_they_drive(tmp_path: Path):
    path = write_arm(tmp_path)
    turned = mjcf(path, "position", JOINTS, JOINTS[::-1], "tool")
    subject = make_subject(turned)
    model = subject.nominal.model
    kp = next(each for each in base_parameters(subject) if each.name == "kp elbow")
    row = subject.nominal.entered(lambda row: kp.change(row, 50.0), recorded(_COMMAND))
    gains = row.field("actuator_gainprm")[:, 0]
    assert gains[model.actuator("elbow").id] == 50.0
    assert sorted(gains) == [50.0, 200.0, 200.0]


def test_friction_that_a_model_lacks_is_no_parameter(tmp_path: Path):
    path = write_arm(tmp_path)
    path.write_text(path.read_text().replace('frictionloss="0.1"', ""))
    subject = make_subject(mjcf(path, "position", JOINTS, JOINTS, "tool"))
    names = [each.name for each in base_parameters(subject)]
    assert [name for name in names if "friction" in name] == ["friction_loss elbow"]


def test_of_an_arm_driven_by_torques_the_links_centres_of_mass_are_free_but_known():
    subject = make_subject(ARMS["torque2"].make())
    found = {each.name: each for each in base_parameters(subject) if "centre" in each.name}
    # both hinges turn about y, along which nothing is felt
    assert list(found) == [f"centre_{axis} {joint}" for joint in subject.joints for axis in "xz"]
    elbow = found["centre_z elbow"]
    assert elbow.value(0.0) == pytest.approx(-0.13)
    assert elbow.value(elbow.prior) == pytest.approx(-0.125)
    row = subject.nominal.entered(lambda row: elbow.change(row, -0.2), recorded(_COMMAND[:2], 0.1))
    assert row.field("body_ipos")[row.body_of("elbow")].tolist() == [0.0, 0.0, -0.2]


def test_a_rail_does_not_feel_where_its_carriage_is_heavy(tmp_path: Path):
    arm = ARMS["torque2"]
    assert arm.file is not None
    path = tmp_path / "rail.xml"
    path.write_text(arm.file.read_text().replace('axis="0 1 0"', 'type="slide" axis="1 0 0"'))
    subject = make_subject(mjcf(path, "torque", arm.joints, arm.joints, arm.tracked))
    assert not [each for each in base_parameters(subject) if "centre" in each.name]


def test_what_else_is_known_of_links_is_how_they_turn_and_where_they_weigh(subject: Subject):
    fitted = base_parameters(subject)
    loose = loose_parameters(subject, fitted)
    assert not {each.name for each in loose} & {each.name for each in fitted}
    assert {f"inertia {joint}" for joint in JOINTS} <= {each.name for each in loose}
    x = np.where([each.name == "inertia elbow" for each in loose], 0.1, 0.0)
    row = subject.nominal.entered(lambda row: enter_base(loose, x, row), recorded(_COMMAND))
    model = subject.nominal.model
    fore = model.body("fore").id
    assert row.field("body_inertia")[fore] == pytest.approx(np.exp(0.1) * model.body_inertia[fore])
    assert "body_mass" not in row.fields
    assert any(each.name.startswith("centre_") for each in loose)


_STAND_INS = """<mujoco><compiler angle="radian"/><option gravity="0 0 0"/>
<worldbody><body><joint name="turn" axis="0 0 1" armature="0.001" frictionloss="0.01"/>
<inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/></body></worldbody>
<actuator><motor name="turn" joint="turn"/></actuator></mujoco>"""


def test_stand_ins_for_rotor_and_friction_may_be_far_from_what_the_drive_gives(tmp_path: Path):
    path = tmp_path / "turntable.xml"
    path.write_text(_STAND_INS)
    subject = make_subject(mjcf(path, "torque", ["turn"], ["turn"], ""))
    found = {each.name: each for each in base_parameters(subject)}
    # 5 N m at 4 rad/s^2
    assert found["armature turn"].value(found["armature turn"].high) == pytest.approx(1.25)
    friction = found["friction_loss turn"]
    assert friction.scale == pytest.approx(0.05)
    assert friction.value(friction.low) == pytest.approx(0.0)
    assert friction.value(friction.high) >= 5.0 - 0.01
