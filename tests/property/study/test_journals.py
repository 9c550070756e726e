"""Journals and tables: cut anywhere they lose only what did not count, and come back as written."""

import tempfile
from pathlib import Path

import msgspec
from hypothesis import given, settings
from hypothesis import strategies as st

from shared.clock import ManualClock
from shared.study.events import (
    Aborted,
    Answer,
    Answered,
    Event,
    GameEnded,
    GameStarted,
    Noted,
    Ranked,
    SessionBegan,
    StepBegan,
    StepDone,
)
from shared.study.journal import FILE, Journal, decode_events, read_journal
from shared.study.progress import follow, replay
from shared.study.rows import QuestionnaireRow
from shared.study.tsv import RowLog, decode_table, encode_table, read_table

words = st.text(max_size=30)
names = st.sampled_from(["consent", "s1-g01", "s1-g02", "s2-q-tam"])
answers = st.dictionaries(
    words,
    st.builds(
        Answer, value=st.none() | st.integers(1, 11), text=words,
        chosen=st.lists(words, max_size=3).map(tuple),
    ),
    max_size=3,
)  # fmt: skip
events = st.one_of(
    st.builds(StepBegan),
    st.builds(StepDone, reason=words),
    st.builds(Noted, text=words),
    st.builds(Answered, instrument=words, answers=answers),
    st.builds(
        Ranked, instrument=words,
        ranks=st.dictionaries(words, st.dictionaries(st.integers(1, 9), st.integers(1, 9))),
    ),
)  # fmt: skip
BEGAN = SessionBegan(
    participant="sub-01", session=1, order=("A",), study="s", protocol="p", config="c",
    commit="", version="1",
)  # fmt: skip
GAME = [
    (GameStarted(attempt=1, bout="b", policy="p", seconds=20.0), "s1-g01"),
    (GameEnded(attempt=1, bout="b", policy="p", outcome="finished", score=1.5), "s1-g01"),
]


def written(folder, whats):
    clock = ManualClock(1.8e9)
    with Journal(folder, clock) as journal:
        for what, step in whats:
            journal.write(what, step)
            clock.advance(0.1)
        return journal.events


@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(events, names), max_size=4))
def test_a_journal_cut_at_any_byte_holds_the_events_before_it_and_goes_on(whats):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = written(folder, [(BEGAN, ""), *GAME, *whats])
        data = (folder / FILE).read_bytes()
        assert read_journal(folder) == made
    for end in range(len(data) + 1):
        found, size = decode_events(data[:end], "journal")
        assert found == list(made[: data[:end].count(b"\n")])
        assert size == data[:end].rfind(b"\n") + 1
        replay(found)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 10_000), st.integers(1, 3))
def test_whoever_goes_on_after_a_cut_loses_and_doubles_nothing(cut, more):
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        made = written(folder, [(BEGAN, ""), *GAME])
        path = folder / FILE
        data = path.read_bytes()
        path.write_bytes(data[: cut % (len(data) + 1)])
        left = list(read_journal(folder))
        added = [BEGAN] if not left else [Noted(text="on")] * more
        clock = ManualClock(1.8e9 + 60.0)
        with Journal(folder, clock) as journal:
            for what in added:
                journal.write(what)
        after = read_journal(folder)
        assert list(after[: len(left)]) == left == list(made[: len(left)])
        assert [event.what for event in after[len(left) :]] == added
        assert [event.number for event in after] == list(range(1, len(after) + 1))


@settings(max_examples=20, deadline=None)
@given(st.lists(st.tuples(events, names), max_size=12), st.integers(0, 12))
def test_progress_is_the_same_whether_events_come_one_by_one_or_all_at_once(whats, begin):
    whole = [(BEGAN, ""), *whats[:begin], *GAME, *whats[begin:], (Aborted(reason="x"), "")]
    made = [
        Event(number=number, t_ns=number, wall_ns=number, step=step, what=what)
        for number, (what, step) in enumerate(whole, start=1)
    ]
    live = replay(made[:begin])
    for event in made[begin:]:
        follow(live, event)
    assert msgspec.to_builtins(live) == msgspec.to_builtins(replay(made))
    assert live.done == {event.step for event in made if event.kind == "step_done"}


rows = st.builds(
    QuestionnaireRow,
    participant=st.just("sub-01"), session=st.integers(1, 9), section=st.integers(0, 9),
    condition=words, step=words, instrument=words, item=words, construct=words,
    reversed=st.booleans(), value=st.none() | st.integers(-(2**62), 2**62), option=words,
    text=words | st.sampled_from(["n/a", "\\", "\\n", "n\\/a", "\t\n\r", "a\\"]),
    t_ns=st.integers(0, 2**62), wall=words, policy=words, config=words,
)  # fmt: skip


@settings(max_examples=25, deadline=None)
@given(st.lists(rows, max_size=3))
def test_a_table_comes_back_as_it_was_written(made):
    data = encode_table(made, QuestionnaireRow)
    assert decode_table(data, "t", QuestionnaireRow) == made
    assert data.count(b"\n") == len(made) + 1


@settings(max_examples=10, deadline=None)
@given(st.lists(rows, min_size=1, max_size=3), st.integers(0, 100_000), rows)
def test_a_growing_table_cut_at_any_byte_keeps_its_whole_rows_and_goes_on(made, cut, last):
    with tempfile.TemporaryDirectory() as name:
        path = Path(name) / "t.tsv"
        with RowLog(path, QuestionnaireRow) as log:
            for row in made:
                log.write(row)
        data = path.read_bytes()
        assert data == encode_table(made, QuestionnaireRow)
        path.write_bytes(data[: cut % (len(data) + 1)])
        kept = read_table(path, QuestionnaireRow)
        assert kept == made[: len(kept)]
        with RowLog(path, QuestionnaireRow) as log:
            log.write(last)
        assert read_table(path, QuestionnaireRow) == [*kept, last]
