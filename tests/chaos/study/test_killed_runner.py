"""``kill -9`` of the runner at random moments of one session: nothing lost, nothing doubled.

The journal is compared with what the others wrote down themselves: the referee's log and the
recorder's archive.
"""

import itertools
import os
import random
import signal
import time
from collections import Counter
from functools import partial
from pathlib import Path

import pytest

from services.jobs.study.hosting import read_place
from shared.study.events import Event, GameEnded, GameStarted, SessionResumed
from shared.study.folder import Study
from shared.study.journal import read_journal
from shared.study.progress import Progress, follow, replay
from shared.study.recorded import GAMES, HEART_RATE
from shared.study.rows import GameRow, HeartRateRow
from shared.study.tsv import read_table
from shared.telemetry.archive import archived_bouts, read_info
from tests.integration.study.running import SHORT, People, events_of, make, running
from tests.integration.training.training import log_of

pytestmark = [
    pytest.mark.chaos, pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(1500),
]  # fmt: skip
KILLS = 14
RECORDER_KEEPS = 2.0
"""What happened so long before a kill is archived for sure (s)."""
SEED = 20261121


def test_a_runner_killed_at_random_moments_goes_on_at_the_right_step(tmp_path: Path):
    draw = random.Random(SEED)
    study = make(tmp_path / "study", SHORT.replace("games = 2", "games = 4"))
    folder = study.session_folder("sub-01")
    people = People(folder)
    killed: list[str] = []
    while len(killed) < KILLS:
        with running(study, "sub-01") as run:
            people.until(lambda: people.researcher.view, run)
            while len(killed) < KILLS:
                if draw.random() < 0.75:  # else it may be killed before it has done anything
                    before = len(events_of(study))
                    people.until(partial(has_grown, study, before + 2), run)
                stay(people, run, draw.uniform(0.0, 2.0))
                if replay(events_of(study)).state == "ended":
                    break
                if draw.random() < 0.6:  # the command, and with it all its processes
                    run.kill()
                    killed.append("run")
                    people.researcher.view = {}
                    break
                place = read_place(folder)
                if place is not None:  # the study's own process; the robot plays on meanwhile
                    os.kill(place.pid, signal.SIGKILL)
                    killed.append("study")
        assert replay(events_of(study)).state != "ended", f"too fast: {len(killed)} kills only"
    with running(study, "sub-01") as run:
        people.until(lambda: replay(events_of(study)).state == "ended", run, 200.0)
        code, said = run.finish()
    people.close()
    assert code == 0, said
    events = read_journal(folder)

    check_order(events, study)
    check_counts(events, study)
    check_against_the_referee(events, folder)
    check_against_the_recorder(events, folder)
    check_tables(events, folder)
    resumed = sum(isinstance(event.what, SessionResumed) for event in events)
    assert 10 <= resumed <= KILLS


def has_grown(study: Study, events: int) -> bool:
    """Return whether the journal has so many events, or its end."""
    found = events_of(study)
    return len(found) >= events or replay(found).state == "ended"


def stay(people: People, run, seconds: float) -> None:
    """Let the people go on for a while."""
    deadline = time.monotonic() + seconds
    people.until(lambda: time.monotonic() >= deadline, run, seconds + 30.0)


def check_order(events: tuple[Event, ...], study: Study) -> None:
    """What comes first after a resumption belongs to the step that the events before it name."""
    steps = study.steps_of("sub-01")
    progress, expected = Progress(), ""
    for number, event in enumerate(events, start=1):
        assert event.number == number
        if expected and event.step:
            assert event.step == expected, event
            expected = ""
        if event.kind == "step_began":
            current = progress.current(steps)
            assert current is not None
            assert event.step == current.id
        follow(progress, event)
        if isinstance(event.what, SessionResumed):
            current = progress.current(steps)
            expected = current.id if current is not None else ""
    assert progress.state == "ended"


