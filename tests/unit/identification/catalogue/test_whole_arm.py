"""Effects of the whole arm, and of what it stands on, by hand on an arm of three hinges."""

import re
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue import (
    base_compliance,
    gravity_tilt,
    inertia_error,
    payload,
)
from shared.identification.effect import Effect
from shared.sim.hidden.arms import ARMS
from shared.sim.plant.plant import mjcf
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from tests.arms import JOINTS, make_plant, make_subject, recorded, replay, write_arm

EFFECTS: tuple[Effect, ...] = (gravity_tilt.EFFECT, base_compliance.EFFECT, payload.EFFECT)
_BALL = 4e-4
"""How hard something to carry is to turn by itself (kg m^2)."""


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


@pytest.fixture(scope="module")
def carried(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """An arm of which the controller carries the links' weight."""
    path = write_arm(tmp_path_factory.mktemp("carried"))
    is_carried = r'<body name="\1" gravcomp="1"'
    path.write_text(re.sub('<body name="(upper|fore)"', is_carried, path.read_text()))
    return make_subject(mjcf(path, "position", JOINTS, JOINTS, "tool"))


def test_what_a_controller_does_not_know_of_pulls_though_it_carries_the_arm(carried: Subject):
    still = recorded([0.0, 0.0, 0.0], seconds=3.0)
    plain = replay(carried, still)
    assert np.abs(plain.q[-1]).max() < 1e-4
    found = replay(carried, still, payload.EFFECT, "", [0.5])
    # 0.5 kg at the forearm's centre, 0.55 m from the lift, held by 200 N m/rad but for friction
    assert found.q[-1, 1] * 200 == pytest.approx(0.5 * 9.81 * 0.55, abs=0.12)
    assert payload.EFFECT.places(carried) == ("",)
    heavier = replay(carried, still, inertia_error.EFFECT, "lift", [0.8])
    assert heavier.q[-1, 1] * 200 == pytest.approx(0.8 * 9.81 * 0.2, abs=0.12)


def test_a_controller_that_carries_an_arm_goes_by_a_level_base(carried: Subject):
    tilt, lever = 0.1, 1.0 * 0.2 + 0.5 * 0.55
    still = recorded([0.0, 0.0, 0.0], seconds=3.0)
    found = replay(carried, still, gravity_tilt.EFFECT, "", [tilt, 0.0])
    assert found.q[-1, 0] * 200 == pytest.approx(lever * 9.81 * np.sin(tilt), abs=0.12)
    assert abs(found.q[-1, 1]) * 200 < 0.15  # 4.66 N m of it, were it not carried


def test_a_payload_beside_the_tools_centre_moves_it(subject: Subject):
    # of the forearm: along x and z; both hinges that move it up turn about y, the pan about z
    place = payload.OFF_CENTRE
    assert payload.EFFECT.places(subject) == ("", place)
    names = [each.name for each in payload.EFFECT.quantities(subject, place)]
    assert names == ["mass", "centre_x", "centre_y", "centre_z", "inertia"]
    still = recorded([0.0, 0.0, 0.0], seconds=3.0)
    plain = replay(subject, still)
    found = replay(subject, still, payload.EFFECT, place, [0.5, 0.1, 0.0, 0.0, 0.0])
    # 1 kg at 0.25 m from the elbow instead of 0.5 kg at 0.15 m
    lever = 1.0 * 0.25 - 0.5 * 0.15
    assert (found.q[-1, 2] - plain.q[-1, 2]) * 200 == pytest.approx(9.81 * lever, rel=0.08)


def test_a_payload_beside_the_tools_centre_turns_as_one_that_is_welded_there(tmp_path: Path):
    # a ball of 0.5 kg at (0.1, 0.06, -0.04) m from the centre of the forearm's 0.5 kg
    path = write_arm(tmp_path)
    plant = mjcf(path, "position", JOINTS, JOINTS, "tool")
    own = make_subject(plant).nominal.model
    fore = int(own.body("fore").id)
    at, beside = own.body_ipos[fore], np.array([0.1, 0.06, -0.04])

    def numbers(values: np.ndarray) -> str:
        return " ".join(f"{value:.17g}" for value in values)

    inertial = (
        f'<inertial mass="0.5" pos="{numbers(at + beside)}" '
        f'diaginertia="{numbers(np.full(3, _BALL))}"/>'
    )
    welded = tmp_path / "welded.xml"
    text = path.read_text()
    begin = text.index('<body name="fore"')
    end = text.index("</body>", begin)
    welded.write_text(f'{text[:end]}<body name="held">{inertial}</body>{text[end:]}')
    fast = recorded(swing, seconds=2.0)
    wanted = replay(make_subject(mjcf(welded, "position", JOINTS, JOINTS, "tool")), fast).q
    size = [0.5, *(0.5 * beside), _BALL]  # the centre of both is half-way
    found = replay(make_subject(plant), fast, payload.EFFECT, payload.OFF_CENTRE, size).q
    alone = replay(make_subject(plant), fast, payload.EFFECT, payload.OFF_CENTRE, [0.5, *[0] * 4]).q
    assert np.abs(alone - wanted).max() > 2e-3
    np.testing.assert_allclose(found, wanted, atol=2e-5)


def test_what_moves_the_tools_centre_without_a_mass_is_no_harder_to_turn(subject: Subject):
    def turns(mass: float, inertia: float = 0.0) -> float:
        seen: list[float] = []

        def enter(row: Row) -> None:
            size = np.array([mass, 0.01, 0.0, 0.02, inertia])
            payload.EFFECT.enter(row, payload.OFF_CENTRE, size)
            seen.append(row.field("body_inertia")[row.tool_body()].sum())

        subject.nominal.run([(enter, recorded([0.0, 0.0, 0.0], seconds=0.1))])
        return seen[0]

    tool = subject.nominal.model.body_inertia[subject.nominal.model.body("fore").id].sum()
    more = [turns(mass) - tool for mass in (0.0, 1e-4, 0.3)]
    assert more[0] == pytest.approx(0.0, abs=1e-12)
    assert more[1] < 1e-5
    # 0.5 * 0.3 / 0.8 kg, as far apart as moves the centre by (0.01, 0, 0.02) m; about three axes
    assert more[2] == pytest.approx(2.0 * 0.1875 * (0.01**2 + 0.02**2) * (0.8 / 0.3) ** 2, rel=0.01)
    assert turns(0.3, _BALL) - turns(0.3) == pytest.approx(3.0 * _BALL)


def test_where_the_centre_comes_to_lie_is_the_same_on_a_base_that_gives():
    """Both joints turn about y, hinges that are added for the base do not."""
    pendulum = make_subject(ARMS["torque2"].make())
    bends = Rollouts(pendulum.plant, base_compliance.EFFECT.structure(pendulum, ""), 1)

    def enter(row: Row) -> None:
        payload.EFFECT.enter(row, payload.OFF_CENTRE, np.array([0.5, 0.1, 0.02, 0.0]))

    row = bends.entered(enter, recorded([0.0, 0.0], seconds=0.1))
    tool = row.tool_body()
    moved = row.field("body_ipos")[tool] - bends.model.body_ipos[tool]
    np.testing.assert_allclose(moved, [0.1, 0.0, 0.02], atol=1e-12)


def test_what_the_data_rule_out_sits_nowhere(tmp_path: Path):
    weightless = make_subject(make_plant(tmp_path, has_gravity=False), has_tracker=False)
    assert gravity_tilt.EFFECT.places(weightless) == ()
    assert base_compliance.EFFECT.places(weightless) == ()
