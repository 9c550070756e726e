"""Each word of the verdict, from searches put together by hand."""

import copy
import dataclasses

import msgspec
import numpy as np
import pytest

from shared.identification.conclusion import causes
from shared.identification.conclusion.conclude import conclude
from shared.identification.conclusion.sentence import with_base
from shared.identification.gate.held_out import Taken, floor_of
from shared.identification.search.bent import worse_than_file
from shared.identification.search.searched import Far, Model, Otherwise, Search, Tried
from shared.identification.verdict import BaseValue, HeldOut, Interval, Unexplained
from tests.searches import DRAG, ELBOW, LIFT, Searches

_BAD = np.linspace(8.0, 12.0, 8)
_GOOD = np.linspace(1.0, 1.2, 8)
_PUSH = Unexplained(
    where="elbow", trajectory="first", begin=0.5, end=0.6, phase="once", size=0.01, unit="rad",
    times_noise=9.0,
)  # fmt: skip


@pytest.fixture(scope="module")
def searches(tmp_path_factory: pytest.TempPathFactory) -> Searches:
    return Searches(tmp_path_factory.mktemp("data"))


def test_a_cause_that_leaves_little_more_than_noise_is_named(searches: Searches):
    tried = searches.tried(ELBOW, _BAD, _GOOD)
    found = conclude(searches.search(_BAD, tried), ())
    assert found.word == "named"
    (cause,) = found.causes
    assert (cause.effect, cause.where, cause.unit) == ("torque_bias", "elbow", "N m")
    assert cause.value == pytest.approx(0.5 * tried.fit.space.quantities[0].probe)
    assert cause.interval.low < cause.value < cause.interval.high
    assert found.held_out.base_fit == pytest.approx(np.sqrt(10.0))
    assert found.held_out.extended == pytest.approx(np.sqrt(1.1))
    assert "elbow" in found.sentence
    assert not found.ties


def test_a_cause_that_is_only_like_what_is_wrong_is_told_but_not_named(searches: Searches):
    search = searches.search(_BAD, searches.tried(ELBOW, _BAD, _GOOD))
    search.only_like = "it is not"
    found = conclude(search, ())
    assert (found.word, found.causes) == ("unexplained", ())
    assert "Nearest comes torque bias of elbow" in found.sentence
    assert found.sentence.endswith("and it is not.")
    (scored,) = (each for each in found.candidates if each.where == "elbow")
    assert scored.why_not == "it is not"


def test_a_base_at_the_noise_has_nothing_to_name(searches: Searches):
    found = conclude(searches.search(_GOOD), ())
    assert (found.word, found.causes, found.ties) == ("none", (), ())
    assert found.held_out.share_removed == 0.0


def test_where_nothing_is_named_the_sentence_says_what_the_base_is_far_from(searches: Searches):
    index = [each.name for each in searches.problem.parameters].index("kp elbow")
    z = searches.base.z.copy()
    z[index] = np.log(3.0)
    bent = dataclasses.replace(searches.base, z=z)
    far = Far(bent, [index])
    said = "The base is far from the model file: kp elbow 3 times what it says."
    none = conclude(dataclasses.replace(searches.search(_GOOD), current=bent, far=far), ())
    assert none.word == "none"
    assert none.sentence.endswith(said)
    open_ = conclude(dataclasses.replace(searches.search(_BAD), current=bent, far=far), ())
    assert open_.word == "unexplained"
    assert open_.sentence.endswith(said)
    assert said not in conclude(searches.search(_GOOD), ()).sentence


def test_where_nothing_is_named_the_sentence_says_what_the_fit_surely_has_otherwise():
    def number(name: str, value: float, half: float) -> BaseValue:
        return BaseValue(
            name=name, unit="kg", nominal=1.0, base_fit=value, extended=value,
            interval=Interval(low=value - half, high=value + half),
        )  # fmt: skip

    base = [
        number("mass elbow", 1.3, 0.1), number("mass lift", 1.5, 0.6), number("mass pan", 0.8, 0.01)
    ]  # fmt: skip
    held_out = HeldOut(
        nominal=3.0, base_fit=1.0, extended=1.0, noise_floor=1.0, share_removed=0.0,
        share_interval=Interval(low=0.0, high=0.0), joints_mrad={}, tracker_mm={},
    )  # fmt: skip
    assert with_base("So.", "none", base, held_out) == (
        "So. The file's own numbers are at 3.00; the fit has other ones, surest mass pan 0.8 kg "
        "for 1 and mass elbow 1.3 kg for 1."
    )
    assert with_base(
        "So.", "none", [number(f"m{i}", 2.0, 0.1) for i in range(5)], held_out
    ).endswith("m2 2 kg for 1 and 2 more.")
    near = msgspec.structs.replace(held_out, nominal=1.1)
    assert with_base("So.", "none", base, near) == "So."
    assert with_base("So.", "named", base, held_out) == "So."
    assert with_base("So.", "none", base[1:2], held_out) == "So."


