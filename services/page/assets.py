"""The files of the page, read once: what is not among them does not exist for a browser."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from shared.errors import ConfigError
from shared.runtime.web import Asset, load_files
from shared.sim.chain import chain_of
from shared.sim.model import FencingModel

STATIC = Path(__file__).parent / "static"
SCENE_PATH = "/scene.json"


def load_assets(scene: Mapping[str, Any], folder: Path = STATIC) -> dict[str, Asset]:
    """Return the page's files by path, with the scene among them.

    Raises:
        ConfigError: the installation lacks them.
    """
    found = load_files(folder)
    if "/index.html" not in found:
        raise ConfigError(f"{folder} has no index.html: install Riposte again")
    found["/"] = found["/index.html"]
    body = msgspec.json.encode(scene)
    found[SCENE_PATH] = Asset(body, "application/json")
    return found


def scene_of(model: FencingModel) -> dict[str, Any]:
    """Return what the page draws: bodies with their hinges, solids, bat, target, en garde."""
    solids = [
        {
            "name": shape.name,
            "body": shape.body,
            "kind": shape.kind,
            "size": shape.size,
            "position": shape.position,
            "quaternion": shape.quaternion,
            "rgba": shape.rgba,
        }
        for shape in model.shapes
    ]
    links = [
        {
            "name": link.name,
            "parent": link.parent,
            "position": link.position,
            "quaternion": link.quaternion,
            "axis": link.axis,
            "joint": link.joint,
        }
        for link in chain_of(model)
    ]
    return {
        "links": links,
        "solids": solids,
        "target": {"centre": model.target_centre.tolist(), "radius": model.target_radius},
        "bat": {
            "back": model.bat_back,
            "front": model.bat_front,
            "radius": model.bat_radius,
        },
        "en_garde": model.en_garde.tolist(),
        "half_distance": model.cfg.half_distance,
    }
