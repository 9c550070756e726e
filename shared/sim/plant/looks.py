"""What an arm looks like, for those who draw it: solids fixed to bodies, and where these are."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import mujoco
import numpy as np
from numpy.typing import NDArray

from shared.sim.arm import Float64
from shared.sim.build import AGENTS
from shared.sim.config import SimConfig
from shared.sim.plant.plant import Plant
from shared.sim.visuals import add_visuals

Kind = Literal["box", "capsule", "sphere", "cylinder", "ellipsoid", "mesh"]

_GEOM: Final = mujoco.mjtGeom
_KINDS: Final[dict[int, tuple[Kind, int]]] = {
    int(_GEOM.mjGEOM_BOX): ("box", 3),
    int(_GEOM.mjGEOM_CAPSULE): ("capsule", 2),
    int(_GEOM.mjGEOM_SPHERE): ("sphere", 1),
    int(_GEOM.mjGEOM_CYLINDER): ("cylinder", 2),
    int(_GEOM.mjGEOM_ELLIPSOID): ("ellipsoid", 3),
    int(_GEOM.mjGEOM_MESH): ("mesh", 0),
}
_SHOWN_GROUPS: Final = 3
"""Geoms of groups from here on are not for looking at, in MuJoCo's own viewer too."""
_MOST_FACES: Final = 60_000
"""Of all meshes together; above it they are drawn as boxes."""
_BONE: Final = 0.02
"""Radius of a link that has nothing to look at, as a share of the arm's size."""
_SCENERY: Final = ("look/target", "look/floor", "target", "floor")


@dataclass(frozen=True)
class Solid:
    """One solid fixed to a body."""

    body: int
    """Index into :attr:`Looks.bodies`."""
    kind: Kind
    size: tuple[float, ...]
    """Half extents (box, ellipsoid); radius, half length along z (capsule, cylinder); radius."""
    position: tuple[float, float, float]
    """Centre in the body's frame (m)."""
    quaternion: tuple[float, float, float, float]
    """w, x, y, z in the body's frame."""
    rgba: tuple[float, float, float, float]
    vertices: NDArray[np.float32] | None = None
    """float32[V, 3] of a mesh, in its own frame (m)."""
    faces: NDArray[np.int32] | None = None
    """int32[F, 3]."""


class Looks:
    """An arm as it looks, and its bodies' poses given its joints; no physics."""

    def __init__(self, plant: Plant) -> None:
        spec = plant.make()
        if plant.control == "pose":  # a PR2: its solids are not in the physics
            add_visuals(spec, SimConfig(), AGENTS[1:])
        self._model = spec.compile()
        self._data = mujoco.MjData(self._model)
        self._places = [int(self._model.joint(name).qposadr[0]) for name in plant.joints]
        self.bodies: tuple[str, ...] = tuple(
            self._model.body(index).name or f"body {index}" for index in range(self._model.nbody)
        )
        self.solids: tuple[Solid, ...] = _solids(self._model)

    def poses(self, q: Float64) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
        """Return the poses of all bodies in the world.

        Args:
            q: float64[F, J], logged joints (rad, m).

        Returns:
            float32[F, B, 3] positions (m) and float32[F, B, 4] quaternions, w x y z.
        """
        positions = np.empty((len(q), len(self.bodies), 3), np.float32)
        quaternions = np.empty((len(q), len(self.bodies), 4), np.float32)
        self._data.qpos[:] = self._model.qpos0
        for k, instant in enumerate(q):
            self._data.qpos[self._places] = instant
            mujoco.mj_kinematics(self._model, self._data)
            positions[k] = self._data.xpos
            quaternions[k] = self._data.xquat
        return positions, quaternions


def _solids(model: mujoco.MjModel) -> tuple[Solid, ...]:
    drawable = [
        index
        for index in range(model.ngeom)
        if int(model.geom_type[index]) in _KINDS
        and model.geom(index).name not in _SCENERY
        and model.geom_rgba[index, 3] > 0.0
    ]
    seen = [index for index in drawable if model.geom_group[index] < _SHOWN_GROUPS] or drawable
    meshes = {int(model.geom_dataid[index]) for index in seen} - {-1}
    has_meshes = sum(int(model.mesh_facenum[mesh]) for mesh in meshes) <= _MOST_FACES
    solids = [_solid(model, index, has_mesh=has_meshes) for index in seen]
    return (*solids, *_bones(model, {solid.body for solid in solids}))


def _solid(model: mujoco.MjModel, index: int, *, has_mesh: bool) -> Solid:
    kind, sizes = _KINDS[int(model.geom_type[index])]
    position, size = model.geom_pos[index], model.geom_size[index, :sizes]
    vertices = faces = None
    if kind == "mesh":
        mesh = int(model.geom_dataid[index])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        vertices = np.array(model.mesh_vert[first : first + count], np.float32)
        if has_mesh:
            first, count = int(model.mesh_faceadr[mesh]), int(model.mesh_facenum[mesh])
            faces = np.array(model.mesh_face[first : first + count], np.int32)
        else:
            low, high = vertices.min(axis=0), vertices.max(axis=0)
            turned = np.empty(3)
            mujoco.mju_rotVecQuat(turned, (low + high).astype(np.float64) / 2,
                                  model.geom_quat[index])  # fmt: skip
            kind, vertices, size = "box", None, (high - low) / 2
            position = position + turned
    return Solid(
        body=int(model.geom_bodyid[index]),
        kind=kind,
        size=tuple(float(each) for each in size),
        position=_triple(position),
        quaternion=_quadruple(model.geom_quat[index]),
        rgba=_quadruple(model.geom_rgba[index]),
        vertices=vertices,
        faces=faces,
    )


def _bones(model: mujoco.MjModel, drawn: set[int]) -> list[Solid]:
    """Return a capsule from each body's parent to it, where the parent has nothing to look at."""
    bones: list[Solid] = []
    radius = max(1e-3, _BONE * float(model.stat.extent))
    for body in range(1, model.nbody):
        parent = int(model.body_parentid[body])
        way: Float64 = np.array(model.body_pos[body])
        length = float(np.linalg.norm(way))
        if not parent or parent in drawn or length < radius:
            continue
        quaternion = np.empty(4)
        mujoco.mju_quatZ2Vec(quaternion, way)
        bones.append(
            Solid(
                body=parent,
                kind="capsule",
                size=(radius, length / 2),
                position=_triple(way / 2),
                quaternion=_quadruple(quaternion),
                rgba=(0.6, 0.6, 0.62, 1.0),
            )
        )
    return bones


def _triple(values: Sequence[float] | Float64) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in values)
    return x, y, z


def _quadruple(values: Sequence[float] | Float64) -> tuple[float, float, float, float]:
    w, x, y, z = (float(value) for value in values)
    return w, x, y, z