def test_a_candidate_is_told_why_it_is_not_named(searches: Searches):
    alike = searches.tried(LIFT, _BAD, _GOOD + 0.01)
    unsure = searches.tried(DRAG, _BAD, np.r_[np.full(7, 10.0), 3.0])
    taken = searches.tried(ELBOW, _BAD, _GOOD)
    found = conclude(searches.search(_BAD, taken, tried=(alike, unsure)), ())
    why = {(each.effect, each.where): each.why_not for each in found.candidates}
    assert why["torque_bias", "lift"] == (
        "does as well as what was taken, but its size may be anything"
    )
    assert why["viscous_friction", "elbow"] == (
        "better on held-out recordings, of which there are too few to be sure"
    )


def test_a_base_that_went_far_is_a_tie_with_what_does_as_well(searches: Searches):
    tried = searches.tried(ELBOW, _GOOD, _GOOD)
    parameters = searches.problem.parameters
    index = next(i for i, each in enumerate(parameters) if each.name.startswith("kp"))
    z = searches.base.z.copy()
    z[index] = np.log(3.0)
    bent = dataclasses.replace(searches.base, z=z)
    search = searches.search(_GOOD)
    search.otherwise = Otherwise(bent, (tried,), 0.99)
    found = conclude(search, ())
    assert (found.word, found.causes) == ("tie", ())
    (tie,) = found.ties
    base, cause = tie.causes
    assert (base.effect, base.quantity) == ("base model", "kp factor")
    assert base.where == parameters[index].name.removeprefix("kp ")
    assert base.value == pytest.approx(3.0)
    assert (cause.effect, cause.where) == ("torque_bias", "elbow")
    assert "do not tell apart: base model of" in found.sentence
    assert found.held_out.share_removed == 0.0


def test_what_happened_once_is_not_passed_over(searches: Searches):
    assert conclude(searches.search(_GOOD), (_PUSH,)).word == "unexplained"


def test_a_push_beside_a_cause_is_told_with_it(searches: Searches):
    push = msgspec.structs.replace(_PUSH, is_external=True, torque=175.8, torque_unit="N m")
    found = conclude(searches.search(_BAD, searches.tried(ELBOW, _BAD, _GOOD)), (push,))
    assert found.word == "named"
    assert "pushed elbow once, from 0.50 to 0.60 s of first with 176 N m" in found.sentence
    alone = conclude(searches.search(_GOOD), (push, push))
    assert alone.word == "unexplained"
    assert "Nothing to name but what came from outside" in alone.sentence
    assert "2 times" in alone.sentence
    more = conclude(searches.search(_BAD), (push,))
    assert more.sentence.startswith("Something is wrong that no effect")
    assert "pushed elbow once" in more.sentence


def test_what_comes_again_and_again_is_told_as_a_law_that_lacks(searches: Searches):
    push = msgspec.structs.replace(_PUSH, phase="again and again", torque=3.0, torque_unit="N m")
    found = conclude(searches.search(_BAD, searches.tried(ELBOW, _BAD, _GOOD)), (push, push))
    assert found.word == "named"
    assert "At elbow a torque is missing again and again (2 times, most from 0.50" in found.sentence
    assert "outside" not in found.sentence


def test_a_floor_that_nothing_measured_is_not_called_the_noise(searches: Searches):
    found = searches.search(_BAD, searches.tried(ELBOW, _BAD, _GOOD))
    assert "times the noise" in conclude(found, ()).sentence
    problem = copy.copy(found.problem)
    problem.noise = dataclasses.replace(problem.noise, is_measured=False)
    guessed = conclude(dataclasses.replace(found, problem=problem), ())
    assert not guessed.held_out.is_floor_measured
    assert "times what the base fit usually leaves" in guessed.sentence


def test_causes_that_do_as_well_are_a_tie(searches: Searches):
    one, other = (searches.tried(each, _BAD, _GOOD) for each in (ELBOW, LIFT))
    found = conclude(searches.search(_BAD, one, (other,)), ())
    assert found.word == "tie"
    assert found.causes == ()
    (tie,) = found.ties
    assert [cause.where for cause in tie.causes] == ["elbow", "lift"]
    assert tie.alike == pytest.approx(1.0)
    assert "one at a time" in tie.record
    assert "torque bias of elbow or torque bias of lift" in found.sentence


