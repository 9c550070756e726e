"""The EMPS benchmark: a carriage on a ball screw, driven by one motor.

Janot, Gautier, Brunot, "Data set and reference models of EMPS", Nonlinear System Identification
Benchmarks 2019. The drive's force is ``gtau * vir``. What the second recording calls ``pulses_N``
is no force in newton: it is 5 V (175.8 N) added to the controller's voltage for every other half
second, and it is contained in ``vir``: at each of its edges vir jumps by 5.1 V within 1 ms, and the
carriage follows as 95 kg do. The pulses are hidden by taking them out of ``vir``.

Run ``python -m studies.real_data.emps OUT --raw ../shared/data/emps``.
"""

from pathlib import Path
from typing import Literal, get_args

import numpy as np
from scipy.io import loadmat

from shared.identification.dataset.types import Float64, Trajectory
from studies.real_data.folders import hashes_of, parser_of, recording, there, write

JOINT = "carriage"
MODEL = f"""<mujoco model="emps">
  <option timestep="0.001" gravity="0 0 0"/>
  <worldbody>
    <body name="{JOINT}">
      <joint name="{JOINT}" type="slide" axis="1 0 0" damping="200"/>
      <geom type="box" size="0.1 0.1 0.1" mass="95"/>
    </body>
  </worldbody>
  <actuator>
    <motor name="{JOINT}" joint="{JOINT}"/>
  </actuator>
</mujoco>
"""
"""Mass and viscous friction, nothing else: what the data sheet of such a drive would say."""
FILES = {"plain": "DATA_EMPS.mat", "pulses": "DATA_EMPS_PULSES.mat"}
Pulses = Literal["known", "hidden"]


def convert(out: Path, raw: Path, pulses: Pulses = "known") -> None:
    """Write the data set: the plain recording to fit to, the one with pulses held out.

    Args:
        out: the new folder.
        raw: where the two MATLAB files lie.
        pulses: whether the torque log knows of the pulses.
    """
    paths = {name: there(raw, file) for name, file in FILES.items()}
    trajectories = (
        _read(paths["plain"], "plain", "known"), _read(paths["pulses"], "pulses", pulses)
    )  # fmt: skip
    notes = {
        "source": "nonlinearbenchmark.org, EMPS; Janot, Gautier, Brunot 2019",
        "licence": "none given: cite the authors",
        "pulses": pulses,
        "sha256": hashes_of(paths),
    }
    write(out, MODEL, "torque", (JOINT,), trajectories, notes)


def _read(path: Path, name: str, pulses: Pulses) -> Trajectory:
    tables = loadmat(path)

    def column(key: str) -> Float64:
        return np.asarray(tables[key], np.float64).ravel()

    volts = column("vir")
    if pulses == "hidden":
        volts = volts - column("pulses_N")
    force = column("gtau")[0] * volts
    split = "train" if name == "plain" else "test"
    return recording(name, split, column("t"), column("qm")[:, None], None, force[:, None])


if __name__ == "__main__":
    parser = parser_of(__doc__, Path("../shared/data/emps"))
    parser.add_argument("--pulses", choices=get_args(Pulses), default="known")
    args = parser.parse_args()
    convert(args.out, args.raw, args.pulses)
