"""A UR10e that follows sums of sines, with and without a load of 2.8 kg at its flange.

Recordings of github.com/shamilmamedov/dynamic_calibration at 174ccbd (``data_ur10`` and
``dataset_ur10e``): 100 Hz, positions (0.1 mrad), velocities and motor currents. The torque is the
current by the drive gains that the authors quote (``main.m``). The model has the maker's lengths
and masses as MuJoCo Menagerie's ``universal_robots_ur10e`` has them; what it says of the drives
(rotors of 0.1 kg m^2, dampings that stand for a controller) is not the arm's, and no joint rubs.

Run ``python -m studies.real_data.ur10e OUT --raw FOLDER --train FILE --test FILE``.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.real_data.folders import arm_of_motors, hashes_of, parser_of, recording, there, write

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
GAINS = np.array([14.87, 13.26, 11.13, 10.62, 11.03, 11.47])
"""Of each drive (N m/A)."""
_LINKS = """
0 0 0.181; 1 0 0 0; 0 0 1; 7.778; 0 0 0; 0.0314743 0.0314743 0.0218756; 1 0 0 0
0 0.176 0; 1 0 1 0; 0 1 0; 12.93; 0 0 0.3065; 0.423074 0.423074 0.0363656; 1 0 0 0
0 -0.137 0.613; 1 0 0 0; 0 1 0; 3.87; 0 0 0.2855; 0.11059 0.11059 0.0108844; 1 0 0 0
0 0 0.571; 1 0 1 0; 0 1 0; 1.96; 0 0.135 0; 0.0055125 0.00510825 0.00510825; 0.5 0.5 -0.5 0.5
0 0.135 0; 1 0 0 0; 0 0 1; 1.96; 0 0 0.12; 0.0055125 0.00510825 0.00510825; 0.5 0.5 -0.5 0.5
0 0 0.12; 1 0 0 0; 0 1 0; 0.202; 0 0.092 0; 0.000204525 0.000144346 0.000144346; 0 1 -1 0
"""
"""Of each joint: where its body is (m), how that is turned, axis, mass (kg), centre of mass (m),
inertia (kg m^2), how that is turned."""


def convert(
    out: Path, raw: Path, train: Sequence[str], test: Sequence[str], damping: float = 10.0
) -> None:
    """Write the data set.

    Args:
        out: the new folder.
        raw: where the recordings lie.
        train: ``file[:first[:last]]`` to fit to, rows counted from 0.
        test: the same, held out.
        damping: that the model has at every joint (N m s/rad).
    """
    splits: dict[str, Split] = {**dict.fromkeys(train, "train"), **dict.fromkeys(test, "test")}
    paths = {each: there(raw, each.split(":")[0]) for each in splits}
    trajectories = tuple(
        _read(paths[each], each, f"{split}_{number}", split)
        for number, (each, split) in enumerate(splits.items(), 1)
    )
    notes = {
        "source": "github.com/shamilmamedov/dynamic_calibration at 174ccbd",
        "rows": list(splits),
        "sha256": hashes_of(paths),
    }
    write(out, _model(damping), "torque", JOINTS, trajectories, notes)


def _read(path: Path, rows: str, name: str, split: Split) -> Trajectory:
    """Return one recording: time, six positions, velocities, currents, and what was wanted."""
    first, last = [*rows.split(":")[1:], "", ""][:2]
    table: Float64 = np.loadtxt(path, delimiter=",")
    table = table[int(first or 0) : int(last) if last else None]
    return recording(
        name, split, table[:, 0], table[:, 1:7], table[:, 7:13], table[:, 13:19] * GAINS
    )


def _model(damping: float) -> str:
    bodies = "".join(
        f"""
    <body pos="{at}" quat="{quat}">
      <joint name="{joint}" axis="{axis}" damping="{damping}" armature="0.1"/>
      <inertial mass="{mass}" pos="{centre}" diaginertia="{inertia}" quat="{turned}"/>
      <geom type="sphere" size="0.05" contype="0" conaffinity="0"/>"""
        for joint, (at, quat, axis, mass, centre, inertia, turned) in zip(
            JOINTS, (line.split(";") for line in _LINKS.split("\n") if line), strict=True
        )
    )
    base = f'\n    <body quat="1 0 0 1">{bodies}\n    {"</body>" * (1 + len(JOINTS))}'
    return arm_of_motors("ur10e", JOINTS, base)


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--train", nargs="+", required=True, metavar="FILE[:FIRST[:LAST]]")
    parser.add_argument("--test", nargs="+", required=True, metavar="FILE[:FIRST[:LAST]]")
    parser.add_argument("--damping", type=float, default=10.0, help="of the model (N m s/rad)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.train, args.test, args.damping)
