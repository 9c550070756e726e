"""Base parameters that are fitted only where recordings show them."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.fitting.base import BaseFits
from shared.identification.fitting.fit import Start, polish
from shared.identification.fitting.lead import ahead_of_commands
from shared.identification.fitting.problem import Problem
from shared.identification.fitting.shown import if_shown, with_shown
from shared.identification.fitting.space import Space
from shared.sim.plant.row import Row
from tests.measured import Enter, measure, nothing, problem_of

_EARLY = 0.004


def _early(row: Row) -> None:
    row.command = row.command.later(-_EARLY)


def _fits(problem: Problem) -> BaseFits:
    space, train = Space(problem), problem.of("train")
    fit = polish(space, np.zeros(space.size), train, 4)
    return BaseFits(Start(fit.z, fit.jacobian), fit, fit)


def _shown(folder: Path, enter: Enter) -> tuple[BaseFits, BaseFits]:
    """Return the fits of an arm of which only masses are not known, without and with what shows."""
    problem = problem_of(measure(folder, np.random.default_rng(0), enter))
    words = [each.name.split()[0] for each in problem.parameters]
    known = [index for index, word in enumerate(words) if word != "mass"]
    done = _fits(problem.without(known))
    return done, with_shown(done, if_shown(problem.subject))


def test_what_recordings_do_not_show_is_not_fitted(tmp_path: Path):
    done, found = _shown(tmp_path, nothing)
    assert found is done
    assert with_shown(done, ()) is done
    assert ahead_of_commands(found.whole) == ""


def test_what_they_show_is(tmp_path: Path):
    """Joints that creep: ``tests/integration/identification/test_plain_mujoco.py``."""
    done, found = _shown(tmp_path, _early)
    (lead,) = found.whole.space.problem.parameters[done.whole.z.size :]
    assert lead.name == "command_lead"
    assert lead.value(float(found.whole.z[-1])) == pytest.approx(_EARLY, rel=0.05)
    assert "4 ms ahead of their commands" in ahead_of_commands(found.whole)
    assert found.whole.cost < 0.5 * done.whole.cost
