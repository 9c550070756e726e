import numpy as np
import pytest

from shared.game.bout import Scoreboard
from shared.game.geometry import BatShape
from shared.game.live import judge_states
from shared.game.rules import RuleBook
from tests.unit.referee.driving import APART, CAMP, HIT, PENALTY, TARGET, Stand, bats


def test_before_the_first_bout_it_is_ready_and_judges_nothing():
    stand = Stand()
    said = stand.published()
    assert said is not None
    assert (said.phase, said.bout) == ("ready", "")
    stand.bring(HIT, 5)
    assert (stand.state.phase, stand.state.score) == ("ready", 0.0)
    assert stand.published() is None


def test_a_bout_is_scored_tick_by_tick_with_its_tones():
    stand = Stand()
    assert stand.start().accepted
    said = stand.published()
    assert said is not None
    assert (said.phase, said.step, said.tone_hz) == ("running", 0, 0.0)
    heard = []
    for where in (APART, HIT, PENALTY, HIT, APART):
        stand.bring(where)
        said = stand.published()
        assert said is not None
        heard.append((said.score, said.points, said.tone_hz, said.seconds))
    assert heard == [
        (0.0, 0.0, 0.0, 0.01),
        (1.0, 1.0, 440.0, 0.02),
        (-9.0, -10.0, 300.0, 0.03),
        (-8.0, 1.0, 440.0, 0.04),
        (-8.0, 0.0, 0.0, 0.05),
    ]
    assert (said.attack_steps, said.penalty_steps, said.camping_steps) == (2, 1, 0)
    assert (said.antagonist, said.protagonist) == ("person", "scripted:guard")
    assert said.tick == stand.tick - 1


def test_camping_pays_without_a_sound():
    stand = Stand(camping_steps=3)
    stand.start()
    state = stand.bring(CAMP, 5)
    assert (state.score, state.camping_steps, state.tone_hz) == (20.0, 2, 0.0)
    assert state.in_target.tolist() == [False, True]


def test_a_bout_ends_with_its_steps_and_stays_as_it_is():
    stand = Stand(bout_steps=5)
    stand.start()
    state = stand.bring(HIT, 5)
    assert (state.phase, state.score, state.step, state.tone_hz) == ("finished", 5.0, 5, 0.0)
    stand.published()
    stand.bring(HIT, 5)
    assert stand.state.score == 5.0
    assert stand.published() is None


def test_a_lost_tick_is_judged_as_the_one_before():
    stand = Stand()
    stand.start()
    stand.bring(HIT)
    stand.lose(3)
    state = stand.bring(PENALTY)
    assert (state.step, state.missed_ticks, state.score) == (5, 3, 4.0 - 10.0)
    assert stand.referee.health().counters["missed_ticks"] == 3


def test_random_losses_are_judged_as_a_literal_reading_of_the_rule():
    generator = np.random.default_rng(4)
    stand = Stand(bout_steps=400, camping_steps=5)
    stand.start()
    literal = Scoreboard(1, RuleBook(bout_steps=400, camping_steps=5), BatShape(), TARGET)
    held = APART
    missed = 0
    for _ in range(400):
        where = bats(generator.choice([0.0, 1.0]), generator.choice([0.0, 0.03, 2.0]))
        if generator.random() < 0.2 and missed < 8:
            stand.lose(1)
            missed += 1
        else:
            stand.bring(where)
            held, missed = where, 0
        judge_states(literal, held[None])
    state = stand.bring(APART)
    assert (state.phase, state.step) == ("finished", 400)
    assert state.missed_ticks > 40
    for name in ("score", "attack_steps", "penalty_steps", "camping_steps"):
        assert getattr(state, name) == getattr(literal, name)[0]


def test_silence_pauses_good_tracking_resumes_and_the_pause_is_not_judged():
    stand = Stand()
    stand.start()
    stand.bring(HIT, 3)
    state = stand.silence(0.1)
    assert state.phase == "running"
    state = stand.silence(0.02)
    assert (state.phase, state.tone_hz) == ("paused", 0.0)
    assert "not tracked" in state.reason
    state = stand.bring(HIT, 19)
    assert state.phase == "paused"
    state = stand.bring(HIT, 1)
    assert (state.phase, state.step, state.score) == ("running", 3, 3.0)
    assert (state.tick, state.seconds) == (stand.tick - 1, 0.03)
    state = stand.bring(HIT, 2)
    assert (state.step, state.score, state.missed_ticks) == (5, 5.0, 0)


