"""Our identification on that fit: ``python -m benchmarks.fits.ours FOLDER`` prints JSON.

The base fit's own steps (`shared.identification.fitting.fit.polish`) on short parts, then on the
whole recording; the armatures are the only parameters. Reading the data set is not timed.
"""

import json
import sys
import time
from pathlib import Path

import numpy as np

from benchmarks.fits.arm import JOINTS
from shared.identification.arm.subject import subject_of
from shared.identification.dataset.reading import read_dataset
from shared.identification.fitting.base import WINDOW
from shared.identification.fitting.fit import polish
from shared.identification.fitting.parameters import base_parameters
from shared.identification.fitting.problem import BLOCK, Problem
from shared.identification.fitting.space import Space
from shared.identification.noise.floor import noise_of

STEPS = 30
ENOUGH = 1e-5


def main() -> None:
    """Fit and print armatures and seconds."""
    dataset = read_dataset(Path(sys.argv[1]))
    cpu, wall = time.process_time(), time.perf_counter()
    subject = subject_of(dataset)
    known = tuple(each for each in base_parameters(subject) if each.name.startswith("armature "))
    problem = Problem(subject, dataset, known, noise_of(dataset, BLOCK, subject.starts))
    parts = Space(problem.in_parts(WINDOW))
    begun = polish(parts, np.zeros(parts.size), parts.problem.of("train"))
    fit = polish(Space(problem), begun.z, problem.of("train"), STEPS, ENOUGH)
    found = {
        each.name.split()[1]: each.value(float(z)) for each, z in zip(known, fit.z, strict=True)
    }
    json.dump(
        {
            "cpu_s": time.process_time() - cpu,
            "wall_s": time.perf_counter() - wall,
            "armatures": [found[name] for name in JOINTS],
        },
        sys.stdout,
    )


if __name__ == "__main__":
    main()
