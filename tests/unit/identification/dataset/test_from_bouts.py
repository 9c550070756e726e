import datetime
from pathlib import Path

import numpy as np
import pytest

from services.jobs.identify.from_bouts import of_bouts, tools_of
from services.robot_io.vive.calibration import Calibration, Frame
from shared.errors import IdentificationError
from shared.identification.dataset.reading import read_dataset
from shared.identification.dataset.writing import write_dataset
from shared.telemetry.archive import ArchivedBout, BoutInfo
from shared.telemetry.streams import Rows

START_NS = 1_700_000_000_000_000_000
TICKS = 400
HALF = float(np.sqrt(0.5))
GRIPPER = Calibration(
    made_at=datetime.datetime(2026, 1, 1, tzinfo=datetime.UTC), serial="LHR-1",
    torso_from_base=Frame(position=(1.0, 0.0, 0.0), orientation=(HALF, 0.0, 0.0, HALF)),
    tracker_from_tool=Frame(position=(0.0, 0.0, -0.1), orientation=(1.0, 0.0, 0.0, 0.0)),
    poses=20, rejected=0, residual_mm=0.5, held_out_mm=0.6, expected_mm=0.7, spread_deg=30.0,
)  # fmt: skip


def bout(seed: int, ticks: int = TICKS, **changes: Rows) -> ArchivedBout:
    """Return a bout of a robot that moves; commands 3 ms after a tick, joints 4 ms before it."""
    tick = np.arange(ticks)
    t_ns = START_NS + seed * 60_000_000_000 + 10_000_000 * tick
    q = 0.3 * np.sin(np.arange(1, 8) * (1.0 + 0.3 * seed) * 0.01 * tick[:, None])
    qd = np.gradient(q, 0.01, axis=0)
    place = np.array([0.6, 0.0, 0.0]) + 0.1 * q[:, :3]
    turn = np.tile([1.0, 0.0, 0.0, 0.0], (ticks, 1))
    streams = {
        "bats": Rows({"t_ns": t_ns, "tick": tick, "boot": np.array(["b"] * ticks, object)}),
        "gate": Rows({
            "t_ns": t_ns, "tick": tick, "is_sent": tick % 50 != 7,
            "answer_ms": np.where(tick % 2, 3.0, np.nan),
            "commanded_position": place, "commanded_orientation": turn,
        }),
        "arms": Rows({
            "t_ns": t_ns, "tick": tick, "protagonist_is_there": np.ones(ticks, bool),
            "protagonist_joint_positions": q, "protagonist_joint_velocities": qd,
        }),
        "robot": Rows({
            "t_ns": t_ns[3:] - 4_000_000, "tick": tick[3:],
            "efforts": 2.0 * q[3:],
        }),
        "tracker_raw": Rows({
            "t_ns": t_ns + 1_234_567, "serial": np.array(["LHR-1", "LHR-2"] * (ticks // 2), object),
            "is_valid": tick % 7 != 0, "position": 0.1 * q[:, :3], "orientation": turn,
        }),
        **changes,
    }  # fmt: skip
    info = BoutInfo(
        bout=f"b{seed}", antagonist="person", protagonist="scripted:guard",
        started_at_ns=START_NS, sections={"sim": {"arms": ["right", "left"]}},
    )  # fmt: skip
    return ArchivedBout(Path(f"bout {seed}"), info, streams)


def test_bouts_become_a_data_set_of_the_arm_that_played(tmp_path):
    made, left_out = of_bouts([bout(seed) for seed in range(5)])
    assert not left_out
    write_dataset(made, tmp_path / "set", {})
    found = read_dataset(tmp_path / "set")
    assert found.source.kind == "pr2"
    assert found.source.arm == "left"
    assert [each.name for each in found.train] == [f"bout_{seed}" for seed in range(4)]
    assert [each.name for each in found.test] == ["bout_4"]
    assert not found.has_tracker


def test_a_command_is_of_when_it_was_sent_and_a_reading_of_when_it_arrived():
    made, _ = of_bouts([bout(0), bout(1)])
    one = made.trajectories[0]
    assert len(one.command_at) == TICKS - 8  # those that were not sent
    ticks = np.round((one.command_at - one.joints_at[0]) / 0.01 - 0.1).astype(int)
    np.testing.assert_array_equal(ticks[:9], [0, 1, 2, 3, 4, 5, 6, 8, 9])
    np.testing.assert_allclose(one.command_at[:3], [0.0, 0.013, 0.02], atol=1e-12)
    np.testing.assert_allclose(one.joints_at[:5], [0.0, 0.01, 0.02, 0.026, 0.036], atol=1e-12)
    source = bout(0).streams["arms"]
    np.testing.assert_array_equal(one.q, source["protagonist_joint_positions"])
    np.testing.assert_array_equal(one.qd, source["protagonist_joint_velocities"])
    assert one.effort is None  # those of the first three ticks are not known


def test_efforts_that_are_always_known_are_kept():
    whole = bout(0)
    robot = Rows({
        "t_ns": whole.streams["arms"]["t_ns"] - 4_000_000, "tick": np.arange(TICKS),
        "efforts": np.tile(np.arange(7.0), (TICKS, 1)),
    })  # fmt: skip
    made, _ = of_bouts([bout(0, robot=robot), bout(1)])
    np.testing.assert_array_equal(made.trajectories[0].effort[5], np.arange(7.0))


def test_a_state_read_twice_is_taken_once():
    whole = bout(0)
    held = np.arange(TICKS) // 2 * 2
    robot = Rows({
        "t_ns": whole.streams["arms"]["t_ns"][held], "tick": np.arange(TICKS),
        "efforts": np.zeros((TICKS, 7)),
    })  # fmt: skip
    made, _ = of_bouts([bout(0, robot=robot), bout(1)])
    np.testing.assert_allclose(np.diff(made.trajectories[0].joints_at), 0.02, atol=1e-9)


def test_a_tracker_on_the_gripper_is_the_tool_in_the_torso_frame(tmp_path):
    made, _ = of_bouts([bout(0), bout(1)], gripper=GRIPPER)
    seen = np.arange(TICKS)[(np.arange(TICKS) % 2 == 0) & (np.arange(TICKS) % 7 != 0)]
    one = made.trajectories[0]
    assert len(one.tracker_at) == len(seen)
    x, y, z = bout(0).streams["tracker_raw"]["position"][seen[3]]
    np.testing.assert_allclose(one.tracker[3], [1.0 - y, x, z - 0.1, HALF, 0, 0, HALF], atol=1e-12)


def test_a_tool_is_composed_from_the_outside_in():
    turned = Calibration(**{
        **{name: getattr(GRIPPER, name) for name in GRIPPER.__struct_fields__},
        "tracker_from_tool": Frame(position=(0.2, 0.0, 0.0), orientation=(HALF, HALF, 0.0, 0.0)),
    })  # fmt: skip
    found = tools_of(np.array([[0.0, 0.0, 0.5, HALF, 0.0, 0.0, HALF]]), turned)
    # a quarter turn about z twice: x of the tracker is -x of the torso
    np.testing.assert_allclose(found[0], [0.8, 0.0, 0.5, 0.0, 0.0, HALF, HALF], atol=1e-12)


def test_bouts_that_say_too_little_are_left_out_with_the_reason():
    restarted = bout(1)
    restarted.streams["bats"].columns["boot"][-1] = "c"
    silent = bout(2)
    del silent.streams["gate"]
    unsent = bout(3)
    unsent.streams["gate"].columns["is_sent"] = np.zeros(TICKS, bool)
    made, left_out = of_bouts([bout(0), restarted, silent, unsent, bout(4, 100), bout(5)])
    assert [each.name for each in made.trajectories] == ["bout_0", "bout_5"]
    assert left_out == [
        "bout 1: robot_io was restarted in it",
        "bout 2: it has no stream 'gate'",
        "bout 3: 0.0 s of commands and 4.0 s of joints, at least 2 s are needed",
        "bout 4: 1.0 s of commands and 1.0 s of joints, at least 2 s are needed",
    ]


def test_one_bout_is_too_few():
    with pytest.raises(IdentificationError, match=r"1 archived bouts, 1 of them usable; at least"):
        of_bouts([bout(0)])
