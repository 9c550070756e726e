"""The nominal scene as a plain MJCF file, for whoever wants to build on it."""

from pathlib import Path
from typing import Final

import mujoco

from shared.errors import ConfigError
from shared.sim.build import AGENTS, build_spec
from shared.sim.config import SimConfig
from shared.sim.model import FencingModel
from shared.sim.visuals import add_visuals

EN_GARDE: Final = "en_garde"
"""The keyframe of the exported file: posture and the controls that hold it."""


def export_mjcf(path: Path, single: bool, cfg: SimConfig | None = None) -> None:
    """Write the scene, looks and keyframe included, to ``path``.

    Args:
        path: the file to write; it needs nothing beside it.
        single: only the protagonist's arm with its bat, instead of two robots.
        cfg: the scene; the nominal one if None.

    Raises:
        ConfigError: if ``path`` cannot be written.
    """
    model = FencingModel.build(cfg or SimConfig())
    agents = AGENTS[1:] if single else AGENTS
    spec = build_spec(model.cfg, model.parameters, agents)
    add_visuals(spec, model.cfg, agents)
    mj = spec.compile()
    data = mujoco.MjData(mj)
    data.qpos[:] = model.en_garde[AGENTS.index(agents[0]) :].ravel()
    mujoco.mj_forward(mj, data)
    hold = [
        number
        for agent in agents
        for part in ("position", "quaternion")
        for number in data.sensor(f"{agent}/tool/{part}").data
    ]
    spec.add_key(name=EN_GARDE, qpos=data.qpos, ctrl=hold)
    spec.compile()
    try:
        path.write_text(spec.to_xml(), encoding="utf-8")
    except OSError as error:
        raise ConfigError(f"cannot write {path}: {error.strerror}") from error
