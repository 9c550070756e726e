import pytest

from tests.unit.jobs.play_stage import Stage


def test_a_match_arms_once_plays_its_bouts_and_is_over():
    stage = Stage().in_bout()
    assert [request.operator for request in stage.asked] == ["ada"]
    assert (stage.started[0].antagonist, stage.started[0].protagonist) == (
        "scripted:stab", "sha256:aa",
    )  # fmt: skip
    stage.say("finished", 31.0)
    stage.tick(0.5)
    assert not stage.match.is_over
    stage.tick(4.0)
    assert [asked.bout for asked in stage.started] == ["bout-1", "bout-2"]
    stage.say("finished", -12.0)
    stage.tick(0.2)
    assert stage.match.is_over
    assert not stage.match.ended
    assert [(bout.score, bout.outcome) for bout in stage.match.results] == [
        (31.0, "finished"), (-12.0, "finished"),
    ]  # fmt: skip
    assert stage.arm_count == 1
    stage.tick(5.0)
    assert len(stage.started) == 2


def test_between_bouts_there_is_a_rest():
    stage = Stage(rest=3.0).in_bout()
    stage.say("finished", 1.0)
    stage.tick(2.8)
    assert len(stage.started) == 1
    assert 0.0 < stage.match.rest_seconds < 0.5
    stage.tick(0.6)
    assert len(stage.started) == 2


def test_arming_waits_for_what_stands_in_its_way_and_says_it():
    stage = Stage()
    stage.obstacles = ("the other bat was not tracked",)
    stage.tick(3.0)
    assert "the other bat was not tracked" in stage.match.waits_for
    assert not stage.started
    stage.obstacles = ()
    stage.tick(4.0)
    assert stage.started
    assert not stage.match.waits_for


def test_a_real_robot_is_never_armed_by_the_match():
    stage = Stage(arms=False).tick(20.0)
    assert stage.asked == []
    assert stage.started == []
    assert stage.match.waits_for.startswith("the robot to be armed (disarmed")
    stage.mode = "armed"  # somebody's act
    stage.tick(3.0)
    assert stage.started


@pytest.mark.parametrize("name", ["policy-protagonist", "referee-0", "robot-io-0", "router-0"])
def test_a_death_disarms_the_robot_and_it_is_not_armed_again(name: str):
    stage = Stage().in_bout()
    stage.match.on_death(name)
    stage.tick(20.0)
    assert stage.asked[-1].action == "disarm"
    assert name in stage.asked[-1].operator
    assert stage.arm_count == 1
    assert stage.mode == "disarmed"
    assert (
        stage.abandoned[0].reason
        == f"the robot is disarmed: disarmed by riposte play ({name} died)"
    )
    assert len(stage.started) == 1
    assert any("stays where it is until somebody arms it: riposte robot arm" in text
               for text in stage.events)  # fmt: skip
    stage.mode, stage.reason = "armed", ""  # somebody's act
    stage.tick(4.0)
    assert len(stage.started) == 2


def test_a_death_before_arming_uses_up_what_was_typed():
    stage = Stage()
    stage.obstacles = ("no command",)
    stage.tick(1.0)
    stage.match.on_death("robot-io-0")
    stage.obstacles = ()
    count = stage.arm_count
    stage.tick(10.0)
    assert stage.arm_count == count
    assert stage.started == []


def test_a_disarm_is_repeated_until_it_is_heard():
    stage = Stage().in_bout()
    stage.is_silent = True
    stage.match.on_death("router-0")
    stage.tick(3.0)
    assert stage.mode == "armed"
    stage.is_silent = False
    stage.tick(3.0)
    assert stage.mode == "disarmed"


def test_a_trip_ends_the_bout_and_is_told_with_what_to_do():
    stage = Stage().in_bout()
    stage.mode, stage.reason = "tripped", "the run stop was pressed"
    stage.tick(2.0)
    assert stage.abandoned[0].reason == "the robot is tripped: the run stop was pressed"
    assert stage.match.results[0].outcome == "void"
    assert stage.match.finished == 0
    assert any("robot tripped: the run stop was pressed; it stays" in text for text in stage.events)
    assert not stage.match.is_over


def test_a_robot_io_that_falls_silent_ends_the_bout():
    stage = Stage().in_bout()
    stage.is_silent = True
    stage.tick(2.5)
    assert stage.abandoned[0].reason == "robot_io is silent"


def test_a_referee_that_comes_back_without_its_bout_makes_it_void():
    stage = Stage().in_bout()
    stage.restart_referee()
    stage.tick(0.3)
    assert stage.match.results[0].reason == "the referee was restarted"
    assert "bout-1 is lost: the referee was restarted" in stage.events


def test_a_match_does_not_wait_for_a_person_for_ever():
    stage = Stage().in_bout()
    stage.mode, stage.reason = "tripped", "over 40 N"
    stage.tick(25.0)
    assert not stage.match.is_over
    stage.tick(10.0)
    assert stage.match.is_over
    assert stage.match.ended == "waited 30 s for the robot to be armed (tripped: over 40 N)"


def test_the_time_of_a_bout_and_its_rest_is_no_waiting():
    stage = Stage(patience=5.0, rest=8.0)
    stage.tick(12.0)
    assert stage.started
    stage.tick(20.0)
    stage.say("finished", 0.0)
    stage.tick(12.0)
    assert not stage.match.ended
    assert len(stage.started) == 2


def test_a_referee_that_refuses_is_asked_again_and_told():
    stage = Stage()
    stage.refuses = "a bout cannot start: bats are not tracked"
    stage.tick(5.0)
    assert "bats are not tracked" in stage.match.waits_for
    stage.refuses = ""
    stage.tick(2.0)
    assert stage.started
    assert not stage.match.waits_for


def test_bouts_that_somebody_else_starts_are_counted_the_same():
    stage = Stage(starts=False, bouts=1).tick(5.0)
    assert stage.started == []
    assert stage.arm_count == 1
    stage.say("running", bout="page-1")
    stage.tick(1.0)
    stage.say("finished", 250.0)
    stage.tick(0.2)
    assert stage.match.is_over
    assert stage.match.results[0].bout == "page-1"


def test_a_match_without_an_end_goes_on():
    stage = Stage(bouts=0, rest=0.0)
    for _ in range(5):
        stage.tick(3.0)
        stage.say("finished", 1.0)
    stage.tick(1.0)
    assert not stage.match.is_over
    assert stage.match.finished == 5


def test_bouts_that_are_all_void_end_the_match():
    stage = Stage(rest=0.0)
    for _ in range(25):
        stage.tick(2.0)
        stage.say("void", reason="bats were not tracked for 1.00 s")
    assert stage.match.ended.startswith("20 bouts in a row were void")


def test_the_end_of_a_match_shuts_the_gate():
    stage = Stage().in_bout()
    shut = stage.match.shut()
    stage.tick(0.2)
    assert shut.take() is not None
    assert stage.mode == "disarmed"
    assert stage.abandoned[0].reason == "the match was stopped"
    stage.match.hear()
    assert stage.match.results[0].outcome == "void"
    stage.tick(5.0)
    assert stage.arm_count == 1
