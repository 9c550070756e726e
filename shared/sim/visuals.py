"""What the scene looks like: simple solids that weigh nothing and touch nothing."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, Literal

import mujoco
import numpy as np

from shared.sim.arm import load_stance
from shared.sim.build import AGENTS
from shared.sim.config import SimConfig

Rgba = tuple[float, float, float, float]

_GEOM: Final = mujoco.mjtGeom
_Kind = Literal["box", "capsule", "sphere", "cylinder"]

_KINDS: Final[dict[int, tuple[_Kind, int]]] = {
    _GEOM.mjGEOM_BOX: ("box", 3),
    _GEOM.mjGEOM_CAPSULE: ("capsule", 2),
    _GEOM.mjGEOM_SPHERE: ("sphere", 1),
    _GEOM.mjGEOM_CYLINDER: ("cylinder", 2),
}
_WHITE: Final = (0.90, 0.90, 0.88, 1.0)
_GREY: Final = (0.52, 0.54, 0.57, 1.0)
_DARK: Final = (0.16, 0.17, 0.19, 1.0)
_GLASS: Final = (0.05, 0.06, 0.09, 1.0)
_TARGET: Final = (1.0, 0.66, 0.05, 0.34)
_FLOOR: Final = (0.86, 0.87, 0.89, 1.0)
_TRIM: Final = {"antagonist": (0.80, 0.24, 0.19, 1.0), "protagonist": (0.15, 0.38, 0.72, 1.0)}
_BAT: Final = {"antagonist": (0.96, 0.42, 0.28, 1.0), "protagonist": (0.27, 0.58, 0.95, 1.0)}


@dataclass(frozen=True)
class Shape:
    """One solid of the scene."""

    name: str
    body: int
    """Index into ``body_names`` of the body that carries it."""
    kind: _Kind
    size: tuple[float, ...]
    """box: half extents x, y, z; capsule, cylinder: radius, half length along z; sphere: radius."""
    position: tuple[float, float, float]
    """Centre in the body's frame (m)."""
    quaternion: tuple[float, float, float, float]
    """w, x, y, z in the body's frame."""
    rgba: Rgba


def shapes_of(scene: mujoco.MjModel) -> tuple[Shape, ...]:
    """Return every visible solid of a compiled scene."""
    shapes: list[Shape] = []
    for index in range(scene.ngeom):
        geom = scene.geom(index)
        if geom.rgba[3] == 0.0:
            continue
        kind, sizes = _KINDS[_GEOM(int(geom.type[0]))]
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


def add_visuals(spec: mujoco.MjSpec, cfg: SimConfig, agents: Sequence[str] = AGENTS) -> None:
    """Add everything that is only for looking at to the physics of ``build_spec``."""
    spec.memory = -1
    _add_studio(spec)
    target = _Painter(spec.worldbody, "")
    target.sphere("target", (0.0, 0.0, cfg.target_height), cfg.target_radius, _TARGET)
    for agent in agents:
        for geom in spec.geoms:
            if geom.name.startswith(f"{agent}/"):
                geom.rgba = _BAT[agent] if geom.name.endswith("/bat") else [0.0, 0.0, 0.0, 0.0]
        _add_torso(spec, cfg, agent)
        _add_arm(spec, agent)


def _add_studio(spec: mujoco.MjSpec) -> None:
    """Add floor, sky, lights and the camera called ``audience``."""
    spec.visual.quality.shadowsize = 4096
    spec.visual.headlight.ambient = [0.36, 0.36, 0.37]
    spec.visual.headlight.diffuse = [0.22, 0.22, 0.22]
    spec.visual.headlight.specular = [0.05, 0.05, 0.05]
    spec.stat.center, spec.stat.extent = [0.0, 0.0, 0.9], 3.0
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=[0.93, 0.94, 0.96],
        rgb2=[0.62, 0.68, 0.76],
        width=512,
        height=3072,
    )
    spec.add_texture(
        name="tiles",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        rgb1=[0.93, 0.93, 0.94],
        rgb2=[0.86, 0.87, 0.89],
        width=512,
        height=512,
    )
    tiles = spec.add_material(name="tiles", texrepeat=[1.0, 1.0], texuniform=True)
    tiles.textures[int(mujoco.mjtTextureRole.mjTEXROLE_RGB)] = "tiles"
    floor = _Painter(spec.worldbody, "")
    floor.box("floor", (0.0, 0.0, -0.02), (6.0, 6.0, 0.02), _FLOOR, material="tiles")
    light = {"castshadow": True, "type": mujoco.mjtLightType.mjLIGHT_DIRECTIONAL}
    spec.worldbody.add_light(
        name="key", pos=[1.5, -3.0, 4.0], dir=[-0.35, 0.6, -1.0], diffuse=[0.55] * 3, **light
    )
    light["castshadow"] = False
    spec.worldbody.add_light(
        name="fill", pos=[-2.0, -2.0, 3.0], dir=[0.6, 0.6, -0.5], diffuse=[0.18] * 3, **light
    )
    eye, aim = np.array([0.55, -3.3, 1.72]), np.array([0.0, 0.0, 0.80])
    right = np.cross(aim - eye, [0.0, 0.0, 1.0])
    up = np.cross(right, aim - eye)
    camera = spec.worldbody.add_camera(name="audience", pos=eye, fovy=34.0)
    camera.alt.type = mujoco.mjtOrientation.mjORIENTATION_XYAXES
    camera.alt.xyaxes = [*right, *up]


