import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, TypeVar

import msgspec
import numpy as np
import pytest

from services.league import leases
from services.league.events import LeaseGranted
from services.league.history import LeaseRecord, RunState
from services.league.ledger import open_read_only
from shared.bus.base import Refused, Subscription
from shared.errors import LedgerError
from shared.messages.league import Lease, LeaseRequest, Leases, SnapshotRequest
from shared.messages.message import Message
from shared.messages.topics import LEASE, LEASES, PROGRESS, RESULTS, SCHEDULE, SNAPSHOT, VERSION
from shared.messages.wire import encode
from tests.unit.league.driving import (
    SAMPLES,
    SMALL,
    Match,
    bout_results,
    metrics,
    snapshot,
    version_report,
)


@pytest.fixture
def match(tmp_path: Path) -> Iterator[Match]:
    match = Match(tmp_path)
    yield match
    match.stop()


def replayed(match: Match) -> RunState:
    with open_read_only(match.folder / "league.sqlite") as ledger:
        return RunState.fold(ledger.replay())


def test_a_run_goes_from_its_start_to_its_end(match: Match) -> None:
    match.finish()
    state = match.league.state
    assert state.finished
    assert [(r.stage.iteration, r.stage.agent, r.updates) for r in state.stages] == [
        (1, "antagonist", 3), (1, "protagonist", 2), (2, "antagonist", 3), (2, "protagonist", 2),
    ]  # fmt: skip
    assert {r.end_reason for r in state.stages} == {"budget"}
    assert len(state.evaluations) == 2 * 3
    assert all(r.done == r.planned == 5 and all(r.played) for r in state.evaluations.values())
    assert state.repeated_rollouts == 0
    assert replayed(match) == state


def test_each_stage_is_against_what_the_other_agent_had_learned(match: Match) -> None:
    match.finish()
    one, two, three, four = match.league.state.stages
    assert one.stage.opponent == snapshot("protagonist", 0, -1).reference
    assert two.stage.opponent == f"sha256:{one.end_snapshot}"
    assert three.stage.opponent == f"sha256:{two.end_snapshot}"
    assert four.stage.opponent == f"sha256:{three.end_snapshot}"
    assert three.end_version == 6


def test_there_is_no_work_before_both_agents_have_a_version(match: Match) -> None:
    match.report("antagonist", 0, -1)
    lease = match.lease()
    assert (lease.lease, lease.kind) == ("", "none")
    assert lease.reason == "waiting for version 0 of protagonist"
    assert match.league.health().waiting_for == "learner protagonist"


