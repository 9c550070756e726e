"""Two links that hang, each turned by a motor on the stand, the outer one by a belt.

Recordings of github.com/lvjonok/mujoco-sysid at cc768d5 (``data/trajectories/two_link``,
``two_link_observer_05_norm.csv`` and ``..._fast.csv``): 100 Hz, both links' angles to the horizon
in steps of 0.38 mrad, and the currents of both motors. The links and 1/400 N m a unit of current
are by the authors' numbers (``_model.py`` beside them), in which nothing is carried and nothing
rubs; what the ``05`` of the names stands for they do not say.

That the second motor turns the outer link against the stand, not against the first link, is read
off the recordings: a regression leaves 8 units of its current then, and 28 otherwise.

Run ``python -m studies.real_data.two_links OUT --raw FOLDER``.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64, Trajectory
from studies.real_data.folders import arm_of_motors, hashes_of, in_parts, parser_of, there, write

JOINTS = ("shoulder", "elbow")
FILES = ("two_link_observer_05_norm.csv", "two_link_observer_05_fast.csv")
_PARTS = 3
_TORQUE = 1.0 / 400.0
"""Of a unit of current (N m)."""
_BODIES = """
    <body name="upper">
      <joint name="shoulder" axis="0 -1 0"/>
      <inertial pos="0.144 0 0" mass="0.91" diaginertia="0.001 0.012 0.012"/>
      <geom type="capsule" fromto="0 0 0 0.327 0 0" size="0.02"/>
      <body name="fore" pos="0.327 0 0">
        <joint name="elbow" axis="0 -1 0"/>
        <inertial pos="0.1 0 0" mass="0.19" diaginertia="0.0001 0.0009 0.0009"/>
        <geom type="capsule" fromto="0 0 0 0.2 0 0" size="0.015"/>
      </body>
    </body>"""


def convert(out: Path, raw: Path, begin: float = 11.3, seconds: float = 3.57) -> None:
    """Write the data set: three parts of each recording, of which the last one is held out.

    Args:
        out: the new folder.
        raw: where the recordings lie.
        begin: from when on (s).
        seconds: so much of each.
    """
    paths = {name: there(raw, name) for name in FILES}
    parts: list[Trajectory] = []
    for name, path in paths.items():
        parts += _parts(
            name.removesuffix(".csv").rsplit("_", 1)[1], np.loadtxt(path), begin, seconds
        )
    notes = {
        "source": "github.com/lvjonok/mujoco-sysid at cc768d5",
        "sha256": hashes_of(paths),
    }
    write(out, arm_of_motors("two_links", JOINTS, _BODIES), "torque", JOINTS, tuple(parts), notes)


def _parts(name: str, table: Float64, begin: float, seconds: float) -> list[Trajectory]:
    """Return a recording in parts, of the elbow's angle and what turns each joint.

    Of float64[T, 7]: time, the angle and speed of each link, both currents.
    """
    at, upper, fore = table[:, 0], table[:, 1], table[:, 3]
    first, second = _TORQUE * table[:, 5], _TORQUE * table[:, 6]
    q = np.column_stack([upper, fore - upper])
    torque = np.column_stack([first + second, second])  # the second one pushes off the stand
    return [
        replace(each, name=f"{name}_{each.name}")
        for each in in_parts(at, q, torque, (begin, begin + seconds), _PARTS)
    ]


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--begin", type=float, default=11.3, help="from when on (11.3 s)")
    parser.add_argument("--seconds", type=float, default=3.57, help="so much of each (3.57)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.begin, args.seconds)
