"""An MJCF file with identified values in it."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from shared.sim.arm import Float64
from shared.sim.plant.plant import Plant, lift_limits
from shared.sim.plant.structure import Builder, Structure


def patched_xml(
    plant: Plant, path: Path, structure: Structure, fields: Mapping[str, Float64]
) -> str:
    """Return an arm's MJCF with fields of its model changed.

    It is the file's own text with the arm's time step, sensors and keyframes included, unless
    something was compiled into the arm or its actuators gave way to motors: then it is the arm as
    identification simulates it.

    Args:
        plant: the arm.
        path: its MJCF.
        structure: what must be compiled into it.
        fields: of ``mjModel``, whole, as ``Row.fields`` has them.
    """
    builder = Builder(plant)
    for edit in structure:
        edit.change(builder)
    spec = builder.spec
    compiled = spec.compile()
    kind: Any = mujoco.MjSpec  # its stub lacks reading a file
    own: mujoco.MjSpec = kind.from_file(str(path))
    own.option.timestep = plant.timestep
    lift_limits(own, plant)
    original = own.compile()
    if not structure and _actuators(original) == _actuators(compiled):
        spec, compiled = own, original
    for name, values in fields.items():
        owner = compiled.opt if name.startswith("opt.") else compiled
        array = getattr(owner, name.removeprefix("opt."))
        array[...] = values.reshape(array.shape)
    spec.copy_back(compiled)
    if "jnt_actfrcrange" in fields:  # copying back leaves these out
        for joint in spec.joints:
            index = compiled.joint(joint.name).id
            if compiled.jnt_actfrclimited[index]:
                joint.actfrclimited = 1
                joint.actfrcrange = np.array(compiled.jnt_actfrcrange[index])
    if spec.meshes:
        spec.meshdir = str((path.parent / spec.meshdir).resolve())
    if spec.textures:
        spec.texturedir = str((path.parent / spec.texturedir).resolve())
    return spec.to_xml()


def _actuators(model: mujoco.MjModel) -> list[str]:
    return [model.actuator(index).name for index in range(model.nu)]
