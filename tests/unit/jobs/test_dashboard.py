import io
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from services.jobs.train import dashboard_view
from services.jobs.train.dashboard import Dashboard
from services.jobs.train.dashboard_view import State, line, render, sparkline
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import PROGRESS, STATUS


def progress(**changes: Any) -> Progress:
    fields: dict[str, Any] = {
        "run": "r", "stage": 2, "stages": 4, "phase": "one", "iteration": 2,
        "agent": "antagonist", "update": 30, "max_updates": 120, "total_samples": 6_020_000,
        "score_mean": 739.0, "score_low": 649.0, "score_high": 829.0, "score_bouts": 256,
        "samples_per_s": 61234.0, "policy_lag_mean": 0.62, "approx_kl": 0.0093,
        "explained_variance": 0.83, "dropped_rollouts": 3, "eta_seconds": 402.0,
    }  # fmt: skip
    return Progress(**(fields | changes))


def status(name: str = "actor-0", **changes: Any) -> ServiceStatus:
    fields: dict[str, Any] = {
        "role": name.split("-")[0], "name": name, "boot": "b1", "pid": 4711, "host": "h",
        "state": "playing", "rss_bytes": 148 << 20, "cpu_seconds": 1.0,
    }  # fmt: skip
    return ServiceStatus(**(fields | changes))


def shown(state: State, width: int = 110) -> str:
    console = Console(file=io.StringIO(), width=width, force_terminal=True, color_system=None)
    console.print(render(state))
    assert isinstance(console.file, io.StringIO)
    return console.file.getvalue()


def running() -> State:
    state = State(run="train-1", started_at=0.0)
    for update in range(1, 31):
        state.now = 2.0 * update
        state.on_progress(progress(update=update, score_mean=20.0 * update))
    state.on_status(status(cpu_seconds=0.0))
    state.now += 1.0
    state.on_status(status(cpu_seconds=0.97))
    return state


def test_the_dashboard_says_who_learns_how_well_and_how_long() -> None:
    text = shown(running())

    assert "antagonist learns" in text
    assert "update 30 of 120 · 3:00 left" in text
    assert "stage 3 of 4 · 6:42 left" in text
    assert "+600  95 %: +649 to +829, 256 bouts" in text
    assert "6.02 M at 61.2 k/s · policy lag 0.62" in text
    assert "KL 0.0093 · explained variance 0.83 · dropped 3" in text
    assert "▁" in text
    assert "█" in text


def test_a_service_shows_its_share_of_a_core_and_whom_it_waits_for() -> None:
    state = running()
    state.restarts = {"actor-0": 2}
    state.on_status(status("learner-antagonist", waiting_for="actors", waiting_seconds=12.3))

    text = shown(state, 140)

    actor = next(row for row in text.splitlines() if "actor-0" in row)
    assert actor.split()[-5:-1] == ["playing", "97", "148", "2"]
    assert "actors 12 s" in text


def test_a_silent_service_is_called_silent() -> None:
    state = running()
    state.now += 60.0

    assert "silent for 1:00" in shown(state)


def test_a_restarted_service_is_an_event() -> None:
    state = running()

    state.on_status(status(boot="b2", pid=5))

    assert "actor-0 came back as process 5" in shown(state)


def test_events_are_the_last_few() -> None:
    state = running()
    for number in range(50):
        state.say(f"event {number}")

    text = shown(state)
    assert "event 49" in text
    assert "event 44" not in text


def test_it_starts_with_who_has_been_heard() -> None:
    state = State(run="train-1", started_at=0.0)
    assert "heard from nobody yet" in shown(state)

    state.on_status(status("league-0"))

    assert "heard from league-0" in shown(state)


def test_an_evaluation_shows_its_bouts() -> None:
    state = running()
    state.on_progress(progress(agent="", evaluations_done=96, evaluations_total=384))

    assert "bout 96 of 384" in shown(state)
    assert line(state) == "evaluation: 96 of 384 bouts"


def test_a_narrow_terminal_is_enough() -> None:
    for row in shown(running(), 60).splitlines():
        assert len(row) <= 60


def test_the_sparkline_averages_what_does_not_fit() -> None:
    values = [("antagonist", float(k)) for k in range(1000)]

    assert len(sparkline(values, 40).plain) == 40
    assert sparkline([("antagonist", 3.0)] * 5, 40).plain == "▁" * 5
    assert sparkline([], 40).plain == ""


def test_without_a_terminal_there_is_a_plain_line_now_and_then(tmp_path: Path) -> None:
    clock = ManualClock(100.0)
    hub = MemoryHub(clock)
    out = io.StringIO()
    speaker = hub.join("league-0")
    console = Console(file=out, width=80, force_terminal=False)
    (tmp_path / "viewer.json").write_text('{"url": "http://127.0.0.1:9090", "page": "", "pid": 1}')
    with Dashboard(hub.join("train"), clock, tmp_path, console) as dashboard:
        for update in range(1, 61):
            speaker.publish(PROGRESS, progress(update=update, message="stage 3 began"))
            speaker.publish(STATUS, status(), role="actor", name="actor-0")
            dashboard.tick({})
            clock.advance(0.5)
        dashboard.say("actor-0 died [signal 9]")

    lines = out.getvalue().splitlines()
    assert lines[0] == "0:00 live view: http://127.0.0.1:9090"
    assert lines[1].startswith("0:00 stage 3/4, antagonist learns, update 1/120, score +739")
    assert len([text for text in lines if "learns" in text]) == 6
    assert lines[-1] == "0:30 actor-0 died [signal 9]"
    assert "\x1b" not in out.getvalue()


def test_on_a_terminal_it_is_drawn_twice_a_second(tmp_path: Path) -> None:
    clock = ManualClock(100.0)
    hub = MemoryHub(clock)
    out = io.StringIO()
    speaker = hub.join("league-0")
    console = Console(file=out, width=100, height=40, force_terminal=True)
    with Dashboard(hub.join("train"), clock, tmp_path, console) as dashboard:
        speaker.publish(PROGRESS, progress())
        for _ in range(40):
            dashboard.tick({})
            clock.advance(0.1)

    assert 8 <= out.getvalue().count("Ctrl-C stops in order") <= 10


def test_what_is_heard_is_shown_as_it_is_and_never_obeyed() -> None:
    nasty = "[/x] [bus] \x1b]0;owned\x07"
    state = running()
    state.on_status(
        status(f"a {nasty}", state=nasty, waiting_for=f"w {nasty}", waiting_seconds=2.0)
    )
    state.on_status(status("b", last_error=f"e {nasty}"))
    state.on_progress(progress(message=f"m {nasty}", agent=nasty, round=1, opponent=f"o {nasty}"))

    text = shown(state, 200)

    for first in ("a", "w", "e", "m", "o"):
        assert f"{first} [/x] [bus] ]0;owned" in text
    assert "[/x] [bus] ]0;owned learns" in text
    assert "\x1b" not in text
    assert "\x1b" not in line(state)


def test_before_it_starts_names_are_shown_as_they_are() -> None:
    state = State(run="r", started_at=0.0)
    state.on_status(status("a [/x] [bus] \x1b]0;"))
    text = shown(state)
    assert "heard from a [/x] [bus] ]0;" in text
    assert "\x1b" not in text


def test_invented_services_push_out_who_was_heard_longest_ago(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(dashboard_view, "MOST_SERVICES", 3)
    state = State(run="r", started_at=0.0)
    for name in ("a", "b", "c", "a", "d", "e"):
        state.on_status(status(name))
    assert list(state.services) == ["a", "d", "e"]
