import math
from pathlib import Path

import numpy as np
import pytest

from shared.messages.play import TrackerPose
from shared.messages.topics import TRACKER
from tests.unit.robot_io.looping import HOLD, Looping

UP = np.array([0.0, 0.0, 0.0375, 0.0, 0.0, 0.0])


def test_states_go_out_each_tick_and_nothing_moves_unless_armed():
    looping = Looping()
    looping.offset = UP
    looping.tick(50)
    assert [states.tick for states in looping.states] == list(range(50))
    assert looping.states[-1].is_valid.tolist() == [True, True]
    assert {gate.mode for gate in looping.seen} == {"disarmed"}
    assert np.allclose(looping.tool, looping.states[0].tools[1], atol=1e-6)
    assert looping.service.health().counters["commands_sent"] == 0


def test_an_armed_robot_follows_the_policy():
    looping = Looping().armed()
    start = looping.tool.copy()
    looping.offset = UP
    looping.tick(60)
    assert looping.tool[2] - start[2] > 0.02
    assert looping.service.health().rates["real_time_factor"] == pytest.approx(1.0, abs=0.02)


def test_a_policy_that_dies_leaves_a_robot_that_holds_then_trips_and_stays():
    looping = Looping().armed()
    looping.offset = UP
    looping.tick(30)
    looping.offset = None
    looping.tick(12)
    assert looping.seen[-1].mode == "holding"
    looping.tick(50)
    assert looping.seen[-1].mode == "tripped"
    still = looping.tool.copy()
    looping.offset = UP  # it is back, and that alone moves nothing
    looping.tick(100)
    assert looping.seen[-1].mode == "tripped"
    assert np.linalg.norm(looping.tool[:3] - still[:3]) < 0.01


def test_the_run_stop_pressed_and_released_moves_nothing_until_a_person_says_so():
    looping = Looping().armed()
    looping.offset = UP
    looping.tick(20)
    looping.link.press_run_stop()
    looping.tick(2)
    assert looping.seen[-1].mode == "tripped"
    refused = looping.ask("reset")
    assert refused.reasons == ("the run stop is pressed", "the motors are halted")
    looping.tick(50)
    looping.link.release_run_stop()
    still = looping.tool.copy()
    looping.tick(100)
    assert np.linalg.norm(looping.tool[:3] - still[:3]) < 0.005
    assert looping.ask("arm").accepted is False
    assert looping.ask("reset").mode == "disarmed"
    assert looping.ask("arm").mode == "ramping"
    looping.tick(150)
    assert looping.tool[2] - still[2] > 0.01


def test_a_restarted_controller_trips():
    looping = Looping().armed()
    looping.link.restart_controller()
    looping.tick(2)
    assert looping.seen[-1].reason == "the robot's controller was restarted"


def test_physics_that_diverged_trips():
    looping = Looping().armed()
    looping.link._twin._data.qvel[:] = np.nan
    looping.tick(2)
    assert "diverged" in looping.seen[-1].reason
    assert looping.states[-1].is_valid.tolist()[1] is False


def test_a_late_loop_counts_what_it_lost_and_the_ticks_tell():
    looping = Looping()
    looping.tick(5)
    looping.clock.advance(0.03)
    looping.tick(1)
    assert [states.tick for states in looping.states][-2:] == [4, 8]
    counters = looping.service.health().counters
    assert (counters["ticks_lost"], counters["ticks_late"]) == (3, 1)
    assert looping.seen[-1].lateness_ms == pytest.approx(30.0)
    assert looping.service.health().rates["lateness_max_ms"] == pytest.approx(30.0)


def test_an_answer_to_another_boot_or_an_old_tick_is_not_used():
    looping = Looping()
    looping.tick(3)
    looping.offset = None
    looping.say_offset("protagonist", HOLD)  # answered already
    looping.tick()
    assert looping.service.health().counters["offsets_stale"] == 1


def test_the_robot_opposite_follows_its_own_policy():
    looping = Looping()
    looping.tick(3)
    start = looping.states[-1].bats[0, 2]
    for _ in range(40):
        looping.say_offset("antagonist", UP)
        looping.tick()
    assert looping.states[-1].bats[0, 2] - start > 0.02
    assert {gate.mode for gate in looping.seen} == {"disarmed"}