def test_a_second_of_silence_voids_the_bout_for_good():
    stand = Stand()
    stand.start()
    stand.bring(HIT, 3)
    assert stand.silence(0.99).phase == "paused"
    state = stand.silence(0.03)
    assert (state.phase, state.score) == ("void", 3.0)
    assert "not tracked for 1.0" in state.reason
    stand.bring(HIT, 30)
    assert stand.state.phase == "void"
    assert not stand.ask("resume").accepted


def test_a_bat_that_is_not_tracked_counts_as_silence():
    stand = Stand()
    stand.start()
    state = stand.bring(HIT, 10, is_valid=(False, True))
    assert (state.phase, state.step, state.score) == ("running", 10, 10.0)  # the last pose held
    assert stand.bring(HIT, 1, is_valid=(True, False)).phase == "paused"
    assert stand.bring(HIT, 90, is_valid=(False, True)).phase == "void"


def test_a_burst_after_a_hold_up_is_judged_in_full():
    stand = Stand()
    stand.start()
    for _ in range(40):
        stand.send(HIT)
    stand.clock.advance(0.4)
    stand.referee.tick()
    assert (stand.state.phase, stand.state.step, stand.state.score) == ("running", 40, 40.0)


@pytest.mark.parametrize(("lost", "phase"), [(10, "running"), (11, "paused"), (101, "void")])
def test_a_gap_between_ticks_is_measured_like_silence(lost: int, phase: str):
    stand = Stand(bout_steps=500)
    stand.start()
    stand.bring(HIT)
    stand.lose(lost)
    state = stand.bring(HIT)
    assert (state.phase, state.missed_ticks) == (phase, 10 if phase == "running" else 0)


def test_a_restarted_robot_io_voids_the_bout():
    stand = Stand()
    stand.start()
    stand.bring(HIT)
    stand.boot, stand.tick = "b2", 0
    state = stand.bring(HIT)
    assert (state.phase, state.score) == ("void", 1.0)
    assert "robot_io was restarted" in state.reason
    stand.bring(APART, 25)
    assert stand.start("two").accepted


def test_old_doubled_and_senseless_states_change_nothing():
    stand = Stand()
    stand.start()
    state = stand.bring(HIT)
    tick = state.tick
    for again in (tick, tick - 1, 0):
        stand.bring(HIT, tick=again)
    stand.bring(HIT * 3.0, tick=tick + 1)  # no unit quaternions
    far = HIT.copy()
    far[0, 0] = 1e9
    stand.bring(far, tick=tick + 1)
    assert (stand.state.step, stand.state.score) == (1, 1.0)
    counters = stand.referee.health().counters
    assert (counters["states_late"], counters["states_refused"]) == (3, 2)


def test_states_that_are_no_numbers_never_get_past_the_bus():
    stand = Stand()
    stand.start()
    nan = HIT.copy()
    nan[1, 4] = np.nan
    stand.bring(nan)
    assert stand.state.step == 0
    assert stand.referee._bus.counters["refused_messages"] == 1


def test_a_person_pauses_resumes_and_abandons():
    stand = Stand()
    stand.start()
    stand.bring(HIT, 2)
    assert stand.ask("pause", reason="a shoelace").accepted
    stand.bring(HIT, 40)
    assert (stand.state.phase, stand.state.reason) == ("paused", "a shoelace")
    stand.silence(3.0)  # a pause of one's own may be as long as it likes
    refused = stand.ask("resume")
    assert not refused.accepted
    assert "not tracked (for 3" in refused.reason
    stand.bring(APART, 25)
    assert stand.ask("resume").accepted
    assert stand.bring(HIT).score == 3.0
    assert stand.ask("abandon", reason="enough").phase == "void"
    assert stand.state.reason == "enough"


def test_a_pause_asked_for_while_tracking_is_lost_waits_for_the_person():
    stand = Stand()
    stand.start()
    stand.silence(0.2)
    assert stand.ask("pause", reason="wait").accepted
    assert stand.bring(APART, 50).phase == "paused"
    assert stand.ask("resume").accepted


