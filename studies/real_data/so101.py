"""An SO-101: five joints of hobby servos that are told positions, its jaw held.

Recordings of github.com/isaac-sim2real/sage (``output/real/so101/custom``): 50 Hz, in steps of
1.5 mrad, of Feetech STS3215 servos. The links are the maker's, as Menagerie has them
(``robotstudio_so101``). Of the servos the file has stand-ins: what others use for the same gain.

Run ``python -m studies.real_data.so101 OUT --raw FOLDER``.
"""

import csv
import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.real_data.folders import hashes_of, parser_of, there, write

JOINTS = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll")
TRAIN = ("prbs_excitation", "multisine", "chirp_sweep")
TEST = ("coupled_joints", "frequency_sweep")
_MODEL = """<mujoco model="so101">
  <compiler angle="radian"/>
  <option timestep="0.002"/>
  <default>
    <joint axis="0 0 1" damping="0.6" frictionloss="0.052" armature="0.028"/>
    <position kp="17.8" forcerange="-2.94 2.94"/>
  </default>
  <worldbody>
    <body name="shoulder" pos="0.0388353 0 0.0624" quat="0 0 -1 0">
      <joint name="shoulder_pan"/>
      <inertial pos="-0.0307604 -1.7e-05 -0.0252713" mass="0.100006"
        fullinertia="8.3759e-05 8.10403e-05 2.39783e-05 7.55525e-08 -1.16342e-06 1.54663e-07"/>
      <body name="upper_arm" pos="-0.0303992 -0.0182778 -0.0542" quat="1 -1 -1 -1">
        <joint name="shoulder_lift"/>
        <inertial pos="-0.089847 -0.008382 0.018409" mass="0.103"
          fullinertia="4.08002e-05 0.000147318 0.000142487 -1.97819e-05 -4.03016e-08 8.97326e-09"/>
        <body name="lower_arm" pos="-0.11257 -0.028 0" quat="1 0 0 1">
          <joint name="elbow_flex"/>
          <inertial pos="-0.098070 0.0032438 0.018283" mass="0.104"
            fullinertia="2.87438e-05 0.000159844 0.00014529 7.41152e-06 1.26409e-06 -4.90188e-08"/>
          <body name="wrist" pos="-0.1349 0.0052 0" quat="1 0 0 -1">
            <joint name="wrist_flex"/>
            <inertial pos="-0.000103312 -0.0386143 0.0281156" mass="0.079"
              fullinertia="3.68263e-05 2.5391e-05 2.1e-05 1.7893e-08 -5.28128e-08 3.6412e-06"/>
            <body name="gripper" pos="0 -0.0611 0.0181"
                quat="0.0172091 -0.0172091 0.706897 0.706897">
              <joint name="wrist_roll"/>
              <inertial pos="0.000214 0.000245 -0.025187" mass="0.087"
                fullinertia="2.75087e-05 4.33657e-05 3.45059e-05 -3.35241e-07 -5.7352e-06
                -5.17847e-08"/>
              <body name="jaw" pos="0.0202 0.0188 -0.0234" quat="1 1 0 0">
                <inertial pos="-0.001575 -0.0300244 0.0192755" mass="0.012"
                  fullinertia="6.61427e-06 1.89032e-06 5.28738e-06 -3.19807e-07 -5.90717e-09
                  -1.09945e-07"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>{servos}
  </actuator>
</mujoco>
"""


def convert(
    out: Path, raw: Path, seconds: float = 11.0,
    train: Sequence[str] = TRAIN, test: Sequence[str] = TEST,
) -> None:  # fmt: skip
    """Write the data set.

    Args:
        out: the new folder.
        raw: a folder for each motion, with ``control.csv`` and ``state_motor.csv``.
        seconds: so much of each.
        train: motions to fit to.
        test: those held out.
    """
    files: dict[str, Path] = {}
    trajectories: list[Trajectory] = []
    for name, split in [*((each, "train") for each in train), *((each, "test") for each in test)]:
        told, logged = (there(raw / name, file) for file in ("control.csv", "state_motor.csv"))
        files |= {f"{name}/{told.name}": told, f"{name}/{logged.name}": logged}
        trajectories.append(_recording(name, split, _table(told), _table(logged), seconds))
    notes = {"source": "github.com/isaac-sim2real/sage", "sha256": hashes_of(files)}
    servos = "".join(f'\n    <position name="{name}" joint="{name}"/>' for name in JOINTS)
    write(out, _MODEL.format(servos=servos), "position", JOINTS, tuple(trajectories), notes)


def _recording(
    name: str, split: Split, told: Float64, logged: Float64, seconds: float
) -> Trajectory:
    begin = min(told[0, 0], logged[0, 0])
    told, logged = (each[each[:, 0] <= begin + seconds] for each in (told, logged))
    at, q = logged[:, 0] - begin, logged[:, 1:]
    return Trajectory(
        name, split, "", q[0], np.zeros(q.shape[1]), told[:, 0] - begin, told[:, 1:], at, q
    )


def _table(path: Path) -> Float64:
    """Return float64[T, 1 + J]: seconds, positions (rad)."""
    with path.open(newline="") as file:
        rows = list(csv.DictReader(file))
    at = np.array([float(row["timestamp"]) for row in rows]) * 1e-6
    q = np.array([json.loads(row["positions"])[: len(JOINTS)] for row in rows], np.float64)
    return np.column_stack([at, q])


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--seconds", type=float, default=11.0, help="so much of each (11)")
    for name, motions in (("train", TRAIN), ("test", TEST)):
        parser.add_argument(
            f"--{name}", nargs="+", default=motions, metavar="MOTION", help=" ".join(motions)
        )
    args = parser.parse_args()
    convert(args.out, args.raw, args.seconds, args.train, args.test)
