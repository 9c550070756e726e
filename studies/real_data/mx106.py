"""A Dynamixel MX-106 that turns a rod with three discs, 0.87 kg, straight up where it is at 0.

Recordings of github.com/RnD-king/Jandi_real2sim at 70fb42e (``results/mode3_bam/
mx106_id24_p850_20260913_v2/mujoco_validation/mass3_distance2``, a ``comparison.csv`` each): 100 Hz
by times that were measured, goals and positions in steps of 1.5 mrad. What turns is by the authors'
scales and rulers (``bench.yaml``); of the servo the file has stand-ins.

Run ``python -m studies.real_data.mx106 OUT --raw FOLDER``.
"""

from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Split, Trajectory
from studies.real_data.folders import hashes_of, parser_of, there, write

JOINT = "pivot"
MOTIONS: dict[str, tuple[Split, float, float]] = {
    "sin_sin": ("train", 0.0, 4.085),
    "sin_time_square": ("train", 2.255, 6.0),
    "up_and_down": ("test", 0.0, 4.0),
}
"""What each is for, and what of it is taken (s)."""
_FILE = "{}/repeat_3/comparison.csv"
_MODEL = """<mujoco model="mx106">
  <compiler angle="radian"/>
  <option timestep="0.002" gravity="0 0 -9.80665"/>
  <worldbody>
    <body name="pendulum">
      <joint name="pivot" axis="0 1 0" armature="0.03" damping="{damping}"
        frictionloss="{friction}"/>
      <inertial pos="0 0 0.14534" mass="0.8732" diaginertia="0.000882 0.000882 0.000882"/>
      <geom type="capsule" fromto="0 0 0 0 0 0.15" size="0.01" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
  <actuator><position name="pivot" joint="pivot" kp="{kp}"/></actuator>
</mujoco>
"""
_START = 7
"""Readings that the first speed is told from."""


def convert(
    out: Path, raw: Path, kp: float = 40.0, damping: float = 0.5, friction: float = 0.1
) -> None:
    """Write the data set.

    Args:
        out: the new folder.
        raw: where the recordings lie.
        kp: of the model (N m/rad).
        damping: of the model (N m s/rad).
        friction: of the model (N m).
    """
    paths = {name: there(raw, _FILE.format(name)) for name in MOTIONS}
    notes = {
        "source": "github.com/RnD-king/Jandi_real2sim at 70fb42e",
        "sha256": hashes_of(paths),
    }
    model = _MODEL.format(kp=kp, damping=damping, friction=friction)
    recordings = tuple(_read(name, path) for name, path in paths.items())
    write(out, model, "position", (JOINT,), recordings, notes)


def _read(name: str, path: Path) -> Trajectory:
    split, first, last = MOTIONS[name]
    table = np.genfromtxt(path, delimiter=",", names=True)
    table = table[(table["time_sec"] >= first) & (table["time_sec"] <= last)]
    at = table["time_sec"] - table["time_sec"][0]
    goal, q = table["goal_position_rad"][:, None], table["real_position_rad"][:, None]
    speed = np.polyfit(at[:_START], q[:_START, 0], 1)[0]
    return Trajectory(name, split, "", q[0], np.array([speed]), at, goal, at, q)


if __name__ == "__main__":
    parser = parser_of(__doc__)
    parser.add_argument("--kp", type=float, default=40.0, help="of the model (40 N m/rad)")
    parser.add_argument("--damping", type=float, default=0.5, help="(0.5 N m s/rad)")
    parser.add_argument("--friction", type=float, default=0.1, help="(0.1 N m)")
    args = parser.parse_args()
    convert(args.out, args.raw, args.kp, args.damping, args.friction)
