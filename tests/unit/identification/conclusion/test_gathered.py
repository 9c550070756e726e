"""What the report draws is gathered from one replay of every recording."""

from pathlib import Path

import numpy as np
import pytest

from shared.identification.catalogue.tracker_frame import EFFECT as TRACKER_FRAME
from shared.identification.catalogue.viscous_friction import EFFECT as VISCOUS
from shared.identification.conclusion.evidence import Evidence
from shared.identification.conclusion.gathered import evidence_of
from shared.identification.effect import Candidate, Effect
from shared.identification.fitting.problem import Variant
from shared.sim.plant.row import Row
from tests.measured import JOINT_NOISE, measure, nominal, problem_of


def gathered(folder: Path, effect: Effect, place: str, values: list[float]) -> Evidence:
    """Return the evidence of data with an effect in them, and of a model that has it."""
    sizes = np.array(values)

    def enter(row: Row) -> None:
        effect.enter(row, place, sizes)

    problem = problem_of(measure(folder, np.random.default_rng(0), enter, seconds=4.0))
    base = nominal(problem)
    extended = Variant(base.x, ((Candidate(effect, place), sizes),))
    return evidence_of(problem, {"nominal": base, "extended": extended})


def test_evidence_has_every_recording_under_every_stage(tmp_path: Path) -> None:
    found = gathered(tmp_path, VISCOUS, "elbow", [1.0])
    assert [each.name for each in found.replays] == ["first", "second"]
    assert [each.name for each in found.held_out] == ["second"]
    assert [each.begins for each in found.replays] == pytest.approx([0.0, 4.0], abs=0.02)
    first = found.replays[0]
    assert first.loss["base_fit"] == first.loss["nominal"] > 2.0
    assert first.loss["extended"] == pytest.approx(1.0, abs=0.1)
    off = first.q - first.predicted["extended"]
    assert off.std() == pytest.approx(JOINT_NOISE, rel=0.1)
    assert found.units == ("rad", "rad", "rad")
    assert found.noise_from_repeats
    assert found.noise == pytest.approx(np.full(3, JOINT_NOISE / np.sqrt(2.0)), rel=0.15)


def test_drag_of_a_joint_is_off_before_the_encoders(tmp_path: Path) -> None:
    sides = gathered(tmp_path, VISCOUS, "elbow", [1.0]).diagnostics.sides
    assert sides is not None
    assert sides.where == "before the encoders"
    assert sides.joints > 2.0
    assert sides.behind_noise < 1.3


def test_a_tracker_in_another_frame_is_off_behind_the_encoders(tmp_path: Path) -> None:
    values = [0.01, 0.0, 0.0, 0.0, 0.0, 0.0]
    sides = gathered(tmp_path, TRACKER_FRAME, "", values).diagnostics.sides
    assert sides is not None
    assert sides.where == "behind the encoders"
    assert sides.joints < 1.3
    assert sides.behind[0] == pytest.approx(0.01, rel=0.1)
