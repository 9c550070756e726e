"""Replays every recording by every stage of a model: what the report draws."""

from collections import defaultdict

import numpy as np

from shared.identification.arm.efforts import effort_of
from shared.identification.arm.places import place_of
from shared.identification.conclusion.diagnose import diagnose
from shared.identification.conclusion.evidence import STAGES, Evidence, Replay, Stage
from shared.identification.conclusion.sides import Floors
from shared.identification.dataset.types import Float64, Trajectory
from shared.identification.fitting.problem import BLOCK, Problem, Variant
from shared.sim.plant.kinematics import tool_poses
from shared.sim.plant.replay import Reports
from shared.sim.plant.signals import sampled


def evidence_of(problem: Problem, stages: dict[Stage, Variant]) -> Evidence:
    """Return everything the report draws.

    Repeats are not replayed: their commands are those of what they repeat. Where recordings are
    replayed in parts (torque control), the parts are put together again; each starts from the
    measured state, and what comes before the first one is left out.

    Args:
        problem: data set and arm.
        stages: of the model; a stage that is not there is taken to be the one before it.

    Raises:
        ValueError: there is no nominal stage.
    """
    variants = [stages[stage] for stage in STAGES if stage in stages]
    if "nominal" not in stages:
        raise ValueError("evidence needs the nominal stage")
    found = problem.reports(variants, range(len(problem.segments)))
    by_stage: dict[Stage, list[Reports]] = {}
    index = -1
    for stage in STAGES:
        index += stage in stages
        by_stage[stage] = found[index]
    parts: dict[int, list[int]] = defaultdict(list)
    for number, segment in enumerate(problem.segments):
        parts[segment.trajectory].append(number)
    replays = tuple(
        _replay(problem, problem.dataset.trajectories[trajectory], numbers, by_stage)
        for trajectory, numbers in parts.items()
    )
    noise = problem.noise
    units = tuple(place_of(problem.subject, label).angle for label in problem.subject.joints)
    tracker = noise.tracker
    return Evidence(
        joints=problem.subject.joints,
        units=units,
        noise=noise.joints,
        tracker_noise=None if tracker is None else (_length(tracker[:3]), _length(tracker[3:])),
        noise_from_repeats=noise.is_measured,
        replays=replays,
        diagnostics=diagnose(replays, problem.subject.joints, units, Floors(noise, BLOCK)),
        is_in_parts=problem.subject.control == "torque",
    )


def _replay(
    problem: Problem, of: Trajectory, numbers: list[int], by_stage: dict[Stage, list[Reports]]
) -> Replay:
    segments = [problem.segments[number] for number in numbers]
    earlier = problem.dataset.trajectories[: segments[0].trajectory]
    at = np.concatenate([each.recorded.begin + each.recorded.joints_at for each in segments])
    seen = [
        (each.recorded.begin + each.recorded.tracker_at, each.tracker)
        for each in segments
        if each.recorded.tracker_at is not None and each.tracker is not None
    ]
    tracker_at = tracker = by_encoders = None
    tracked: dict[Stage, Float64] = {}
    if seen:
        tracker_at = np.concatenate([each[0] for each in seen])
        tracker = np.concatenate([each[1] for each in seen])
        by_encoders = tool_poses(
            problem.subject.plant, problem.subject.nominal.model,
            sampled(of.joints_at, of.q, tracker_at),
        )  # fmt: skip
        tracked = {
            stage: np.concatenate(
                [pose for number in numbers if (pose := reports[number].tracker) is not None]
            )
            for stage, reports in by_stage.items()
        }
    return Replay(
        name=of.name,
        split=of.split,
        at=at,
        q=np.concatenate([each.q for each in segments]),
        predicted={
            stage: np.concatenate([reports[number].q for number in numbers])
            for stage, reports in by_stage.items()
        },
        loss={stage: _loss(problem, numbers, reports) for stage, reports in by_stage.items()},
        begins=sum(each.duration for each in earlier),
        effort=effort_of(problem.subject, of, at),
        tracker_at=tracker_at,
        tracker=tracker,
        tracked=tracked,
        by_encoders=by_encoders,
    )


def _loss(problem: Problem, numbers: list[int], reports: list[Reports]) -> float:
    squares = np.concatenate([problem.floors(reports[each], each) ** 2 for each in numbers])
    return float(np.sqrt(squares.mean()))


def _length(axes: Float64) -> float:
    return float(np.sqrt(np.sum(axes**2)))
