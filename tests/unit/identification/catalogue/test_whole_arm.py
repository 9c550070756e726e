"""Effects of the whole arm, and of what it stands on, by hand on an arm of three hinges."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue import base_compliance, gravity_tilt, payload
from shared.identification.effect import Effect
from shared.identification.subject import Subject
from tests.arms import make_plant, make_subject, recorded, replay

EFFECTS: tuple[Effect, ...] = (gravity_tilt.EFFECT, base_compliance.EFFECT, payload.EFFECT)


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm")))


def swing(at: np.ndarray) -> np.ndarray:
    return np.stack([0.3 * np.sin(4 * at), 0.2 * np.sin(5 * at), 0.3 * np.sin(7 * at)], axis=1)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_nothing_of_it_is_the_model_as_it_was(subject: Subject, effect: Effect):
    none = [0.0] * len(effect.quantities(subject, ""))
    plain, found = (
        replay(subject, recorded(swing)),
        replay(subject, recorded(swing), effect, "", none),
    )
    np.testing.assert_allclose(found.q, plain.q, atol=2e-6)
    np.testing.assert_allclose(found.tracker, plain.tracker, atol=2e-6)


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_its_probe_is_seen_and_within_its_bounds(subject: Subject, effect: Effect):
    quantities = effect.quantities(subject, "")
    assert all(each.low <= 0.0 <= each.high for each in quantities)
    assert all(each.low <= each.probe <= each.high for each in quantities)
    probe = [each.probe for each in quantities]
    plain = replay(subject, recorded(swing))
    found = replay(subject, recorded(swing), effect, "", probe)
    assert plain.tracker is not None
    assert found.tracker is not None
    assert np.abs(found.tracker - plain.tracker).max() > 3e-4


def test_a_tilt_loads_the_pan_by_hand(subject: Subject):
    # Straight out along x, weight acts 0.275 kg m of x from the pan's axis, plus 0 at the pan.
    # Turned by a about x, gravity is 9.81 (0, sin a, -cos a): the pan feels -m y + ... = m x g_y.
    tilt = 0.1
    still = recorded([0.0, 0.0, 0.0], seconds=3.0)
    found = replay(subject, still, gravity_tilt.EFFECT, "", [tilt, 0.0])
    lever = 1.0 * 0.2 + 0.5 * 0.55
    pushed = lever * 9.81 * np.sin(tilt)
    # The servo of 200 N m/rad holds it but for 0.1 N m of friction.
    assert found.q[-1, 0] * 200 == pytest.approx(pushed, abs=0.12)


def test_gravity_of_a_tilt_keeps_its_strength_and_turns_as_a_right_hand_does(subject: Subject):
    gravity: dict[str, np.ndarray] = {}

    def look(row) -> None:
        gravity_tilt.EFFECT.enter(row, "", np.array([0.0, 0.2]))
        gravity["found"] = row.field("opt.gravity").copy()

    subject.nominal.run([(look, recorded([0.0, 0.0, 0.0], seconds=0.1))])
    # About y, -z turns towards -x.
    np.testing.assert_allclose(gravity["found"], 9.81 * np.array([-np.sin(0.2), 0, -np.cos(0.2)]))


def test_a_base_that_gives_lets_the_tool_sag_by_hand(subject: Subject):
    # The shoulder's torque at rest is 9.81 * 0.475 kg m = 4.66 N m about y; the tool is 0.7 m out.
    compliance = 1e-3
    still = recorded([0.0, 0.0, 0.0], seconds=4.0)
    plain = replay(subject, still)
    found = replay(subject, still, base_compliance.EFFECT, "", [0.0, compliance, 0.2])
    assert plain.tracker is not None
    assert found.tracker is not None
    np.testing.assert_allclose(found.q[-1], plain.q[-1], atol=1e-3)  # encoders see little of it
    pitch = 2.0 * np.arcsin(found.tracker[-1, 5])
    turned = pitch - found.q[-1, 1] - found.q[-1, 2]
    assert turned == pytest.approx(4.66 * compliance, rel=0.01, abs=1e-10)


def test_what_the_data_rule_out_sits_nowhere(tmp_path: Path):
    weightless = make_subject(make_plant(tmp_path, has_gravity=False), has_tracker=False)
    assert gravity_tilt.EFFECT.places(weightless) == ()
    assert base_compliance.EFFECT.places(weightless) == ()
