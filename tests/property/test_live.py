"""Live bouts: what can be judged, and a referee whatever arrives."""

import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.game.bout import Event, Phase, next_phase
from shared.game.live import LARGEST, is_sound
from tests.unit.referee.driving import APART, CAMP, HIT, PENALTY, Stand

numbers = st.one_of(st.floats(), st.sampled_from([0.5, -0.5, 1.0, 0.0]))


@given(st.lists(numbers, min_size=13, max_size=13))
def test_a_state_is_sound_if_it_is_small_numbers_and_a_unit_quaternion(state: list[float]):
    small = all(math.isfinite(number) and abs(number) <= LARGEST for number in state)
    length = math.hypot(*state[3:7]) if small else math.nan
    assert bool(is_sound(np.array(state))) == (small and 0.99 <= length <= 1.01)


steps = st.one_of(
    st.tuples(st.just("bring"), st.integers(1, 12), st.sampled_from([APART, HIT, PENALTY, CAMP])),
    st.tuples(st.just("lose"), st.integers(1, 30), st.none()),
    st.tuples(st.just("blind"), st.integers(1, 15), st.none()),
    st.tuples(st.just("silence"), st.integers(1, 40), st.none()),
    st.tuples(st.sampled_from(["pause", "resume", "abandon"]), st.none(), st.none()),
)
LEGAL = {
    (phase.value, next_phase(phase, event).value)
    for phase, event in (
        (Phase.RUNNING, Event.PAUSE), (Phase.RUNNING, Event.TIME_UP),
        (Phase.RUNNING, Event.ABANDON), (Phase.PAUSED, Event.RESUME),
        (Phase.PAUSED, Event.ABANDON),
    )
}  # fmt: skip


@settings(deadline=None, max_examples=60)
@given(st.lists(steps, max_size=12))
def test_whatever_arrives_a_bout_adds_up_and_moves_on_by_the_rules(events):
    stand = Stand(bout_steps=60, camping_steps=5)
    stand.start()
    before = stand.state
    for kind, count, where in events:
        for _ in range(count or 1):
            if kind == "bring":
                stand.bring(where)
            elif kind == "lose":
                stand.lose(1)
            elif kind == "blind":
                stand.bring(HIT, is_valid=(False, True))
            elif kind == "silence":
                stand.silence(0.01)
            else:
                stand.ask(kind)
            state = stand.state
            assert state.phase == before.phase or (before.phase, state.phase) in LEGAL
            assert before.step <= state.step <= 60
            assert state.score - before.score == (
                (state.attack_steps - before.attack_steps)
                - 10.0 * (state.penalty_steps - before.penalty_steps)
                + 10.0 * (state.camping_steps - before.camping_steps)
            )
            if before.phase in ("paused", "finished", "void"):
                assert state.step == before.step
            assert (state.phase == "finished") == (state.step == 60) or state.phase == "void"
            assert state.tone_hz == 0.0 or state.phase == "running"
            before = state
