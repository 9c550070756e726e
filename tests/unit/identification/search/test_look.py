"""What is looked at more closely, and from where."""

from typing import Any

import numpy as np
import pytest

from shared.identification.catalogue.asymmetric_friction import EFFECT as ASYMMETRIC
from shared.identification.catalogue.command_latency import EFFECT as LATENCY
from shared.identification.catalogue.external_contact import EFFECT as PUSH
from shared.identification.catalogue.load_friction import EFFECT as LOAD
from shared.identification.catalogue.sample_and_hold import EFFECT as HOLD
from shared.identification.catalogue.torque_saturation import EFFECT as SATURATION
from shared.identification.effect import Candidate
from shared.identification.fitting.fit import Fit, Start, polish
from shared.identification.fitting.refit import Rough, refit
from shared.identification.fitting.space import Space
from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe, wish_of
from shared.identification.progress import silent
from shared.identification.search import look as module
from shared.identification.search.look import (
    _diverse,  # pyright: ignore[reportPrivateUsage]
    look,
)
from shared.identification.search.screen import Screened
from shared.sim.plant.row import Row
from tests.measured import measure, problem_of

LIMIT = Candidate(SATURATION, "elbow")
CANDIDATES = (LIMIT, Candidate(ASYMMETRIC, "elbow"), Candidate(LOAD, "elbow"))


@pytest.fixture(scope="module")
def bent(tmp_path_factory: pytest.TempPathFactory) -> tuple[Fit, Start]:
    """Return a base that makes up for an elbow of little torque by inertia, and the nominal one."""

    def limit(row: Row) -> None:
        SATURATION.enter(row, "elbow", np.array([0.8]))

    folder = tmp_path_factory.mktemp("data")
    problem = problem_of(measure(folder, np.random.default_rng(0), limit, seconds=4.0))
    space, train = Space(problem), problem.of("train")
    z = np.zeros(space.size)
    for index, parameter in enumerate(problem.parameters):
        if parameter.name in ("armature elbow", "damping elbow"):
            z[index] = 2.5
    origin = np.zeros(space.size)
    return Fit.at(space, z, train), Start(origin, space.jacobian(origin, train)[1])


def test_from_a_bent_base_a_large_cause_does_not_show(bent: tuple[Fit, Start]):
    screened, rough = look(*bent, CANDIDATES, False, silent)
    assert {each.candidate for each in screened} == set(CANDIDATES)
    assert LIMIT not in [each.screened.candidate for each in rough]


def test_seen_from_the_nominal_model_it_comes_first(bent: tuple[Fit, Start]):
    screened, rough = look(*bent, CANDIDATES, True, silent)
    assert max(screened, key=lambda each: each.share).candidate != LIMIT  # as told to people
    assert rough[0].screened.candidate == LIMIT
    assert rough[0].space.values(rough[0].z)[0][0] == pytest.approx(0.8, rel=0.05)
    assert rough[0].ratio < 0.01
    assert [each.ratio for each in rough] == sorted(each.ratio for each in rough)


def test_what_the_nominal_model_shows_best_is_refitted_from_there_though_the_base_shows_it_too(
    bent: tuple[Fit, Start], monkeypatch: pytest.MonkeyPatch
):
    fit, nominal = bent
    begun_at: list[tuple[Candidate, bool]] = []

    def noted(fit: Fit, nominal: Start, screened: Screened, *others: Any) -> Rough:
        begun_at.append((screened.candidate, others[-1] is fit))
        return refit(fit, nominal, screened, *others)

    monkeypatch.setattr(module, "refit", noted)
    load = CANDIDATES[-1]
    _, rough = look(fit, nominal, (load,), True, silent)
    assert begun_at == [(load, True), (load, False)]
    assert [each.screened.candidate for each in rough] == [load]


@pytest.mark.slow
def test_an_interval_that_looks_like_a_delay_of_half_of_it_is_told_from_it():
    wish = wish_of("sample_and_hold=0.0243")
    dataset, _ = simulated(Recipe(arm="arm3", seconds=3.0, train=2, test=1, seed=1, wishes=(wish,)))
    problem = problem_of(dataset).in_parts(1.0)
    space, train = Space(problem), problem.of("train")
    begun = Fit.at(space, np.zeros(space.size), train)
    fit = polish(space, begun.z, train, 2)
    latched, late = Candidate(HOLD, ""), Candidate(LATENCY, "")
    _, rough = look(fit, Start(begun.z, begun.jacobian), (latched, late), False, silent)
    assert [each.screened.candidate for each in rough] == [latched, late]
    assert rough[0].space.values(rough[0].z)[0][0] == pytest.approx(0.0243, rel=1e-3)
    assert rough[1].space.values(rough[1].z)[0][0] == pytest.approx(0.0122, rel=0.15)
    assert rough[0].ratio < 0.7 * rough[1].ratio


@pytest.mark.parametrize("is_calm", [False, True])
def test_where_nothing_stands_out_nothing_that_happened_once_is_refitted(
    bent: tuple[Fit, Start], is_calm: bool
):
    once = Candidate(PUSH, "elbow in first")
    screened, rough = look(*bent, (once,), False, silent, is_calm)
    assert once in {each.candidate for each in screened}  # people are told of it all the same
    assert (once in {each.screened.candidate for each in rough}) != is_calm


@pytest.mark.parametrize(("push", "looked_at"), [(0.4, True), (0.1, False)])
def test_what_happened_once_takes_nobodys_place(push: float, looked_at: bool):
    def seen(candidate: Candidate, share: float) -> Screened:
        return Screened(candidate, np.ones(1), np.zeros(0), share, np.zeros(0))

    effects = (LOAD, ASYMMETRIC, SATURATION)
    lasting = [
        seen(Candidate(effect, place), 0.5 - 0.05 * index)
        for index, (effect, place) in enumerate(
            (effect, place) for place in ("lift", "elbow") for effect in effects
        )
    ]
    once = [seen(Candidate(PUSH, f"{joint} in first"), push) for joint in ("lift", "elbow")]
    found = _diverse(sorted([*lasting, *once], key=lambda each: -each.share))
    assert [each for each in found if each not in once] == lasting
    assert [each for each in found if each in once] == (once if looked_at else [])
