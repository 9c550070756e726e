"""`riposte identify from-bouts`: the archived bouts of a run as a data set of its robot.

Commands are what the safety gate sent, at the time it sent them; joints and efforts are the
robot's, at the time they arrived; all poses are in its torso frame. One bout is one recording, the
last quarter of the bouts is held out; of a programme that was played, what it holds out.
"""

import argparse
import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import msgspec
import numpy as np

from services.robot_io.poses import pose_of
from services.robot_io.vive.calibration import Calibration, load_calibration
from services.robot_io.vive.frames import composed
from shared.errors import IdentificationError
from shared.identification.dataset.caveats import in_words
from shared.identification.dataset.logs import Log, Rows, data_set, rising
from shared.identification.dataset.reading import NANO, read_dataset
from shared.identification.dataset.types import POSE, Dataset, Float64, ModelSource
from shared.identification.dataset.writing import write_dataset
from shared.identification.excitation.motions import PERIOD
from shared.identification.excitation.reading import AT, PosePlan, read_programme
from shared.messages.message import Array
from shared.sim.config import SimConfig
from shared.sim.parameters import JOINT_NAMES
from shared.telemetry import streams
from shared.telemetry.archive import ArchivedBout, archived_bouts, load_bout
from shared.telemetry.streams import TICK, TIME

SHORTEST: Final = 2.0
"""Of a bout's commands and readings (s)."""
ROBOT: Final = "protagonist"
LOOKED_AT: Final = range(-20, 100)
"""Ticks after a bout's start at which the motion of a programme may have begun."""
STREAMS: Final = (streams.GATE.name, streams.ARMS.name, streams.BATS.name)


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declare the command line."""
    parser.add_argument("run", type=Path, metavar="RUN", help="a run's folder with bouts/ in it")
    parser.add_argument("out", type=Path, metavar="OUT", help="the data set's new folder")
    parser.add_argument(
        "--model", type=Path, metavar="M.toml",
        help="the simulator's model.toml to compare with (the nominal one)",
    )  # fmt: skip
    parser.add_argument(
        "--gripper-tracker", type=Path, metavar="CALIBRATION",
        help="the Vive tracker of this calibration was on the gripper during the bouts",
    )  # fmt: skip
    parser.add_argument(
        "--programme", type=Path, metavar="DIR",
        help="only its recordings, as riposte robot play-programme played them",
    )  # fmt: skip


def run(found: argparse.Namespace) -> int:
    """Write the data set, and say what is in it."""
    bouts = [load_bout(folder) for folder in archived_bouts(found.run)]
    calibration = load_calibration(found.gripper_tracker) if found.gripper_tracker else None
    plan = read_programme(found.programme) if found.programme else None
    dataset, left_out = of_bouts(bouts, found.model, calibration, plan)
    for line in left_out:
        print(f"left out: {line}")
    write_dataset(dataset, found.out, {"by": "riposte identify from-bouts", "run": found.run.name})
    report(found.out)
    return 0


def report(folder: Path) -> None:
    """Print what is in a data set that was just written."""
    made = read_dataset(folder)
    seconds = sum(each.duration for each in made.trajectories)
    print(
        f"wrote {folder}: {len(made.train)} recordings to fit and {len(made.test)} held out, "
        f"{seconds:.0f} s of {len(made.joints)} joints"
    )
    for each in in_words(made.caveats):
        print(each)


def of_bouts(
    bouts: Sequence[ArchivedBout], model: Path | None = None,
    gripper: Calibration | None = None, plan: PosePlan | None = None,
) -> tuple[Dataset, list[str]]:  # fmt: skip
    """Return archived bouts as a data set, and why some are not in it.

    Args:
        bouts: in the order they were played.
        model: the ``model.toml`` to compare with; the nominal model where it is None.
        gripper: of the Vive tracker on the robot's gripper, where it had one.
        plan: the programme that was played; where it is None, bouts are taken as they are.

    Raises:
        IdentificationError: a recording of the programme is missing, fewer than two bouts can be
            used, or they were played by different arms.
    """
    logs: list[Log] = []
    left_out: list[str] = []
    arms: set[str] = set()
    named = [(bout, "") for bout in bouts] if plan is None else _played(plan, bouts)
    for bout, recording in named:
        log, why = _log(bout, gripper, recording)
        if log is None:
            left_out.append(f"{bout.folder.name}: {why}")
            continue
        logs.append(log if plan is None else _cut(log, bout, plan))
        arms.add(msgspec.convert(bout.info.sections.get("sim", {}), SimConfig).arms[1])
    if len(logs) < 2:
        reasons = f" ({'; '.join(left_out[:4])})" if left_out else ""
        raise IdentificationError(
            f"{len(bouts)} archived bouts, {len(logs)} of them usable{reasons}; at least two are "
            "needed: record more with riposte play, --out RUN"
        )
    if len(arms) > 1:
        raise IdentificationError(
            "the robot played with both its arms in turn: make a data set of each arm's bouts"
        )
    source = ModelSource("pr2", arm="left" if "left" in arms else "right", parameters=model)
    if plan is None:
        return data_set(source, "pose", JOINT_NAMES, POSE, logs), left_out
    there = {log.name for log in logs}
    held_out = [each.name for each in plan.stretches if each.split == "test"]
    repeats = {
        each.name: each.repeats for each in plan.stretches
        if each.repeats in there and each.name in there
    }  # fmt: skip
    return data_set(source, "pose", JOINT_NAMES, POSE, logs, held_out, repeats), left_out


def _played(plan: PosePlan, bouts: Sequence[ArchivedBout]) -> list[tuple[ArchivedBout, str]]:
    """Return the last whole bout of each recording of a programme, with the recording's name.

    Raises:
        IdentificationError: one was not played to its end.
    """
    whole = {
        bout.info.bout.partition(AT)[0]: bout
        for bout in sorted(bouts, key=lambda bout: bout.info.started_at_ns)
        if bout.info.protagonist == plan.reference and bout.info.outcome == "finished"
    }
    lost = [each.name for each in plan.stretches if each.name not in whole]
    if lost:
        raise IdentificationError(
            f"of {plan.folder} {', '.join(lost)} was not played to its end in these {len(bouts)} "
            f"bouts: riposte robot play-programme {plan.folder} --only {' '.join(lost)}"
        )
    return [(whole[each.name], each.name) for each in plan.stretches]


def _cut(log: Log, bout: ArchivedBout, plan: PosePlan) -> Log:
    """Return a recording from where its motion began, so that repeats are of the same instants.

    The bout says so only roughly (the way from the referee to the robot takes some ticks); the
    commands that were sent say it to the tick.
    """
    poses = next(each.poses for each in plan.stretches if each.name == log.name)
    tick = round(NANO * PERIOD)
    command, gone = log.command, tick * np.arange(len(poses))

    def off(ticks: int) -> float:
        at = bout.info.started_at_ns + ticks * tick + gone
        held = np.searchsorted(command.t_ns, at + tick // 2, side="right") - 1
        sent = command.values[np.maximum(held, 0), :3]
        return float(np.abs(sent - poses[:, :3]).mean())

    began = bout.info.started_at_ns + tick * min(LOOKED_AT, key=off)
    return replace(log.cut(began - tick // 2)[1], name=log.name)


def _log(bout: ArchivedBout, gripper: Calibration | None, recording: str) -> tuple[Log | None, str]:
    """Return a bout's recording, or why there is none."""
    for name in STREAMS:
        if name not in bout.streams:
            return None, f"it has no stream {name!r}"
    if len(set(bout.streams[streams.BATS.name]["boot"])) > 1:
        return None, "robot_io was restarted in it"
    if not bout.streams[streams.ARMS.name][f"{ROBOT}_is_there"].all():
        return None, "its joints are not all known"
    command, readings = _commands(bout), _readings(bout)
    spans = [_span(rows) for rows in (command, readings)]
    if min(spans) < SHORTEST:
        return None, (
            f"{spans[0]:.1f} s of commands and {spans[1]:.1f} s of joints, at least {SHORTEST:g} s "
            "are needed"
        )
    tracker = None if gripper is None else _tracker(bout, gripper)
    if tracker is not None and _span(tracker) < SHORTEST:
        assert gripper is not None
        return None, f"tracker {gripper.serial} was seen for less than {SHORTEST:g} s"
    plain = re.sub(r"[^\w.-]", "_", bout.folder.name, flags=re.ASCII).lstrip(".-") or "bout"
    return Log(recording or plain, command, readings, tracker), ""


