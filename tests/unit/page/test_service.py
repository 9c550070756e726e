import math

import numpy as np
import pytest

from services.page.protocol import BoutAsk, Pointer
from tests.unit.page.paging import Paging

START = '{"type":"bout","action":"start"}'


def ready() -> Paging:
    return Paging().crowd().open().tick(3)


def running() -> tuple[Paging, str]:
    site = ready().wish(START).tick(105)
    name = site.bouts[0][1]
    return site.referee("running", name), name


def test_a_new_page_is_greeted_with_what_it_has_to_know_once():
    site = Paging(players=(("A", "scripted:guard"), ("B", "scripted:heuristic"))).open()
    hello, results = site.window.notes
    assert (hello["type"], hello["players"], hello["chosen"]) == ("hello", ["A", "B"], "A")
    assert (results["type"], results["results"]) == ("results", [])
    site.tick(5)
    assert len(site.window.notes) == 2
    assert len(site.open(2).window.notes) == 4


def test_every_bat_state_makes_a_frame_with_the_newest_of_all():
    site = ready()
    seen = len(site.window.frames)
    site.tick(5)
    assert len(site.window.frames) == seen + 5
    frame = site.window.frames[-1]
    assert frame["gate"]["mode"] == "armed"
    assert frame["is_there"] == [False, True]
    assert np.shape(frame["bats"]) == (2, 7)
    assert np.shape(frame["joints"]) == (2, 7)


def test_without_a_page_nothing_is_made_for_one():
    site = Paging().crowd().tick(5)
    assert site.window.frames == []
    assert site.page.patience == 0.05
    assert site.open().page.patience == 0.002


def test_the_page_says_who_is_missing_in_words():
    site = Paging().open()
    site.is_robot_io_on = False
    site.tick(60)
    assert site.window.frames[-1]["missing"] == ["robot_io", "the referee", "the policy"]
    assert site.page.health().waiting_for == "robot_io, the referee, the policy"
    site.is_robot_io_on = True
    site.crowd("referee").tick(60)
    assert site.window.frames[-1]["missing"] == ["the policy"]
    site.crowd("policy").tick(60)
    assert site.window.frames[-1]["missing"] == []


def test_the_mouse_becomes_a_tracker_and_its_echo_comes_back():
    site = ready()
    site.window.pointer = Pointer(
        session=1, sequence=31, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=True
    )
    site.tick()
    assert [pose.source for pose in site.poses] == ["mouse"]
    assert site.poses[0].is_valid
    site.tick(tracker_source="mouse", tracker_sequence=site.poses[0].sequence)
    assert site.window.frames[-1]["echo"] == 31
    assert not site.window.frames[-1]["is_lost"]
    site.tick(20)
    assert not site.poses[-1].is_valid  # the page fell silent
    assert site.window.frames[-1]["is_lost"]


def test_poses_go_out_at_least_sixty_times_a_second_while_a_page_beats():
    site = ready()
    for sequence in range(100):
        site.window.pointer = Pointer(
            session=1, sequence=sequence, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=True
        )
        site.tick()
    assert len(site.poses) >= 100
    assert site.page.health().rates["poses_per_s"] > 60


def test_a_pose_of_a_page_that_was_replaced_is_not_used():
    site = ready().open(2)
    site.window.pointer = Pointer(
        session=1, sequence=9, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=True
    )
    assert site.tick().poses == []


def test_without_the_mouse_the_page_moves_nothing():
    site = Paging(pointer=False).crowd().open()
    site.window.pointer = Pointer(
        session=1, sequence=0, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=True
    )
    assert site.tick(5).poses == []


def test_a_page_that_goes_has_lost_the_bat():
    site = ready()
    site.window.pointer = Pointer(
        session=1, sequence=0, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=True
    )
    site.tick()
    site.window.session = 0
    site.tick(12)
    assert not site.poses[-1].is_valid


