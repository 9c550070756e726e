from pathlib import Path

import numpy as np
import pytest

from shared.sim.plant.plant import Plant, mjcf, pr2
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.structure import Builder, Edit, Structure, series_name
from tests.arms import make_plant, recorded


def series(label: str) -> Structure:
    return (Edit(f"series {label}", lambda builder: builder.series_joint(label)),)


def base() -> Structure:
    def change(builder: Builder) -> None:
        builder.base_joint((1.0, 0.0, 0.0), "base/roll")
        builder.base_joint((0.0, 1.0, 0.0), "base/pitch")

    return (Edit("base", change),)


def swing(at: np.ndarray) -> np.ndarray:
    return np.stack([0.3 * np.sin(4 * at), 0.2 * np.sin(5 * at), 0.3 * np.sin(7 * at)], axis=1)


@pytest.mark.parametrize("structure", [series("elbow"), series("pan"), base()])
def test_added_joints_change_nothing_until_an_effect_sets_them(
    tmp_path: Path, structure: Structure
):
    plant = make_plant(tmp_path)
    plain = Rollouts(plant, (), 1).run([(lambda row: None, recorded(swing))])[0]
    found = Rollouts(plant, structure, 1).run([(lambda row: None, recorded(swing))])[0]
    np.testing.assert_allclose(found.q, plain.q, atol=2e-6)
    np.testing.assert_allclose(found.tracker, plain.tracker, atol=2e-6)


@pytest.mark.parametrize("compliance", [1e-9, 1e-7, 1e-6, 1e-5, 1e-4])
def test_a_spring_is_stable_at_any_stiffness_and_gives_in_proportion(
    tmp_path: Path, compliance: float
):
    plant = make_plant(tmp_path)
    still = recorded([0.0, 0.0, 0.0], seconds=2.0)

    def enter(row: Row) -> None:
        row.spring(series_name(plant, "elbow"), compliance, ringing=0.02)

    found = Rollouts(plant, series("elbow"), 1).run([(enter, still)])[0]
    assert found.tracker is not None
    pitch = 2.0 * np.arcsin(found.tracker[-1, 5])
    given = pitch - found.q[-1, 1] - found.q[-1, 2]  # what the encoders do not see
    assert given == pytest.approx(0.736 * compliance, rel=0.01, abs=1e-10)


def test_what_the_arm_stands_on_turns_before_the_arm_does(tmp_path: Path):
    rooted = tmp_path / "rooted.xml"  # its first body below the world has a joint
    rooted.write_text(
        """<mujoco><compiler angle="radian"/><worldbody><body name="link" pos="0 0 1">
        <joint name="pan" axis="0 0 1" range="-1 1.5" damping="0.3" armature="0.1"
               frictionloss="0.2" actuatorfrcrange="-3 3" stiffness="2" springref="0.4"/>
        <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/>
        </body></worldbody><actuator><motor name="motor" joint="pan"/></actuator></mujoco>"""
    )
    plant = mjcf(rooted, "torque", ["pan"], ["motor"], "")
    plain, changed = Rollouts(plant, (), 1).model, Rollouts(plant, base(), 1).model
    assert [changed.joint(index).name for index in range(3)] == ["base/pitch", "base/roll", "pan"]
    np.testing.assert_array_equal(changed.jnt_axis, [[0, 1, 0], [1, 0, 0], [0, 0, 1]])
    for field in ("jnt_range", "jnt_stiffness", "qpos_spring", "dof_damping", "dof_armature",
                  "dof_frictionloss", "jnt_actfrcrange"):  # fmt: skip
        assert getattr(changed, field)[2] == pytest.approx(getattr(plain, field)[0])


def test_a_tracker_stays_where_it_was_when_the_base_turns():
    plant: Plant = pr2("right", None)
    model = Rollouts(plant, base(), 1).model
    plain = Rollouts(plant, (), 1).model
    site = model.site("protagonist/torso/fixed")
    assert site.bodyid == 0
    np.testing.assert_allclose(site.pos, plain.body("protagonist/torso").pos)
    assert set(model.sensor_refid) == {site.id}
