from pathlib import Path

import msgspec
import pytest

from shared.errors import ConfigError
from shared.sim.config import SimConfig
from shared.sim.parameters import (
    JOINT_NAMES,
    ResidualSpring,
    dump_parameters,
    load_parameters,
)

NOMINAL = dump_parameters(load_parameters("nominal"))


def test_the_shipped_model_survives_being_written_and_read(tmp_path: Path):
    nominal = load_parameters("nominal")
    spring = ResidualSpring(joint="shoulder_lift", stiffness=2.0, angle=0.3)
    changed = msgspec.structs.replace(nominal, name="fitted", extensions=(spring,))
    path = tmp_path / "model.toml"
    path.write_text(dump_parameters(changed))
    assert load_parameters(path) == changed


def test_every_joint_of_the_shipped_model_has_rotor_inertia_and_a_torque_limit():
    joints = load_parameters("nominal").joints
    assert all(joints[name].armature > 0 and joints[name].torque_limit > 0 for name in JOINT_NAMES)


@pytest.mark.parametrize(
    ("old", "new", "field", "reason"),
    [
        ("torque_limit = 11.88", "torque_limit = -1.0", "joints.shoulder_pan", "torque_limit must"),
        ("torque_limit = 11.88", "torque_limit = nan", "joints.shoulder_pan", "got nan"),
        ("armature = 0.05504", 'armature = "heavy"', "joints.shoulder_pan.armature", "str"),
        ("kp = 800.0", "kq = 800.0", "servo.translation", "kq"),
        ("kp = 800.0", "", "servo.translation", "kp"),
        ("filter = 1.0", "filter = 0.0", "command", "filter must be between"),
        ("delay = 0.0", "delay = 9.0", "command", "delay must be between"),
        ("[joints.elbow_flex]", "[joints.elbow_flux]", "joints", "elbow_flux"),
        ("schema = 1", "schema = 2", "", "schema must be 1, got 2"),
        ("schema = 1", "schema = = 1", "", "is not TOML"),
    ],
)
def test_a_bad_model_is_refused_in_one_line_that_names_the_field(
    tmp_path: Path, old: str, new: str, field: str, reason: str
):
    path = tmp_path / "model.toml"
    assert old in NOMINAL
    path.write_text(NOMINAL.replace(old, new, 1))
    with pytest.raises(ConfigError) as caught:
        load_parameters(path)
    line = str(caught.value)
    assert str(path) in line
    assert field in line
    assert reason in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("extension", "reason"),
    [
        ('type = "magnet"\njoint = "elbow_flex"', "magnet"),
        ('type = "residual_spring"\njoint = "knee"\nstiffness = 1.0\nangle = 0.0', "knee"),
        ('type = "residual_spring"\njoint = "elbow_flex"\nstiffness = -1.0\nangle = 0.0', "stiff"),
    ],
)
def test_an_unknown_extension_is_refused(tmp_path: Path, extension: str, reason: str):
    path = tmp_path / "model.toml"
    path.write_text(f"{NOMINAL}\n[[extensions]]\n{extension}\n".replace("extensions = []\n", ""))
    with pytest.raises(ConfigError, match=rf"extensions.*{reason}|{reason}.*extensions"):
        load_parameters(path)


def test_one_kind_of_extension_twice_on_a_joint_is_refused(tmp_path: Path):
    spring = (
        '[[extensions]]\ntype = "residual_spring"\njoint = "elbow_flex"\n'
        "stiffness = 1.0\nangle = 0.0\n"
    )
    path = tmp_path / "model.toml"
    path.write_text(NOMINAL.replace("extensions = []\n", "") + 2 * spring)
    with pytest.raises(ConfigError, match="twice"):
        load_parameters(path)


def test_a_model_that_does_not_exist_is_named():
    with pytest.raises(ConfigError, match='no model called "nominel"'):
        load_parameters("nominel")
    with pytest.raises(ConfigError, match=r"cannot read the model missing/model\.toml"):
        load_parameters("missing/model.toml")


def test_the_control_step_must_be_a_multiple_of_the_physics_step():
    assert SimConfig(physics_timestep=0.002).substeps == 5
    with pytest.raises(ValueError, match=r"control_timestep \(0.01 s\) must be a whole multiple"):
        SimConfig(physics_timestep=0.003)
