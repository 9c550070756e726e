"""The screen: the right candidate comes first, with a size and a form near the truth."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.segments import thinned
from shared.identification.arm.subject import Subject
from shared.identification.catalogue.base_compliance import EFFECT as GIVES
from shared.identification.catalogue.base_compliance import BaseCompliance
from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.catalogue.joint_spring import EFFECT as SPRING
from shared.identification.catalogue.stribeck_friction import EFFECT as STRIBECK
from shared.identification.catalogue.torque_bias import EFFECT as BIAS
from shared.identification.catalogue.torque_saturation import EFFECT as SATURATION
from shared.identification.effect import Candidate, Effect, Quantity
from shared.identification.fitting.fit import Fit, polish
from shared.identification.fitting.space import Space
from shared.identification.search.screen import Screened, Seen, screen
from shared.sim.plant.row import Row
from tests.arms import JOINTS, make_plant, make_subject
from tests.measured import measure, problem_of

_EFFECTS = (SPRING, STRIBECK, BIAS, SATURATION)


def screened(folder: Path, effect: Effect, values: list[float]) -> tuple[Screened, list[float]]:
    """Return the best of four effects at two joints, and its size in units."""

    def enter(row: Row) -> None:
        effect.enter(row, "elbow", np.array(values))

    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=4.0))
    space, segments = Space(problem), problem.of("train")
    fit = polish(space, np.zeros(space.size), segments, 2)
    candidates = [Candidate(each, place) for each in _EFFECTS for place in ("lift", "elbow")]
    best = screen(fit, candidates, segments)[0]
    quantities = best.candidate.effect.quantities(problem.subject, best.candidate.place)
    probes = np.array([each.probe for each in quantities])
    return best, (best.start * probes).tolist()


def test_a_form_is_tried_where_its_grid_says_and_the_size_is_found_with_it(tmp_path: Path) -> None:
    best, (excess, falloff, bend) = screened(tmp_path, STRIBECK, [0.4, 0.2, 8e-4])
    assert best.candidate.label == "stribeck_friction elbow"
    assert excess == pytest.approx(0.4, rel=0.5)
    assert 0.05 < falloff < 0.6
    assert 0.0 < bend < 1e-3
    assert best.share > 0.05  # most of the rest is noise


def test_a_spring_is_found_with_a_rest_in_the_joints_range(tmp_path: Path) -> None:
    best, (stiffness, rest) = screened(tmp_path, SPRING, [2.0, 0.3])
    assert best.candidate.label == "joint_spring elbow"
    assert stiffness == pytest.approx(2.0, rel=0.5)
    assert -0.6 <= rest <= 0.6


class _LookedAtOnce(BaseCompliance):
    def quantities(self, subject: Subject, place: str) -> tuple[Quantity, ...]:
        return tuple(replace(each, scales=(1.0,)) for each in super().quantities(subject, place))


def test_what_sways_more_slowly_the_softer_it_is_is_looked_at_soft(tmp_path: Path) -> None:
    def give(row: Row) -> None:
        GIVES.enter(row, "", np.array([6e-3, 3e-3, 0.1]))

    structure = GIVES.structure(make_subject(make_plant(tmp_path)), "")
    problem = problem_of(measure(tmp_path, np.random.default_rng(0), give, structure, seconds=4.0))
    space, segments = Space(problem), problem.of("train")
    fit = Fit.at(space, np.zeros(space.size), segments)
    found, once = (
        screen(fit, [Candidate(each, "")], segments)[0] for each in (GIVES, _LookedAtOnce())
    )
    assert found.share > once.share
    probe = GIVES.quantities(problem.subject, "")[0].probe
    assert found.start[0] * probe == pytest.approx(6e-3, rel=0.6)


def test_an_effect_without_a_form_is_looked_at_as_before(tmp_path: Path) -> None:
    best, (torque,) = screened(tmp_path, BIAS, [0.5])
    assert best.candidate.label == "torque_bias elbow"
    assert torque == pytest.approx(0.5, rel=0.3)


def test_seen_from_the_nominal_model_what_the_base_makes_up_for_hides_no_cause(tmp_path: Path):
    def enter(row: Row) -> None:
        BIAS.enter(row, "elbow", np.array([0.1]))
        row.field("dof_damping")[row.dofs[0]] = 0.7

    problem = problem_of(measure(tmp_path, np.random.default_rng(0), enter, seconds=4.0))
    space, segments = Space(problem), problem.of("train")
    candidates = [Candidate(BIAS, place) for place in ("lift", "elbow")]
    nominal = Fit.at(space, np.zeros(space.size), segments)
    alone = Fit.at(space, polish(space, np.zeros(space.size), segments, 2).z, segments)
    assert alone.cost < 0.5 * nominal.cost  # most of it is damping
    best = screen(nominal, candidates, segments)[0]
    assert best.candidate.place == "elbow"
    assert best.share > 0.5 * screen(alone, candidates, segments)[0].share


def test_a_limit_is_looked_for_on_its_own_grid(tmp_path: Path) -> None:
    best, (inverse,) = screened(tmp_path, SATURATION, [0.8])
    assert best.candidate.label == "torque_saturation elbow"
    assert inverse == pytest.approx(0.8, rel=0.2)


def test_a_push_is_looked_for_half_a_second_at_a_time_in_its_own_recording(tmp_path: Path) -> None:
    def enter(row: Row) -> None:
        PUSH.enter(row, "elbow in first", np.array([1.0, 2.1, 0.3]))

    problem = problem_of(measure(tmp_path, np.random.default_rng(0), enter, seconds=4.0))
    space, segments = Space(problem), problem.of("train")
    fit = polish(space, np.zeros(space.size), segments, 2)
    names = ("first", "again", "second")
    candidates = [Candidate(PUSH, f"{joint} in {name}") for name in names for joint in JOINTS]
    found = screen(fit, candidates, segments)
    best = found[0]
    assert best.candidate.label == "external_contact elbow in first"
    torque, begin, length = (
        start * each.probe
        for start, each in zip(
            best.start, PUSH.quantities(problem.subject, best.candidate.place), strict=True
        )
    )
    assert torque == pytest.approx(1.0, rel=0.6)
    assert (begin, length) == pytest.approx((2.0, 0.5), abs=0.01)
    held_out = [each for each in found if each.candidate.place.endswith("in second")]
    assert len(held_out) == 3
    assert all(each.share == 0.0 for each in held_out)


def test_of_many_parts_the_best_are_seen_in_all_at_the_look_that_showed_them(tmp_path: Path):
    def enter(row: Row) -> None:
        SPRING.enter(row, "elbow", np.array([0.6, 0.3]))

    problem = problem_of(measure(tmp_path, np.random.default_rng(0), enter)).in_parts(1.0)
    space, segments = Space(problem), problem.of("train")
    assert len(segments) >= 8
    fit = Fit.at(space, np.zeros(space.size), segments)
    one = Candidate(SPRING, "elbow")
    (found,) = screen(fit, [one], segments)
    some = thinned(problem.segments, segments)
    (half,) = screen(fit.on(problem.rows_of(segments, some)), [one], some)
    assert found.start[1] == pytest.approx(half.start[1], rel=0.5)  # its rest: the same look
    assert found.share == pytest.approx(half.share, rel=0.4)
    assert found.share != half.share
    assert len(found.signature) == len(half.signature)


@pytest.mark.parametrize("is_calm", [True, False])
def test_where_little_is_left_what_explained_least_is_not_looked_at_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, is_calm: bool
):
    monkeypatch.setattr("shared.identification.search.screen._AGAIN", 2)
    monkeypatch.setattr("shared.identification.search.screen._AGAIN_LOCAL", 1)

    def enter(row: Row) -> None:
        BIAS.enter(row, "elbow", np.array([0.1]))

    problem = problem_of(measure(tmp_path, np.random.default_rng(0), enter, seconds=4.0))
    space, segments = Space(problem), problem.of("train")
    fit = polish(space, np.zeros(space.size), segments)
    if not is_calm:
        fit = replace(fit, cost=fit.cost + len(fit.residual))
    candidates = [Candidate(each, place) for each in (BIAS, SATURATION) for place in JOINTS]
    candidates.append(Candidate(STRIBECK, "elbow"))
    seen = Seen()
    first = screen(fit, candidates, segments, seen)
    assert {each.candidate for each in first} == set(candidates)
    again = screen(fit, candidates, segments, seen)
    assert again[0].candidate == first[0].candidate == Candidate(BIAS, "elbow")
    assert again[0].share == first[0].share
    assert len(again) == (3 if is_calm else len(candidates))
