"""The fencing scene, compiled once and shared by every world that is stepped or drawn."""

import hashlib
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import msgspec
import mujoco
import numpy as np

from shared.errors import ConfigError
from shared.sim.arena import BASE_YAW
from shared.sim.arm import Float64
from shared.sim.build import AGENTS, base_position, build_spec
from shared.sim.config import Side, SimConfig
from shared.sim.parameters import ModelParameters, load_parameters
from shared.sim.visuals import Shape, add_visuals, shapes_of

_EN_GARDE: Final = (-0.971, 0.231, -1.600, -1.607, 0.513, -0.961, 1.460)
"""Right arm: tool 0.55 m ahead and 0.25 m to the right, blade clear of the target (rad)."""
_MIRROR: Final = (-1.0, 1.0, -1.0, 1.0, -1.0, 1.0, -1.0)
"""Turns a right arm's posture into the left arm's mirror image."""


@dataclass(frozen=True)
class FencingModel:
    """Two robots, their bats and the target between them; build one with :meth:`build`."""

    cfg: SimConfig
    parameters: ModelParameters
    mj: mujoco.MjModel
    """The compiled physics, without anything that is only for looking at."""
    hash: str
    """Hex sha256 of everything that decides how a command moves a bat in this scene."""
    body_names: tuple[str, ...]
    """``world`` first; the bodies that :meth:`FencingBatch.body_poses` gives the poses of."""
    target_centre: Float64
    """float64[3], world frame (m)."""
    target_radius: float
    bat_radius: float
    bat_back: float
    """Where the axis of a bat's capsule begins, on the bat frame's x axis (m)."""
    bat_front: float
    """Where it ends (m)."""
    base_position: Float64
    """float64[2, 3]: the torso frames, antagonist first (m)."""
    base_yaw: tuple[float, float]
    """Headings of the torso frames about the world's z (rad)."""
    en_garde: Float64
    """float64[2, 7]: the posture a bout begins in (rad)."""

    @staticmethod
    def build(cfg: SimConfig) -> "FencingModel":
        """Compile the scene that ``cfg`` describes.

        Raises:
            ConfigError: if the model file cannot be used.
        """
        parameters = load_parameters(cfg.model)
        return FencingModel.of(cfg, parameters)

    @staticmethod
    def of(cfg: SimConfig, parameters: ModelParameters) -> "FencingModel":
        """Compile the scene with ``parameters`` in place of the file that ``cfg`` names."""
        silence()
        try:
            spec = build_spec(cfg, parameters)
            mj = spec.compile()
        except ValueError as error:
            raise ConfigError(f"MuJoCo refused the model {parameters.name}: {error}") from error
        bat = parameters.bat
        return FencingModel(
            cfg=cfg,
            parameters=parameters,
            mj=mj,
            hash=_hash(spec.to_xml(), cfg, parameters),
            body_names=tuple(mj.body(index).name for index in range(mj.nbody)),
            target_centre=np.array([0.0, 0.0, cfg.target_height]),
            target_radius=cfg.target_radius,
            bat_radius=bat.radius,
            bat_back=-bat.behind_grip,
            bat_front=bat.length - bat.behind_grip,
            base_position=base_position(cfg),
            base_yaw=BASE_YAW,
            en_garde=np.array([_en_garde(side) for side in cfg.arms]),
        )

    @property
    def agents(self) -> tuple[str, str]:
        """The agents' names in the order of every array."""
        return AGENTS

    def to_xml(self) -> str:
        """Return the physics as MJCF."""
        spec = build_spec(self.cfg, self.parameters)
        spec.compile()
        return spec.to_xml()

    @cached_property
    def scene(self) -> mujoco.MjModel:
        """The same bodies and joints with something to look at; never stepped."""
        spec = build_spec(self.cfg, self.parameters)
        add_visuals(spec, self.cfg)
        return spec.compile()

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """What any viewer needs to draw the scene, given the bodies' poses."""
        return shapes_of(self.scene)


def silence() -> None:
    """Keep MuJoCo from printing, and from writing MUJOCO_LOG.TXT where the process stands.

    What it would say is in the warning counters that ``FencingBatch.check`` reads.
    """
    config = mujoco.MjLogConfig.get()
    config.logto_console = False
    config.logto_file = False
    config.set()


def _en_garde(side: Side) -> Float64:
    posture = np.array(_EN_GARDE)
    return posture if side == "right" else posture * _MIRROR


def _hash(xml: str, cfg: SimConfig, parameters: ModelParameters) -> str:
    """Return the hash of the physics and of what this package adds around it.

    The text of the compiled model catches a change of this code or of the arm's data, the exact
    parameters one that its digits would hide. Not the compiled bytes: their last bits depend on
    the processor. The name of the model, the place of its file and what it says of measurement are
    left out: they move nothing.
    """
    moving: dict[str, object] = msgspec.to_builtins(msgspec.structs.replace(parameters, name=""))
    del moving["measurement"]
    exact = (msgspec.structs.replace(cfg, model=""), moving)
    return hashlib.sha256(xml.encode() + msgspec.json.encode(exact)).hexdigest()
