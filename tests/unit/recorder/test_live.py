"""Live bouts as they are recorded: every stream, at its rate, and what becomes of trouble."""

import contextlib
from collections import defaultdict
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from rerun.chunk import RrdReader

from services.recorder import archivist
from services.recorder.config import RecorderConfig
from services.recorder.tap import Tap
from services.robot_io.trackers import ReplayTracker
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import ConfigError, RiposteError
from shared.game.rules import RuleBook
from shared.messages import topics
from shared.messages.play import GateState
from shared.runtime.files import atomic_write
from shared.telemetry.archive import archived_bouts, load_bout, missing_ticks, read_journal
from shared.telemetry.live import LATENESS, PHASE_PATH, SERIES
from shared.telemetry.streams import BY_NAME, GATE, MESSAGES, STREAMS, Column
from tests.unit.recorder.fencing import BOOT, MODEL, ONLY_FILE, Fencing

RULES = RuleBook(bout_steps=200)
ONLY_ARCHIVE = RecorderConfig(live=False, file=False, min_free_mib=0)
BEGAN_AT = 1_700_000_000.0
EN_GARDE = np.zeros((2, 13))
EN_GARDE[:, 3] = 1.0
EN_GARDE[0, 1], EN_GARDE[1, 1] = 2.0, -2.0


def moving(tick: int) -> np.ndarray:
    bats = EN_GARDE.copy()
    bats[:, 2] = 1.0 + 0.1 * np.sin(tick / 20.0)
    bats[0, 7:] = np.arange(6.0) + tick
    return bats


def fenced(folder: Path, cfg: RecorderConfig = ONLY_FILE, **options: Any) -> Fencing:
    """Return a stage on which one bout of two seconds was played and recorded."""
    fencing = Fencing(folder, cfg, rules=RULES, **options)
    fencing.start("the bout", EN_GARDE, 120)
    for step in range(RULES.bout_steps):
        fencing.bring(moving(step))
    fencing.rest(EN_GARDE, 20)
    fencing.recorder.close()
    return fencing


def columns_of(path: Path, entity: str) -> dict[str, list[Any]]:
    """Return everything of one entity, by column, in the order it was logged."""
    found: dict[str, list[Any]] = defaultdict(list)
    for chunk in RrdReader(path).stream():
        if chunk.entity_path == f"/{entity}" and not chunk.is_static:
            batch = chunk.to_record_batch()
            for name in set(batch.schema.names) - {"bout_time"}:
                found[name] += batch.column(name).to_pylist()
    return found


@pytest.mark.parametrize("person", [False, True])
def test_every_stream_is_in_the_recording_at_its_rate(tmp_path: Path, person: bool):
    fenced(tmp_path, person=person)
    path = tmp_path / "recording.rrd"
    found: dict[str, list[float]] = defaultdict(list)
    for chunk in RrdReader(path).stream():
        if not chunk.is_static:
            times = chunk.to_record_batch().column("wall_time").cast("int64").to_pylist()
            found[chunk.entity_path.removeprefix("/")] += [1e-9 * when for when in times]
    absent = {"antagonist_offsets"} if person else {"tracker", "tracker_raw"}
    for series in SERIES:
        if series.stream in absent or (person and series.only_with == "antagonist_is_there"):
            assert series.path not in found
            continue
        nominal = BY_NAME[series.stream].rate_hz or 100.0
        begin = BEGAN_AT + (1.2 if series.stream == "referee" else 0.0)  # silent before a bout
        times = sorted(when for when in found[series.path] if when > begin - 0.02)
        assert len(times) >= 1.9 * nominal, series.path
        assert (len(times) - 1) / np.ptp(times) == pytest.approx(nominal, rel=0.02), series.path
    scene = found["bout/scene/poses"]
    bodies = sum(name != "world" for name in MODEL.body_names)
    assert len(scene) >= 2 * 25 * (7 if person else bodies - 2)
    assert found["services/rss_mib/robot-io-0"]


