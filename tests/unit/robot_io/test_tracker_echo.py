import numpy as np

from shared.messages.play import TrackerPose
from shared.messages.topics import TRACKER
from tests.unit.robot_io.looping import Looping


def test_bat_states_name_the_newest_pose_that_they_hold():
    loop = Looping(tracker="mouse")
    loop.tick(2)
    assert (loop.states[-1].tracker_source, loop.states[-1].tracker_sequence) == ("", -1)
    pose = np.array([0.9, 0.1, 1.0, 0.0, 0.0, 0.0, 1.0])
    for sequence in (4, 5):
        loop.bench.publish(TRACKER, TrackerPose(sequence=sequence, source="page", pose=pose))
    loop.tick()
    assert (loop.states[-1].tracker_source, loop.states[-1].tracker_sequence) == ("page", 5)


def test_a_second_robot_is_no_tracker_to_name():
    loop = Looping(tracker="policy").tick(2)
    assert (loop.states[-1].tracker_source, loop.states[-1].tracker_sequence) == ("", -1)