def test_a_new_bout_starts_from_nothing():
    stand = Stand(bout_steps=5)
    stand.start()
    stand.bring(PENALTY, 5)
    assert stand.start("two").accepted
    state = stand.bring(HIT)
    assert (state.bout, state.step, state.score, state.penalty_steps) == ("two", 1, 1.0, 0)


@pytest.mark.parametrize(
    ("action", "bout", "fields", "reason"),
    [
        ("start", "two", {"antagonist": "a", "protagonist": "b"}, "'one' is running: abandon it"),
        ("resume", "one", {}, "running cannot resume; possible: pause"),
        ("pause", "two", {}, "the bout is 'one', not 'two'"),
    ],
)
def test_what_cannot_happen_is_refused_with_the_reason(action, bout, fields, reason):
    stand = Stand()
    stand.start()
    answer = stand.ask(action, bout, **fields)
    assert not answer.accepted
    assert reason in answer.reason
    assert answer.phase == stand.state.phase == "running"


def test_a_bout_needs_states_names_and_a_name_of_its_own():
    stand = Stand(bout_steps=5)
    names = {"antagonist": "a", "protagonist": "b"}
    assert "no bat states arrive" in stand.ask("start", **names).reason
    stand.bring(APART, 3)
    assert "tracked for 0.03 s, 0.2 s are needed" in stand.ask("start", **names).reason
    stand.bring(APART, 25)
    assert "antagonist of a bout needs a name" in stand.ask("start").reason
    assert "1 to 128 characters" in stand.ask("start", "x" * 1000, **names).reason
    assert "there is no bout yet" in stand.ask("pause").reason
    assert stand.ask("start", **names).accepted
    stand.bring(APART, 5)
    assert "there has been a bout 'one'" in stand.ask("start", **names).reason
    assert stand.referee.health().counters["requests_refused"] == 6


def test_a_referee_that_is_stopped_says_that_the_bout_is_void():
    stand = Stand()
    stand.start()
    stand.bring(HIT)
    stand.published()
    stand.referee.close()
    said = stand.published()
    assert said is not None
    assert (said.phase, said.reason) == ("void", "the referee was stopped")


def test_its_health_says_what_is_played_and_whom_it_waits_for():
    stand = Stand()
    stand.silence(3.0)
    health = stand.referee.health()
    assert (health.state, health.waiting_for) == ("no bout yet", "robot_io: bat states")
    assert health.waiting_seconds == pytest.approx(3.0)
    stand.start()
    stand.bring(HIT, 3)
    health = stand.referee.health()
    assert health.state == "running 'one': 3 after 0.03 s"
    assert health.waiting_for == ""
    assert health.rates["states_per_s"] > 5


def test_who_starts_a_bout_may_say_how_long_it_is():
    stand = Stand(bout_steps=5)
    assert stand.start(seconds=0.08).accepted
    assert stand.bring(HIT, 7).phase == "running"
    assert (stand.bring(HIT).phase, stand.state.step) == ("finished", 8)
    reply = stand.start("next", seconds=1000.0)
    assert not reply.accepted
    assert "a bout of 1000 s: 0.01 to 600 s" in reply.reason
    assert stand.start("last").accepted
    assert stand.bring(HIT, 5).phase == "finished"


def test_who_starts_a_bout_may_slow_the_robot_and_keep_the_bout_out_of_the_archive():
    stand = Stand()
    stand.bring(APART, 25)
    names = {"antagonist": "person", "protagonist": "scripted:guard"}
    assert stand.ask("start", **names, speed=0.3, is_recorded=False).accepted
    assert (stand.state.speed, stand.state.is_recorded) == (0.3, False)
    stand.ask("abandon")
    assert stand.ask("start", "two", **names).accepted
    assert (stand.state.speed, stand.state.is_recorded) == (1.0, True)


@pytest.mark.parametrize("speed", [-0.1, 1.1, float("nan")])
def test_a_speed_that_is_no_share_is_refused(speed: float):
    stand = Stand()
    stand.bring(APART, 25)
    reply = stand.ask("start", antagonist="a", protagonist="b", speed=speed)
    assert not reply.accepted
    assert "0 to 1 can be asked" in reply.reason
