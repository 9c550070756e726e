from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.external_contact import EFFECT
from tests.arms import make_plant, make_subject, recorded, replay


@pytest.fixture(scope="module")
def subject(tmp_path_factory: pytest.TempPathFactory) -> Subject:
    folder: Path = tmp_path_factory.mktemp("arm")
    return make_subject(make_plant(folder, "torque", has_gravity=False))


def test_it_sits_at_every_joint_in_every_recording(subject: Subject):
    places = EFFECT.places(subject)
    assert len(places) == 6
    assert places[0] == "pan in slow"
    torque, begin, length = EFFECT.quantities(subject, "elbow in fast")
    assert torque.unit == "N m"
    # windows of half a second that cover all of 10 s
    assert begin.grid == pytest.approx(tuple(0.5 * index for index in range(20)))
    assert length.grid == (0.5,)


def test_a_push_turns_a_free_joint_by_hand(subject: Subject):
    # Pan with the arm straight out. Links 0.002 (shoulder) + 0.015 + 1 0.2^2 + 0.004 + 0.5 0.55^2
    # and 0.02 of armature make 0.23225 kg m^2; 2 N m less 0.1 of friction, against 0.5 N m s/rad.
    idle = recorded([0.0, 0.0, 0.0], seconds=0.3)
    found = replay(subject, idle, EFFECT, "pan in slow", [2.0, 0.05, 0.1])
    speed = (found.q[15, 0] - found.q[13, 0]) / 0.02  # 0.09 s into the push
    assert speed == pytest.approx(1.9 / 0.5 * (1.0 - np.exp(-0.09 * 0.5 / 0.23225)), rel=0.02)
    assert np.all(found.q[:5, 0] == 0.0)
    assert np.all(np.diff(found.q[16:, 0], 2) < 0.0)  # from then on it only gets slower


def test_nothing_happens_in_another_recording_and_without_a_torque_or_a_time(subject: Subject):
    idle = recorded([0.0, 0.0, 0.0], seconds=0.3)
    for place, values in (
        ("pan in fast", [2.0, 0.05, 0.1]),
        ("pan in slow", [0.0, 0.05, 0.1]),
        ("pan in slow", [2.0, 0.05, 0.0]),
    ):
        assert not replay(subject, idle, EFFECT, place, values).q.any()


def test_the_window_need_not_begin_on_a_step(subject: Subject):
    idle = recorded([0.0, 0.0, 0.0], seconds=0.2)
    ends = [
        replay(subject, idle, EFFECT, "elbow in slow", [1.0, 0.05 + shift, 0.05]).q[-1, 2]
        for shift in (0.0, 0.0005, 0.001)
    ]
    assert ends[0] > ends[1] > ends[2]
