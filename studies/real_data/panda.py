"""A Franka Emika Panda that follows a sum of sines, its torques measured beyond its gears.

Recordings of github.com/marcocognetti/FrankaEmikaPandaDynModel at 44f1ec8
(``matlab/data/Exciting_Traj/Trajectory_1/rbt_log``; Gaz et al., RA-L 2019): 1 kHz, positions and
the torque sensors of all seven joints, with the time at which each reading came. The model has the
links as MuJoCo Menagerie's ``franka_emika_panda`` has them, whose rotors of 0.1 kg m^2 and dampings
of 1 stand for a controller; no joint rubs.

Run ``python -m studies.real_data.panda OUT --raw FOLDER``.
"""

from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64
from studies.real_data.folders import arm_of_motors, hashes_of, in_parts, parser_of, there, write

JOINTS = tuple(f"joint{number}" for number in range(1, 8))
FILES = {name: f"exciting_traj_{name}.txt" for name in ("time", "positions", "torques")}
_LINKS = """
0 0 0.333; 1 0; 4.970684; 0.003875 0.002081 -0.04762; 0.70337 0.70661 0.009117 -0.000139 0.006772 0.019169
0 0 0; 1 -1; 0.646926; -0.003141 -0.02872 0.003495; 0.007962 0.02811 0.025995 -0.003925 0.010254 0.000704
0 -0.316 0; 1 1; 3.228604; 0.027518 0.039252 -0.066502; 0.037242 0.036155 0.01083 -0.004761 -0.011396 -0.012805
0.0825 0 0; 1 1; 3.587895; -0.05317 0.104419 0.027454; 0.025853 0.019552 0.028323 0.007796 -0.001332 0.008641
-0.0825 0.384 0; 1 -1; 1.225946; -0.011953 0.041065 -0.038437; 0.035549 0.029474 0.008627 -0.002117 -0.004037 0.000229
0 0 0; 1 1; 1.666555; 0.060149 -0.014117 -0.010517; 0.001964 0.004354 0.005433 0.000109 -0.001158 0.000341
0.088 0 0; 1 1; 0.735522; 0.010517 -0.004252 0.061597; 0.012516 0.010027 0.004815 -0.000428 -0.001196 -0.000741
"""  # noqa: E501
"""Of each joint: where its body is (m), how that is turned about x, mass (kg), centre of mass (m),
inertia (kg m^2: xx, yy, zz, xy, xz, yz)."""
_BEGIN = 0.3
"""Until then it stands (s)."""


def convert(out: Path, raw: Path, seconds: float = 15.0, every: int = 5, parts: int = 6) -> None:
    """Write the data set: parts of one length, of which every third is held out.

    Args:
        out: the new folder.
        raw: where the recordings lie.
        seconds: so much of them.
        every: of so many readings one is taken.
        parts: recordings that they become.
    """
    paths = {name: there(raw, file) for name, file in FILES.items()}
    at: Float64 = np.loadtxt(paths["time"])
    q, torque = (np.loadtxt(paths[name]).reshape(-1, 7) for name in ("positions", "torques"))
    at = at[: min(len(at), len(q), len(torque))]
    trajectories = in_parts(at, q, torque, (_BEGIN, seconds), parts, every)
    notes = {
        "source": "github.com/marcocognetti/FrankaEmikaPandaDynModel at 44f1ec8",
        "sha256": hashes_of(paths),
    }
    write(out, _model(), "torque", JOINTS, trajectories, notes)


def _model() -> str:
    links = (line.split(";") for line in _LINKS.split("\n") if line)
    bodies = "".join(
        f"""
    <body pos="{at}" quat="{turned} 0 0">
      <joint name="{joint}" axis="0 0 1" damping="1" armature="0.1"/>
      <inertial mass="{mass}" pos="{centre}" fullinertia="{inertia}"/>
      <geom type="sphere" size="0.05" contype="0" conaffinity="0"/>"""
        for joint, (at, turned, mass, centre, inertia) in zip(JOINTS, links, strict=True)
    )
    return arm_of_motors("panda", JOINTS, bodies + "\n    " + "</body>" * len(JOINTS))


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--seconds", type=float, default=15.0, help="so much of them (15)")
    parser.add_argument("--every", type=int, default=5, help="of so many readings one (5)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.seconds, args.every)