def _add_torso(spec: mujoco.MjSpec, cfg: SimConfig, agent: str) -> None:
    """Add the base, the torso, the head and the arm that does not fence."""
    stance, trim = load_stance(), _TRIM[agent]
    paint = _Painter(spec.body(f"{agent}/torso"), f"{agent}/")
    base_x = stance.base_in_torso[0]
    floor = -(stance.torso_height + cfg.torso_lift)
    half_x, half_y = stance.base_size[0] / 2, stance.base_size[1] / 2
    paint.box("base", (base_x, 0.0, floor + 0.19), (half_x, half_y, 0.105), _WHITE)
    paint.box(
        "base_skirt", (base_x, 0.0, floor + 0.085), (half_x - 0.02, half_y - 0.02, 0.02), _DARK
    )
    paint.box(
        "base_trim", (base_x, 0.0, floor + 0.262), (half_x + 0.003, half_y + 0.003, 0.012), trim
    )
    paint.box(
        "base_deck", (base_x, 0.0, floor + 0.305), (half_x - 0.02, half_y - 0.02, 0.012), _GREY
    )
    for name, x, y in (("fl", 1, 1), ("fr", 1, -1), ("bl", -1, 1), ("br", -1, -1)):
        wheel = (base_x + x * 0.2246, y * 0.2246, floor + 0.055)
        paint.cylinder(f"wheel_{name}", wheel, 0.055, 0.055, _DARK, along="y")
    bottom, top = floor + 0.31, -0.10
    paint.box("column", (-0.15, 0.0, (top + bottom) / 2), (0.10, 0.16, (top - bottom) / 2), _GREY)
    paint.box("chest", (-0.13, 0.0, -0.03), (0.13, 0.17, 0.29), _WHITE)
    paint.box("chest_trim", (-0.004, 0.0, 0.0), (0.008, 0.06, 0.20), trim)
    paint.box("shoulders", (-0.08, 0.0, -0.03), (0.09, 0.21, 0.10), _WHITE)
    head_x, _, head_z = stance.head_in_torso
    paint.cylinder("neck", (head_x - 0.03, 0.0, head_z - 0.09), 0.065, 0.07, _DARK, along="z")
    paint.box("head", (head_x, 0.0, head_z + 0.03), (0.085, 0.115, 0.07), _WHITE)
    paint.box("visor", (head_x + 0.083, 0.0, head_z + 0.03), (0.006, 0.095, 0.045), _GLASS)
    paint.box("brow", (head_x + 0.01, 0.0, head_z + 0.105), (0.07, 0.10, 0.006), trim)
    for name, y in (("left", 0.045), ("right", -0.045)):
        eye = (head_x + 0.092, y, head_z + 0.03)
        paint.cylinder(f"eye_{name}", eye, 0.022, 0.004, _GREY, along="x")
    _add_resting_arm(paint, 1.0 if cfg.arms[AGENTS.index(agent)] == "right" else -1.0)