def _span(rows: Rows) -> float:
    return float(rows.t_ns[-1] - rows.t_ns[0]) / 1e9 if len(rows.t_ns) else 0.0


def _commands(bout: ArchivedBout) -> Rows:
    """Return the poses sent, in the torso frame, at the time of sending."""
    gate = bout.streams[streams.GATE.name]
    sent = gate["is_sent"].astype(bool)
    delay = np.nan_to_num(gate["answer_ms"][sent], nan=0.0) * 1e6
    poses = np.concatenate([gate["commanded_position"], gate["commanded_orientation"]], axis=1)
    return rising(gate[TIME][sent] + np.round(delay).astype(np.int64), poses[sent])


def _readings(bout: ArchivedBout) -> Rows:
    """Return the joints, at the time their state arrived where the robot said it."""
    arms = bout.streams[streams.ARMS.name]
    count = len(arms)
    t_ns = arms[TIME].copy()
    efforts = np.full((count, len(JOINT_NAMES)), np.nan)
    robot = bout.streams.get(streams.ROBOT.name)
    if robot is not None and len(robot):
        order = np.argsort(robot[TICK], kind="stable")
        place = np.searchsorted(robot[TICK][order], arms[TICK])
        match = order[np.minimum(place, len(order) - 1)]
        is_same = robot[TICK][match] == arms[TICK]
        t_ns[is_same] = robot[TIME][match[is_same]]
        efforts[is_same] = robot["efforts"][match[is_same]]
    values = [arms[f"{ROBOT}_joint_positions"], arms[f"{ROBOT}_joint_velocities"], efforts]
    return rising(t_ns, np.stack(values, axis=1))


def _tracker(bout: ArchivedBout, gripper: Calibration) -> Rows:
    """Return the tool in the torso frame as the tracker on the gripper saw it."""
    raw = bout.streams.get(streams.TRACKER_RAW.name)
    if raw is None:
        return Rows(np.zeros(0, np.int64), np.zeros((0, 7)))
    which = raw["is_valid"].astype(bool) & (raw["serial"] == gripper.serial)
    poses = np.concatenate([raw["position"], raw["orientation"]], axis=1)[which]
    return rising(raw[TIME][which], tools_of(poses, gripper))


def tools_of(tracked: Array, gripper: Calibration) -> Float64:
    """Return float64[K, 7], the tool in the torso frame.

    Args:
        tracked: float64[K, 7], the tracker in the base stations' frame.
        gripper: how both lie.
    """
    outer, inner = gripper.torso_from_base.pose, gripper.tracker_from_tool.pose
    made: list[Any] = []
    for row in tracked.tolist():
        tool = composed(composed(outer, pose_of(np.array(row))), inner)
        made.append([*tool.position, *tool.orientation])
    return np.array(made, np.float64).reshape(-1, 7)
