import itertools

import numpy as np
import pytest

from services.page.hand import Hand, Reach
from services.page.protocol import Pointer
from services.page.tracking import LOST_PERIOD, PERIOD, SILENCE, PointerTracker
from shared.game.geometry import BatShape, Target
from shared.messages.play import BatStates, TrackerPose


def tracker() -> PointerTracker:
    hand = Hand(Reach.of(1.0, Target()), BatShape(), 3.0, 6.0)
    names = itertools.count()
    return PointerTracker(hand, 0.0, name=lambda: f"source-{next(names)}")


def said(sequence: int, *, session: int = 1, is_valid: bool = True) -> Pointer:
    return Pointer(
        session=session, sequence=sequence, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=is_valid
    )


def heard(made: PointerTracker, pointer: Pointer, now: float) -> TrackerPose:
    made.hear(pointer, now)
    pose = made.due(now, is_fresh=True)
    assert pose is not None
    return pose


def states_of(pose: TrackerPose) -> BatStates:
    return BatStates(
        tick=0, boot="b", at_ns=0, bats=np.zeros((2, 13)), tools=np.zeros((2, 7)),
        is_valid=np.ones(2, np.bool_), seconds=0.0, tracker_source=pose.source,
        tracker_sequence=pose.sequence,
    )  # fmt: skip


def test_nothing_is_said_before_a_page_has_said_something():
    made = tracker()
    assert made.due(10.0, is_fresh=False) is None
    assert made.is_lost


def test_poses_go_on_at_their_pace_while_the_mouse_rests():
    made = tracker()
    first = heard(made, said(0), 1.0)
    assert made.due(1.0 + 0.5 * PERIOD, is_fresh=False) is None
    now, poses = 1.0, [first]
    for _ in range(10):
        now += PERIOD + 1e-6
        pose = made.due(now, is_fresh=False)
        assert pose is not None
        poses.append(pose)
    assert [pose.sequence for pose in poses] == list(range(11))
    assert all(pose.is_valid for pose in poses)


def test_a_page_that_falls_silent_has_lost_the_bat_and_says_so_on_and_on():
    made = tracker()
    heard(made, said(0), 1.0)
    lost = made.due(1.0 + SILENCE + 0.01, is_fresh=False)
    assert lost is not None
    assert not lost.is_valid
    assert made.is_lost
    assert made.due(1.0 + SILENCE + 0.05, is_fresh=False) is None
    again = made.due(1.0 + SILENCE + 0.02 + LOST_PERIOD, is_fresh=False)
    assert again is not None
    assert not again.is_valid
    assert heard(made, said(1), 2.0).is_valid


def test_a_hidden_page_is_lost_at_once():
    made = tracker()
    heard(made, said(0), 1.0)
    assert not heard(made, said(1, is_valid=False), 1.01).is_valid


def test_a_page_that_is_gone_is_lost_without_waiting():
    made = tracker()
    heard(made, said(0), 1.0)
    made.lose()
    pose = made.due(1.0 + LOST_PERIOD, is_fresh=False)
    assert pose is not None
    assert not pose.is_valid


def test_a_new_page_is_a_new_tracker_that_counts_from_zero():
    made = tracker()
    heard(made, said(0), 1.0)
    heard(made, said(1), 1.01)
    pose = heard(made, said(0, session=2), 1.02)
    assert (pose.source, pose.sequence) == ("source-1", 0)


def test_the_echo_says_which_of_the_pages_poses_is_in_the_bat_states():
    made = tracker()
    first = heard(made, said(7), 1.0)
    second = made.due(1.0 + 2 * PERIOD, is_fresh=False)
    third = heard(made, said(12), 1.02)
    assert second is not None
    assert [made.echo(states_of(pose)) for pose in (first, second, third)] == [7, 7, 12]


def test_states_of_another_tracker_are_no_echo():
    made = tracker()
    old = heard(made, said(7), 1.0)
    heard(made, said(0, session=2), 1.1)
    assert made.echo(states_of(old)) == -1


@pytest.mark.parametrize("gap", [0.0, 0.004, 1.0])
def test_a_pose_never_leaps_whatever_the_gap(gap: float):
    made = tracker()
    before = heard(made, said(0), 1.0)
    pose = heard(made, said(1), 1.0 + gap)
    assert np.linalg.norm(pose.pose[:3] - before.pose[:3]) < 0.05
