"""Someone pushed the hand of an arm under torque control, in a recording that is fitted to.

No push at one joint is one at the hand, and an arm that nothing holds is led far astray by it: a
base that is fitted to that has links bent until nothing else can be seen.
"""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.identification.dataset.types import Dataset, Float64, ModelSource, Split, Trajectory
from shared.identification.find import identify

pytestmark = pytest.mark.timeout(600)

_JOINTS = ("hip", "knee")
_STEP, _PERIOD, _SECONDS = 2.5e-4, 0.004, 10.0
_PUSH = (3.0, 4.0)
"""(s)."""
_FORCE = (-8.0, 0.0, 1.0)
"""At the hand (N)."""
_MOTIONS: dict[str, tuple[Split, str, tuple[float, float]]] = {
    "sines": ("train", "", (1.9, 2.7)),
    "slow": ("train", "", (0.6, 0.9)),
    "slow_again": ("train", "slow", (0.6, 0.9)),
    "fast": ("train", "", (3.1, 4.3)),
    "held_out": ("test", "", (1.3, 2.2)),
}


def _mjcf(friction: Float64, damping: Float64, step: float) -> str:
    joints = [
        f'<joint name="{name}" axis="0 1 0" armature="0.03" damping="{damping[index]}" '
        f'frictionloss="{friction[index]}"/>'
        for index, name in enumerate(_JOINTS)
    ]
    motors = "".join(f'<motor name="{name}" joint="{name}"/>' for name in _JOINTS)
    return f"""<mujoco><compiler angle="radian"/>
      <option timestep="{step}" integrator="implicitfast"/>
      <worldbody><body>{joints[0]}
      <geom type="capsule" fromto="0 0 0 0 0 -0.35" size="0.03" mass="1.6"/>
      <body pos="0 0 -0.35">{joints[1]}
      <geom type="capsule" fromto="0 0 0 0 0 -0.3" size="0.025" mass="1.0"/>
      <site name="hand" pos="0 0 -0.3"/>
      </body></body></worldbody><actuator>{motors}</actuator></mujoco>"""


def _recording(name: str, xml: str, rng: np.random.Generator) -> Trajectory:
    """Return torques of a PD controller and what encoders log, every 4 ms."""
    split, repeats, speeds = _MOTIONS[name]
    at = _PERIOD * np.arange(round(_SECONDS / _PERIOD))
    wanted = np.sin(at[:, None] * speeds) * [0.7, 0.9]
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    hand = model.body(model.site("hand").bodyid[0]).id
    q, torques = np.empty_like(wanted), np.empty_like(wanted)
    for row, target in enumerate(wanted):
        q[row] = data.qpos
        torques[row] = data.ctrl[:] = [60.0, 35.0] * (target - data.qpos) - [4.0, 2.0] * data.qvel
        is_pushed = name == "sines" and _PUSH[0] <= at[row] < _PUSH[1]
        data.qfrc_applied[:] = 0.0
        for _ in range(round(_PERIOD / _STEP)):
            if is_pushed:
                data.qfrc_applied[:] = 0.0
                mujoco.mj_applyFT(
                    model, data, np.array(_FORCE), np.zeros(3), data.site("hand").xpos, hand,
                    data.qfrc_applied,
                )  # fmt: skip
            mujoco.mj_step(model, data)
    q += 2e-4 * rng.standard_normal(q.shape)
    return Trajectory(name, split, repeats, q[0], np.zeros(2), at, torques, at, q)


def _recorded(folder: Path) -> Dataset:
    rng = np.random.default_rng(3)
    friction, damping = np.array([0.2, 0.14]), np.array([0.12, 0.08])
    path = folder / "arm.xml"
    path.write_text(_mjcf(friction, damping, 0.002))
    own = _mjcf(friction * [0.88, 1.1], damping * [1.15, 0.9], _STEP)
    made = tuple(_recording(name, own, rng) for name in _MOTIONS)
    return Dataset(folder, ModelSource("mjcf", path), "torque", _JOINTS, _JOINTS, made, (), "")


@pytest.mark.slow
def test_a_push_at_the_hand_is_located_and_bends_nothing(tmp_path: Path):
    verdict = identify(_recorded(tmp_path)).verdict
    assert not verdict.causes, verdict.sentence
    assert verdict.held_out.base_fit < 1.3, verdict.sentence
    pushes = [each for each in verdict.unexplained if each.is_external]
    assert {each.where for each in pushes} == set(_JOINTS)
    for each in pushes:
        assert each.trajectory == "sines"
        assert (each.begin, each.end) == pytest.approx(_PUSH, abs=0.1)
    sizes = {each.name: each for each in verdict.base}
    assert sizes["friction_loss hip"].base_fit == pytest.approx(0.88 * 0.2, rel=0.1)
