"""What a model.toml may add to the nominal arm, and that it acts as its numbers say."""

from pathlib import Path

import msgspec
import mujoco
import numpy as np
import pytest

from shared.sim.build import AGENTS, build_spec
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.parameters import (
    AxisGains,
    Extension,
    LinkMass,
    Measured,
    ModelParameters,
    ResidualSpring,
    TorqueBias,
    dump_parameters,
    load_parameters,
)

CFG = SimConfig()
NOMINAL = load_parameters("nominal")
AGENT = AGENTS[1]


def extended(*extensions: Extension) -> ModelParameters:
    return msgspec.structs.replace(NOMINAL, extensions=extensions)


def compiled(*extensions: Extension) -> mujoco.MjModel:
    return build_spec(CFG, extended(*extensions), (AGENT,)).compile()


def passive_torque(model: mujoco.MjModel, joint: str, q: float) -> float:
    """Return what springs put on a joint at an angle (N m)."""
    data = mujoco.MjData(model)
    found = model.joint(f"{AGENT}/{joint}")
    data.qpos[found.qposadr[0]] = q
    mujoco.mj_forward(model, data)
    return float(data.qfrc_passive[found.dofadr[0]])


def test_a_torque_bias_pushes_the_same_at_every_angle() -> None:
    model = compiled(TorqueBias(joint="elbow_flex", torque=1.5))
    torques = [passive_torque(model, "elbow_flex", q) for q in (-2.0, -1.0, -0.2)]
    assert torques == pytest.approx([1.5] * 3, rel=1e-6)


def test_a_spring_and_a_bias_at_one_joint_add_up() -> None:
    spring = ResidualSpring(joint="elbow_flex", stiffness=4.0, angle=-1.0)
    model = compiled(spring, TorqueBias(joint="elbow_flex", torque=0.5))
    assert passive_torque(model, "elbow_flex", -1.5) == pytest.approx(4.0 * 0.5 + 0.5)


def test_a_heavier_link_is_heavier_in_mass_and_inertia_alone() -> None:
    plain, heavy = compiled(), compiled(LinkMass(joint="wrist_roll", factor=1.4))
    body = plain.body(f"{AGENT}/wrist_roll").id
    assert heavy.body_mass[body] == pytest.approx(1.4 * plain.body_mass[body])
    assert heavy.body_inertia[body] == pytest.approx(1.4 * plain.body_inertia[body])
    assert heavy.body_ipos[body] == pytest.approx(plain.body_ipos[body])
    others = np.arange(plain.nbody) != body
    assert heavy.body_mass[others] == pytest.approx(plain.body_mass[others])


def test_gains_of_one_axis_leave_the_others_alone() -> None:
    model = compiled(AxisGains(axis="z", kp=500.0, kv=9.0))
    z, x = (model.actuator(f"{AGENT}/{axis}").id for axis in "zx")
    assert model.actuator_gainprm[z, 0] == 500.0
    assert model.actuator_biasprm[z, 2] == -9.0
    assert model.actuator_gainprm[x, 0] == NOMINAL.servo.translation.kp


def test_what_a_tracker_gets_wrong_leaves_the_physics_and_its_hash_alone() -> None:
    late = Measured(effect="tracker_latency", where="", values={"delay": 0.02})
    changed = msgspec.structs.replace(NOMINAL, measurement=(late,))
    assert FencingModel.of(CFG, changed).hash == FencingModel.of(CFG, NOMINAL).hash


def test_each_extension_changes_the_hash() -> None:
    one_of_each: tuple[Extension, ...] = (
        ResidualSpring(joint="elbow_flex", stiffness=4.0, angle=-1.0),
        TorqueBias(joint="elbow_flex", torque=0.5),
        LinkMass(joint="elbow_flex", factor=1.1),
        AxisGains(axis="orientation", kp=81.0, kv=1.2),
    )
    hashes = {FencingModel.of(CFG, extended(each)).hash for each in one_of_each}
    assert len(hashes | {FencingModel.of(CFG, NOMINAL).hash}) == 5


def test_every_extension_survives_being_written_and_read(tmp_path: Path) -> None:
    model = msgspec.structs.replace(
        extended(
            TorqueBias(joint="shoulder_lift", torque=-2.0),
            LinkMass(joint="wrist_roll", factor=1.2),
            AxisGains(axis="x", kp=700.0, kv=14.0),
        ),
        measurement=(
            Measured(effect="encoder_offset", where="elbow_flex", values={"angle": 0.01}),
        ),
    )
    path = tmp_path / "model.toml"
    path.write_text(dump_parameters(model))
    assert load_parameters(path) == model


@pytest.mark.parametrize(
    "extensions",
    [
        (TorqueBias(joint="elbow_flex", torque=1.0), TorqueBias(joint="elbow_flex", torque=2.0)),
        (AxisGains(axis="x", kp=1.0, kv=1.0), AxisGains(axis="x", kp=2.0, kv=1.0)),
    ],
)
def test_one_kind_twice_at_one_place_is_refused(extensions: tuple[Extension, ...]) -> None:
    with pytest.raises(ValueError, match="twice"):
        extended(*extensions)
