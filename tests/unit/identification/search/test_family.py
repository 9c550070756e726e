"""An effect that was named at one joint, looked for at the others."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.cogging import EFFECT as COGGING
from shared.identification.catalogue.gravity_tilt import EFFECT as TILT
from shared.identification.catalogue.nonlinear_viscous import EFFECT as DRAG
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.gate.held_out import stretches
from shared.identification.search.family import Family, look_elsewhere, relatives
from shared.sim.plant.row import Row
from tests.arms import JOINTS
from tests.measured import measure, problem_of

AT_JOINTS = tuple(Candidate(DRAG, joint) for joint in JOINTS)


def named_at_the_elbow(folder: Path, drags: dict[str, float]) -> Fit:
    """Return the fit of drag at the elbow to an arm that has some at joints (N m s^2/rad^2)."""

    def enter(row: Row) -> None:
        for joint, drag in drags.items():
            DRAG.enter(row, joint, np.array([drag]))

    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=4.0))
    space = Space(problem, (Candidate(DRAG, "elbow"),))
    return polish(space, np.zeros(space.size), problem.of("train"), 4)


def elsewhere(fit: Fit) -> Family | None:
    problem = fit.space.problem
    train, test = problem.of("train"), problem.of("test")
    losses = stretches(problem, fit.variant, test)
    others = relatives(AT_JOINTS, Candidate(DRAG, "elbow"), fit)
    return look_elsewhere(fit, others, losses, train, test, np.random.default_rng(0))


def test_what_every_joint_has_is_found_at_the_others_at_once(tmp_path: Path):
    truth = {"pan": 1.0, "lift": 1.5, "elbow": 0.6}
    family = elsewhere(named_at_the_elbow(tmp_path, truth))
    assert family is not None
    assert [each.place for each in family.gains] == ["pan", "lift"]
    found = {candidate.place: float(values[0]) for candidate, values in family.fit.variant.extras}
    assert found == pytest.approx(truth, rel=0.3)  # damping makes up for some
    assert family.losses.mean() < 1.25
    assert all(gain.surely > 0.0 for gain in family.gains.values())


def test_what_one_joint_has_is_found_at_no_other(tmp_path: Path):
    assert elsewhere(named_at_the_elbow(tmp_path, {"elbow": 0.6})) is None


def test_what_two_of_three_joints_have_is_left_to_the_search(tmp_path: Path):
    # Something else at one joint may pass for it there, too.
    assert elsewhere(named_at_the_elbow(tmp_path, {"lift": 1.5, "elbow": 0.6})) is None


def test_what_is_no_joints_or_has_a_form_to_be_looked_for_has_no_relatives(tmp_path: Path):
    fit = named_at_the_elbow(tmp_path, {"elbow": 0.6})
    everywhere = (Candidate(TILT, ""), *(Candidate(COGGING, joint) for joint in JOINTS))
    assert relatives(everywhere, Candidate(TILT, ""), fit) == ()
    assert relatives(everywhere, Candidate(COGGING, "pan"), fit) == ()
