"""An arm with a soft gear whose encoders sit beyond it, by MJCF of its own: the motor is a body.

Nothing says so in the data set, or ``encoders = "link"`` does.
"""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.identification.dataset.types import (
    Dataset,
    EncoderSide,
    Float64,
    ModelSource,
    Split,
    Trajectory,
)
from shared.identification.find import identify

_JOINTS = ("swing", "elbow")
_STEP, _PERIOD, _SECONDS = 2e-4, 0.004, 6.0
_COMPLIANCE = 2e-3
_LINKS = """<geom type="capsule" fromto="0 0 0 0.3 0 0" size="0.03" mass="1.5"/>
      <body pos="0.3 0 0">{elbow}
      <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.02" mass="0.8"/></body>"""
_MOTIONS: dict[str, tuple[Split, str, tuple[float, float]]] = {
    "slow": ("train", "", (2.0, 2.9)),
    "again": ("train", "slow", (2.0, 2.9)),
    "fast": ("train", "", (6.3, 8.1)),
    "held_out": ("test", "", (4.1, 3.2)),
}


def _file(numbers: Float64) -> str:
    """Return the arm as its file has it: stiff. Numbers are armature, damping, friction a joint."""
    joints = [
        f'<joint name="{name}" axis="0 0 1" armature="{own[0]}" damping="{own[1]}" '
        f'frictionloss="{own[2]}"/>'
        for name, own in zip(_JOINTS, numbers, strict=True)
    ]
    motors = "".join(f'<motor name="{name}" joint="{name}"/>' for name in _JOINTS)
    return f"""<mujoco><option timestep="0.001" gravity="0 0 0" integrator="implicitfast"/>
      <worldbody><body>{joints[0]}{_LINKS.format(elbow=joints[1])}</body></worldbody>
      <actuator>{motors}</actuator></mujoco>"""


def _arm(numbers: Float64) -> str:
    """Return the arm as it is: what turns the first joint is a wheel that a spring ties to it."""
    own, other = numbers
    elbow = (
        f'<joint name="elbow" axis="0 0 1" armature="{other[0]}" damping="{other[1]}" '
        f'frictionloss="{other[2]}"/>'
    )
    return f"""<mujoco><option timestep="{_STEP}" gravity="0 0 0" integrator="implicitfast">
      <flag contact="disable"/></option><worldbody>
      <body><joint name="motor" axis="0 0 1" damping="{own[1]}" frictionloss="{own[2]}"/>
      <inertial pos="0 0 0" mass="1" diaginertia="1 1 {own[0]}"/></body>
      <body><joint name="swing" axis="0 0 1"/>{_LINKS.format(elbow=elbow)}</body></worldbody>
      <tendon><fixed stiffness="{1.0 / _COMPLIANCE}" damping="0.6"><joint joint="motor" coef="1"/>
      <joint joint="swing" coef="-1"/></fixed></tendon>
      <actuator><motor name="swing" joint="motor"/><motor name="elbow" joint="elbow"/></actuator>
      </mujoco>"""


def _recording(name: str, xml: str, rng: np.random.Generator) -> Trajectory:
    split, repeats, speeds = _MOTIONS[name]
    at = _PERIOD * np.arange(round(_SECONDS / _PERIOD))
    swelling = np.minimum(at, 1.0)[:, None]
    command = swelling * [3.0, 0.8] * np.cos(at[:, None] * speeds)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    q = np.empty_like(command)
    for row, torque in enumerate(command):
        q[row] = data.joint("swing").qpos[0], data.joint("elbow").qpos[0]
        data.ctrl[:] = torque
        for _ in range(round(_PERIOD / _STEP)):
            mujoco.mj_step(model, data)
    q += 1e-4 * rng.standard_normal(q.shape)
    return Trajectory(name, split, repeats, q[0], np.zeros(2), at, command, at, q)


@pytest.mark.timeout(300)
@pytest.mark.parametrize("encoders", [None, "link"])
def test_a_soft_gear_before_the_encoder_is_named(tmp_path: Path, encoders: EncoderSide | None):
    rng = np.random.default_rng(1)
    numbers = np.array([[0.15, 0.4, 0.3], [0.03, 0.1, 0.08]])
    path = tmp_path / "arm.xml"
    path.write_text(_file(numbers))
    own = _arm(numbers * np.exp(rng.normal(0.0, 0.1, (2, 3))))
    made = tuple(_recording(name, own, rng) for name in _MOTIONS)
    source = ModelSource("mjcf", path, encoders=encoders)
    dataset = Dataset(tmp_path, source, "torque", _JOINTS, _JOINTS, made, (), "")
    verdict = identify(dataset, seed=1).verdict
    assert verdict.verdict == "named"
    (cause,) = verdict.causes
    assert (cause.effect, cause.where) == ("joint_elasticity", "swing")
    assert cause.value == pytest.approx(_COMPLIANCE, rel=0.03)
    is_told = any("beyond the gears" in each for each in verdict.caveats)
    assert is_told == (encoders is None)