def check_counts(events: tuple[Event, ...], study: Study) -> None:
    """Every step is done once and in order, and what it is for happened once."""
    steps = study.steps_of("sub-01")
    assert [event.step for event in events if event.kind == "step_done"] == [s.id for s in steps]
    count = Counter((event.kind, event.step) for event in events)
    once = {
        "consent": "consented", "baseline": "measured", "questionnaire": "answers",
        "ranking": "ranking",
    }  # fmt: skip
    for step in steps:
        if step.kind in once:
            assert count[once[step.kind], step.id] == 1, step.id
    assert count["session_began", ""] == count["session_ended", ""] == 1
    progress = replay(events)
    for step in steps:
        attempts = progress.games.get(step.id, [])
        assert [one.number for one in attempts] == list(range(1, len(attempts) + 1))
        if step.player:
            assert [one.outcome for one in attempts[:-1]] == ["void"] * (len(attempts) - 1)
            assert attempts[-1].outcome == "finished"
    asks = [event.ask for event in events if event.ask]
    assert len(set(asks)) == len(asks)


def check_against_the_referee(events: tuple[Event, ...], folder: Path) -> None:
    """The referee judged what the journal says, each bout once, and the verdicts are the same."""
    log = log_of(folder, "referee-0")
    ran = [e["bout"] for e in log if e["event"] == "bout_running" and e["step"] == 0]
    assert len(set(ran)) == len(ran)
    started = [e.what.bout for e in events if isinstance(e.what, GameStarted)]
    assert set(ran) - set(started) == {bout for bout in ran if bout.startswith("explore")}
    verdicts = {e["bout"]: e for e in log if e["event"] == "bout_finished"}
    finished = [
        e.what for e in events if isinstance(e.what, GameEnded) and e.what.score is not None
    ]
    finished = [what for what in finished if what.outcome == "finished"]
    assert len(finished) == 8
    assert not any(what.bout.startswith("warm-up") for what in finished)
    for what in finished:
        told = verdicts[what.bout]
        assert (told["score"], told["step"]) == (what.score, what.steps)


def check_against_the_recorder(events: tuple[Event, ...], folder: Path) -> None:
    """Every game that counts is archived once, with the score of the journal.

    A recorder that is killed with all others keeps all but the last seconds (docs/recordings.md).
    """
    infos = [read_info(path) for path in archived_bouts(folder)]
    started = {e.what.bout for e in events if isinstance(e.what, GameStarted)}
    assert {info.bout for info in infos} <= started
    assert not any(info.bout.startswith("warm-up") for info in infos)
    for event in events:
        what = event.what
        if not isinstance(what, GameEnded) or what.outcome != "finished" or not what.archive:
            continue
        (info,) = [one for one in infos if one.bout == what.bout]
        assert folder / what.archive in archived_bouts(folder)
        assert info.protagonist == what.policy
        if info.outcome == "finished":
            assert (info.score, info.steps) == (what.score, what.steps)
        else:
            assert info.outcome == "interrupted"
            assert seconds_lived(events, event) < RECORDER_KEEPS


def seconds_lived(events: tuple[Event, ...], after: Event) -> float:
    """Return how long the runner surely went on after an event before it was killed."""
    life = itertools.takewhile(
        lambda event: not isinstance(event.what, SessionResumed), events[after.number :]
    )
    return 1e-9 * (max((event.wall_ns for event in life), default=after.wall_ns) - after.wall_ns)


def check_tables(events: tuple[Event, ...], folder: Path) -> None:
    """The tables are the journal's, and no heart beat is in them twice."""
    rows = read_table(folder / GAMES, GameRow)
    assert [row.bout for row in rows] == [
        event.what.bout for event in events if isinstance(event.what, GameStarted)
    ]
    beats = read_table(folder / HEART_RATE, HeartRateRow)
    assert len({row.wall for row in beats}) == len(beats)