def test_a_sure_cause_is_listed_beside_a_tie(searches: Searches, monkeypatch: pytest.MonkeyPatch):
    sure = searches.tried(DRAG, _BAD, 0.4 * _BAD)
    one, other = (searches.tried(each, 0.4 * _BAD, _GOOD) for each in (ELBOW, LIFT))

    def without(found: Search, each: Tried, train: object, test: object) -> Model:
        return Model(found.base, 0.7 * _BAD if each is sure else 0.4 * _BAD)

    monkeypatch.setattr(causes, "without", without)
    found = conclude(searches.search(_BAD, one, (other,), before=(sure,)), ())
    assert found.word == "tie"
    assert [(each.effect, each.where) for each in found.causes] == [("viscous_friction", "elbow")]
    # Without it 7 are left for 1.1, though by itself it took off 6 of 10.
    assert found.causes[0].share == pytest.approx((7.0 - 1.1) / (10.0 - floor_of(10.0)))
    (tie,) = found.ties
    assert [each.where for each in tie.causes] == ["elbow", "lift"]
    assert "surely gets wrong" in found.sentence
    assert "torque bias of elbow or torque bias of lift" in found.sentence
    assert {each.effect: each.why_not for each in found.candidates}["viscous_friction"] == ""


def test_much_that_no_effect_takes_off_is_unexplained(searches: Searches):
    tried = searches.tried(ELBOW, _BAD, _BAD)
    found = conclude(searches.search(_BAD, tried=(tried,)), (_PUSH,))
    assert (found.word, found.causes) == ("unexplained", ())
    assert "elbow once" in found.sentence
    (scored,) = found.candidates
    assert scored.why_not == "no better on held-out recordings"


def test_what_held_out_motion_follows_is_not_called_no_better(searches: Searches):
    """Its loss alone does not say so; what was taken does better."""
    taken, tried = searches.tried(DRAG, _BAD, _GOOD), searches.tried(ELBOW, _BAD, _BAD)
    gain = dataclasses.replace(tried.gain, is_measured=True, apart=Taken(1.1, 0.05))
    found = conclude(
        searches.search(_BAD, taken, tried=(dataclasses.replace(tried, gain=gain),)), ()
    )
    whys = {each.effect: each.why_not for each in found.candidates}
    assert whys["torque_bias"] == "explained better by what was taken"


def test_what_stands_out_of_a_base_that_fits_is_told_with_when_it_was(searches: Searches):
    found = conclude(searches.search(_GOOD, doubted=("mass elbow",)), (_PUSH,))
    assert (found.word, found.causes) == ("unexplained", ())
    assert "is at 1.05 times the noise, but" in found.sentence
    assert "at elbow, from 0.50 to 0.60 s of first, 9 times the noise" in found.sentence


def test_a_cause_that_leaves_too_much_is_not_believed(searches: Searches):
    half = 0.5 * _BAD
    found = conclude(searches.search(_BAD, searches.tried(DRAG, _BAD, half)), ())
    assert (found.word, found.causes) == ("unexplained", ())
    assert "too much to believe" in found.sentence
    assert "too much is left over" in found.candidates[0].why_not


def test_a_cause_beside_which_the_model_file_does_better_is_not_believed(searches: Searches):
    found = searches.search(100.0 * _BAD, searches.tried(DRAG, 100.0 * _BAD, 5.0 * _BAD))
    assert conclude(found, ()).word == "named"
    assert worse_than_file(found) == ""
    nearer = dataclasses.replace(found, nominal_losses=3.0 * _BAD)
    told = conclude(nearer, ())
    assert (told.word, told.causes) == ("unexplained", ())
    assert "it leaves 7.07, and the model file as it is 5.48" in told.sentence
    assert "is at 7.07 and the model file as it is at 5.48" in worse_than_file(nearer)


def test_a_fit_at_the_noise_is_not_said_to_be_worse_than_the_file(searches: Searches):
    found = dataclasses.replace(searches.search(_GOOD), nominal_losses=0.5 * _GOOD)
    assert worse_than_file(found) == ""


@pytest.mark.parametrize(("doubted", "word"), [((), "named"), (("mass elbow",), "unexplained")])
def test_a_share_of_much_may_be_left_unless_links_are_far_from_what_is_known(
    searches: Searches, doubted: tuple[str, ...], word: str
):
    much = 100.0 * _BAD  # of 1,000 floors 50 are left
    found = conclude(
        searches.search(much, searches.tried(ELBOW, much, 0.05 * much), doubted=doubted), ()
    )
    assert found.word == word


def test_links_far_from_what_is_known_of_them_make_the_base_too_coarse(searches: Searches):
    found = conclude(searches.search(_BAD, doubted=("mass elbow",)), ())
    assert (found.word, found.causes) == ("base_too_coarse", ())
    assert "with mass elbow as the model file has it" in found.sentence


def test_the_base_is_told_before_and_after_within_its_bounds(searches: Searches):
    found = conclude(searches.search(_BAD, searches.tried(ELBOW, _BAD, _GOOD)), ())
    for told, each in zip(found.base, searches.problem.parameters, strict=True):
        assert told.name == each.name
        assert told.nominal == told.base_fit == told.extended == each.nominal
        assert each.value(each.low) <= told.interval.low <= told.interval.high
        assert told.interval.high <= each.value(each.high)
