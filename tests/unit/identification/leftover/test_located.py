"""What was hidden in recordings of the small arm is located: where, when, in which phase."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from msgspec.structs import replace

from shared.identification.catalogue.backlash import EFFECT as BACKLASH
from shared.identification.catalogue.viscous_friction import EFFECT as VISCOUS
from shared.identification.dataset.types import Float64
from shared.identification.effect import Candidate, Effect
from shared.identification.fitting.problem import Problem, Variant
from shared.identification.leftover.located import leftovers
from shared.identification.verdict import Unexplained
from shared.sim.plant.row import Row, TrackerReport
from shared.sim.plant.step import Step
from tests.arms import JOINTS
from tests.measured import Enter, measure, nominal, problem_of


class Push:
    """0.3 s of torque; values: begin (s), then a torque for each joint (N m)."""

    memory = 0

    def __call__(self, step: Step, values: Float64, memory: Float64) -> Float64:
        """Return the torque."""
        since = step.time - values[:, :1]
        return np.where((since >= 0.0) & (since < 0.3), values[:, 1:], 0.0)


PUSH = Push()


def problem_with(folder: Path, enter: Enter) -> Problem:
    """Return recordings with something in them, against the arm as its model file has it."""
    return problem_of(measure(folder, np.random.default_rng(11), enter))


def hidden(folder: Path, effect: Effect, place: str, values: Sequence[float]) -> Problem:
    """Return the same with an effect of the catalogue in them."""
    rng = np.random.default_rng(11)
    sizes = np.asarray(values, np.float64)

    def enter(row: Row) -> None:
        effect.enter(row, place, sizes)

    subject = problem_of(measure(folder, rng, seconds=1.0)).subject
    return problem_of(measure(folder, rng, enter, effect.structure(subject, place)))


def left(problem: Problem) -> tuple[Unexplained, ...]:
    return leftovers(problem, nominal(problem), range(len(problem.segments)))


@pytest.mark.parametrize(
    ("joint", "recording", "torque"),
    [("pan", "second", 1.0), ("lift", "second", 2.0), ("elbow", "first", 2.0)],
)
def test_a_push_is_located_at_its_joint_and_within_a_tenth_of_a_second(
    tmp_path: Path, joint: str, recording: str, torque: float
) -> None:
    torques = [3.0, *(torque if name == joint else 0.0 for name in JOINTS)]

    def enter(row: Row) -> None:
        if row.trajectory == recording:
            row.torque(PUSH, np.array(torques))

    found = left(problem_with(tmp_path, enter))
    assert [(each.where, each.trajectory, each.phase) for each in found] == [
        (joint, recording, "once")
    ]
    assert found[0].begin == pytest.approx(3.0, abs=0.1)
    assert found[0].end == pytest.approx(3.3, abs=0.1)
    assert found[0].torque == pytest.approx(torque, rel=0.3)
    assert found[0].unit == "rad"
    assert found[0].is_external


def test_what_comes_back_when_a_recording_is_repeated_is_left_over_and_no_push(
    tmp_path: Path,
) -> None:
    def enter(row: Row) -> None:
        if row.trajectory in ("first", "again"):
            row.torque(PUSH, np.array([3.0, 0.0, 0.0, 2.0]))

    found = left(problem_with(tmp_path, enter))
    assert found[0].where == "elbow"
    assert not any(each.is_external for each in found)


def test_a_push_that_is_known_is_told_again_where_it_does_not_show_anew(tmp_path: Path) -> None:
    def enter(row: Row) -> None:
        if row.trajectory == "second":
            row.torque(PUSH, np.array([3.0, 0.0, 0.0, 2.0]))

    problem = problem_with(tmp_path, enter)
    (shown,) = left(problem)
    gone = replace(shown, where="lift", trajectory="first", begin=5.0, end=5.4)
    over = replace(shown, begin=shown.begin - 0.2, torque=99.0)
    segments = range(len(problem.segments))
    again = leftovers(problem, nominal(problem), segments, [over, gone])
    assert set(again) == {shown, gone}


def test_nothing_else_is_told_of_where_a_known_push_was(tmp_path: Path) -> None:
    problem = hidden(tmp_path, VISCOUS, "elbow", [0.8])
    before = left(problem)
    assert {each.where for each in before} == {"elbow"}
    last = float(problem.dataset.trajectories[0].joints_at[-1])
    pushes = [
        replace(before[0], trajectory=each.name, begin=0.0, end=last, is_external=True)
        for each in problem.dataset.trajectories
        if not each.repeats
    ]
    segments = range(len(problem.segments))
    assert set(leftovers(problem, nominal(problem), segments, pushes)) == set(pushes)


@pytest.mark.parametrize("recording", ["first", "second"])
def test_a_tracker_that_slips_is_off_from_a_time_on(tmp_path: Path, recording: str) -> None:
    def slip(report: TrackerReport) -> None:
        report.pose[report.at >= 4.0, 0] += 0.004

    def enter(row: Row) -> None:
        if row.trajectory == recording:
            row.on_tracker(slip)

    found = left(problem_with(tmp_path, enter))
    assert [each.trajectory for each in found] == [recording]
    first = found[0]
    assert (first.where, first.phase, first.unit) == ("tracker", "from a time on", "m")
    assert first.begin == pytest.approx(4.0, abs=0.1)
    assert first.size == pytest.approx(0.004, rel=0.2)
    assert first.torque is None
    assert not first.is_external


def test_play_of_a_gear_shows_after_reversals_of_the_load(tmp_path: Path) -> None:
    found = left(hidden(tmp_path, BACKLASH, "pan", [0.01]))
    motor = [each for each in found if each.where == "pan"]
    link = [each for each in found if each.where == "pan, tracker"]
    assert {each.phase for each in motor} == {"after reversals of the load"}
    assert {each.trajectory for each in motor} == {"first", "second"}
    assert {each.trajectory for each in link} == {"first", "second"}
    assert len(found) == 4
    assert not any(each.is_external for each in found)


def test_drag_is_left_at_its_joint_while_it_is_fast_until_it_is_in_the_model(
    tmp_path: Path,
) -> None:
    problem = hidden(tmp_path, VISCOUS, "elbow", [0.5])
    assert {(each.where, each.phase) for each in left(problem)} == {("elbow", "while fast")}
    named = Variant(nominal(problem).x, ((Candidate(VISCOUS, "elbow"), np.array([0.5])),))
    assert leftovers(problem, named, range(len(problem.segments))) == ()


def test_noise_alone_leaves_nothing(tmp_path: Path) -> None:
    for seed in range(3):
        problem = problem_of(measure(tmp_path, np.random.default_rng(seed)))
        assert left(problem) == ()
