"""What a model leaves of a recording that is replayed in parts."""

import numpy as np

from shared.identification.hidden.generator import simulated
from shared.identification.hidden.recipe import Recipe
from shared.identification.leftover.tracks import tracks_of
from tests.measured import nominal, problem_of


def test_of_an_arm_held_by_its_tool_a_quarter_of_what_is_off_shows_however_late():
    dataset, _ = simulated(Recipe(seconds=2.5, train=1, test=1, seed=3, has_tracker=False))
    problem = problem_of(dataset)
    everything = range(len(problem.segments))
    assert any(segment.recorded.begin > 1.0 for segment in problem.segments)
    joints, _ = tracks_of(problem, nominal(problem), everything)
    plain = problem.plain(nominal(problem), everything)
    for track in joints:
        own = [
            off
            for off, segment in zip(plain, problem.segments, strict=True)
            if segment.trajectory == track.trajectory
        ]
        off = np.abs(np.concatenate(own))
        shown = np.abs(track.x)
        assert shown.shape == off.shape
        assert (shown >= off / 4.0 - 1e-9).all()
        assert shown.max() < off.max()
