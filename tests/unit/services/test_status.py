import json
from pathlib import Path

import msgspec
import pytest
from rich.console import Console

from services.jobs import status
from services.jobs.roll_call import RollCall
from services.jobs.status_view import Heard, Missing, Snapshot, headline, lags, render
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock, SystemClock
from shared.errors import ConfigError
from shared.messages.league import Leases, LeaseSummary
from shared.messages.live import Progress, ServiceStatus
from shared.messages.topics import LEASES, PROGRESS, STATUS


class PassingClock(ManualClock):
    """Goes on by 10 ms whenever it is looked at."""

    def now(self) -> float:
        self.advance(0.01)
        return super().now()


ACTOR = ServiceStatus(
    role="actor", name="actor-0", boot="b", pid=1, host="h", state="playing",
    waiting_for="learner-antagonist", waiting_seconds=3.25, rates={"samples_per_s": 12345.6},
    counters={"bus_sent": 9, "rollouts_dropped": 2, "refused_messages": 0},
    rss_bytes=100 << 20, last_error="lease lapsed",
)  # fmt: skip
PROGRESS_NOW = Progress(
    run="demo", stage=1, stages=4, phase="one", iteration=1, agent="protagonist", update=3,
    max_updates=120, total_samples=1000, score_mean=1500.2, score_low=1400.0, score_high=1600.0,
    score_bouts=64, eta_seconds=125.0,
)  # fmt: skip


LEARNER = ServiceStatus(
    role="learner", name="learner-antagonist", boot="c", pid=2, host="big", state="learning",
    policies={"antagonist": 12}, rss_bytes=1, version="1.0", commit="abc",
)  # fmt: skip


def shown(snapshot: Snapshot) -> list[str]:
    """Return the lines that a person sees."""
    console = Console(width=200)
    with console.capture() as capture:
        console.print(render(snapshot))
    return capture.get().splitlines()


def test_what_services_say_is_gathered_and_shown_as_one_row_each():
    hub = MemoryHub(SystemClock())
    service = hub.join("actor-0")
    service.publish(STATUS, ACTOR, role="actor", name="actor-0")
    service.publish(PROGRESS, PROGRESS_NOW)
    call = RollCall(hub.join("status"), SystemClock())
    call.listen(0.02)
    snapshot = call.snapshot()
    call.close()
    assert snapshot.services == (ACTOR,)
    assert snapshot.progress == PROGRESS_NOW
    assert snapshot.missing == ()
    (row,) = [line for line in shown(snapshot) if "actor-0" in line]
    for text in (
        "playing", "learner-antagonist for 3.2 s", "samples 12,346/s", "rollouts_dropped 2",
        "100 MiB", "lease lapsed",
    ):  # fmt: skip
        assert text in row
    assert "refused" not in row
    assert "silent" not in row
    (said,) = json.loads(json.dumps(status.to_json(snapshot)))["services"]
    assert (said["pid"], said["host"], said["policy_lags"]) == (1, "h", {})


def test_processes_stand_under_their_host_and_who_runs_other_code_is_pointed_out():
    actor = msgspec.structs.replace(ACTOR, policies={"antagonist": 9}, version="1.0", commit="def")
    both = (actor, LEARNER)
    processes = tuple(
        Heard(status=one, silent_seconds=0.1, cpu_percent=7.0, lags=lags(both, one)) for one in both
    )
    lines = shown(Snapshot(processes=processes))
    heads = [line.split()[0] for line in lines]
    assert heads == ["process", "big", "learner-antagonist", "h", "actor-0", "different"]
    assert "antagonist 12 " in lines[2]
    assert "antagonist 9 (-3)" in lines[4]
    assert "7 %" in lines[4]
    assert lines[5].strip() == "different code is running: 1.0 (abc), 1.0 (def)"


