"""The journal: on the disk before it counts, whole lines only, and replayed to where it stood."""

import os

import pytest

from shared.clock import ManualClock
from shared.errors import RiposteError, StudyError
from shared.study.events import (
    Aborted,
    Answer,
    Answered,
    Consented,
    GameEnded,
    GameStarted,
    Noted,
    Ranked,
    Repeated,
    SessionBegan,
    SessionEnded,
    SessionResumed,
    StepBegan,
    StepDone,
    Voided,
)
from shared.study.journal import FILE, Journal, read_journal
from shared.study.progress import replay
from shared.study.protocol_file import load_protocol, shipped_protocol
from shared.study.steps import steps_of

BEGAN = SessionBegan(
    participant="sub-01", session=1, order=("B", "A"), study="study-two", protocol="p", config="c",
    commit="abc", version="1",
)  # fmt: skip
START = GameStarted(attempt=1, bout="one", policy="scripted:heuristic", seconds=20.0)
END = GameEnded(
    attempt=1, bout="one", policy="scripted:heuristic", outcome="finished", score=12.0,
    attack_steps=22, penalty_steps=1, camping_steps=0, steps=2000, seconds=20.0,
    archive="bouts/one",
)  # fmt: skip
ONE_OF_EACH = [
    (BEGAN, ""),
    (StepBegan(), "consent"),
    (Consented(statements=("I agree.",)), "consent"),
    (StepDone(), "consent"),
    (START, "s1-g01"),
    (END, "s1-g01"),
    (StepDone(), "s1-g01"),
    (Noted(text="a line\nand another: é\t€"), "s1-g01"),
    (
        Answered(instrument="tam", answers={"PU": Answer(value=4), "Q": Answer(text="so")}),
        "s1-q-tam",
    ),
    (Ranked(instrument="comparison", ranks={"fun": {1: 1, 2: 1}}), "s2-r-comparison"),
    (SessionEnded(), ""),
]


@pytest.fixture
def clock():
    return ManualClock(1.8e9)


def test_what_is_written_is_read_again(tmp_path, clock):
    with Journal(tmp_path, clock) as journal:
        for what, step in ONE_OF_EACH:
            journal.write(what, step)
            clock.advance(1.0)
            assert read_journal(tmp_path) == journal.events
    read = read_journal(tmp_path)
    assert [(event.what, event.step) for event in read] == ONE_OF_EACH
    assert [event.number for event in read] == list(range(1, len(ONE_OF_EACH) + 1))
    assert read[3].wall_ns - read[2].wall_ns == 10**9
    with Journal(tmp_path, clock) as journal:
        assert journal.events == read


def test_a_second_writer_is_refused(tmp_path, clock):
    with Journal(tmp_path, clock), pytest.raises(RiposteError, match=f"process {os.getpid()}"):
        Journal(tmp_path, clock)


def test_a_line_that_was_cut_short_is_dropped_and_the_next_event_takes_its_number(tmp_path, clock):
    with Journal(tmp_path, clock) as journal:
        journal.write(BEGAN)
        journal.write(StepBegan(), "consent")
    whole = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(whole[:-1])
    with Journal(tmp_path, clock) as journal:
        assert [event.kind for event in journal.events] == ["session_began"]
        journal.write(Noted(text="again"))
    assert [event.kind for event in read_journal(tmp_path)] == ["session_began", "note"]


def test_a_damaged_line_is_named(tmp_path, clock):
    with Journal(tmp_path, clock) as journal:
        journal.write(BEGAN)
        journal.write(StepBegan(), "consent")
    path = tmp_path / FILE
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + b'{"number": 2}\n')
    with pytest.raises(StudyError, match=r"journal\.jsonl:2: damaged"):
        read_journal(tmp_path)
    path.write_bytes(lines[0] + lines[0])
    with pytest.raises(StudyError, match="event 1, expected 2"):
        Journal(tmp_path, clock)
    path.write_bytes(lines[0] + lines[1])
    with Journal(tmp_path, clock) as journal:  # who was refused holds no lock
        assert len(journal.events) == 2


def test_a_clock_that_went_back_is_refused(tmp_path, clock):
    with Journal(tmp_path, clock) as journal:
        journal.write(BEGAN)
    with Journal(tmp_path, ManualClock(1.8e9 - 1.5)):
        pass
    with pytest.raises(StudyError, match=r"2\.5 s before the last event"):
        Journal(tmp_path, ManualClock(1.8e9 - 2.5))