def test_a_training_lease_names_stage_seed_and_window(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    assert lease.lease == "L000001"
    assert lease.stage is not None
    assert lease.stage.agent == "antagonist"
    assert (lease.window, lease.expires_in) == (8, 10.0)
    assert match.lease("actor-1").window == 4
    assert match.renew(lease).window == 4


def test_the_window_of_an_actor_with_short_rollouts_is_wider(match: Match) -> None:
    match.both_start()
    small = LeaseRequest(actor="actor-0", boot="b0", num_envs=32, rollout_steps=40)
    lease = match.ask(LEASE, small)
    assert lease.window == 32  # of 1280 samples: two batches of 20480
    match.lease("actor-1")
    assert match.renew(lease).window == 16


@pytest.mark.parametrize("field", ["actor", "boot"])
def test_a_name_that_would_swell_every_list_gets_no_work(match: Match, field: str) -> None:
    match.both_start()
    asked = {"actor": "actor-0", "boot": "b0", "num_envs": 4} | {field: "x" * 201}
    answer = match.ask(LEASE, LeaseRequest(**asked))  # type: ignore[arg-type]
    assert (answer.lease, answer.kind) == ("", "none")
    assert f"{field} has 201 characters" in answer.reason


def test_more_leases_than_a_message_holds_are_cut_with_the_ended_ones_first(
    match: Match, monkeypatch: pytest.MonkeyPatch
) -> None:
    match.both_start()
    known = match.peer.subscribe(LEASES)
    for number in range(3):
        match.lease(f"actor-{number}")
    for number in range(2):  # ends what they had
        match.lease(f"actor-{number}")
    size = len(encode(Leases(leases=leases.summaries(match.league.state, match.cfg, 0)))) / 5
    monkeypatch.setattr(leases, "MOST_BYTES", round(4.4 * size))
    match.lease("actor-3")
    live = newest(known, match)
    assert live is not None
    assert [summary.lease for summary in live.leases] == [f"L{n:06d}" for n in (3, 4, 5, 6)]


def test_the_longest_list_of_leases_can_be_sent(match: Match) -> None:
    match.both_start()
    granted = {
        f"L{number:06d}": LeaseRecord(
            grant=LeaseGranted(
                lease=f"L{number:06d}", number=number, actor=f"actor-node{number:05d}-é",
                boot="b" * 16, work="train", stage=0, antagonist="", protagonist="", seed=2**62,
            ),
            granted_at_ns=0,
        )
        for number in range(9_000)
    }  # fmt: skip
    match.league.state.leases.update(granted)
    match.league.state.live_leases.update(dict.fromkeys(granted))
    listed = leases.summaries(match.league.state, match.cfg, 0)
    assert 5_000 < len(listed) < 9_000
    assert len(encode(Leases(leases=listed))) < LEASES.max_bytes


def test_the_window_of_a_serial_run_is_one_batch(tmp_path: Path) -> None:
    match = Match(tmp_path, serial=True)
    match.both_start()
    assert match.lease().window == 4
    match.stop()


def test_a_version_is_entered_once_however_often_it_is_reported(match: Match) -> None:
    match.both_start()
    first = match.report("antagonist", 1, 0)
    assert first.accepted
    position = match.league.ledger_position
    again = match.report("antagonist", 1, 0)
    assert again.accepted
    assert match.league.ledger_position == position


def test_another_snapshot_under_a_used_number_is_told_the_latest_number(match: Match) -> None:
    match.both_start()
    match.report("antagonist", 1, 0)
    answer = match.report("antagonist", 1, 0, salt=1.0)
    assert (answer.accepted, answer.latest_version) == (False, 1)
    assert "use a number after the latest" in answer.reason
    assert match.report("antagonist", 2, 0, salt=1.0).accepted


def test_the_answer_to_the_last_version_of_a_stage_names_the_next_stage(match: Match) -> None:
    match.both_start()
    stages = [match.report("antagonist", version, 0).stage for version in (1, 2, 3)]
    assert stages == [0, 0, 1]
    late = match.report("antagonist", 4, 0)
    assert (late.accepted, late.stage) == (True, 1)
    assert match.league.state.stages[0].end_version == 3


def test_the_answer_says_when_all_stages_are_done(match: Match) -> None:
    match.finish()
    assert match.report("protagonist", 4, 3).stage == -1


@pytest.mark.parametrize(
    ("agent", "version", "stage", "text"),
    [
        ("antagonist", 1, 5, "stage 5 has not started"),
        ("protagonist", 1, 0, "in stage 0 antagonist learns"),
        ("antagonist", -1, 0, "versions count from 0"),
    ],
)
def test_a_version_that_cannot_be_is_refused_for_good(
    match: Match, agent: str, version: int, stage: int, text: str
) -> None:
    match.both_start()
    answer = match.report(agent, version, stage)  # type: ignore[arg-type]
    assert isinstance(answer, Refused)
    assert text in answer.reason
    assert not answer.retry


def test_a_snapshot_that_is_not_what_the_report_says_is_refused(match: Match) -> None:
    match.both_start()
    report = version_report("antagonist", 1, 0)
    swapped = type(report)(
        **{name: getattr(report, name) for name in report.__struct_fields__} | {"policy_version": 2}
    )
    answer = match.ask(VERSION, swapped)
    assert isinstance(answer, Refused)
    assert "reported as version 2" in answer.reason
    cut = type(report)(
        **{name: getattr(report, name) for name in report.__struct_fields__}
        | {"payload": report.payload[:-1]}
    )
    answer = match.ask(VERSION, cut)
    assert isinstance(answer, Refused)
    assert "damaged" in answer.reason


@pytest.mark.parametrize("odd", [{"explained_variance": math.inf}, {"samples": 2**63}])
def test_metrics_that_are_no_numbers_to_keep_are_dropped_and_noted(
    match: Match, odd: dict[str, Any]
) -> None:
    match.both_start()
    report = msgspec.structs.replace(version_report("antagonist", 1, 0), metrics=metrics(1, **odd))
    assert match.ask(VERSION, report).accepted
    assert match.league.state.versions["antagonist"][1].metrics is None
    assert match.league.state.incidents[-1].what == "metrics_dropped"
    assert replayed(match) == match.league.state


def test_results_count_once_however_often_they_are_sent(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    assert match.play(lease, sequence=9).accepted
    assert match.play(lease, sequence=9).accepted
    assert match.league.state.stages[0].complete_bouts == 3


def test_only_complete_bouts_make_the_learning_curve(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    match.play(lease, complete=False)
    match.report("antagonist", 1, 0)
    match.play(lease, attack=500)
    record = match.league.state.stages[0]
    assert (record.incomplete_bouts, record.complete_bouts) == (3, 3)
    (point,) = record.points
    assert (point.update, point.total_samples, point.mean) == (1, SAMPLES, 490.0)


@pytest.mark.parametrize(
    ("changes", "text"),
    [
        ({"lease": "L999999"}, "was never granted"),
        ({"actor": "actor-9"}, "actor is 'actor-9'"),
        ({"boot": "other"}, "boot is 'other'"),
        ({"stage": 1}, "stage is 1"),
        ({"seed": 1}, "seed is 1"),
        ({"kind": "evaluate"}, "kind is 'evaluate'"),
        ({"protagonist": "scripted:static"}, "protagonist is 'scripted:static'"),
        ({"antagonist": "somebody"}, "is no snapshot"),
        ({"score": np.full(3, 91.0, np.float32)}, "score of bout 0 is 91"),
        ({"attack_steps": np.full(3, 2001, np.int32)}, "outside 0 to 2000"),
        ({"penalty_steps": np.full(3, -1, np.int32)}, "outside 0 to 2000"),
    ],
)
def test_results_that_cannot_be_are_dropped_with_the_reason(
    match: Match, changes: dict[str, object], text: str
) -> None:
    match.both_start()
    lease = match.lease()
    position = match.league.ledger_position
    fields = bout_results(lease, "actor-0", "b0", 1)
    names = fields.__struct_fields__
    odd = type(fields)(**{name: getattr(fields, name) for name in names} | changes)
    answer = match.ask(RESULTS, odd)
    assert not answer.accepted
    assert text in answer.reason
    assert match.league.ledger_position == position


def test_bouts_of_another_simulator_model_are_dropped(match: Match) -> None:
    """What the policies are made for decides, not who hands bouts over first."""
    match.both_start()
    lease = match.lease()
    answer = match.play(lease, model="n" * 64)
    assert not answer.accepted
    assert "same [sim] section" in answer.reason
    assert match.play(lease).accepted


def test_results_without_a_bout_are_dropped(match: Match) -> None:
    match.both_start()
    answer = match.play(match.lease(), bouts=0)
    assert answer.reason == "there are no bouts in it"


def test_late_results_of_an_ended_lease_still_count(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    match.clock.advance(11.0)
    match.league.tick()
    assert not match.renew(lease).alive
    assert match.play(lease).accepted


def test_a_lease_lapses_unless_it_is_renewed(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    for _ in range(3):
        match.clock.advance(9.0)
        assert match.renew(lease).alive
    match.clock.advance(10.0)
    match.league.tick()
    assert not match.renew(lease).alive
    assert match.league.state.leases[lease.lease].end_reason == "lapsed"


def test_a_renewal_that_waited_while_the_league_slept_counts(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    match.clock.advance(60.0)
    assert match.renew(lease).alive


def test_only_the_holder_can_renew_a_lease(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    assert not match.renew(lease, boot="other").alive
    assert not match.renew(lease, actor="actor-9").alive
    assert match.renew(lease).alive


def test_an_actor_that_asks_again_gets_a_new_lease_and_its_old_one_ends(match: Match) -> None:
    match.both_start()
    one, two, three = match.lease(), match.lease(), match.lease(boot="b1")
    assert len({one.lease, two.lease, three.lease}) == 3
    leases = match.league.state.leases
    assert leases[one.lease].end_reason == "asked_again"
    assert leases[two.lease].end_reason == "restarted"
    assert list(match.league.state.live_leases) == [three.lease]


def test_leases_of_a_finished_stage_end_and_are_known_for_a_while(match: Match) -> None:
    match.both_start()
    known = match.peer.subscribe(LEASES)
    lease = match.lease()
    for version in (1, 2, 3):
        match.report("antagonist", version, 0)
    assert not match.renew(lease).alive

    def leases() -> list[str]:
        match.league.tick()
        newest: Leases | None = None
        while (value := known.take()) is not None:
            newest = value
        assert newest is not None
        return [summary.lease for summary in newest.leases]

    assert leases() == [lease.lease]
    match.clock.advance(5.1)
    assert leases() == []


def test_what_every_actor_hears_is_as_long_for_any_number_of_actors(match: Match) -> None:
    match.both_start()
    schedule, known = match.peer.subscribe(SCHEDULE), match.peer.subscribe(LEASES)
    match.lease("actor-0")
    assert newest(schedule, match) is not None
    for number in range(1, 20):
        match.lease(f"actor-{number}")
    assert newest(schedule, match) is None  # there is nothing new to tell an actor
    live = newest(known, match)
    assert live is not None
    assert len(live.leases) == 20


M = TypeVar("M", bound=Message)


def newest(subscription: Subscription[M], match: Match) -> M | None:
    match.league.tick()
    found: M | None = None
    while (value := subscription.take()) is not None:
        found = value
    return found


def evaluation(match: Match) -> None:
    match.both_start()
    for _ in range(4):
        match.learn_stage()


def test_evaluation_work_is_cut_to_the_size_of_the_actor(match: Match) -> None:
    evaluation(match)
    one, two = match.lease(num_envs=3), match.lease("actor-1", num_envs=3)
    three = match.lease("actor-2", num_envs=3)
    assert (one.bouts, two.bouts, three.bouts) == (3, 2, 3)
    assert one.protagonist == two.protagonist == "scripted:static"
    assert three.protagonist != "scripted:static"


def test_lapsed_evaluation_work_is_granted_again_and_counts_once(match: Match) -> None:
    evaluation(match)
    lost = match.lease(num_envs=5)
    match.clock.advance(11.0)
    again = match.lease("actor-1", num_envs=5)
    assert (again.antagonist, again.protagonist) == (lost.antagonist, lost.protagonist)
    assert again.lease != lost.lease
    assert again.seed == lost.seed
    assert match.play(again, actor="actor-1").accepted
    late = match.play(lost)
    assert not late.accepted
    assert "played by another actor" in late.reason
    assert match.league.state.evaluation_done == 5


def test_late_evaluation_bouts_count_when_nobody_has_played_them_meanwhile(match: Match) -> None:
    evaluation(match)
    slow = match.lease(num_envs=5)
    match.clock.advance(11.0)
    again = match.lease("actor-1", num_envs=3)
    assert match.play(slow).accepted
    assert not match.renew(again, actor="actor-1").alive
    assert match.league.state.leases[again.lease].end_reason == "superseded"
    assert not match.play(again, actor="actor-1").accepted
    assert match.league.state.evaluation_done == 5


def test_an_evaluation_lease_wants_all_of_its_bouts_complete(match: Match) -> None:
    evaluation(match)
    lease = match.lease()
    assert "is for 5 complete ones" in match.play(lease, bouts=4).reason
    assert "is for 5 complete ones" in match.play(lease, complete=False).reason


def test_snapshots_are_served_by_reference(match: Match) -> None:
    match.both_start()
    policy = snapshot("protagonist", 0, -1)
    answer = match.ask(SNAPSHOT, SnapshotRequest(snapshot=policy.reference))
    assert answer.found
    assert answer.payload.tobytes() == policy.payload
    missing = match.ask(SNAPSHOT, SnapshotRequest(snapshot="sha256:" + "0" * 64))
    assert not missing.found
    assert "never reported" in missing.reason


def test_a_restarted_league_goes_on_where_it_was(match: Match) -> None:
    match.both_start()
    lease = match.lease()
    match.play(lease)
    match.report("antagonist", 1, 0)
    before = match.league.state
    match.restart()
    assert match.league.state == before
    match.clock.advance(9.0)
    assert match.renew(lease).alive
    match.learn_stage()


def test_incidents_are_entered_once(match: Match) -> None:
    assert match.note(1).accepted
    assert match.note(1).accepted
    assert match.note(2).accepted
    assert [i.what for i in match.league.state.incidents] == ["process_restarted"] * 2


def test_progress_shows_score_with_interval_rate_and_time_left(match: Match) -> None:
    progress = match.peer.subscribe(PROGRESS)
    match.both_start()
    lease = match.lease()
    for version in (1, 2):
        match.clock.advance(1.0)
        match.play(lease, attack=100 * version)
        match.report("antagonist", version, 0)
    match.clock.advance(1.0)
    match.league.tick()
    while (value := progress.take()) is not None:
        shown = value
    assert (shown.stage, shown.stages, shown.agent, shown.update) == (0, 4, "antagonist", 2)
    assert shown.score_mean == 140.0
    assert shown.score_low < 140.0 < shown.score_high
    assert shown.score_bouts == 6
    assert shown.samples_per_s == SAMPLES
    updates, bouts = 1 + 2 + 3 + 2, 6 * 5
    assert shown.eta_seconds == pytest.approx(updates * 1.0 + bouts * 2000 / SAMPLES)


def test_progress_ends_at_nothing_left(match: Match) -> None:
    progress = match.peer.subscribe(PROGRESS)
    match.finish()
    match.clock.advance(1.0)
    match.league.tick()
    while (value := progress.take()) is not None:
        shown = value
    assert (shown.phase, shown.eta_seconds, shown.evaluations_done) == ("finished", 0.0, 30)


def test_a_rewound_league_repeats_the_same_run(tmp_path: Path) -> None:
    match = Match(tmp_path, serial=True)
    match.both_start()
    match.learn_stage()
    cut, at = match.league.ledger_position, match.clock.now()
    sequence = match.sequence()
    match.learn_stage()
    first = list(open_read_only(tmp_path / "league.sqlite").replay())
    match.league.rewind_to(cut)
    match.clock.__init__(at)  # as a resumed process has it
    match._sequence = sequence
    match.learn_stage()
    assert list(open_read_only(tmp_path / "league.sqlite").replay()) == first
    match.stop()


def test_a_cut_beyond_the_ledger_is_refused(match: Match) -> None:
    with pytest.raises(LedgerError, match="before the cut at event 99"):
        match.league.rewind_to(99)


def test_a_ledger_of_another_run_or_seed_is_refused(tmp_path: Path) -> None:
    match = Match(tmp_path)
    match.stop()
    match.seed = 8
    with pytest.raises(LedgerError, match="seed 7, not 8"):
        match.start()
    match.seed = 7
    (tmp_path / "league.sqlite").rename(tmp_path / "elsewhere")
    match.start()
    match.both_start()
    match.stop()
    (tmp_path / "league.sqlite").unlink()
    with pytest.raises(LedgerError, match="there are snapshots beside it"):
        match.start()


def test_a_run_without_evaluation_ends_after_its_last_stage(tmp_path: Path) -> None:
    cfg = type(SMALL)(iterations=1, antagonist_updates=1, protagonist_updates=1, evaluation_bouts=0)
    match = Match(tmp_path, cfg)
    match.finish()
    assert match.league.state.finished
    lease = match.ask(LEASE, _request())
    assert isinstance(lease, Lease)
    assert lease.reason == "finished"
    match.stop()


def _request() -> object:
    return LeaseRequest(actor="actor-0", boot="b0", num_envs=1)
