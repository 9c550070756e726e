"""An arm simulated by MuJoCo as its file says, dry friction and all, with other numbers in it.

Friction of MuJoCo's default impedance lets what it holds creep by mrad/s, and its step is half of
itself ahead of the command: if the base cannot, that is what a cause is named for.
"""

from pathlib import Path

import mujoco
import numpy as np
import pytest

from shared.identification.conclusion.model_file import model_file
from shared.identification.dataset.types import Dataset, Float64, ModelSource, Split, Trajectory
from shared.identification.find import identify

_JOINTS = ("lift", "elbow")
_FINE, _FILE, _PERIOD, _SECONDS = 5e-5, 0.002, 0.01, 6.0
_MOTIONS: dict[str, tuple[Split, str, tuple[float, float]]] = {
    "slow": ("train", "", (0.5, 0.7)),
    "again": ("train", "slow", (0.5, 0.7)),
    "fast": ("train", "", (3.0, 4.3)),
    "held_out": ("test", "", (1.3, 2.1)),
}


def _mjcf(friction: Float64, damping: Float64, gains: Float64, step: float) -> str:
    joints = [
        f'<joint name="{name}" axis="0 1 0" armature="0.02" damping="{damping[index]}" '
        f'frictionloss="{friction[index]}"/>'
        for index, name in enumerate(_JOINTS)
    ]
    servos = "".join(
        f'<position name="{name}" joint="{name}" kp="{gains[index]}" kv="1.5"/>'
        for index, name in enumerate(_JOINTS)
    )
    return f"""<mujoco><compiler angle="radian"/>
      <option timestep="{step}" integrator="implicitfast"/>
      <worldbody><body>{joints[0]}
      <geom type="capsule" fromto="0 0 0 0 0 0.25" size="0.03" mass="0.6"/>
      <body pos="0 0 0.25">{joints[1]}
      <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.025" mass="0.4"/>
      </body></body></worldbody><actuator>{servos}</actuator></mujoco>"""


def _recording(name: str, xml: str, noise: float, rng: np.random.Generator) -> Trajectory:
    """Return what encoders log at 100 Hz of an arm that stops for a while now and then."""
    split, repeats, speeds = _MOTIONS[name]
    at = _PERIOD * np.arange(round(_SECONDS / _PERIOD))
    moving = np.maximum(np.sin(0.4 * np.pi * at), 0.0)[:, None]
    command = [-0.3, 0.5] + moving * [0.6, 0.8] * np.sin(at[:, None] * speeds)
    model = mujoco.MjModel.from_xml_string(xml)
    data = mujoco.MjData(model)
    data.qpos[:] = data.ctrl[:] = command[0]
    step = model.opt.timestep
    mujoco.mj_step(model, data, round(1.0 / step))
    q = np.empty_like(command)
    for row, target in enumerate(command):
        q[row], data.ctrl[:] = data.qpos, target
        mujoco.mj_step(model, data, round(_PERIOD / step))
    q += noise * rng.standard_normal(q.shape)
    return Trajectory(name, split, repeats, q[0], np.zeros(2), at, command, at, q)


def _recorded(
    folder: Path, seed: int, step: float, noise: float, friction: Float64, own_step: float = _FINE
) -> Dataset:
    """Return recordings of an arm of which the numbers are not quite its file's."""
    rng = np.random.default_rng(seed)
    damping, gains = np.array([0.3, 0.15]), np.array([40.0, 20.0])
    spread = np.exp(rng.normal(0.0, 0.15, (3, 2)))
    path = folder / "arm.xml"
    path.write_text(_mjcf(friction, damping, gains, step))
    own = _mjcf(friction * spread[0], damping * spread[1], gains * spread[2], own_step)
    made = tuple(_recording(name, own, noise, rng) for name in _MOTIONS)
    source = ModelSource("mjcf", path)
    return Dataset(folder, source, "position", _JOINTS, _JOINTS, made, (), "")


@pytest.mark.slow
@pytest.mark.timeout(300)
@pytest.mark.parametrize("seed", [1, 2])
def test_an_arm_that_is_as_its_file_says_has_no_cause(tmp_path: Path, seed: int):
    dataset = _recorded(tmp_path, seed, _FILE, 1e-4, np.array([0.15, 0.08]))
    verdict = identify(dataset, seed=seed).verdict
    assert verdict.verdict == "none"
    assert verdict.timestep == _FILE
    assert verdict.held_out.base_fit < 1.1
    creep = next(each for each in verdict.base if each.name == "friction_creep")
    assert creep.base_fit == pytest.approx(1.0 / 9.0, rel=0.2)
    file = mujoco.MjModel.from_xml_string(model_file(dataset, verdict).text)
    assert file.dof_solimp[:, 0] == pytest.approx([0.9, 0.9], abs=0.02)


@pytest.mark.timeout(300)
def test_an_arm_stepped_as_the_file_says_is_ahead_of_its_commands(tmp_path: Path):
    dataset = _recorded(tmp_path, 3, _FILE, 1e-4, np.array([0.15, 0.08]), own_step=_FILE)
    verdict = identify(dataset, seed=3).verdict
    assert verdict.verdict == "none"
    assert verdict.held_out.base_fit < 1.1
    lead = next(each for each in verdict.base if each.name == "command_lead")
    assert lead.base_fit == pytest.approx(0.5 * _FILE, rel=0.1)
    assert any("ms ahead of their commands" in each for each in verdict.caveats)


@pytest.mark.timeout(300)
def test_what_a_long_time_step_leaves_is_no_cause_but_a_shorter_step(tmp_path: Path):
    dataset = _recorded(tmp_path, 1, 0.01, 1e-5, np.zeros(2))
    verdict = identify(dataset, seed=1, resume_folder=tmp_path / "steps").verdict
    assert verdict.verdict == "none"
    assert verdict.timestep == 0.0025
    assert any("at a time step of 2.5 ms" in each for each in verdict.caveats)
    file = mujoco.MjModel.from_xml_string(model_file(dataset, verdict).text)
    assert file.opt.timestep == 0.0025
    assert (tmp_path / "steps" / "shorter_step" / "base_fit.json").exists()


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_what_a_long_time_step_leaves_is_no_push(tmp_path: Path):
    verdict = identify(_recorded(tmp_path, 1, 0.005, 1e-5, np.zeros(2)), seed=1).verdict
    assert verdict.verdict == "none"