def test_only_a_click_arms_and_what_stands_in_the_way_is_said():
    site = ready()
    assert site.gate_asked == []
    site.gate_reply = site.gate_reply.__class__(
        accepted=False, mode="disarmed", reasons=("the tool moves", "the bat is not tracked")
    )
    site.wish('{"type":"gate","action":"arm"}')
    assert site.gate_asked == ["arm by a person at the page"]
    note = site.notes("gate")[-1]
    assert (note["is_done"], note["lines"]) == (False, ["the tool moves", "the bat is not tracked"])


def test_a_bout_is_counted_down_then_asked_for_with_who_the_policy_said_it_is():
    site = ready().wish(START)
    assert site.course.step == "countdown"
    assert site.players == ["scripted:heuristic"]
    site.tick(50)
    assert site.bouts == []
    assert 0.4 < site.window.frames[-1]["left"] < 0.6
    site.tick(60)
    (action, bout, antagonist, protagonist) = site.bouts[0]
    assert (action, antagonist, protagonist) == ("start", "person", "scripted:heuristic")
    assert site.referee("running", bout, seconds=1.0).course.step == "bout"


def test_a_finished_bout_is_listed_rested_from_and_fenced_again_under_a_new_name():
    site, bout = running()
    site.referee("finished", bout, score=42.0, attack_steps=52, penalty_steps=1)
    (result,) = site.window.notes[-1]["results"]
    assert (result["score"], result["opponent"], result["number"]) == (42.0, "Heuristic", 1)
    assert site.course.step == "rest"
    assert site.window.frames[-1]["left"] > 1.9
    site.wish(START).tick(105)  # a rematch does not wait for the end of the rest
    assert site.bouts[1][1] not in ("", bout)
    site.referee("running", site.bouts[1][1])
    site.referee("finished", site.bouts[1][1], score=-8.0)
    assert [result["number"] for result in site.window.notes[-1]["results"]] == [1, 2]
    site.tick(210)
    assert site.course.step == "idle"


def test_a_bout_that_somebody_else_started_is_followed_and_listed():
    site = ready().referee("running", "theirs")
    assert site.course.step == "bout"
    site.referee("finished", "theirs", score=7.0)
    assert site.window.notes[-1]["results"][0]["opponent"] == "scripted:heuristic"


def test_a_bout_that_was_over_before_the_page_came_is_not_listed():
    site = Paging().crowd().referee("finished", "old", score=3.0).open()
    assert site.window.notes[-1]["results"] == []


def test_a_void_bout_is_not_listed():
    site, bout = running()
    site.referee("void", bout, reason="bats were not tracked for 1.02 s")
    assert site.course.step == "idle"
    assert site.window.frames[-1]["referee"]["reason"] == "bats were not tracked for 1.02 s"
    assert site.course.results == []


def test_an_abandoned_bout_is_over_even_if_its_state_overtakes_the_answer():
    site, bout = running()
    site.is_referee_slow = True
    site.wish('{"type":"bout","action":"abandon"}')
    site.referee("void", bout, reason="abandon by a person at the page")
    assert site.course.step == "idle"
    site.is_referee_slow = False
    site.tick(3).wish(START)
    assert site.course.step == "countdown"


@pytest.mark.parametrize("action", ["pause", "resume", "abandon"])
def test_the_running_bout_is_what_a_click_is_about(action: str):
    site, bout = running()
    site.wish(f'{{"type":"bout","action":"{action}"}}')
    assert site.bouts[-1] == (action, bout, "", "")


def test_the_countdown_can_be_stopped():
    site = ready().wish(START).tick(20).wish('{"type":"bout","action":"abandon"}').tick(200)
    assert site.bouts == []
    assert site.course.step == "idle"


@pytest.mark.parametrize(
    ("mode", "valid", "line"),
    [
        ("disarmed", True, "the robot is not armed: arm it first"),
        ("tripped", True, "the robot is not armed: arm it first"),
        ("armed", False, "your bat is not tracked: move the mouse over the scene"),
    ],
)
def test_a_bout_that_cannot_begin_says_why(mode: str, valid: bool, line: str):
    site = ready()
    site.mode = mode
    site.tick(2, is_valid=np.array([valid, True]))
    site.window.asks.append(BoutAsk("start"))
    site.tick(2, is_valid=np.array([valid, True]))
    assert site.notes("bout")[-1]["lines"] == [line]
    assert site.course.step == "idle"