def test_who_has_fallen_silent_and_who_was_never_heard_is_said():
    hub = MemoryHub(SystemClock())
    clock = PassingClock()
    service, league = hub.join("actor-0"), hub.join("league-0")
    hub.join("actor-1").declare_alive("actor")
    service.declare_alive("actor")
    call = RollCall(hub.join("status"), clock)
    service.publish(STATUS, ACTOR, role="actor", name="actor-0")
    lease = LeaseSummary(
        lease="L2", actor="actor-2", agent="antagonist", stage=0, opponent="x", seed=1
    )
    league.publish(LEASES, Leases(leases=(lease,)))
    call.listen(0.5)
    clock.advance(20.0)
    snapshot = call.snapshot()
    assert snapshot.processes[0].silent_seconds >= 20.0
    assert [(one.name, one.role) for one in snapshot.missing] == [
        ("actor-1", "actor"), ("actor-2", "actor"),
    ]  # fmt: skip
    text = "\n".join(shown(snapshot))
    assert "silent for 2" in text
    assert "had lease L2 a moment ago" in text
    clock.advance(1000.0)
    call.listen(0.5)
    assert call.snapshot().processes == ()


def test_the_load_of_a_process_is_what_it_used_between_two_reports():
    hub = MemoryHub(SystemClock())
    clock = PassingClock()
    service = hub.join("actor-0")
    call = RollCall(hub.join("status"), clock)
    for used in (10.0, 11.5):
        said = msgspec.structs.replace(ACTOR, cpu_seconds=used)
        service.publish(STATUS, said, role="actor", name="actor-0")
        call.listen(0.5)
        clock.advance(2.5)
    (heard,) = call.snapshot().processes
    assert heard.cpu_percent == pytest.approx(100.0 * 1.5 / 3.0, rel=0.2)


def test_what_is_heard_is_shown_as_it_is_and_never_obeyed():
    nasty = "[/x] [bus] \x1b]0;owned\x07"
    said = msgspec.structs.replace(
        ACTOR, name=f"n {nasty}", host=f"h {nasty}", state=f"s {nasty}",
        waiting_for=f"w {nasty}", last_error=f"e {nasty}", version=f"v {nasty}",
        rates={f"r {nasty}": 1.0}, counters={f"drop {nasty}": 2}, policies={f"p {nasty}": 3},
    )  # fmt: skip
    snapshot = Snapshot(
        processes=(
            Heard(status=said, silent_seconds=0.0), Heard(status=LEARNER, silent_seconds=0.0),
            Heard(status=said, silent_seconds=9.0),
        ),
        missing=(Missing(name=f"m {nasty}", role="actor", why=f"why {nasty}"),),
        progress=msgspec.structs.replace(PROGRESS_NOW, run=f"run {nasty}"),
    )  # fmt: skip
    console = Console(width=400, force_terminal=True, color_system=None)
    with console.capture() as capture:
        console.print(render(snapshot))
    text = capture.get()
    for first in ("n", "h", "s", "w", "e", "v", "r", "drop", "p", "m", "why", "run"):
        assert f" {first} [/x] [bus] ]0;owned" in f" {text}".replace("\n", " "), first
    assert "then: s [/x]" in text
    assert "\x1b" not in text


def test_the_headline_says_who_learns_and_how_long_it_takes():
    line = headline(PROGRESS_NOW)
    assert (
        "iteration 1, stage 2/4, protagonist learns, update 3/120, score 1500 [1400, 1600]" in line
    )
    assert line.endswith(", 2:05 left")


def test_a_run_is_found_through_its_folder(tmp_path: Path):
    (tmp_path / "endpoint.json").write_text('{"connect": "tcp/127.0.0.1:9", "run": "demo"}')
    assert status.read_endpoint(tmp_path) == status.Endpoint(connect="tcp/127.0.0.1:9", run="demo")


@pytest.mark.parametrize("text", [None, "not json", '{"connect": 7}'])
def test_a_folder_without_a_run_is_answered_in_one_line(tmp_path: Path, text: str | None):
    if text is not None:
        (tmp_path / "endpoint.json").write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError, match=r"endpoint\.json is (missing|damaged)"):
        status.read_endpoint(tmp_path)
