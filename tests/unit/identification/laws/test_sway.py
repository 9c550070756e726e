"""A part of a recording begins with what no encoder sees as the motion before left it."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.backlash import EFFECT as PLAYS
from shared.identification.catalogue.base_compliance import EFFECT as GIVES
from shared.identification.catalogue.joint_elasticity import EFFECT as BENDS
from shared.identification.dataset.types import Float64
from shared.identification.effect import Effect
from shared.sim.plant.plant import stepped
from shared.sim.plant.replay import Recorded
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal, pose_error
from tests.arms import make_plant, make_subject, recorded

VALUES = np.array([5e-3, 1e-2, 0.1])
BEGIN = 1.5


def swing(at: Float64) -> Float64:
    return np.stack([0.3 * np.sin(4 * at), 0.4 * np.sin(5 * at), 0.3 * np.sin(7 * at)], axis=1)


def gives(row: Row) -> None:
    GIVES.enter(row, "", VALUES)


@pytest.fixture(scope="module")
def rollouts(tmp_path_factory: pytest.TempPathFactory) -> Rollouts:
    subject = make_subject(make_plant(tmp_path_factory.mktemp("arm")))
    return Rollouts(subject.plant, GIVES.structure(subject, ""), 4)


@pytest.fixture(scope="module")
def whole(rollouts: Rollouts) -> tuple[Recorded, Float64, Float64]:
    """Return a recording, its joints and its tracker."""
    asked = recorded(swing, seconds=3.0)
    (found,) = rollouts.run([(gives, asked)])
    assert found.tracker is not None
    return asked, found.q, found.tracker


def part(asked: Recorded, q: Float64) -> Recorded:
    """Return what begins in the midst of a recording."""
    at = asked.joints_at
    first = int(np.searchsorted(at, BEGIN))
    speed = (q[first + 1] - q[first - 1]) / (at[first + 1] - at[first - 1])
    later = at[first:] - at[first]
    return replace(
        asked, initial_q=q[first], initial_qd=speed, logged_q=Signal(at - at[first], q),
        command=asked.command.later(-at[first]), joints_at=later, tracker_at=later,
        begin=float(at[first]),
    )  # fmt: skip


def test_a_part_sways_as_the_whole_does(
    rollouts: Rollouts, whole: tuple[Recorded, Float64, Float64]
):
    asked, q, tracker = whole
    (found,) = rollouts.run([(gives, part(asked, q))])
    still = replace(part(asked, q), logged_q=Signal(np.array([0.0, 0.01]), np.zeros((2, 3))))
    (at_rest,) = rollouts.run([(gives, still)])
    assert found.tracker is not None
    assert at_rest.tracker is not None
    true = tracker[-len(found.tracker) :]
    off, without = (
        np.sqrt(np.mean(pose_error(true, each)[:50, :3] ** 2))
        for each in (found.tracker, at_rest.tracker)
    )
    assert without > 1e-3
    assert off < 0.2 * without


def test_what_begins_with_the_recording_begins_at_rest(rollouts: Rollouts):
    row = rollouts.entered(gives, recorded(swing, seconds=1.0))
    assert row.speeds == {}
    assert set(row.rests) == {"base/about_x", "base/about_y"}


def test_how_it_sways_is_not_that_of_a_run_at_a_longer_step(
    tmp_path: Path, rollouts: Rollouts, whole: tuple[Recorded, Float64, Float64]
):
    """What the motion took of it is worked out once; the springs' armature goes by the step."""
    asked, q, _ = whole
    subject = make_subject(stepped(rollouts.plant, 4.0 * rollouts.plant.timestep))
    rough = Rollouts(subject.plant, GIVES.structure(subject, ""), 1)
    later = part(asked, q)
    same = replace(later, logged_q=Signal(later.logged_q.at, later.logged_q.values))
    rough.run([(gives, later)])
    after, alone = (rollouts.entered(gives, each) for each in (later, same))
    assert after.speeds == pytest.approx(alone.speeds, rel=1e-6)
    assert alone.speeds


def test_too_short_a_motion_says_nothing(
    rollouts: Rollouts, whole: tuple[Recorded, Float64, Float64]
):
    asked, q, _ = whole
    short = replace(part(asked, q), logged_q=Signal(asked.joints_at[:5] - 0.04, q[:5]))
    assert rollouts.entered(gives, short).speeds == {}


@pytest.mark.parametrize("effect", [BENDS, PLAYS])
def test_a_link_behind_its_gear_begins_as_the_motion_before_left_it(
    tmp_path: Path, effect: Effect
) -> None:
    """Where it is soft, or free in a gap, its speed counts."""
    subject = make_subject(make_plant(tmp_path))
    rollouts = Rollouts(subject.plant, effect.structure(subject, "pan"), 2)
    size = {"joint_elasticity": 0.05, "backlash": 0.15}[effect.name]

    def loose(row: Row) -> None:
        effect.enter(row, "pan", np.array([size]))

    asked = recorded(swing, seconds=3.0)
    (whole,) = rollouts.run([(loose, asked)])
    assert whole.tracker is not None
    assert asked.tracker_at is not None
    later = part(asked, whole.q)
    seen = Signal(asked.tracker_at - later.begin, whole.tracker)
    true = whole.tracker[-len(later.joints_at) :]

    def off(recording: Recorded) -> float:
        (found,) = rollouts.run([(loose, recording)])
        assert found.tracker is not None
        return float(np.sqrt(np.mean(pose_error(true, found.tracker)[:30, :3] ** 2)))

    as_it_was = off(replace(later, logged_tracker=seen))
    at_rest = off(replace(later, begin=0.0))
    assert at_rest > 1e-3
    assert as_it_was < 0.3 * at_rest


def test_a_spring_before_a_link_that_is_seen_begins_as_its_load_bends_it(tmp_path: Path) -> None:
    """It is the motor's place and speed that the log lacks."""
    seeing = replace(make_plant(tmp_path, "torque", has_gravity=False), encoders="link")
    subject = make_subject(seeing)
    rollouts = Rollouts(seeing, BENDS.structure(subject, "pan"), 2)

    def loose(row: Row) -> None:
        BENDS.enter(row, "pan", np.array([0.02]))

    asked = recorded(lambda at: 3.0 * np.stack([np.sin(9 * at), 0 * at, 0 * at], axis=1), 3.0)
    (whole,) = rollouts.run([(loose, asked)])
    later = part(asked, whole.q)
    rest = whole.q[-len(later.joints_at) :]

    def off(recording: Recorded) -> float:
        (found,) = rollouts.run([(loose, recording)])
        return float(np.sqrt(np.mean((found.q - rest)[:30, 0] ** 2)))

    assert off(later) < 0.2 * off(replace(later, begin=0.0))
