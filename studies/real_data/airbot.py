"""An AIRBOT Play, six light joints, whose motors tell torques.

Recordings of github.com/liuyurong129/figaroh_kinova at 9ac8ad7
(``examples/airbot_play/data/identification/chirp_motion``): 100 Hz by the authors' configuration,
positions in steps of 0.38 mrad and torques in steps of 15 and 4.9 mN m, in two files without times.
The links are those of the ``airbot_play_v3_0_gripper.urdf`` beside them, which says nothing of
drives.

Run ``python -m studies.real_data.airbot OUT --raw FOLDER``.
"""

from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64
from studies.real_data.folders import arm_of_motors, hashes_of, in_parts, parser_of, there, write

JOINTS = tuple(f"joint{number}" for number in range(1, 7))
FILES = ("identification_q_real.csv", "identification_tau_real.csv")
_PERIOD = 0.01
_LINKS = """
0 0 0.1172; 1 0 0 0; 0.5571; 7e-05 -0.0018033 -0.0040245; 0.0003647 0.0002944 0.0003449 -2e-07 -1.4e-06 1.1e-06
0 0 0; 0.135866 0.135867 -0.69393 0.693932; 0.64621; 0.22493 0.0047721 0.008023; 0.0004901 0.0051052 0.0050391 -0.0002434 -0.0005229 2.95e-05
0.27009 0 0; 0.55806 0 0 0.8298; 0.28804; -0.000372 0.16316 0.0024748; 0.0026161 0.0002222 0.0025516 1.32e-05 1e-06 -8.17e-05
0 0.30854 0; 1 -1 -1 -1; 0.34876; 5e-06 0.00040412 -0.03228; 0.0049818 0.0050587 0.0003503 7e-07 -0.0001276 3.18e-05
0 0 0; 1 1 0 0; 0.36132; 8e-06 0.026148 0.002525; 0.0004677 0.0001825 0.0004286 0 0 -3.29e-05
0 0.26145 0; 1 -1 0 0; 0.65361; 2e-06 -0.002582 -0.13382; 0.0029561 0.0025189 0.0021828 -6e-07 2.1e-06 0.000241
"""  # noqa: E501
"""Of each joint, which turns about its z: where its body is (m), how that is turned, mass (kg),
centre of mass (m), inertia xx, yy, zz, xy, xz, yz (kg m^2)."""


def convert(out: Path, raw: Path, rows: int = 462, parts: int = 3) -> None:
    """Write the data set: the last rows, at which the chirp is fastest, in parts.

    Args:
        out: the new folder.
        raw: where the recordings lie.
        rows: so many.
        parts: of which every third is held out.
    """
    paths = {name: there(raw, name) for name in FILES}
    q, torque = (np.loadtxt(path, delimiter=",", skiprows=1)[-rows:, :6] for path in paths.values())
    at: Float64 = _PERIOD * np.arange(len(q), dtype=np.float64)
    notes = {
        "source": "github.com/liuyurong129/figaroh_kinova at 9ac8ad7",
        "rows": rows,
        "sha256": hashes_of(paths),
    }
    recordings = in_parts(at, q, torque, (0.0, float(at[-1])), parts)
    write(out, model(), "torque", JOINTS, recordings, notes)


def model() -> str:
    """Return the arm's MJCF."""
    bodies = "".join(
        f"""
    <body name="link{number}" pos="{at}" quat="{quat}">
      <joint name="{joint}" axis="0 0 1"/>
      <inertial mass="{mass}" pos="{centre}" fullinertia="{inertia}"/>"""
        for number, (joint, (at, quat, mass, centre, inertia)) in enumerate(
            zip(JOINTS, (line.split(";") for line in _LINKS.split("\n") if line), strict=True), 1
        )
    )
    return arm_of_motors("airbot_play", JOINTS, f"{bodies}\n    {'</body>' * len(JOINTS)}")


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--rows", type=int, default=462, help="the last ones that are taken (462)")
    parser.add_argument("--parts", type=int, default=3, help="recordings that they become (3)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.rows, args.parts)
