import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.encoder_offset import EFFECT as OFFSET
from shared.identification.catalogue.encoder_scale import EFFECT as SCALE
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Reports
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from tests.arms import make_plant, make_subject, recorded, replay, still

REST = (-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46)
HELD = (0.3, -0.4, -0.6)


@pytest.fixture(scope="module")
def floating(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    folder = tmp_path_factory.mktemp("floating")
    return make_subject(make_plant(folder, has_gravity=False))


@pytest.fixture(scope="module")
def heavy(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("heavy")))


@pytest.fixture(scope="module")
def fencer() -> Subject:
    return make_subject(pr2("right", None))


def _tracker(reports: Reports) -> Float64:
    assert reports.tracker is not None
    return reports.tracker


def _tool(subject: Subject, *q: float) -> Float64:
    return tool_poses(subject.plant, subject.nominal.model, np.array([q]))[0]


@pytest.mark.parametrize(
    ("effect", "value", "true_lift"), [(OFFSET, 0.05, -0.45), (SCALE, 0.25, -0.32)]
)
def test_a_servo_holds_what_its_encoder_says(
    floating: Subject, effect: Effect, value: float, true_lift: float
):
    """The log is on the command, the link is where the encoder is wrong."""
    found = replay(floating, recorded(HELD, initial_q=HELD), effect, "lift", [value])
    np.testing.assert_allclose(found.q, np.tile(HELD, (len(found.q), 1)), atol=1e-6)
    expected = _tool(floating, HELD[0], true_lift, HELD[2])
    np.testing.assert_allclose(_tracker(found)[-1], expected, atol=1e-6)


def test_a_servo_moves_by_what_its_encoder_says(floating: Subject):
    """From the encoder's 0 to its 0.5; 25 % too much is 0.4 rad of the link."""
    found = replay(floating, recorded((0.5, 0.0, 0.0), seconds=3.0), SCALE, "pan", [0.25])
    assert found.q[-1, 0] == pytest.approx(0.5, abs=2e-3)  # friction
    assert _tracker(found)[-1, :2] == pytest.approx(
        [0.7 * np.cos(0.4), 0.7 * np.sin(0.4)], abs=2e-3
    )


def test_weight_acts_on_the_true_posture(heavy: Subject):
    """Straight out by the log, but 1 rad lower: the sag is that of the arm 1 rad lower."""
    out = recorded((0.0, 0.0, 0.0), seconds=3.0)
    lower = recorded((0.0, 1.0, 0.0), seconds=3.0, initial_q=(0.0, 1.0, 0.0))
    wrong = replay(heavy, out, OFFSET, "lift", [-1.0])
    sag, there = wrong.q[-1, 1], replay(heavy, lower).q[-1, 1] - 1.0
    assert sag == pytest.approx(there, abs=1e-9)
    assert sag < 0.7 * replay(heavy, out).q[-1, 1]  # cos 1 rad = 0.54


def test_under_torques_only_the_report_and_the_posture_differ(tmp_path):
    subject = make_subject(make_plant(tmp_path, "torque", has_gravity=False))
    pushed = recorded((0.5, 0.0, 0.0), seconds=0.5)
    plain, found = replay(subject, pushed), replay(subject, pushed, OFFSET, "pan", [0.2])
    np.testing.assert_allclose(found.q, plain.q, atol=1e-9)  # nothing knows where the pan is
    turned = _tool(subject, found.q[-1, 0] - 0.2, *found.q[-1, 1:])
    np.testing.assert_allclose(_tracker(found)[-1, :3], turned[:3], atol=1e-5)


@pytest.mark.parametrize("joint", ["shoulder_pan", "elbow_flex", "wrist_roll"])
def test_a_pose_controller_rests_where_it_believes_the_tool_to_be(fencer: Subject, joint: str):
    """Told to stay where it believes it is, the arm stays, and the tracker sees the other place."""
    home = _tool(fencer, *REST)
    stay = recorded(home.tolist(), seconds=0.5, initial_q=REST)
    found = replay(fencer, stay, OFFSET, joint, [0.04])
    np.testing.assert_allclose(found.q, np.tile(REST, (len(found.q), 1)), atol=1e-9)
    true = np.array(REST)
    true[fencer.joints.index(joint)] -= 0.04
    np.testing.assert_allclose(_tracker(found)[-1], _tool(fencer, *true), atol=1e-9)


def test_two_wrong_encoders_add_up_exactly(fencer: Subject):
    stay = recorded(_tool(fencer, *REST).tolist(), seconds=0.5, initial_q=REST)

    def enter(row: Row) -> None:
        OFFSET.enter(row, "elbow_flex", np.array([0.1]))
        SCALE.enter(row, "forearm_roll", np.array([0.1]))

    found = Rollouts(fencer.plant, (), 1).run([(enter, stay)])[0]
    true = np.array(REST)
    true[3] -= 0.1
    true[4] /= 1.1
    np.testing.assert_allclose(found.q, np.tile(REST, (len(found.q), 1)), atol=1e-9)
    np.testing.assert_allclose(_tracker(found)[-1], _tool(fencer, *true), atol=1e-9)


def test_a_zero_is_looked_for_where_something_knows_the_posture(heavy: Subject, floating: Subject):
    assert OFFSET.places(floating) == floating.joints
    blind = make_subject(floating.plant, has_tracker=False)
    assert OFFSET.places(blind) == ()
    assert OFFSET.places(make_subject(heavy.plant, has_tracker=False)) == heavy.joints
    assert SCALE.places(still(heavy, "elbow")) == ("elbow",)
    assert [each.unit for each in OFFSET.quantities(heavy, "pan")] == ["rad"]
