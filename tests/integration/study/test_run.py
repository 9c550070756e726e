"""A whole session: the command, every process, the real bus, and people at both pages."""

import signal
import time
from pathlib import Path

import pytest
from rerun.chunk import RrdReader

from services.study.web import TOKEN_FILE
from shared.game.recount import recount
from shared.game.rules import RuleBook
from shared.sim.arena import bat_of, target_of
from shared.sim.config import SimConfig
from shared.study.folder import hash_of
from shared.study.progress import replay
from shared.study.recorded import GAMES, HEART_RATE
from shared.study.rows import GameRow, HeartRateRow
from shared.study.tsv import read_table
from shared.telemetry.archive import archived_bouts, load_bout
from shared.telemetry.live import HEART_PATH
from shared.telemetry.rrd import recordings
from tests.integration.study.running import People, Run, events_of, make, running

pytestmark = [pytest.mark.zenoh, pytest.mark.slow, pytest.mark.timeout(400)]


RULES = RuleBook(bout_steps=150)


def wait_for_heart(people: People, run: Run, seconds: float = 60.0) -> None:
    """Wait until the sensor was heard for a while, and say nothing at the pages."""
    deadline = time.monotonic() + seconds
    page = people.researcher
    while sum(rate is not None for rate in page.view.get("heart", {}).get("recent", ())) < 3:
        page.pump()
        assert run.process.poll() is None, run.said
        assert time.monotonic() < deadline, page.view.get("heart")
        time.sleep(0.05)


def heart_times(path: Path) -> list[int]:
    """Return the wall clock of every heart rate in a recording (ns)."""
    return [
        at
        for chunk in RrdReader(path).stream()
        if chunk.entity_path == f"/{HEART_PATH}" and not chunk.is_static
        for at in chunk.to_record_batch().column("wall_time").cast("int64").to_pylist()
    ]


def test_a_session_is_run_stopped_and_gone_on_with_to_its_end(tmp_path: Path):
    study = make(tmp_path / "study")
    folder = study.session_folder("sub-01")
    people = People(folder)
    with running(study, "sub-01", has_recording=True) as run:
        wait_for_heart(people, run)  # the sensor is on before anybody has agreed to it
        people.until(lambda: "s1-g01" in replay(events_of(study)).done, run)
        run.process.send_signal(signal.SIGINT)
        code, said = run.finish(120.0)
    assert code == 130, said
    assert "say the same command again" in said
    assert "researcher: http" in said
    token = (folder / TOKEN_FILE).read_bytes()
    assert f"token={token.decode()}" in said
    with running(study, "sub-01", has_recording=True) as run:
        people.until(lambda: replay(events_of(study)).state == "ended", run)
        code, said = run.finish(120.0)
    people.close()
    assert code == 0, said
    assert "sub-01 goes on where it was" in said
    kept = [path for path in study.folder.rglob("*") if path.is_file()]
    assert {"journal.jsonl", "run.jsonl"} <= {path.name for path in kept}
    assert [path for path in kept if token in path.read_bytes()] == []

    games = read_table(folder / GAMES, GameRow)
    finished = [row for row in games if row.outcome == "finished"]
    assert [(row.section, row.game) for row in finished] == [(0, 1), (1, 1), (1, 2), (2, 1), (2, 2)]
    assert [row.policy.partition(":")[0] for row in finished[-4:]] == [
        "scripted", "scripted", "sha256", "sha256",
    ]  # fmt: skip
    configs = {hash_of(path.read_bytes()) for path in folder.glob("config-*.toml")}
    assert {row.config for row in games} <= configs

    archived = {path.name: load_bout(path) for path in archived_bouts(folder)}
    assert [row.bout for row in finished if row.is_recorded] == [
        name for name, bout in archived.items() if bout.info.outcome == "finished"
    ]
    assert not any(name.startswith(("warm-up", "explore")) for name in archived)
    sim = SimConfig()
    for row in finished:
        if row.is_recorded:
            info = archived[row.bout].info
            assert (info.score, info.steps, info.protagonist) == (row.score, row.steps, row.policy)
            assert info.site == row.config
            counted = recount(archived[row.bout], RULES, bat_of(sim), target_of(sim))
            assert float(counted.score[0]) == row.score

    (consented,) = [event for event in events_of(study) if event.kind == "consented"]
    in_recording = [at for path in recordings(folder) for at in heart_times(path)]
    assert len(recordings(folder)) == 2
    assert in_recording
    assert min(in_recording) > consented.wall_ns
    assert [row.score for row in finished if not row.is_recorded] == [None]

    beats = read_table(folder / HEART_RATE, HeartRateRow)
    assert {row.game for row in beats} >= {0, 1}
    assert "warm-up-1" not in {row.step for row in beats}
    assert len({(row.wall, row.t_ns) for row in beats}) == len(beats)
    with running(study, "sub-01") as run:
        code, said = run.finish()
    assert code == 2
    assert "sub-01 has played already" in said
