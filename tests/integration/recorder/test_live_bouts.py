"""Live bouts between processes, recorded, and a recorder that is killed in the middle of one."""

import dataclasses
import signal
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
import pytest
from rerun.chunk import RrdReader

from services.jobs.watch import running_view
from shared.game.recount import recount
from shared.game.rules import RuleBook
from shared.messages.live import ServiceStatus
from shared.messages.play import PlayReply, PlayRequest, RefereeState
from shared.messages.topics import BOUT, REFEREE, STATUS
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.telemetry.archive import INFO_FILE, archived_bouts, load_bout, read_info
from shared.telemetry.live import SERIES
from shared.telemetry.rrd import recordings
from tests.integration.robot_io.site import Site

STEPS = 300
COUNTERS = ("score", "attack_steps", "penalty_steps", "camping_steps")
KILLED = """
import sys
from pathlib import Path
from tests.unit.recorder.test_live import EN_GARDE, ONLY_ARCHIVE, Fencing, RuleBook, moving
fencing = Fencing(Path(sys.argv[1]), ONLY_ARCHIVE, rules=RuleBook(bout_steps=100_000))
fencing.start("killed", EN_GARDE)
for step in range(100_000):
    fencing.bring(moving(step))
    if step % 10 == 0:
        print(fencing.tick, flush=True)
"""
FULL_DISK = """
import resource, signal, sys
from pathlib import Path
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
from tests.unit.recorder.test_live import EN_GARDE, ONLY_ARCHIVE, Fencing, RuleBook, moving
fencing = Fencing(Path(sys.argv[1]), ONLY_ARCHIVE, rules=RuleBook(bout_steps=600))
resource.setrlimit(resource.RLIMIT_FSIZE, (120_000, 120_000))
fencing.start("one", EN_GARDE)
for step in range(600):
    fencing.bring(moving(step))
fencing.rest(EN_GARDE, 100)
health = fencing.recorder.health()
print(health.last_error)
print(health.counters["bouts_unarchived"], health.counters["bouts_archived"])
fencing.recorder.close()
"""


class Match(Site):
    """A site with two policies, a referee and a recorder; this process starts the bouts."""

    def __init__(self, folder: Path) -> None:
        super().__init__(folder)
        self.folder = folder
        rules = ("--set", f"game.bout_steps={STEPS}")
        self.recorder = self.start_recorder()
        for agent in ("antagonist", "protagonist"):
            self.service("policy", "--name", f"policy-{agent}", "--agent", agent)
        self.service("referee", *rules, "--set", "referee.void_after=20.0",
                     "--set", "referee.stale_after=10.0")  # fmt: skip
        self.said = self.bus.subscribe(REFEREE)
        self.healths = self.bus.subscribe(STATUS, role="recorder")
        self.last: RefereeState | None = None
        self.health: ServiceStatus | None = None

    def start_recorder(self) -> "subprocess.Popen[bytes]":
        return self.service(
            "recorder", "--name", "recorder-0", "--set", f"game.bout_steps={STEPS}",
            "--set", "recorder.web_port=0", "--set", "recorder.file_period=1.0",
            "--set", "recorder.min_free_mib=0",
        )  # fmt: skip

    def phase(self) -> str:
        while (state := self.said.take()) is not None:
            self.last = state
        while (health := self.healths.take()) is not None:
            self.health = health
        return self.last.phase if self.last is not None else ""

    def start(self, name: str) -> None:
        asked = PlayRequest(
            action="start", bout=name, antagonist="scripted:stab", protagonist="scripted:heuristic"
        )

        def accepted() -> bool:
            pending = self.bus.ask(BOUT, asked, timeout=3.0)
            self.until(lambda: pending.take() is not None)
            reply = pending.take()
            return isinstance(reply, PlayReply) and reply.accepted

        self.until(accepted, 30.0)
        self.until(lambda: self.phase() == "running")


@pytest.fixture
def match(tmp_path: Path) -> Iterator[Match]:
    made = Match(tmp_path)
    yield made
    made.close()