def test_game_time_runs_on_from_what_the_referee_judged():
    looping = Looping()
    looping.tick(3)
    looping.say_referee("running", seconds=1.5)
    looping.tick(2)
    assert [states.seconds for states in looping.states[-2:]] == pytest.approx([1.5, 1.51])
    looping.say_referee("paused", seconds=1.5)
    assert looping.tick().states[-1].seconds == 0.0


def test_between_bouts_the_robot_goes_home():
    looping = Looping().armed()
    home = np.array(looping.parts.home.position)
    looping.say_referee("running")
    looping.offset = UP
    looping.tick(100)
    assert np.linalg.norm(looping.tool[:3] - home) > 0.05
    looping.say_referee("finished")
    looping.tick(200)
    assert np.linalg.norm(looping.tool[:3] - home) < 0.02


@pytest.mark.parametrize("speed", [1.0, 0.3, 0.0])
def test_a_bout_may_be_slower_than_others(speed: float):
    """At full speed the twin that lags behind is what slows it."""
    looping = Looping().armed()
    looping.say_referee("running", speed=speed)
    looping.offset = UP
    looping.tick(60)
    tools = np.array([gate.commanded[:3] for gate in looping.seen[-60:]])
    steps = np.linalg.norm(np.diff(tools, axis=0), axis=1)
    limit = 0.01 * looping.parts.gate.cfg.game_speed
    if speed == 1.0:
        assert 0.5 * limit < steps.max() < limit
    else:
        assert steps.max() == pytest.approx(speed * limit, abs=1e-9)


def test_a_speed_that_is_no_share_keeps_the_robot_still():
    looping = Looping()
    looping.tick(3)
    for speed in (math.nan, -1.0, 1.5):
        looping.say_referee("running", speed=speed)
        looping.tick(2)
        assert looping.service._course.speed == 0.0


def test_disarming_holds_at_once():
    looping = Looping().armed()
    assert looping.ask("disarm").mode == "disarmed"
    looping.offset = UP
    sent = looping.service.health().counters["commands_sent"]
    looping.tick(20)
    assert looping.service.health().counters["commands_sent"] == sent


def test_a_mouse_moves_the_bat_and_a_closed_page_is_a_lost_tracker():
    looping = Looping(tracker="mouse")
    looping.tick(3)
    assert looping.states[-1].is_valid.tolist() == [False, True]
    assert "not tracked" in looping.ask("arm").reasons[0]
    for count in range(40):
        pose = np.array([0.5, 0.002 * count, 1.1, 1.0, 0.0, 0.0, 0.0])
        said = TrackerPose(sequence=count, source="page", pose=pose)
        looping.bench.publish(TRACKER, said)
        looping.tick()
    states = looping.states[-1]
    assert states.is_valid.tolist() == [True, True]
    assert states.bats[0, :3] == pytest.approx(pose[:3])
    assert states.bats[0, 7:10] == pytest.approx([0.0, 0.2, 0.0], abs=0.01)
    assert not states.tools[0].any()
    looping.tick(12)
    assert looping.states[-1].is_valid.tolist() == [False, True]


def test_a_lost_mouse_holds_an_armed_robot():
    looping = Looping(tracker="mouse")
    pose = np.array([0.5, 0.0, 1.1, 1.0, 0.0, 0.0, 0.0])
    for count in range(260):
        looping.bench.publish(TRACKER, TrackerPose(sequence=count, source="page", pose=pose))
        looping.tick()
        if count == 30:
            assert looping.ask("arm").accepted
    assert looping.seen[-1].mode == "armed"
    looping.tick(12)
    assert looping.seen[-1].reason == "the other bat is not tracked for 0.1 s"


def test_a_recorded_bat_is_replayed(tmp_path: Path):
    rows = np.zeros((50, 14))
    rows[:, 0] = np.arange(50) * 0.01
    rows[:, 1], rows[:, 4] = np.arange(50), 1.0
    np.save(tmp_path / "bat.npy", rows)
    looping = Looping(tracker="replay", replay=str(tmp_path / "bat.npy")).tick(30)
    assert [int(states.bats[0, 0]) for states in looping.states] == list(range(30))
