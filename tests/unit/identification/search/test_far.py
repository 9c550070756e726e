"""What is told of a base whose links are not as the model file has them."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from shared.identification.search.far import bent_beyond_belief
from tests.searches import Searches


def test_links_that_are_bent_beyond_belief_are_told_largest_first(tmp_path: Path) -> None:
    found = Searches(tmp_path).search(np.full(8, 3.0))
    names = [each.name for each in found.problem.parameters]
    assert bent_beyond_belief(found) == ""
    z = found.current.z.copy()
    masses = [index for index, name in enumerate(names) if name.startswith("mass ")]
    z[masses[0]], z[masses[1]] = np.log(0.6), np.log(2.0)
    z[names.index("damping pan")] = 2.0  # of which nothing is known
    found.current = replace(found.current, z=z)
    told = bent_beyond_belief(found)
    for index, times in ((masses[0], 0.6), (masses[1], 2.0)):
        each = found.problem.parameters[index]
        said = f"{each.name} {times * each.nominal:.3g} kg for {each.nominal:.3g}"
        assert said in told
    assert told.index(names[masses[1]]) < told.index(names[masses[0]])
    assert "damping" not in told
