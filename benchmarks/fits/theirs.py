"""`mujoco.sysid` on that fit: ``python -m benchmarks.fits.theirs FILE.npz`` prints JSON.

Runs in the environment of `benchmarks/requirements/sysid.txt`.
"""
# pyright: basic

import json
import sys
import time

import mujoco
import numpy as np
from mujoco import sysid

from benchmarks.fits.arm import GUESS, HIGH, JOINTS, LOW, arm


def main() -> None:
    """Fit and print armatures and seconds."""
    with np.load(sys.argv[1]) as kept:
        times, torques, q, qd = (kept[name] for name in ("times", "torques", "q", "qd"))
    spec = arm((GUESS,) * len(JOINTS))
    cpu, wall = time.process_time(), time.perf_counter()
    params = sysid.ParameterDict()
    for name in JOINTS:
        params.add(
            sysid.Parameter(
                name, nominal=GUESS, min_value=LOW, max_value=HIGH,
                modifier=lambda spec, p, name=name: setattr(
                    spec.joint(name), "armature", p.value[0]
                ),
            )
        )  # fmt: skip
    model = spec.compile()
    data = mujoco.MjData(model)
    start = sysid.create_initial_state(model, data.qpos, data.qvel, data.act)
    seen = sysid.TimeSeries.from_names(times, np.hstack([q, qd]), model)
    sequence = sysid.ModelSequences(
        "arm", spec, "one", start, sysid.TimeSeries(times, torques), seen
    )
    residual = sysid.build_residual_fn(models_sequences=[sequence])
    found, _ = sysid.optimize(params, residual, optimizer="mujoco", verbose=False)
    json.dump(
        {
            "cpu_s": time.process_time() - cpu,
            "wall_s": time.perf_counter() - wall,
            "armatures": [float(found[name].value[0]) for name in JOINTS],
        },
        sys.stdout,
    )


if __name__ == "__main__":
    main()
