"""The DFKI double pendulum, design C.1: two hinges, each with a motor, hanging.

RealAIGym (github.com/dfki-ric-underactuated-lab/double_pendulum at 1e8544e,
``data/experiment_records``, BSD-3). The torque is what the motors report, with what the controller
added against friction where it did. The model has the authors' identified lengths, masses, centres
and inertias (``params_C.1_model_1.0.yml``), their reflected inertia, and none of their friction.

Run ``python -m studies.real_data.dfki OUT --raw ../shared/data/dfki_double_pendulum``.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from shared.identification.dataset.types import Float64, Split, Trajectory
from studies.real_data.folders import arm_of_motors, hashes_of, parser_of, recording, there, write

JOINTS = ("shoulder", "elbow")
PARAMETERS = "params_C.1_model_1.0.yml"
TRAIN = ("143339", "143601")
TEST = ("143747", "144003")


def convert(out: Path, raw: Path, train: Sequence[str] = TRAIN, test: Sequence[str] = TEST) -> None:
    """Write the data set.

    Args:
        out: the new folder.
        raw: where the recordings and the authors' parameters lie.
        train: times of day of the recordings to fit to.
        test: of those held out.
    """
    paths = {name: there(raw, f"C1_20230629-{name}.csv") for name in (*train, *test)}
    parameters = there(raw, PARAMETERS)
    splits: dict[str, Split] = {**dict.fromkeys(train, "train"), **dict.fromkeys(test, "test")}
    trajectories = tuple(_read(paths[name], name, split) for name, split in splits.items())
    notes = {
        "source": "github.com/dfki-ric-underactuated-lab/double_pendulum at 1e8544e",
        "licence": "BSD-3-Clause",
        "sha256": hashes_of({**paths, "parameters": parameters}),
    }
    model = _model(_parameters(parameters))
    write(out, model, "torque", JOINTS, trajectories, notes)


def _read(path: Path, name: str, split: Split) -> Trajectory:
    table = np.genfromtxt(path, delimiter=",", names=True)

    def columns(kind: str) -> Float64:
        return np.stack([table[f"{kind}{joint}"] for joint in (1, 2)], axis=1)

    torque = columns("tau_meas") + columns("tau_fric")
    return recording(name, split, table["time"], columns("pos_meas"), columns("vel_meas"), torque)


def _parameters(path: Path) -> dict[str, float]:
    """Return the authors' numbers: one ``name: value`` a line."""
    lines = (line.split(":") for line in path.read_text().splitlines() if line.strip())
    return {name.strip(): float(value) for name, value in lines}


def _model(of: dict[str, float]) -> str:
    """Return the MJCF; the authors' I1 and I2 are about the joints, MuJoCo's about the centres."""
    armature = of["gr"] ** 2 * of["Ir"]
    links = [(of[f"m{i}"], of[f"r{i}"], of[f"I{i}"], of[f"l{i}"]) for i in (1, 2)]
    bodies = "".join(
        f"""
    <body name="{joint}" pos="0 0 {-(0.0 if index == 0 else of["l1"])}">
      <joint name="{joint}" type="hinge" axis="0 -1 0" armature="{armature}"/>
      <inertial pos="0 0 {-centre}" mass="{mass}"
                diaginertia="{inertia - mass * centre**2} {inertia - mass * centre**2} 1e-3"/>
      <geom type="capsule" fromto="0 0 0 0 0 {-length}" size="0.02"/>"""
        for index, (joint, (mass, centre, inertia, length)) in enumerate(
            zip(JOINTS, links, strict=True)
        )
    )
    closed = f"{bodies}\n    </body></body>"
    return arm_of_motors("double_pendulum", JOINTS, closed, of["g"])


if __name__ == "__main__":
    parser = parser_of(__doc__, Path("../shared/data/dfki_double_pendulum"))
    parser.add_argument("--train", nargs="+", default=TRAIN, metavar="TIME", help="to fit to")
    parser.add_argument("--test", nargs="+", default=TEST, metavar="TIME", help="to hold out")
    args = parser.parse_args()
    convert(args.out, args.raw, args.train, args.test)
