"""What the scene looks like: simple solids that weigh nothing and touch nothing."""

# pyright: basic
# (mujoco's bindings carry no types)

from dataclasses import dataclass
from typing import Literal

import mujoco

from shared.sim.config import SimConfig
from shared.sim.parameters import ModelParameters


@dataclass(frozen=True)
class Shape:
    """One solid of the scene."""

    name: str
    body: int
    """Index into ``body_names`` of the body that carries it."""
    kind: Literal["box", "capsule", "sphere", "cylinder"]
    size: tuple[float, ...]
    """box: half extents x, y, z; capsule, cylinder: radius, half length along z; sphere: radius."""
    position: tuple[float, float, float]
    """Centre in the body's frame (m)."""
    quaternion: tuple[float, float, float, float]
    """w, x, y, z in the body's frame."""
    rgba: tuple[float, float, float, float]


def add_visuals(spec: mujoco.MjSpec, cfg: SimConfig, parameters: ModelParameters) -> None:
    """Add everything that is only for looking at to the physics of ``build_spec``."""
    world = spec.worldbody
    world.add_geom(
        name="target",
        type=mujoco.mjtGeom.mjGEOM_SPHERE,
        pos=[0.0, 0.0, cfg.target_height],
        size=[cfg.target_radius, 0.0, 0.0],
        rgba=[0.95, 0.75, 0.2, 0.3],
        contype=0,
        conaffinity=0,
    )


_KINDS = {
    mujoco.mjtGeom.mjGEOM_BOX: ("box", 3),
    mujoco.mjtGeom.mjGEOM_CAPSULE: ("capsule", 2),
    mujoco.mjtGeom.mjGEOM_SPHERE: ("sphere", 1),
    mujoco.mjtGeom.mjGEOM_CYLINDER: ("cylinder", 2),
}


def shapes_of(scene: mujoco.MjModel) -> tuple[Shape, ...]:
    """Return every geom of a compiled scene."""
    shapes: list[Shape] = []
    for index in range(scene.ngeom):
        geom = scene.geom(index)
        kind, sizes = _KINDS[mujoco.mjtGeom(int(geom.type[0]))]
        shapes.append(
            Shape(
                name=geom.name,
                body=int(geom.bodyid[0]),
                kind=kind,
                size=tuple(geom.size[:sizes].tolist()),
                position=tuple(geom.pos.tolist()),
                quaternion=tuple(geom.quat.tolist()),
                rgba=tuple(geom.rgba.tolist()),
            )
        )
    return tuple(shapes)
