"""An arm of five hinges, driven by torques for two seconds, and what it did.

After the example of `mujoco.sysid`'s own tests in MuJoCo 4.0.0 (five armatures of 0.5 to
0.1 kg m^2, sought from 0.01): the same chain of links, numbers and sums of sines. Both sides read
the motion from a file, so that nothing but the fit is timed.
"""

import mujoco
import numpy as np
from mujoco import rollout
from numpy.typing import NDArray

ARMATURES = (0.5, 0.4, 0.3, 0.2, 0.1)
"""kg m^2, from the base to the tip."""
GUESS = 0.01
LOW, HIGH = 0.001, 1.0
SECONDS = 2.0
_MASSES = (1.0, 0.8, 0.6, 0.4, 0.2)
_LENGTHS = (0.1, 0.1, 0.1, 0.08, 0.06)
_AXES = ((0, 0, 1), (0, 1, 0), (0, 1, 0), (0, 0, 1), (0, 1, 0))
_SINES = ((5.0, 0.5, 0.0), (4.0, 0.7, 0.5), (3.0, 0.4, 1.0), (2.0, 0.9, 1.5), (1.0, 0.6, 2.0))
"""Torque (N m), frequency (Hz) and phase (rad) of each joint."""
JOINTS = tuple(f"joint{number}" for number in range(1, 6))


def arm(armatures: tuple[float, ...]) -> mujoco.MjSpec:
    """Return the arm with these armatures (kg m^2)."""
    spec = mujoco.MjSpec()
    spec.modelname = "arm"
    spec.compiler.degree = False
    spec.option.timestep = 0.002
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONTACT)
    body, above = spec.worldbody, 0.1
    for name, axis, mass, length, armature in zip(
        JOINTS, _AXES, _MASSES, _LENGTHS, armatures, strict=True
    ):
        body = body.add_body(name=f"link of {name}", pos=[0.0, 0.0, above])
        body.explicitinertial = True
        body.mass, body.ipos = mass, [0.0, 0.0, length / 2]
        body.inertia = [0.01 * mass, 0.01 * mass, 0.005 * mass]
        hinge = body.add_joint(name=name, type=mujoco.mjtJoint.mjJNT_HINGE, axis=axis)
        hinge.range = [-3.14, 3.14]
        hinge.armature = armature
        hinge.damping[0] = mass if mass < 1.0 else 1.0
        above = length
        motor = spec.add_actuator(name=name, target=name, trntype=mujoco.mjtTrn.mjTRN_JOINT)
        motor.set_to_motor()
    for kind, word in (
        (mujoco.mjtSensor.mjSENS_JOINTPOS, "pos"),
        (mujoco.mjtSensor.mjSENS_JOINTVEL, "vel"),
    ):
        for name in JOINTS:
            spec.add_sensor(
                name=f"{name}_{word}", type=kind, objtype=mujoco.mjtObj.mjOBJ_JOINT, objname=name
            )
    return spec


def recorded(later: float = 0.0) -> tuple[NDArray[np.float64], ...]:
    """Return float64[T] times (s), float64[T, 5] torques, positions and velocities.

    Args:
        later: phase of all torques (rad), for another recording.
    """
    model = arm(ARMATURES).compile()
    data = mujoco.MjData(model)
    times = np.arange(round(SECONDS / model.opt.timestep)) * model.opt.timestep
    torques = np.column_stack(
        [size * np.sin(2 * np.pi * hertz * times + phase + later) for size, hertz, phase in _SINES]
    )
    size = mujoco.mj_stateSize(model, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    begin = np.empty(size)
    mujoco.mj_getState(model, data, begin, mujoco.mjtState.mjSTATE_FULLPHYSICS)
    states, _ = rollout.rollout(model, data, begin, torques[:-1])
    rows = np.concatenate([begin[None], states[0]])
    return times, torques, rows[:, 1:6], rows[:, 6:11]