def test_a_player_that_cannot_play_ends_the_countdown_with_the_reason():
    site = ready()
    site.refuse_player = "there is no player 'x'"
    site.wish(START).tick(5)
    assert site.course.step == "idle"
    assert "there is no player 'x'" in site.notes("bout")[-1]["lines"][0]


def test_a_policy_that_never_answers_ends_the_countdown():
    site = ready()
    site.is_policy_deaf = True
    site.wish(START).tick(350)
    assert site.course.step == "idle"
    assert site.bouts == []
    assert site.notes("bout")[-1]["is_done"] is False


def test_a_referee_that_refuses_leaves_everything_as_it_was():
    site = ready()
    site.refuse_bout = "both bats have been tracked for 0.05 s, 0.2 s are needed"
    site.wish(START).tick(110)
    assert site.course.step == "idle"
    assert site.notes("bout")[-1]["lines"] == [site.refuse_bout]


def test_another_opponent_is_loaded_at_once_and_played_next():
    site = ready().wish('{"type":"player","name":"Guard"}')
    assert site.players == ["scripted:guard"]
    site.wish(START).tick(105)
    assert site.bouts[0][3] == "scripted:guard"
    site.wish('{"type":"player","name":"Heuristic"}')
    assert "between bouts only" in site.notes("player")[-1]["lines"][0]
    assert site.course.chosen == "Guard"


def test_an_opponent_that_is_not_in_the_list_is_refused():
    site = ready().wish('{"type":"player","name":"scripted:static"}')
    assert site.players == []
    assert "no player 'scripted:static' in the list" in site.notes("player")[-1]["lines"][0]


def test_a_policy_on_the_other_side_is_asked_too():
    site = Paging(pointer=False, antagonist="scripted:stab").crowd().open()
    site.tick(60)
    assert site.window.frames[-1]["missing"] == ["the policy"]  # two are needed, one is there


def test_what_the_page_measured_is_in_its_status():
    site = ready().wish(
        '{"type":"stats","frames_per_s":59.5,"latency_p50_ms":8.5,"latency_p90_ms":13}'
    )
    rates = site.page.health().rates
    assert (rates["drawn_per_s"], rates["latency_p50_ms"]) == (59.5, 8.5)
    assert all(math.isfinite(rate) for rate in rates.values())


def test_the_end_of_the_service_loses_the_bat_and_sends_the_page_away():
    site = ready()
    site.window.pointer = Pointer(
        session=1, sequence=0, tip=(0.4, 0.1, 1.2), roll=0.0, is_valid=True
    )
    site.tick()
    site.page.close()
    poses = []
    while (pose := site._poses.take()) is not None:
        poses.append(pose)
    assert [pose.is_valid for pose in poses] == [False]
    assert site.window.is_closed


def test_a_page_that_a_study_leads_names_nobody_and_starts_nothing():
    site = Paging(is_led=True, players=(("Secret", "scripted:guard"),)).crowd().open().tick(3)
    hello, results = site.window.notes[:2]
    assert (hello["is_led"], hello["players"], hello["chosen"]) == (True, [], "")
    site.wish(START).wish('{"type":"gate","action":"arm"}').wish(
        '{"type":"player","name":"Secret"}'
    )
    assert (site.bouts, site.gate_asked, site.players) == ([], [], [])
    assert site.notes("bout")[-1]["lines"] == ["a study leads: its researcher does that"]
    site.referee("running", "theirs")
    assert site.window.frames[-1]["referee"]["protagonist"] == ""
    site.referee("finished", "theirs", score=7.0)
    assert (results["results"], site.window.notes[-1]["results"]) == ([], [])
    assert "Secret" not in str(site.window.notes) + str(site.window.frames)
    site.wish('{"type":"gate","action":"disarm"}')  # to stop is everybody's
    assert site.gate_asked == ["disarm by a person at the page"]