def test_a_clock_that_was_never_set_is_refused(tmp_path):
    with pytest.raises(StudyError, match="shows 1970-01-01: set it"):
        Journal(tmp_path, ManualClock(0.0))


def test_a_journal_begins_once(tmp_path, clock):
    with Journal(tmp_path, clock) as journal:
        with pytest.raises(ValueError, match="begins with session_began"):
            journal.write(StepBegan(), "consent")
        journal.write(BEGAN)
        with pytest.raises(ValueError, match="has it once"):
            journal.write(BEGAN)


def test_an_event_that_finds_no_space_has_not_happened(tmp_path, clock, monkeypatch):
    with Journal(tmp_path, clock) as journal:
        journal.write(BEGAN)
        before = (tmp_path / FILE).read_bytes()
        real = os.pwrite

        def full(descriptor, data, at):
            real(descriptor, bytes(data)[:7], at)
            raise OSError(28, "No space left on device")

        monkeypatch.setattr(os, "pwrite", full)
        with pytest.raises(RiposteError, match="no space left"):
            journal.write(Noted(text="lost"))
        assert (tmp_path / FILE).read_bytes() == before
        monkeypatch.setattr(os, "pwrite", real)
        assert journal.write(Noted(text="kept")).number == 2


def progress_of(tmp_path, clock, *events):
    with Journal(tmp_path, clock) as journal:
        for what, step in events:
            journal.write(what, step)
    return replay(read_journal(tmp_path))


@pytest.fixture
def steps():
    return steps_of(load_protocol(shipped_protocol("study-two")), ["rl", "baseline"])


def test_the_step_to_be_done_is_the_first_that_is_not_over(tmp_path, clock, steps):
    progress = progress_of(tmp_path, clock, *ONE_OF_EACH[:4])
    assert progress.has_consent
    assert progress.current(steps).id == "q-about-you"
    assert progress.done == {"consent"}
    assert progress.state == "going"


def test_a_game_that_ran_when_the_runner_was_killed_is_seen(tmp_path, clock):
    progress = progress_of(tmp_path, clock, *ONE_OF_EACH[:5], (SessionResumed(
        config="d", commit="abc", version="1"), ""))  # fmt: skip
    step, attempt = progress.running
    assert (step, attempt.number, attempt.start.bout) == ("s1-g01", 1, "one")
    assert progress.next_attempt("s1-g01") == 2
    assert progress.config == "d"


def test_a_game_that_is_repeated_is_to_be_done_again(tmp_path, clock, steps):
    events = [(BEGAN, ""), *((StepDone(), step.id) for step in steps[:8])]
    assert steps[8].id == "s1-g01"
    events += [(START, "s1-g01"), (END, "s1-g01"), (StepDone(), "s1-g01")]
    progress = progress_of(
        tmp_path, clock, *events, (Repeated(attempt=1, reason="phone rang"), "s1-g01")
    )
    assert progress.current(steps).id == "s1-g01"
    assert progress.finished("s1-g01") is None
    assert progress.games["s1-g01"][0].outcome == "repeat"
    assert progress.games["s1-g01"][0].end.score == 12.0
    assert progress.next_attempt("s1-g01") == 2


def test_a_game_that_is_taken_out_stays_done(tmp_path, clock):
    progress = progress_of(
        tmp_path, clock, *ONE_OF_EACH, (Voided(attempt=1, reason="feet moved"), "s1-g01")
    )
    assert progress.finished("s1-g01") is None
    assert "s1-g01" in progress.done
    assert progress.games["s1-g01"][0].reason == "feet moved"
    assert progress.state == "ended"


@pytest.mark.parametrize(
    "events",
    [
        [(END, "s1-g01")],
        [(START, "s1-g01"), (START, "s1-g02")],
        [(START, "s1-g01"), (END, "s1-g01"), (START, "s1-g01")],
        [(Voided(attempt=1, reason=""), "s1-g01")],
        [(Aborted(reason=""), ""), (StepBegan(), "consent")],
    ],
    ids=["end without start", "two at once", "attempt 1 twice", "void of none", "after the end"],
)
def test_events_that_cannot_follow_each_other_are_refused(tmp_path, clock, events):
    with pytest.raises(StudyError, match=r"journal, event \d"):
        progress_of(tmp_path, clock, (BEGAN, ""), *events)
