"""Arms that move alike are simulated once."""

import numpy as np
import pytest

from shared.identification.arm.subject import recorded_of, subject_of
from shared.identification.catalogue.base_compliance import EFFECT as GIVES
from shared.sim.plant.replay import Recorded, Reports
from shared.sim.plant.rollouts import Entry, Rollouts
from shared.sim.plant.row import JointsReport, Row
from tests.measured import measure, nothing


def later(row: Row) -> None:
    """Let the robot log other readings of the same motion."""

    def report(joints: JointsReport) -> None:
        joints.q = joints.q + 1.0

    row.on_joints(report)


def heavier(row: Row) -> None:
    row.field("body_mass")[:] *= 1.5


def elsewhere(row: Row) -> None:
    row.initial_q = row.initial_q + 0.1


@pytest.fixture(scope="module")
def arms(tmp_path_factory: pytest.TempPathFactory) -> tuple[Rollouts, tuple[Recorded, ...]]:
    dataset = measure(tmp_path_factory.mktemp("data"), np.random.default_rng(0), seconds=1.0)
    return Rollouts(subject_of(dataset).plant, (), 4), recorded_of(dataset)


def run(
    arms: tuple[Rollouts, tuple[Recorded, ...]],
    entries: list[Entry],
    monkeypatch: pytest.MonkeyPatch,
) -> tuple[list[Reports], int]:
    """Return what arms on the first recording report, and how many were simulated."""
    rollouts, recordings = arms
    simulated = 0
    step = Rollouts._run  # pyright: ignore[reportPrivateUsage]

    def counted(self: Rollouts, work: list[tuple[Row, Recorded]]) -> object:
        nonlocal simulated
        simulated += len(work)
        return step(self, work)

    monkeypatch.setattr(Rollouts, "_run", counted)
    return rollouts.run([(entry, recordings[0]) for entry in entries]), simulated


def test_what_is_only_reported_otherwise_is_simulated_once(
    arms: tuple[Rollouts, tuple[Recorded, ...]], monkeypatch: pytest.MonkeyPatch
):
    found, simulated = run(arms, [nothing, later, nothing], monkeypatch)
    assert simulated == 1
    assert np.array_equal(found[1].q, found[0].q + 1.0)
    assert np.array_equal(found[2].q, found[0].q)


def test_what_moves_otherwise_is_simulated_by_itself(
    arms: tuple[Rollouts, tuple[Recorded, ...]], monkeypatch: pytest.MonkeyPatch
):
    found, simulated = run(arms, [heavier, nothing, elsewhere], monkeypatch)
    assert simulated == 3
    alone = [arms[0].run([(entry, arms[1][0])])[0].q for entry in (heavier, nothing, elsewhere)]
    for together, one in zip(found, alone, strict=True):
        np.testing.assert_allclose(together.q, one, atol=1e-12)
    assert np.abs(found[0].q - found[1].q).max() > 1e-3


def test_arms_whose_added_joints_rest_alike_are_simulated_once(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
):
    dataset = measure(tmp_path_factory.mktemp("soft"), np.random.default_rng(0), seconds=1.0)
    subject = subject_of(dataset)
    arms = Rollouts(subject.plant, GIVES.structure(subject, ""), 6), recorded_of(dataset)

    def soft(row: Row) -> None:
        GIVES.enter(row, "", np.array([1e-3, 2e-3, 0.1]))

    def softer(row: Row) -> None:
        GIVES.enter(row, "", np.array([1e-3, 3e-3, 0.1]))

    def starting(speed: float) -> Entry:
        def enter(row: Row) -> None:
            soft(row)
            row.start("base/about_x", 0.0, speed)

        return enter

    entries = [soft, soft, softer, starting(0.1), starting(0.1), starting(0.2)]
    found, simulated = run(arms, entries, monkeypatch)
    assert simulated == 4
    assert np.array_equal(found[0].q, found[1].q)
    assert np.array_equal(found[3].q, found[4].q)
    assert not np.array_equal(found[4].q, found[5].q)
