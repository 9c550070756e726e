import csv
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.counterbalance import EFFECT
from shared.identification.laws.counterbalance import (
    BAR_TOLERANCE,
    SCREW_TOLERANCE,
    effort_per_turn,
    turns_of,
)
from shared.sim.plant.plant import pr2
from tests.arms import make_plant, make_subject, recorded, replay

MAP = Path(__file__).parents[5] / "shared/data/pr2_counterbalance/counterbalance_model.csv"


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm")))


@pytest.fixture(scope="module")
def fencer() -> Subject:
    return make_subject(pr2("right", None))


def test_it_sits_where_weight_is_carried_and_at_a_pr2_as_a_whole(
    subject: Subject, fencer: Subject, tmp_path: Path
):
    assert EFFECT.places(subject) == ("lift", "elbow")  # the pan's axis is upright
    assert EFFECT.places(fencer) == ("",)
    assert [each.unit for each in EFFECT.quantities(fencer, "")] == ["turns", "turns"]
    assert EFFECT.places(make_subject(make_plant(tmp_path, has_gravity=False))) == ()


def test_a_joint_that_carries_all_of_its_weight_needs_no_torque(subject: Subject):
    still = recorded([0.0, 0.0, 0.0], seconds=3.0)
    plain = replay(subject, still)
    found = replay(subject, still, EFFECT, "lift", [1.0])
    # The servo of 200 N m/rad sags under 4.66 N m, less at most 0.1 N m of friction.
    assert plain.q[-1, 1] * 200 == pytest.approx(4.66, abs=0.15)
    assert found.q[-1, 1] * 200 == pytest.approx(0.0, abs=0.15)
    assert found.q[-1, 2] == pytest.approx(plain.q[-1, 2], abs=1e-3)


def test_no_share_and_no_turn_is_the_model_as_it_was(subject: Subject, fencer: Subject):
    still = recorded([0.2, 0.1, -0.3], seconds=1.0)
    plain = replay(subject, still)
    np.testing.assert_allclose(replay(subject, still, EFFECT, "lift", [0.0]).q, plain.q, atol=1e-9)
    reach = recorded([0.7, -0.3, 0.1, 1.0, 0.0, 0.0, 0.0], 1.0, (0.0, 0.3, 0.0, -1.2, 0.0, -0.8, 0))
    still_there = replay(fencer, reach, EFFECT, "", [0.0, 0.0])
    np.testing.assert_allclose(still_there.q, replay(fencer, reach).q, atol=1e-9)


def test_a_turn_of_the_spring_pushes_as_the_makers_measured(fencer: Subject):
    """The arm floats: its acceleration from rest is that of the torque."""
    at_lift, at_flex = 0.4, -1.0
    per_turn = effort_per_turn(np.array(at_lift), np.array(at_flex))
    assert per_turn[0, 0] == pytest.approx(0.286, abs=0.03)  # the table's row 0.4, -1
    assert per_turn[0, 1] == pytest.approx(0.921, abs=0.12)
    start = (0.0, at_lift, 0.0, at_flex, 0.0, -0.8, 0.0)
    here = recorded([0.7, -0.3, 0.1, 1.0, 0.0, 0.0, 0.0], 0.05, start)
    plain, found = replay(fencer, here), replay(fencer, here, EFFECT, "", [1.0, 0.0])
    gone = found.q[-1, 1] - plain.q[-1, 1]
    assert gone < 0.0  # more effort is needed, so the spring pushes the lift up, to negative angles


@pytest.mark.skipif(not MAP.exists(), reason="needs the measured map of the shared data")
def test_hidden_turns_are_recovered_from_the_measured_map_within_the_makers_tolerance():
    with MAP.open() as file:
        rows = list(csv.DictReader(file))

    def column(name: str) -> np.ndarray:
        return np.array([float(row[name]) for row in rows])

    lift, flex = column("lift_rad"), column("flex_rad")
    measured = np.array(
        [
            [column(f"{joint}_effort_per_turn_{adjuster}") for adjuster in ("secondary", "bar")]
            for joint in ("lift", "flex")
        ]
    ).transpose(2, 0, 1)  # posture, joint, adjuster
    off = np.sqrt(np.mean((effort_per_turn(lift, flex) - measured) ** 2, axis=0))
    np.testing.assert_array_less(off, [[0.012, 0.045], [0.005, 0.02]])
    rng = np.random.default_rng(5)
    for hidden in rng.uniform([-10.0, -4.0], [10.0, 4.0], (20, 2)):
        efforts = measured @ hidden
        found = turns_of(lift, flex, efforts)
        assert abs(found[0] - hidden[0]) < SCREW_TOLERANCE
        assert abs(found[1] - hidden[1]) < BAR_TOLERANCE