@pytest.mark.zenoh
@pytest.mark.filterwarnings("ignore:RRD file has no footer")
def test_bouts_between_processes_are_recorded_and_one_outlives_its_recorder(match: Match):
    match.arm()
    match.until(lambda: match.phase() == "ready" and match.health is not None, 30.0)
    view = running_view(match.folder)
    assert view is not None  # what `riposte watch` opens
    assert view.url.startswith("http://127.0.0.1:")

    match.start("one")
    match.until(lambda: match.phase() == "finished", 30.0)
    assert match.last is not None
    verdict = {name: getattr(match.last, name) for name in COUNTERS}
    path = match.folder / "bouts" / "one"
    match.until(lambda: match.phase() and read_info(path).outcome == "finished")

    match.start("two")
    match.until(lambda: match.phase() and match.last is not None and match.last.step > 200)
    killed_at = time.time_ns()
    match.recorder.kill()
    match.recorder.wait()
    two = match.folder / "bouts" / "two"
    assert read_info(two).outcome == "running"
    half = load_bout(two)  # journals are read as they lie
    assert int(half.streams["bats"]["t_ns"][-1]) > killed_at - 1_500_000_000

    match.recorder = match.start_recorder()
    match.until(lambda: match.phase() and read_info(two).outcome == "interrupted", 30.0)
    match.recorder.send_signal(signal.SIGTERM)
    match.recorder.wait(30)

    sim = SimConfig()
    for name, bout in (("one", load_bout(path)), ("two", load_bout(two))):
        rules = msgspec.convert(bout.info.sections["game"], RuleBook)
        said = bout.streams["referee"]
        assert said["score"][-1] == bout.info.score, name
        assert said["step"][-1] == bout.info.steps
        # journals end where their last writing did: the referee's may be a few ticks ahead
        said = said.pick(said["tick"] <= bout.streams["bats"]["tick"][-1])
        held = dataclasses.replace(bout, streams={**bout.streams, "referee": said})
        scores = recount(held, rules, bat_of(sim), target_of(sim))
        assert scores.score[0] == said["score"][-1], name
        assert scores.step[0] == said["step"][-1] > 100
        for stream in ("bats", "arms", "robot", "gate"):
            counts = bout.info.streams[stream]
            whole = len(bout.streams[stream]) + counts.missing  # a busy machine loses ticks
            seconds = np.ptp(bout.seconds(stream))
            assert whole / seconds == pytest.approx(100.0, rel=0.03), (name, stream)
            assert counts.rate_hz == pytest.approx((counts.rows - 1) / seconds, rel=0.01)
        assert len(bout.streams["protagonist_offsets"]) > 50
    bout = load_bout(path)
    assert {name: getattr(bout.info, name) for name in COUNTERS} == verdict
    assert bout.info.steps == STEPS
    assert np.isfinite(bout.streams["robot"]["efforts"]).all()
    assert {"robot-io-0", "referee-0"} <= set(bout.streams["services"]["name"].tolist())

    first, *others = recordings(match.folder)
    assert others  # the second recorder wrote its own file
    found: dict[str, list[int]] = defaultdict(list)
    for chunk in RrdReader(first).stream():
        if not chunk.is_static:
            times = chunk.to_record_batch().column("wall_time").cast("int64").to_pylist()
            found[chunk.entity_path.removeprefix("/")] += times
    begin, end = bout.info.started_at_ns, bout.info.started_at_ns + 10_000_000 * STEPS
    drawn = 0
    for series in SERIES:
        if (rows := bout.streams.get(series.stream)) is None or series.stream == "heart_rate":
            continue
        archived = [when for when in rows["t_ns"].tolist() if begin <= when <= end]
        assert sorted(w for w in found[series.path] if begin <= w <= end) == sorted(archived)
        assert len(archived) > 100
        drawn += 1
    assert drawn >= 28
    assert found["bout/scene/poses"]
    assert found["services/cpu_percent/robot-io-0"]


def test_a_full_disk_ends_the_archive_of_the_bout_and_what_was_written_can_be_read(tmp_path: Path):
    done = subprocess.run(
        [sys.executable, "-c", FULL_DISK, str(tmp_path)], capture_output=True, text=True,
        timeout=60, check=True,
    )  # fmt: skip
    said = done.stdout.splitlines()
    assert "the archive of bout one ended early: File too large" in said
    assert "1 0" in said
    bout = load_bout(archived_bouts(tmp_path)[0])
    assert bout.info.outcome == "running"  # as after a kill: the next recorder finishes it
    ticks = bout.streams["bats"]["tick"]
    assert 100 < len(ticks) < 600
    np.testing.assert_array_equal(np.diff(ticks), 1)


def test_what_was_archived_survives_a_kill_but_for_the_last_moment(tmp_path: Path):
    process = subprocess.Popen(
        [sys.executable, "-c", KILLED, str(tmp_path)], stdout=subprocess.PIPE, text=True
    )
    assert process.stdout is not None
    tick = 0
    for line in process.stdout:
        if line.strip().isdecimal() and (tick := int(line)) > 700:
            break
    process.kill()
    process.wait(10)
    process.stdout.close()

    folder = archived_bouts(tmp_path)[0]
    assert (folder / INFO_FILE).exists()
    bout = load_bout(folder)
    assert bout.info.outcome == "running"
    lost = 1.0 + 0.25 + 0.02  # archive_period, live_period and the recorder's pace (s)
    for name in ("bats", "arms", "robot", "gate", "antagonist_offsets", "protagonist_offsets"):
        ticks = bout.streams[name]["tick"]
        assert ticks[-1] >= tick - 100.0 * lost, name
        np.testing.assert_array_equal(np.diff(ticks), 1)
