"""A TIAGo's arm: seven joints that follow positions, and what their motors were given.

Recordings of the package figaroh 1.0.2 (``tests/fixtures/tiago/data``, Apache-2.0), 59 s at 100 Hz
of one motion. Torques are what the controller logged, times gear ratio and motor constant as the
authors have them: of the wrist's three joints that is within a step or two of nothing. The links
are those of ``tiago_48_hey5.urdf`` beside them, which says nothing of drives that is used here. The
torso, which went up and down by 0.3 m, at 0.07 m/s at most, is held.

Run ``pip download figaroh==1.0.2 --no-deps --no-binary figaroh`` and unpack that, then
``python -m studies.real_data.tiago OUT --raw figaroh-1.0.2/tests/fixtures/tiago/data``.
"""

import xml.etree.ElementTree as ET
from pathlib import Path

import mujoco
import numpy as np

from studies.real_data.folders import hashes_of, in_parts, parser_of, there, write

JOINTS = tuple(f"arm_{number}_joint" for number in range(1, 8))
FILES = ("tiago_position.csv", "tiago_effort.csv")
_LINKS = "urdf/tiago_48_hey5.urdf"
_GAINS = np.array([13.6, 13.6, -8.7, -8.7, -20.6, -20.6, -20.6])
"""Gear ratio times motor constant (N m per logged unit): ``examples/tiago/identification.py``."""
_FIRST = 2
"""Column of the first joint; before it are time and torso."""
_MOVES = (9.21, 67.9)
"""When the arm moves (s), as the authors take it."""


def convert(out: Path, raw: Path, parts: int = 6) -> None:
    """Write the data set.

    Args:
        out: the new folder.
        raw: where the recordings lie.
        parts: of which every third is held out.
    """
    paths = {name: there(raw, name) for name in (*FILES, _LINKS)}
    q, effort = (np.loadtxt(paths[name], delimiter=",", skiprows=1) for name in FILES)
    own = slice(_FIRST, _FIRST + len(JOINTS))
    recordings = in_parts(q[:, 0], q[:, own], effort[:, own] * _GAINS, _MOVES, parts)
    notes = {"source": "figaroh 1.0.2, Apache-2.0", "sha256": hashes_of(paths)}
    write(out, model(paths[_LINKS].read_text()), "torque", JOINTS, recordings, notes)


def model(urdf: str) -> str:
    """Return the MJCF of an arm and what hangs on it, with a motor at each joint.

    Args:
        urdf: of the whole robot.
    """
    root = ET.fromstring(urdf)
    joints = {_link_of(each, "child"): each for each in root.findall("joint")}
    above = {child: _link_of(each, "parent") for child, each in joints.items()}
    first = next(child for child, each in joints.items() if each.get("name") == JOINTS[0])
    kept = {link for link in above if first in _way(link, above)} | set(_way(first, above))
    for link in root.findall("link"):
        if link.get("name") not in kept:
            root.remove(link)
        for shape in (*link.findall("visual"), *link.findall("collision")):
            link.remove(shape)
    for child, joint in joints.items():
        if child not in kept:
            root.remove(joint)
        joint.set("type", "continuous" if joint.get("name") in JOINTS else "fixed")
        for tag in ("dynamics", "mimic", "limit"):
            for each in joint.findall(tag):
                joint.remove(each)
    options = ET.SubElement(root, "mujoco")
    ET.SubElement(options, "compiler", fusestatic="true", strippath="true", balanceinertia="true")
    spec = mujoco.MjSpec.from_string(ET.tostring(root, encoding="unicode"))
    spec.option.timestep = 0.002
    for joint in JOINTS:
        motor = spec.add_actuator(name=joint, target=joint)
        motor.trntype = mujoco.mjtTrn.mjTRN_JOINT
    spec.compile()
    return spec.to_xml()


def _link_of(joint: ET.Element, end: str) -> str:
    """Return the name of the link at one end of a joint, ``parent`` or ``child``."""
    return str(joint.find(end).get("link"))  # type: ignore[union-attr]


def _way(link: str, above: dict[str, str]) -> list[str]:
    """Return a link and all that it hangs on, up to the robot's first."""
    found = [link]
    while found[-1] in above:
        found.append(above[found[-1]])
    return found


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--parts", type=int, default=6, help="recordings that they become (6)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.parts)
