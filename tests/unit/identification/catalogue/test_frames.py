import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.command_frame import EFFECT as COMMAND
from shared.identification.catalogue.tool_offset import EFFECT as TOOL
from shared.identification.catalogue.tracker_frame import EFFECT as WORLD
from shared.identification.dataset.types import Float64
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.poses import conjugate, frame, product, rotated, seen_from
from shared.sim.plant.replay import Reports
from tests.arms import make_plant, make_subject, recorded, replay

REST = (-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46)


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    return make_subject(make_plant(tmp_path_factory.mktemp("arm")))


@pytest.fixture(scope="module")
def fencer() -> Subject:
    return make_subject(pr2("right", None))


def _waving(at: Float64) -> Float64:
    return np.stack([0.8 * np.sin(4 * at), 0.3 * np.sin(3 * at), 0.5 * np.sin(5 * at)], axis=1)


def _tracker(reports: Reports) -> Float64:
    assert reports.tracker is not None
    return reports.tracker


def test_a_shifted_world_is_off_by_the_same_way_everywhere(subject: Subject):
    motion = recorded(_waving)
    plain, moved = (
        replay(subject, motion),
        replay(subject, motion, WORLD, "", [0.02, -0.01, 0.03, 0, 0, 0]),
    )
    np.testing.assert_array_equal(moved.q, plain.q)
    off = _tracker(moved)[:, :3] - _tracker(plain)[:, :3]
    np.testing.assert_allclose(off, np.tile([-0.02, 0.01, -0.03], (len(off), 1)), atol=1e-12)
    np.testing.assert_allclose(_tracker(moved)[:, 3:], _tracker(plain)[:, 3:], atol=1e-12)


def test_a_turned_world_gives_a_pose_back_once_it_is_turned_back(subject: Subject):
    """A frame that is turned by 90 degrees about z sees the world's x along its -y."""
    still = recorded([0.0, 0.0, 0.0])
    plain = _tracker(replay(subject, still))
    turned = _tracker(replay(subject, still, WORLD, "", [0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2]))
    np.testing.assert_allclose(turned[:, 1], -plain[:, 0], atol=1e-12)
    np.testing.assert_allclose(turned[:, 0], plain[:, 1], atol=1e-12)
    back = seen_from(frame(np.array([0.0, 0.0, 0.0, 0.0, 0.0, np.pi / 2])), turned)
    np.testing.assert_allclose(back, plain, atol=1e-12)


def test_a_tracker_elsewhere_on_the_tool_is_off_by_the_same_way_in_the_hand(subject: Subject):
    motion = recorded(_waving)
    plain = _tracker(replay(subject, motion))
    moved = _tracker(replay(subject, motion, TOOL, "", [0.01, 0.02, -0.03, 0.0, 0.1, 0.0]))
    in_hand = rotated(conjugate(plain[:, 3:]), moved[:, :3] - plain[:, :3])
    np.testing.assert_allclose(in_hand, np.tile([0.01, 0.02, -0.03], (len(plain), 1)), atol=1e-12)
    turn = product(conjugate(plain[:, 3:]), moved[:, 3:])
    expected = [np.cos(0.05), 0.0, np.sin(0.05), 0.0]
    np.testing.assert_allclose(turn, np.tile(expected, (len(plain), 1)), atol=1e-12)
    in_world = moved[:, :3] - plain[:, :3]
    assert np.ptp(in_world, axis=0).max() > 0.01  # which the other effect would not be


def test_commands_in_another_frame_pull_the_tool_there(fencer: Subject):
    """At rest on its command, with no gravity: a command 2 cm lower is where it goes."""
    home = tool_poses(fencer.plant, fencer.nominal.model, np.array([REST]))[0]
    still = recorded(home.tolist(), seconds=3.0, initial_q=REST)
    plain = _tracker(replay(fencer, still))
    lower = _tracker(replay(fencer, still, COMMAND, "", [0.0, 0.0, -0.02, 0.0, 0.0, 0.0]))
    np.testing.assert_allclose(plain[-1, :3], home[:3], atol=1e-6)
    told = recorded((home - [0, 0, 0.02, 0, 0, 0, 0]).tolist(), seconds=3.0, initial_q=REST)
    np.testing.assert_allclose(lower, _tracker(replay(fencer, told)), atol=1e-9)
    assert lower[-1, 2] - plain[-1, 2] < -0.01


def test_only_poses_have_a_frame_and_only_a_tracker_has_one(subject: Subject, fencer: Subject):
    assert COMMAND.places(fencer) == ("",)
    assert COMMAND.places(subject) == ()
    unseen = make_subject(subject.plant, has_tracker=False)
    assert WORLD.places(unseen) == TOOL.places(unseen) == ()
