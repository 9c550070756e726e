"""Whether a base is still far from the model file once that is believed more."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.shown import if_shown
from shared.identification.fitting.space import Space
from shared.identification.gate.held_out import stretches
from shared.identification.search.bent import (
    _brings_back,  # pyright: ignore[reportPrivateUsage]
    _known,  # pyright: ignore[reportPrivateUsage]
    _still_far,  # pyright: ignore[reportPrivateUsage]
)
from shared.identification.search.far import (
    _are_shown,  # pyright: ignore[reportPrivateUsage]
    far_of,
    surely_far,
)
from shared.sim.plant.row import Row
from tests.geared import candidates
from tests.measured import measure, nothing, problem_of

NAME = "armature elbow"


def stiff(row: Row) -> None:
    """Let the elbow's rotor have eight times its inertia."""
    dof = int(row.model.joint(row.plant.mj_joint("elbow")).dofadr[0])
    row.field("dof_armature")[dof] *= 8.0


def bases(folder: Path, *, is_far: bool) -> tuple[Fit, Space]:
    """Return a base at its best, but for a rotor without inertia, and where it is asked again."""
    enter = stiff if is_far else nothing
    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=4.0))
    space, train = Space(problem), problem.of("train")
    found = polish(space, np.zeros(space.size), train)
    index = [each.name for each in problem.parameters].index(NAME)
    z = found.z.copy()
    z[index] = z[index] if is_far else space.bounds[0][index]
    return Fit.at(space, z, train), Space(replace(problem, parameters=_known(problem)))


def test_what_only_these_recordings_show_of_an_arm_is_not_forgotten(tmp_path: Path):
    problem = problem_of(measure(tmp_path, np.random.default_rng(0), seconds=2.0))
    more = if_shown(problem.subject)
    assert _known(problem.freer(more))[len(problem.parameters) :] == more


def test_a_base_that_only_went_far_where_nothing_holds_it_comes_back(tmp_path: Path):
    """A rotor of next to no inertia is hardly felt, nor is one of a little."""
    base, space = bases(tmp_path, is_far=False)
    assert _still_far(base, space) is None


def test_a_base_of_which_the_recordings_say_that_it_is_far_stays_there(tmp_path: Path):
    base, space = bases(tmp_path, is_far=True)
    found = _still_far(base, space)
    assert found is not None
    names = [each.name for each in space.problem.parameters]
    assert [names[index] for index in surely_far(found)] == [NAME]
    assert found.z[names.index(NAME)] == pytest.approx(np.log(8.0), rel=0.1)


@pytest.mark.parametrize("is_far", [True, False])
def test_a_number_that_can_be_put_back_at_no_cost_is_not_shown(tmp_path: Path, is_far: bool):
    base, _ = bases(tmp_path, is_far=is_far)
    index = [each.name for each in base.space.problem.parameters].index(NAME)
    assert index in far_of(base)
    losses = stretches(base.space.problem, base.variant, base.space.problem.of("test"))
    assert _are_shown(base, losses, [index]) is is_far
    assert not _are_shown(base, 1e6 * losses, [index])  # held-out motion would rather have it back


@pytest.mark.parametrize(
    ("less", "alone", "with_more"), [(14.0, False, False), (20.0, True, False), (32.0, True, True)]
)
def test_a_cause_of_many_numbers_must_explain_more_than_one_of_one(
    tmp_path: Path, less: float, alone: bool, with_more: bool
):
    base, _ = bases(tmp_path, is_far=True)
    index = [each.name for each in base.space.problem.parameters].index(NAME)

    def nearer(candidate: Candidate) -> Fit:
        space = base.space.grown(candidate)
        z = np.r_[base.z, np.zeros(space.size - base.space.size)]
        z[index] = 0.0
        return replace(base, space=space, z=z, cost=base.cost - less)

    (torque,) = (
        each for each in candidates(base.space.problem, "torque_bias") if each.place == "elbow"
    )
    carried = candidates(base.space.problem, "payload")[-1]  # its mass, where, and how it turns
    assert _brings_back(base, nearer(torque)) is alone
    assert nearer(carried).space.size == base.space.size + 5
    assert _brings_back(base, nearer(carried)) is with_more
