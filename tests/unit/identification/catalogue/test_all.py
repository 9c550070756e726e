"""What every entry of the catalogue must keep to, on every kind of arm."""

from collections import defaultdict
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
import pytest

from shared.identification import catalogue
from shared.identification.arm.subject import Subject, subject_of
from shared.identification.dataset.types import POSE, Dataset, Float64, ModelSource, Trajectory
from shared.identification.effect import Candidate, Effect
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.plant import mjcf, pr2
from shared.sim.plant.replay import Recorded, Reports
from shared.sim.plant.rollouts import Rollouts
from shared.sim.plant.row import Row
from shared.sim.plant.signals import Signal
from shared.sim.plant.structure import Structure
from tests.arms import JOINTS, make_subject, write_arm

EFFECTS = catalogue.effects()
Kind = Literal["pose", "position", "torque"]
_PERIOD = 0.01
_SECONDS = 1.0
_SLIP_AT = 0.6
_REST = {
    "pose": np.array([-0.85, 0.30, -1.50, -1.45, 0.50, -1.00, 1.46]),
    "position": np.array([0.1, -0.4, 0.6]),
    "torque": np.array([0.1, -0.4, 0.6]),
}


@pytest.fixture(scope="module", params=["pose", "position", "torque"])
def subject(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Subject:
    """An arm with a recording in which the link was down for a while and the tracker slipped."""
    kind: Kind = request.param
    path = None if kind == "pose" else write_arm(tmp_path_factory.mktemp("arm"), kind)
    plant = pr2("right", None) if path is None else mjcf(path, kind, JOINTS, JOINTS, "tool")
    bare = make_subject(plant)
    recorded = _recorded(bare)
    reports = bare.nominal.run([(lambda row: None, recorded)])[0]
    assert reports.tracker is not None
    assert recorded.tracker_at is not None
    reports.tracker[recorded.tracker_at >= _SLIP_AT, :3] += 0.05
    trajectory = Trajectory(
        "slow", "train", "", recorded.initial_q, recorded.initial_qd, recorded.command.at,
        recorded.command.values, recorded.joints_at, reports.q, tracker_at=recorded.tracker_at,
        tracker=reports.tracker,
    )  # fmt: skip
    source = ModelSource("pr2") if path is None else ModelSource("mjcf", path, tracked="tool")
    columns = POSE if path is None else JOINTS
    dataset = Dataset(Path(), source, kind, plant.labels, columns, (trajectory,), (), "")
    return subject_of(dataset)


def _recorded(subject: Subject) -> Recorded:
    """Return motion about a posture, with a gap in the joints' log."""
    rest = _REST[subject.control]
    at: Float64 = np.arange(0.0, _SECONDS, _PERIOD)
    wave = np.sin(2.0 * np.pi * at)[:, None] * np.linspace(1.0, 0.5, len(rest))
    q = rest + 0.2 * wave
    command = (
        tool_poses(subject.plant, subject.nominal.model, q) if subject.control == "pose"
        else 2.0 * wave if subject.control == "torque"
        else q
    )  # fmt: skip
    has_arrived = (at < 0.3) | (at >= 0.4)
    return Recorded(
        initial_q=rest,
        initial_qd=np.zeros_like(rest),
        command=Signal(at, command),
        logged_q=Signal(at[has_arrived], q[has_arrived]),
        joints_at=at[has_arrived],
        tracker_at=at,
        trajectory="slow",
    )


def _replayed(subject: Subject, wanted: list[tuple[Candidate, Float64]]) -> list[Reports]:
    """Return what the arm reports with each candidate at a size."""
    recorded = _recorded(subject)
    groups: dict[Structure, list[int]] = defaultdict(list)
    for index, (candidate, _) in enumerate(wanted):
        groups[candidate.effect.structure(subject, candidate.place)].append(index)
    found: dict[int, Reports] = {}
    for structure, members in groups.items():
        rollouts = Rollouts(subject.plant, structure, len(members))
        entries = [_Enter(*wanted[index]) for index in members]
        reports = rollouts.run([(entry, recorded) for entry in entries])
        found.update(zip(members, reports, strict=True))
    return [found[index] for index in range(len(wanted))]


class _Enter:
    def __init__(self, candidate: Candidate, values: Float64) -> None:
        self._candidate, self._values = candidate, values

    def __call__(self, row: Row) -> None:
        self._candidate.effect.enter(row, self._candidate.place, self._values)


def _candidates(subject: Subject) -> list[Candidate]:
    """Return every effect at the first and the last of its places."""
    return [
        Candidate(effect, place)
        for effect in EFFECTS
        for place in dict.fromkeys((*effect.places(subject)[:1], *effect.places(subject)[-1:]))
    ]


def _seen(subject: Subject, candidate: Candidate) -> Float64:
    """Return probes; twice of what is searched on a grid, as it may begin to act only there."""
    quantities = candidate.effect.quantities(subject, candidate.place)
    sizes = [
        each.probe if each.is_smooth or each.unit == "s" else min(2.0 * each.probe, each.high)
        for each in quantities
    ]
    return np.array(sizes)


def test_an_effect_is_called_as_its_module_is() -> None:
    folder = Path(catalogue.__file__).parent
    modules = sorted(path.stem for path in folder.glob("*.py") if path.stem != "__init__")
    assert [effect.name for effect in EFFECTS] == modules


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)
def test_an_effect_says_what_it_is_in_sentences(effect: Effect) -> None:
    assert effect.title[0].islower()
    assert not effect.title.endswith(".")
    assert " " in effect.title
    assert effect.signature[0].isupper()
    assert effect.signature.endswith(".")
    assert "  " not in effect.signature
    assert effect.signature.count(". ") == 0, "one sentence"