def _add_resting_arm(paint: "_Painter", side: float) -> None:
    """Add the arm that is tucked away: ``side`` +1 for the left, -1 for the right."""
    shoulder, elbow = (0.02, side * 0.23, 0.0), (0.0, side * 0.30, -0.36)
    wrist, tip = (0.22, side * 0.22, -0.50), (0.30, side * 0.17, -0.53)
    paint.cylinder("rest_turret", (0.0, side * 0.20, -0.04), 0.095, 0.13, _WHITE, along="z")
    paint.capsule("rest_upper_arm", shoulder, elbow, 0.062, _WHITE)
    paint.sphere("rest_elbow", elbow, 0.066, _GREY)
    paint.capsule("rest_forearm", elbow, wrist, 0.05, _WHITE)
    paint.capsule("rest_gripper", wrist, tip, 0.035, _DARK)


def _add_arm(spec: mujoco.MjSpec, agent: str) -> None:
    """Add the arm that fences, link by link."""
    trim = _TRIM[agent]

    def link(name: str) -> _Painter:
        return _Painter(spec.body(f"{agent}/{name}"), f"{agent}/")

    pan = link("shoulder_pan")
    pan.cylinder("turret", (0.0, 0.0, -0.04), 0.10, 0.14, _WHITE, along="z")
    pan.cylinder("turret_trim", (0.0, 0.0, 0.075), 0.103, 0.012, trim, along="z")
    pan.capsule("shoulder_bracket", (0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.07, _WHITE)
    link("shoulder_lift").cylinder("shoulder", (0.0, 0.0, 0.0), 0.095, 0.085, _GREY, along="y")
    upper = link("upper_arm_roll")
    upper.capsule("upper_arm", (0.05, 0.0, 0.0), (0.34, 0.0, 0.0), 0.066, _WHITE)
    upper.cylinder("upper_arm_trim", (0.2, 0.0, 0.0), 0.068, 0.012, trim, along="x")
    link("elbow_flex").cylinder("elbow", (0.0, 0.0, 0.0), 0.07, 0.072, _GREY, along="y")
    fore = link("forearm_roll")
    fore.capsule("forearm", (0.05, 0.0, 0.0), (0.26, 0.0, 0.0), 0.052, _WHITE)
    fore.cylinder("forearm_trim", (0.18, 0.0, 0.0), 0.054, 0.010, trim, along="x")
    link("wrist_flex").cylinder("wrist", (0.0, 0.0, 0.0), 0.042, 0.045, _GREY, along="y")
    hand = link("wrist_roll")
    hand.cylinder("palm_mount", (0.035, 0.0, 0.0), 0.042, 0.025, _DARK, along="x")
    hand.box("palm", (0.085, 0.0, 0.0), (0.035, 0.055, 0.028), _GREY)
    for name, y in (("left", 0.038), ("right", -0.038)):
        hand.box(f"finger_{name}", (0.155, y, 0.0), (0.045, 0.011, 0.018), _DARK)


class _Painter:
    """Adds solids to one body, all named under one prefix."""

    def __init__(self, body: mujoco.MjsBody, prefix: str) -> None:
        self._body = body
        self._prefix = prefix

    def _add(self, name: str, kind: int, size: list[float], rgba: Rgba, **more: object) -> None:
        self._body.add_geom(
            name=f"{self._prefix}look/{name}",
            type=kind,
            size=size,
            rgba=rgba,
            contype=0,
            conaffinity=0,
            mass=0.0,
            **more,
        )

    def box(
        self,
        name: str,
        centre: Sequence[float],
        half: Sequence[float],
        rgba: Rgba,
        material: str = "",
    ) -> None:
        self._add(name, _GEOM.mjGEOM_BOX, [*half], rgba, pos=[*centre], material=material)

    def sphere(self, name: str, centre: Sequence[float], radius: float, rgba: Rgba) -> None:
        self._add(name, _GEOM.mjGEOM_SPHERE, [radius, 0.0, 0.0], rgba, pos=[*centre])

    def capsule(
        self, name: str, start: Sequence[float], end: Sequence[float], radius: float, rgba: Rgba
    ) -> None:
        size = [radius, 0.0, 0.0]
        self._add(name, _GEOM.mjGEOM_CAPSULE, size, rgba, fromto=[*start, *end])

    def cylinder(
        self,
        name: str,
        centre: Sequence[float],
        radius: float,
        half_length: float,
        rgba: Rgba,
        along: Literal["x", "y", "z"],
    ) -> None:
        ends = [[*centre], [*centre]]
        axis = "xyz".index(along)
        ends[0][axis] -= half_length
        ends[1][axis] += half_length
        size = [radius, 0.0, 0.0]
        self._add(name, _GEOM.mjGEOM_CYLINDER, size, rgba, fromto=[*ends[0], *ends[1]])
