"""Data sets and verdicts about them, for tests of what `riposte identify` writes."""

from pathlib import Path

import numpy as np

from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import PR2_JOINTS
from shared.identification.dataset.types import POSE, Dataset, Float64, ModelSource, Trajectory
from shared.identification.fitting.parameters import BaseParameter, base_parameters
from shared.identification.verdict import BaseValue, Cause, HeldOut, Interval, Verdict
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.signals import Signal

SECONDS = 1.5
PENDULUM = """<mujoco><compiler angle="radian"/><option timestep="0.002"/>
<worldbody><body name="upper" pos="0 0 1"><joint name="shoulder" axis="0 1 0" damping="0.05"
 armature="0.01"/><geom type="capsule" size=".02" fromto="0 0 0 0 0 -.3" mass="0.8"/>
<body name="lower" pos="0 0 -.3"><joint name="elbow" axis="0 1 0" damping="0.03" armature="0.005"/>
<geom type="capsule" size=".02" fromto="0 0 0 0 0 -.25" mass="0.5"/></body></body></worldbody>
<actuator><motor name="m1" joint="shoulder"/><motor name="m2" joint="elbow"/></actuator>
<sensor><jointpos name="encoder" joint="elbow"/></sensor></mujoco>"""


def instants(hertz: float = 100.0) -> Float64:
    return np.arange(0.0, SECONDS, 1.0 / hertz)


def pr2_dataset(folder: Path) -> Dataset:
    """Return a PR2's arm that is to swing about en garde; what it logged is not of that motion."""
    at = instants()
    q = FencingModel.build(SimConfig()).en_garde[1]
    logged = q + 0.2 * np.sin(7.0 * at)[:, None]
    start = Recorded(q, np.zeros(7), Signal(at[:1], np.eye(1, 7, 3)), Signal(at, logged), at, at)
    tool = Rollouts(pr2("right", None), (), 1).run([(lambda row: None, start)])[0].tracker
    assert tool is not None
    command = np.tile(tool[0], (len(at), 1))
    command[:, 1] += 0.15 * np.sin(2 * np.pi * 1.2 * at)
    command[:, 2] += 0.10 * np.sin(2 * np.pi * 0.8 * at)
    made = tuple(
        Trajectory(name, split, "", q, np.zeros(7), at, command, at, logged)
        for name, split in (("swing", "train"), ("swing_again", "test"))
    )
    return Dataset(folder, ModelSource("pr2"), "pose", PR2_JOINTS, POSE, made, (), "ab" * 32)


def pendulum_dataset(folder: Path) -> Dataset:
    """Return a double pendulum under torques."""
    path = folder / "pendulum.xml"
    path.write_text(PENDULUM)
    at = instants()
    command = np.stack([1.5 * np.sin(9.0 * at), 0.6 * np.sin(14.0 * at)], axis=1)
    q = np.zeros((len(at), 2))
    q[:, 0] = 0.4 * np.sin(5.0 * at)
    q[:, 1] = 0.4 * np.cos(5.0 * at)
    made = tuple(
        Trajectory(name, split, "", q[0], np.zeros(2), at, command, at, q)
        for name, split in (("shake", "train"), ("shake_again", "test"))
    )
    source = ModelSource("mjcf", path)
    joints = ("shoulder", "elbow")
    return Dataset(folder, source, "torque", joints, joints, made, (), "cd" * 32)


def cause(effect: str, where: str, quantity: str, value: float, **others: float) -> Cause:
    return Cause(
        effect=effect, where=where, quantity=quantity, value=value, unit="",
        interval=Interval(low=0.9 * value, high=1.1 * value), title=effect.replace("_", " "),
        signature="It shows.", others=others,
    )  # fmt: skip


def verdict_of(dataset: Dataset, *causes: Cause, factor: float = 1.2) -> Verdict:
    """Return a verdict whose base parameters all moved by a factor."""

    def moved(each: BaseParameter) -> float:
        return factor * each.nominal + (0.0 if each.nominal else 0.05)

    base = tuple(
        BaseValue(name=each.name, unit=each.unit, nominal=each.nominal, base_fit=moved(each),
                  extended=moved(each),
                  interval=Interval(low=0.0, high=1.0))
        for each in base_parameters(subject_of(dataset, capacity=1))
    )  # fmt: skip
    held_out = HeldOut(
        nominal=9.0, base_fit=5.0, extended=1.0, noise_floor=1.0, share_removed=1.0,
        share_interval=Interval(low=0.9, high=1.0), joints_mrad={},
    )  # fmt: skip
    return Verdict(
        verdict="named" if causes else "none", sentence="A sentence.", causes=causes, ties=(),
        unexplained=(), held_out=held_out, candidates=(), ruled_out={}, base=base, caveats=(),
        record_next=(), starts_agree=True, dataset=dataset.hash, model="a model", seed=0,
        version="0", commit="", cpu_s=1.0, seconds={},
    )  # fmt: skip
