"""A pendubot: two links that hang, a motor at the shoulder, an elbow that nothing drives.

Recordings of github.com/shamilmamedov/dynamic_calibration at 0eeac77
(``planar2DOF/data_pndbt/data_06.csv`` and others): 200 Hz by the clock of the computer, both
encoders, the current of the motor, which its authors take for 0.123 N m/A. The model is theirs by
construction drawings (``planar_manip.urdf``): nothing rubs, and the motor has no rotor.

Run ``python -m studies.real_data.pendubot OUT --raw FOLDER``.
"""

from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64
from studies.real_data.folders import arm_of_motors, hashes_of, in_parts, parser_of, there, write

JOINTS = ("shoulder", "elbow")
DRIVEN = JOINTS[:1]
FILE = "data_06.csv"
_TORQUE = -0.123
"""Of a current (N m/A); positive turns a link up, as positions have it."""
_BODIES = """
    <body name="upper">
      <joint name="shoulder" axis="0 -1 0"/>
      <inertial pos="0.043 0 0" mass="1.085" diaginertia="0.01 0.008 0.01"/>
      <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.02"/>
      <body name="fore" pos="0.25 0 0">
        <joint name="elbow" axis="0 -1 0"/>
        <inertial pos="0.0954 0 0" mass="0.26" diaginertia="0.01 0.002 0.01"/>
        <geom type="capsule" fromto="0 0 0 0.25 0 0" size="0.015"/>
      </body>
    </body>"""


def convert(out: Path, raw: Path, seconds: float = 12.0, parts: int = 6) -> None:
    """Write the data set: parts of one length, of which every third is held out.

    Args:
        out: the new folder.
        raw: where the recording lies.
        seconds: so much of it.
        parts: recordings that it becomes.
    """
    path = there(raw, FILE)
    table: Float64 = np.loadtxt(path, delimiter=",")
    at, q, torque = table[:, 0] - table[0, 0], table[:, 1:3], _TORQUE * table[:, 5:6]
    trajectories = in_parts(at, q, torque, (0.0, seconds), parts)
    notes = {
        "source": "github.com/shamilmamedov/dynamic_calibration at 0eeac77",
        "sha256": hashes_of({FILE: path}),
    }
    model = arm_of_motors("pendubot", DRIVEN, _BODIES)
    write(out, model, "torque", JOINTS, trajectories, notes, DRIVEN)


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--seconds", type=float, default=12.0, help="so much of it (12)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.seconds)
