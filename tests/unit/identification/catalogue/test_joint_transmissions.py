"""Links that do not stand where their motors do: springs and gaps between them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.arm.subject import Subject
from shared.identification.catalogue.backlash import EFFECT as BACKLASH
from shared.identification.catalogue.joint_elasticity import EFFECT as ELASTICITY
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import pr2
from shared.sim.plant.replay import Recorded, Reports
from shared.sim.plant.signals import Signal
from tests.arms import make_plant, make_subject, recorded, replay, still

_ELBOW_WEIGHT = 0.736
"""On the elbow held straight out (N m), against the positive turn: so it pulls by plus."""
_LIFT_WEIGHT = 4.66


@pytest.fixture
def subject(tmp_path: Path) -> Subject:
    return make_subject(make_plant(tmp_path))


def _unseen_pitch(reports: Reports) -> Float64:
    """Return float64[T], by how much the tool is pitched further than the encoders say (rad)."""
    assert reports.tracker is not None
    pitch = 2.0 * np.arcsin(reports.tracker[:, 5])
    return pitch - reports.q[:, 1] - reports.q[:, 2]


@pytest.mark.parametrize(("place", "weight"), [("lift", _LIFT_WEIGHT), ("elbow", _ELBOW_WEIGHT)])
def test_an_elastic_joint_gives_by_load_times_compliance(
    subject: Subject, place: str, weight: float
) -> None:
    held = recorded([0.0, 0.0, 0.0], 2.0)
    given = _unseen_pitch(replay(subject, held, ELASTICITY, place, [0.002]))
    assert given[-1] == pytest.approx(0.002 * weight, rel=0.01)


def test_an_elastic_joint_starts_where_its_load_leaves_it(subject: Subject) -> None:
    settled = replay(subject, recorded([0.0, 0.0, 0.0], 3.0)).q[-1]
    held = recorded([0.0, 0.0, 0.0], 0.5, settled)
    given = _unseen_pitch(replay(subject, held, ELASTICITY, "elbow", [0.01]))
    np.testing.assert_allclose(given, 0.01 * _ELBOW_WEIGHT, rtol=0.03)


def test_the_softer_a_joint_the_slower_its_link_swings(subject: Subject) -> None:
    flick = recorded(lambda at: np.outer(at > 0.2, [0.0, 0.0, 0.1]), 1.0)

    def swings(compliance: float) -> float:
        off = _unseen_pitch(replay(subject, flick, ELASTICITY, "elbow", [compliance]))
        return 0.01 * float(np.argmax(off[21:60]))  # until it has swung through (s)

    # 0.015 kg m^2 on 20 and on 67 N m/rad: periods of 0.17 s and 0.09 s
    assert 1.3 < swings(0.05) / swings(0.015) < 2.5


def test_a_gap_is_crossed_when_the_load_reverses(tmp_path: Path) -> None:
    subject = make_subject(make_plant(tmp_path, has_gravity=False))
    gap = 0.02

    def command(at: Float64) -> Float64:
        return np.outer(0.4 * np.sin(2.0 * np.pi * at), [0.0, 0.0, 1.0])

    found = replay(subject, recorded(command, 3.0), BACKLASH, "elbow", [gap])
    off = _unseen_pitch(found)[100:]
    assert off.max() == pytest.approx(0.5 * gap, rel=0.15)  # flanks give when they are hit
    assert off.min() == pytest.approx(-0.5 * gap, rel=0.15)
    # the motor accelerates against its position: so does the link, which lies on the other flank
    q = found.q[100:, 2]
    assert np.corrcoef(off, q)[0, 1] > 0.7


def test_under_weight_a_link_lies_on_one_flank_from_the_start(subject: Subject) -> None:
    settled = replay(subject, recorded([0.0, 0.0, 0.0], 3.0)).q[-1]
    held = recorded([0.0, 0.0, 0.0], 0.5, settled)
    off = _unseen_pitch(replay(subject, held, BACKLASH, "elbow", [0.02]))
    np.testing.assert_allclose(off, 0.01, rtol=0.05)


def test_encoders_hardly_notice_a_gap(subject: Subject) -> None:
    held = recorded([0.0, 0.0, 0.0], 1.0)
    plain, gapped = replay(subject, held), replay(subject, held, BACKLASH, "elbow", [0.02])
    assert np.abs(gapped.q - plain.q).max() < 1e-3


def test_transmissions_show_only_at_joints_that_move(subject: Subject) -> None:
    for effect in (ELASTICITY, BACKLASH):
        assert effect.places(still(subject, "elbow")) == ("elbow",)


def test_a_pose_controller_goes_by_the_encoders_and_lets_the_tool_bend() -> None:
    subject = make_subject(pr2("right", None))
    model = subject.nominal.model
    rest = np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46])
    at: Float64 = np.arange(0.0, 2.0, 0.01)
    q = rest + 0.15 * np.outer(1.0 - np.cos(2.0 * np.pi * at), np.linspace(1.0, 0.5, 7))
    command = Signal(at, tool_poses(subject.plant, model, q))
    recording = Recorded(rest, np.zeros(7), command, Signal(at, q), at, at, "slow", 0.0)
    plain = replay(subject, recording)
    logged = replace(recording, logged_q=Signal(at, plain.q))
    bent = replay(subject, logged, ELASTICITY, "shoulder_pan", [0.0005])
    assert plain.tracker is not None
    assert bent.tracker is not None
    seen = np.linalg.norm((bent.tracker - plain.tracker)[:, :3], axis=1)
    believed = np.linalg.norm(
        tool_poses(subject.plant, model, bent.q)[:, :3]
        - tool_poses(subject.plant, model, plain.q)[:, :3],
        axis=1,
    )
    assert seen.max() > 1e-3
    # A controller that saw the bend would hold the tool and let the encoders stray: 0.4 here.
    assert np.sqrt(np.mean(seen**2)) > 1.2 * np.sqrt(np.mean(believed**2))


@pytest.mark.parametrize(("effect", "size"), [(ELASTICITY, 0.02), (BACKLASH, 0.02)])
def test_encoders_of_the_link_see_what_a_tracker_sees(
    subject: Subject, effect: Effect, size: float
) -> None:
    """And the link, not its motor, begins where the log says."""
    seeing = replace(subject, plant=replace(subject.plant, encoders="link"))
    settled = replay(subject, recorded([0.0, 0.0, 0.0], 3.0)).q[-1]
    held = recorded([0.0, 0.0, 0.0], 0.5, settled)
    of_motor, of_link = (replay(each, held, effect, "elbow", [size]) for each in (subject, seeing))
    assert abs(_unseen_pitch(of_motor)).max() > 0.4 * size * min(1.0, _ELBOW_WEIGHT)
    np.testing.assert_allclose(_unseen_pitch(of_link), 0.0, atol=1e-3 * size)
    np.testing.assert_allclose(of_link.q[0], settled, atol=1e-3 * size)