def test_what_the_recording_says_is_what_was_said(tmp_path: Path):
    fencing = fenced(tmp_path)
    path = tmp_path / "recording.rrd"
    assert fencing.state is not None
    score = columns_of(path, "bout/score")
    last = int(np.argmax(score["control_step"]))
    assert score["Scalars:scalars"][last] == [fencing.state.score]
    lateness = columns_of(path, f"{LATENESS}/robot_io")["Scalars:scalars"]
    assert {value for row in lateness for value in row} == {0.2}
    clipped = columns_of(path, "bout/command/is_clipped")
    flags = {tick: row[0] for tick, row in zip(clipped["control_step"], clipped["Scalars:scalars"],
                                               strict=True)}  # fmt: skip
    assert all(flag == (tick % 7 == 0) for tick, flag in flags.items())
    phases = [row[0] for row in columns_of(path, PHASE_PATH)["StateChange:state"]]
    assert "running" in phases
    heart = columns_of(path, "bout/heart_rate")["Scalars:scalars"]
    assert all(90.0 <= row[0] <= 95.0 for row in heart)


def test_the_archive_holds_every_number_with_its_unit_and_its_provenance(tmp_path: Path):
    fencing = fenced(tmp_path)
    bout = load_bout(archived_bouts(tmp_path)[0])
    info = bout.info

    assert set(bout.streams) == set(BY_NAME) - {"tracker", "tracker_raw"}
    ticks = bout.streams["bats"]["tick"]
    start = 120
    bats = bout.bats()
    for tick in (start, start + 77, start + 199):
        np.testing.assert_array_equal(bats[ticks == tick][0], moving(tick - start))
    assert bout.unit("bats", "antagonist_velocity") == "m/s"
    assert bout.unit("robot", "efforts") == "N m"
    assert bout.streams["arms"]["protagonist_joint_positions"].shape == (len(ticks), 7)
    robot, bats_at = bout.streams["robot"], bout.streams["bats"]["t_ns"]
    np.testing.assert_array_equal(bats_at - robot["t_ns"], np.full(len(ticks), 3_000_000))
    np.testing.assert_array_equal(robot["efforts"][0], np.arange(7.0))
    gate = bout.streams["gate"]
    assert np.isnan(gate["answer_ms"][gate["tick"] % 5 == 0]).all()
    assert (gate["answer_ms"][gate["tick"] % 5 != 0] == 1.5).all()
    assert set(gate["mode"].tolist()) == {"armed"}
    assert bout.seconds("referee")[bout.streams["referee"]["step"] == 100] == pytest.approx(1.0)
    assert bout.streams["heart_rate"]["rr_ms"][0] == "[660.0,671.5]"

    assert (info.outcome, info.steps, info.from_step) == ("finished", 200, 0)
    assert info.antagonist == "sha256:" + "ab" * 32
    assert info.protagonist == "scripted:guard"
    assert (info.model, info.site) == (MODEL.hash, "ab" * 32)
    assert info.robot_io_boot == BOOT
    assert info.version
    assert len(info.observation_schema) == len(info.action_schema) == 16
    assert info.sections["game"]["bout_steps"] == 200
    for name in ("bats", "arms", "robot", "gate", "referee", "protagonist_offsets"):
        stream = info.streams[name]
        assert stream.rate_hz == pytest.approx(100.0, rel=0.01), name
        assert (stream.dropped, stream.missing) == (0, 0)
    lead_in = 1e-9 * (info.started_at_ns - int(bout.streams["bats"]["t_ns"][0]))
    assert 0.9 < lead_in < 1.4
    assert fencing.recorder.health().counters["bouts_archived"] == 1


def test_memory_is_given_back_once_a_bout_is_filed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    given: list[str] = []
    for name in ("release_buffers", "release_memory"):
        monkeypatch.setattr(f"services.recorder.archivist.{name}", lambda it=name: given.append(it))
    fenced(tmp_path)
    assert given == ["release_buffers", "release_memory"]