def test_a_probe_is_a_size_that_may_be(subject: Subject) -> None:
    for candidate in _candidates(subject):
        quantities = candidate.effect.quantities(subject, candidate.place)
        assert len({each.name for each in quantities}) == len(quantities) > 0, candidate.label
        assert any(each.low <= 0.0 <= each.high for each in quantities), candidate.label
        for each in quantities:
            assert each.low < each.high, (candidate.label, each)
            assert each.probe > 0.0, (candidate.label, each)  # sizes are counted in probes
            assert each.probe <= each.high or each.high < 0.0, (candidate.label, each)
            assert each.unit, (candidate.label, each)


def test_a_place_is_named_once(subject: Subject) -> None:
    for effect in EFFECTS:
        places = effect.places(subject)
        assert len(set(places)) == len(places), effect.name


def test_nothing_of_an_effect_is_the_model_as_it_was(subject: Subject) -> None:
    candidates = _candidates(subject)
    plain = subject.nominal.run([(lambda row: None, _recorded(subject))])[0]
    assert plain.tracker is not None
    none = [
        (each, np.zeros(len(each.effect.quantities(subject, each.place)))) for each in candidates
    ]
    for candidate, reports in zip(candidates, _replayed(subject, none), strict=True):
        # What must be compiled in is as good as locked, not locked.
        bound = 1e-4 if candidate.effect.structure(subject, candidate.place) else 1e-9
        assert reports.tracker is not None
        np.testing.assert_allclose(reports.q, plain.q, atol=bound, err_msg=candidate.label)
        np.testing.assert_allclose(
            reports.tracker, plain.tracker, atol=bound, err_msg=candidate.label
        )


def test_a_probe_of_an_effect_is_seen_and_finite(subject: Subject) -> None:
    candidates = _candidates(subject)
    plain = subject.nominal.run([(lambda row: None, _recorded(subject))])[0]
    assert plain.tracker is not None
    probes = [(each, _seen(subject, each)) for each in candidates]
    for candidate, reports in zip(candidates, _replayed(subject, probes), strict=True):
        assert reports.tracker is not None
        assert np.isfinite(reports.q).all(), candidate.label
        assert np.isfinite(reports.tracker).all(), candidate.label
        moved = max(
            float(np.abs(reports.q - plain.q).max()),
            float(np.abs(reports.tracker - plain.tracker).max()),
        )
        assert moved > 1e-5, candidate.label


def test_without_a_tracker_nothing_sits_on_its_side(subject: Subject) -> None:
    unseen = replace(subject, has_tracker=False)
    for effect in EFFECTS:
        if effect.side == "tracker":
            assert effect.places(unseen) == (), effect.name