def test_a_file_of_the_archive_means_something_without_riposte(tmp_path: Path):
    import pyarrow.parquet as pq

    fenced(tmp_path, ONLY_ARCHIVE)
    schema = pq.read_schema(archived_bouts(tmp_path)[0] / "bats.parquet")
    field = schema.field("protagonist_tool_position")
    assert field.metadata[b"unit"] == b"m"
    assert b"torso frame" in field.metadata[b"about"]
    said = msgspec.json.decode(schema.metadata[b"riposte"])
    assert (said["bout"], said["outcome"]) == ("the bout", "finished")


def test_ticks_that_never_came_are_counted_as_missing(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", EN_GARDE)
    for step in range(100):
        fencing.bring(EN_GARDE, lost=step in (20, 50, 51))
    fencing.recorder.close()
    streams = load_bout(archived_bouts(tmp_path)[0]).info.streams
    assert (streams["bats"].missing, streams["bats"].dropped) == (3, 0)


def test_what_a_recorder_that_is_behind_throws_away_is_counted_stream_by_stream(tmp_path: Path):
    clock = ManualClock(BEGAN_AT)
    fencing = Fencing(
        tmp_path, ONLY_ARCHIVE, rules=RULES, hub=MemoryHub(clock, max_messages=8), clock=clock
    )
    fencing.start("one", EN_GARDE)
    for _ in range(20):
        fencing.bring(EN_GARDE)
    fencing.is_recorder_held_up = True
    for _ in range(20):
        fencing.bring(EN_GARDE)
    fencing.is_recorder_held_up = False
    for _ in range(20):
        fencing.bring(EN_GARDE)
    health = fencing.recorder.health()
    fencing.recorder.close()

    assert health.counters["dropped_bats"] == 13
    assert health.counters["dropped_heart_rate"] == 0
    streams = load_bout(archived_bouts(tmp_path)[0]).info.streams
    assert (streams["bats"].dropped, streams["bats"].missing) == (13, 13)


def test_a_bout_whose_folder_is_taken_gets_another(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RuleBook(bout_steps=20))
    names = ["a/../b c", "a b c"]
    for name in names:
        fencing.start(name, EN_GARDE)
        fencing.rest(EN_GARDE, 80)
    fencing.recorder.close()
    found = archived_bouts(tmp_path)
    assert [folder.name for folder in found] == ["a-b-c", "a-b-c-2"]
    assert [load_bout(folder).info.bout for folder in found] == names


def test_a_bout_that_is_not_to_be_recorded_is_in_no_archive(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RuleBook(bout_steps=20))
    fencing.start("warm-up", EN_GARDE, is_recorded=False)
    fencing.rest(EN_GARDE, 80)
    fencing.start("game", EN_GARDE)
    fencing.rest(EN_GARDE, 80)
    fencing.recorder.close()
    assert [folder.name for folder in archived_bouts(tmp_path)] == ["game"]


def test_a_long_pause_is_not_archived_from_end_to_end(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", EN_GARDE)
    fencing.rest(EN_GARDE, 50)
    assert fencing.ask("pause", "one").accepted
    fencing.rest(EN_GARDE, 1000)
    assert fencing.ask("resume", "one").accepted
    fencing.rest(EN_GARDE, 50)
    fencing.recorder.close()
    bout = load_bout(archived_bouts(tmp_path)[0])
    rows = bout.streams["bats"]
    assert len(rows) < 800  # of more than 1,100
    assert len(np.unique(rows["tick"])) == len(rows)
    resumed = bout.streams["referee"]["step"][-1]
    assert resumed == 100


def test_a_bout_without_a_verdict_says_why(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("void", EN_GARDE)
    fencing.rest(EN_GARDE, 30)
    assert fencing.ask("abandon", "void").accepted
    fencing.rest(EN_GARDE, 80)
    fencing.start("silent", EN_GARDE)
    fencing.rest(EN_GARDE, 30)
    fencing.is_referee_gone = True
    fencing.rest(EN_GARDE, 700)
    infos = [load_bout(folder).info for folder in archived_bouts(tmp_path)]
    fencing.recorder.close()
    assert [info.outcome for info in infos] == ["void", "interrupted"]
    assert infos[1].reason == "the referee fell silent"
    assert infos[1].steps == 30


def test_a_disk_without_room_is_said_and_nothing_is_archived(tmp_path: Path):
    cfg = msgspec.structs.replace(ONLY_ARCHIVE, min_free_mib=1 << 20)
    fencing = Fencing(tmp_path, cfg, rules=RULES)
    fencing.start("one", EN_GARDE)
    fencing.rest(EN_GARDE, 30)
    health = fencing.recorder.health()
    fencing.recorder.close()
    assert "bout one is not archived" in health.last_error
    assert health.counters["bouts_unarchived"] == 1
    assert archived_bouts(tmp_path) == []


def test_a_value_that_is_sent_again_is_one_row(tmp_path: Path):
    clock = ManualClock(10.0)
    hub = MemoryHub(clock)
    bus = hub.join("robot-io-0")
    tap = Tap(hub.join("recorder-0"), clock, 0.01)
    state = GateState(
        tick=1, mode="armed", commanded=np.zeros(7), is_clipped=False, lateness_ms=0.0, late_ticks=0
    )
    for tick in (1, 1, 2, 2, 2):
        bus.publish(topics.GATE, msgspec.structs.replace(state, tick=tick))
    tap.listen()
    assert tap.take().rows[GATE.name]["tick"].tolist() == [1, 2]


def test_ticks_of_a_restarted_robot_io_lie_behind_the_ones_before(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_FILE, rules=RULES)
    fencing.start("one", EN_GARDE)
    fencing.rest(EN_GARDE, 50)
    fencing.boot, fencing.tick = "fedcba9876543210", -1
    fencing.rest(EN_GARDE, 30)
    assert fencing.state is not None
    assert fencing.state.phase == "void"
    fencing.start("two", EN_GARDE)
    fencing.rest(EN_GARDE, 50)
    fencing.recorder.close()
    steps = columns_of(tmp_path / "recording.rrd", "bout/bat/antagonist")
    order = np.argsort([when.timestamp() for when in steps["wall_time"]], kind="stable")
    assert (np.diff(np.array(steps["control_step"])[order]) > 0).all()
    boots = [load_bout(folder).info.robot_io_boot for folder in archived_bouts(tmp_path)]
    assert boots == [BOOT, "fedcba9876543210"]


def test_a_recorded_bat_is_replayed_from_the_archive(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", EN_GARDE)
    for step in range(RULES.bout_steps):
        fencing.bring(moving(step), lost=step == 60, valid=step != 90)
    fencing.recorder.close()
    folder = archived_bouts(tmp_path)[0]
    tracker = ReplayTracker.load(folder)
    tracker.read(5.0)  # from the tick at which the bout was started, one before its first step
    for step, shown in ((10, 10), (60, 59), (90, 89), (91, 91), (180, 180)):
        found = tracker.read(5.0 + 0.01 * (step + 1))
        np.testing.assert_array_equal(found.state, moving(shown)[0])
        assert found.is_valid
    damaged(folder, "bats.parquet")
    with pytest.raises(ConfigError, match=r"cannot replay .*one: .*bats.parquet is no stream"):
        ReplayTracker.load(folder)
    with pytest.raises(ConfigError, match=r"cannot replay .*is no archived bout"):
        ReplayTracker.load(tmp_path)


def damaged(folder: Path, name: str) -> None:
    path = folder / name
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def test_a_folder_that_is_no_archive_is_refused_in_one_line(tmp_path: Path):
    fenced(tmp_path, ONLY_ARCHIVE)
    folder = archived_bouts(tmp_path)[0]
    with pytest.raises(RiposteError, match=r"is no archived bout \(no bout.json"):
        load_bout(tmp_path)
    damaged(folder, "gate.parquet")
    with pytest.raises(RiposteError, match=r"gate.parquet is no stream of an archived bout"):
        load_bout(folder)
    text = (folder / "bout.json").read_text()
    (folder / "bout.json").write_text(text.replace('"schema": 1', '"schema": 7'))
    with pytest.raises(RiposteError, match="has schema 7, this Riposte reads 1"):
        load_bout(folder)
    damaged(folder, "bout.json")
    with pytest.raises(RiposteError, match=r"bout.json is damaged"):
        load_bout(folder)


def test_a_column_of_another_kind_is_refused_by_name(tmp_path: Path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    fenced(tmp_path, ONLY_ARCHIVE)
    folder = archived_bouts(tmp_path)[0]
    table = pq.read_table(folder / "gate.parquet")
    pq.write_table(table.drop_columns(["mode"]), folder / "gate.parquet")
    with pytest.raises(RiposteError, match="it has no column 'mode'"):
        load_bout(folder)
    at = table.schema.get_field_index("mode")
    changed = table.set_column(at, "mode", pa.array([1] * len(table)))
    pq.write_table(changed, folder / "gate.parquet")
    with pytest.raises(RiposteError, match="column 'mode' has type int64"):
        load_bout(folder)


def test_a_journal_is_read_up_to_its_last_whole_piece_wherever_it_is_cut(tmp_path: Path):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", EN_GARDE)
    fencing.rest(EN_GARDE, 350)
    fencing.recorder.close = lambda: None  # type: ignore[method-assign]
    path = tmp_path / "bouts" / "one" / "gate.arrows"
    whole = path.read_bytes() if path.exists() else b""
    if not whole:  # finished by now: a bout of 2 s and its end
        fencing.start("two", EN_GARDE)
        fencing.rest(EN_GARDE, 150)
        path = tmp_path / "bouts" / "two" / "gate.arrows"
        whole = path.read_bytes()
    rows = read_journal(path, GATE)
    assert rows is not None
    counts: list[int] = []
    for cut in np.linspace(0, len(whole), 60).astype(int):
        path.write_bytes(whole[:cut])
        found = read_journal(path, GATE)
        counts.append(0 if found is None else len(found))
    assert counts == sorted(counts)
    assert counts[0] == 0
    assert counts[-1] == len(rows)
    assert len(set(counts)) >= 2


def test_missing_ticks_are_those_between() -> None:
    assert missing_ticks(np.array([3, 4, 7, 8, 0, 1, 3])) == 3


def test_every_column_is_described_and_every_message_is_a_stream() -> None:
    assert set(MESSAGES) == set(BY_NAME)
    for stream in STREAMS:
        assert stream.columns[0].name == "t_ns"
        assert len({column.name for column in stream.columns}) == len(stream.columns)
        for column in stream.columns:
            assert isinstance(column, Column)
            assert column.about
            assert column.unit or column.kind == "text"


class Killed(BaseException):
    """The recorder ends here."""


@pytest.mark.parametrize("place", range(0, 8, 2))
def test_a_recorder_killed_while_it_finishes_a_bout_loses_nothing_of_it(
    tmp_path: Path, place: int, monkeypatch: pytest.MonkeyPatch
):
    fencing = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    fencing.start("one", EN_GARDE)
    writes = 0

    def killed_at_the(path: Path, data: bytes) -> None:
        nonlocal writes
        writes += path.suffix == ".parquet"
        if writes > place:
            raise Killed
        atomic_write(path, data)

    with monkeypatch.context() as patch, contextlib.suppress(Killed):
        patch.setattr(archivist, "atomic_write", killed_at_the)
        fencing.rest(EN_GARDE, RULES.bout_steps + 300)
        fencing.recorder.close()
    (folder,) = archived_bouts(tmp_path)
    mending = Fencing(tmp_path, ONLY_ARCHIVE, rules=RULES)
    mending.rest(EN_GARDE, 50)
    mending.recorder.close()
    bout = load_bout(folder)
    assert (bout.info.outcome, bout.info.steps) == ("finished", RULES.bout_steps)
    assert len(bout.streams["bats"]) > RULES.bout_steps
    assert not list(folder.glob("*.arrows"))
