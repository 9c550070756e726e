"""What every bus promises; the same assertions for the one in memory and the real one."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from shared.bus.base import Bus, NoAnswer, Refused
from shared.messages.league import Lease, LeaseRequest, Schedule
from shared.messages.live import BoutFrames, Progress, ServiceStatus
from shared.messages.topics import (
    FRAMES,
    INCIDENT,
    LEASE,
    POLICY,
    PROGRESS,
    SCHEDULE,
    STATUS,
    Qos,
    Service,
    Topic,
)
from shared.messages.training import PolicyAnnouncement

INBOX = 8
REQUEST = LeaseRequest(actor="actor-0", boot="b0", num_envs=4)


def a_schedule(version: int) -> Schedule:
    return Schedule(stage=None, versions={"antagonist": version})


def a_status(name: str) -> ServiceStatus:
    return ServiceStatus(role="actor", name=name, boot="b", pid=1, host="h", state="playing")


def a_progress(text: str = "") -> Progress:
    return Progress(
        run=text, phase=text, agent=text, message=text, stage=0, stages=1, iteration=1, update=0,
        max_updates=1, total_samples=0, score_mean=0.0, score_low=0.0, score_high=0.0,
        score_bouts=0,
    )  # fmt: skip


def some_frames(bout: int) -> BoutFrames:
    return BoutFrames(
        actor="actor-0", lease="l", bout=bout, antagonist="", protagonist="", model="",
        steps=np.zeros(2, np.int32), positions=np.zeros((2, 3, 3), np.float32),
        quaternions=np.zeros((2, 3, 4), np.float32), joints=np.zeros((2, 2, 7), np.float32),
        score=np.zeros(2, np.float32), in_target=np.zeros((2, 2), bool),
        contact=np.zeros(2, bool),
    )  # fmt: skip


def a_lease(name: str) -> Lease:
    return Lease(lease=name, kind="none")


def connected(world: Any, asker: Bus, answerer: Bus) -> Any:
    """Return the inbox of LEASE, once it is reached."""
    inbox = answerer.answer(LEASE)

    def reached() -> bool:
        pending = asker.ask(LEASE, REQUEST, 1.0)
        request = world.until(lambda: inbox.take() or pending.take())
        if isinstance(request, NoAnswer):
            return False
        request.reply(a_lease("probe"))
        return isinstance(world.until(pending.take), Lease)

    assert world.until(reached)
    return inbox


def test_a_value_reaches_those_who_listen(world: Any) -> None:
    writer, reader = world.join("league"), world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    writer.publish(SCHEDULE, a_schedule(3))
    assert world.until(values.take) == a_schedule(3)


def test_a_late_joiner_gets_the_latest_value_within_a_second_and_a_half(world: Any) -> None:
    writer = world.join("league")
    for version in range(3):
        writer.publish(SCHEDULE, a_schedule(version))
    world.rest(0.3)
    late = world.join("actor-0").subscribe(SCHEDULE)
    assert world.until(late.take, 1.5) == a_schedule(2)


def test_a_latest_value_is_taken_once_however_often_it_is_sent(world: Any) -> None:
    writer, reader = world.join("league"), world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    writer.publish(SCHEDULE, a_schedule(1))
    assert world.until(values.take) == a_schedule(1)
    world.rest(1.3)
    assert values.take() is None
    writer.publish(SCHEDULE, a_schedule(1))
    assert world.until(values.take) == a_schedule(1)


def test_of_several_untaken_values_only_the_newest_is_left(world: Any) -> None:
    writer, reader = world.join("league"), world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    for version in range(5):
        writer.publish(SCHEDULE, a_schedule(version))
    world.rest(1.3)
    assert values.take() == a_schedule(4)
    assert values.take() is None


def test_a_field_left_out_matches_every_key_and_each_keeps_its_newest(world: Any) -> None:
    reader = world.join("recorder")
    every, one = reader.subscribe(STATUS), reader.subscribe(STATUS, role="actor", name="actor-1")
    for name in ("actor-0", "actor-1"):
        world.join(name).publish(STATUS, a_status(name), role="actor", name=name)
    seen: set[str] = set()

    def all_seen() -> bool:
        if (status := every.take()) is not None:
            seen.add(status.name)
        return seen == {"actor-0", "actor-1"}

    assert world.until(all_seen)
    assert world.until(one.take) == a_status("actor-1")
    world.rest(0.1)
    assert one.take() is None


def test_a_value_that_claims_to_be_anothers_is_refused_and_counted(world: Any) -> None:
    writer, reader = world.join("actor-1"), world.join("operator-0")
    values = reader.subscribe(STATUS)
    honest = ServiceStatus(role="robot_io", name="actor-1", boot="b", pid=1, host="h", state="up")
    writer.publish(STATUS, honest, role="robot-io", name="actor-1")
    assert world.until(values.take) == honest
    for key in ({"role": "actor", "name": "actor-1"}, {"role": "robot-io", "name": "robot-io-0"}):
        writer.publish(STATUS, honest, **key)
    taken: list[ServiceStatus | None] = []

    def both_refused() -> bool:
        taken.append(values.take())
        return reader.counters["refused_messages"] == 2

    assert world.until(both_refused)
    assert not any(taken)


def test_a_restarted_writer_is_heard(world: Any) -> None:
    reader = world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    first = world.join("league")
    for version in (1, 2):
        first.publish(SCHEDULE, a_schedule(version))
    world.until(lambda: values.take() == a_schedule(2))
    first.close()
    world.join("league").publish(SCHEDULE, a_schedule(9))
    assert world.until(values.take) == a_schedule(9)


def test_a_stream_comes_in_order(world: Any) -> None:
    writer, reader = world.join("actor-0"), world.join("recorder")
    values = reader.subscribe(FRAMES)
    world.rest(0.3)
    for bout in range(5):
        writer.publish(FRAMES, some_frames(bout), name="actor-0")
        frames = world.until(values.take)
        assert frames.bout == bout
        assert frames.positions.shape == (2, 3, 3)
        assert not frames.positions.flags.writeable
    assert values.take() is None


def test_a_slow_reader_of_a_stream_loses_the_oldest_and_it_is_counted(world: Any) -> None:
    writer, reader = world.join("actor-0"), world.join("recorder")
    values = reader.subscribe(FRAMES)
    world.rest(0.3)
    for bout in range(INBOX + 5):
        writer.publish(FRAMES, some_frames(bout), name="actor-0")
        world.rest(0.02)
    world.until(lambda: reader.counters["dropped_values"] >= 5)
    bouts = [frames.bout for frames in iter(values.take, None)]
    assert bouts == list(range(5, INBOX + 5))
    assert reader.counters["dropped_values"] == 5


def test_a_request_is_answered_now_or_on_a_later_tick(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    pendings = [asker.ask(LEASE, REQUEST, 10.0) for _ in range(3)]
    held = [world.until(inbox.take) for _ in range(3)]
    assert [request.message for request in held] == [REQUEST] * 3
    world.rest(0.2)
    assert [pending.take() for pending in pendings] == [None] * 3
    for number, request in reversed(list(enumerate(held))):
        request.reply(a_lease(str(number)))
    answers = {world.until(pending.take).lease for pending in pendings}
    assert answers == {"0", "1", "2"}
    assert pendings[0].take() is pendings[0].take()


def test_a_refusal_gives_its_reason_and_a_second_answer_is_ignored(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    pending = asker.ask(LEASE, REQUEST, 5.0)
    request = world.until(inbox.take)
    request.refuse("no such actor")
    request.reply(a_lease("late"))
    request.refuse("again")
    assert world.until(pending.take) == Refused("no such actor")


def test_a_request_that_nobody_answers_ends_at_once(world: Any) -> None:
    asker = world.join("actor-0")
    pending = asker.ask(LEASE, REQUEST, 30.0)
    began_at = world.clock.now()
    assert world.until(pending.take) == NoAnswer("nobody answers league/lease")
    assert world.clock.now() - began_at < 1.0
    assert asker.counters["asks_unanswered"] == 1


def test_a_silent_answerer_costs_the_deadline_and_no_more(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    began_at = world.clock.now()
    pending = asker.ask(LEASE, REQUEST, 0.5)
    request = world.until(inbox.take)
    assert world.until(pending.take) == NoAnswer("no answer from league/lease within 0.5 s")
    assert 0.45 < world.clock.now() - began_at < 1.5
    request.reply(a_lease("too late"))
    world.rest(0.1)
    assert isinstance(pending.take(), NoAnswer)
    assert isinstance(world.until(asker.ask(LEASE, REQUEST, 0.2).take), NoAnswer)


def test_an_answerer_that_leaves_ends_what_it_was_asked(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    pendings = [asker.ask(LEASE, REQUEST, 30.0) for _ in range(2)]
    assert world.until(inbox.take)
    answerer.close()
    for pending in pendings:
        assert isinstance(world.until(pending.take), NoAnswer)


def test_a_full_inbox_turns_askers_away_and_they_may_come_again(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    pendings = [asker.ask(LEASE, REQUEST, 20.0) for _ in range(INBOX + 3)]
    refused = world.until(
        lambda: (
            [p.take() for p in pendings if p.take()]
            if sum(p.take() is not None for p in pendings) == 3
            else []
        )
    )
    assert [answer.retry for answer in refused] == [True] * 3
    assert "too many requests wait on" in refused[0].reason
    assert answerer.counters["refused_requests"] == 3
    for _ in range(INBOX):
        world.until(inbox.take).reply(a_lease("x"))
    assert all(world.until(pending.take) for pending in pendings)


def test_an_oversize_request_or_value_is_not_sent_and_counted(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox, values = connected(world, asker, answerer), answerer.subscribe(PROGRESS)
    large = LeaseRequest(actor="a" * 5000, boot="b", num_envs=1)
    answer = world.until(asker.ask(LEASE, large, 5.0).take)
    assert isinstance(answer, Refused)
    assert "is over its limit of 4096 B" in answer.reason
    asker.publish(dataclasses.replace(PROGRESS, max_bytes=10), a_progress())
    world.rest(0.2)
    assert inbox.take() is None
    assert values.take() is None
    assert asker.counters["refused_messages"] == 2


def test_an_oversize_request_or_value_that_is_sent_anyway_is_refused_unread(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox, values = connected(world, asker, answerer), answerer.subscribe(PROGRESS)
    world.rest(0.3)
    generous = dataclasses.replace(LEASE, max_bytes=1 << 20)
    large = LeaseRequest(actor="a" * 5000, boot="b", num_envs=1)
    answer = world.until(asker.ask(generous, large, 5.0).take)
    assert isinstance(answer, Refused)
    assert not answer.retry
    assert answerer.counters["refused_messages"] == 1
    huge = a_progress("x" * 16_384)
    asker.publish(dataclasses.replace(PROGRESS, max_bytes=1 << 23), huge)
    world.until(lambda: values.take() or answerer.counters["refused_messages"] >= 2)
    assert answerer.counters["refused_messages"] >= 2
    assert values.take() is None
    assert inbox.take() is None


def test_another_message_under_a_key_is_refused_with_the_reason(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox, values = connected(world, asker, answerer), answerer.subscribe(SCHEDULE)
    world.rest(0.3)
    wrong = Service(LEASE.key, Lease, Lease, 4096, 4096, "", "", "")
    pending = asker.ask(wrong, a_lease("x"), 5.0)
    answer = world.until(lambda: inbox.take() or pending.take())
    assert isinstance(answer, Refused)
    assert "LeaseRequest refused: has schema 'Lease/" in answer.reason
    asker.publish(Topic(SCHEDULE.key, Lease, Qos.LATEST, 4096, "", "", ""), a_lease("x"))
    world.until(lambda: values.take() or answerer.counters["refused_messages"] >= 2)
    assert answerer.counters["refused_messages"] >= 2
    assert values.take() is None


def test_another_answer_than_the_services_is_refused(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    connected(world, asker, answerer).close()
    wrong = answerer.answer(dataclasses.replace(LEASE, reply=LeaseRequest))

    def outcome() -> Any:
        pending = asker.ask(LEASE, REQUEST, 5.0)
        found = world.until(lambda: wrong.take() or pending.take())
        if isinstance(found, NoAnswer):
            return None
        found.reply(REQUEST)
        return world.until(pending.take)

    answer = world.until(outcome)
    assert isinstance(answer, Refused)
    assert "Lease refused: has schema 'LeaseRequest/" in answer.reason


def test_an_answer_over_the_limit_is_refused_and_ends_nobody(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    pending = asker.ask(LEASE, REQUEST, 5.0)
    request = world.until(inbox.take)
    request.reply(Lease(lease="x" * 10_000, kind="none", reason="y" * 10_000))
    answer = world.until(pending.take)
    assert isinstance(answer, Refused)
    assert answer.reason.startswith("the answer cannot be sent: ")
    assert "over its limit of 16384 B" in answer.reason
    assert not answer.retry


def test_an_array_arrives_as_it_was_sent(world: Any) -> None:
    writer, reader = world.join("learner-a"), world.join("actor-0")
    values = reader.subscribe(POLICY, agent="antagonist")
    payload = np.random.default_rng(0).integers(0, 256, 1_000_000, dtype=np.uint8)
    message = PolicyAnnouncement(
        agent="antagonist", policy_version=3, stage=0, snapshot="aa", payload=payload
    )
    writer.publish(POLICY, message, agent="antagonist")
    got = world.until(values.take)
    np.testing.assert_array_equal(got.payload, payload)
    assert not got.payload.flags.writeable


def test_the_living_are_seen_and_the_gone_are_not(world: Any) -> None:
    watcher, early = world.join("learner-a"), world.join("actor-0")
    early.declare_alive("actor")
    assert world.until(lambda: watcher.alive("actor") == {"actor-0"})
    late = world.join("actor-1")
    late.declare_alive("actor")
    late.declare_alive("actor")
    assert world.until(lambda: watcher.alive("actor") == {"actor-0", "actor-1"})
    assert watcher.alive("league") == frozenset()
    early.close()
    assert world.until(lambda: watcher.alive("actor") == {"actor-1"})


def test_wait_reports_what_is_new_and_only_once(world: Any) -> None:
    writer, reader = world.join("league"), world.join("actor-0")
    values = reader.subscribe(SCHEDULE)
    world.rest(0.3)
    reader.wait(0.0)
    assert not reader.wait(0.0)
    writer.publish(SCHEDULE, a_schedule(1))
    assert reader.wait(2.0)
    assert not reader.wait(0.0)
    assert values.take() == a_schedule(1)


def test_what_is_closed_hears_and_answers_no_more(world: Any) -> None:
    writer, reader = world.join("league"), world.join("actor-0")
    values, inbox = reader.subscribe(SCHEDULE), connected(world, writer, reader)
    values.close()
    inbox.close()
    world.rest(0.3)
    writer.publish(SCHEDULE, a_schedule(1))
    assert isinstance(world.until(writer.ask(LEASE, REQUEST, 5.0).take), NoAnswer)
    assert values.take() is None


def test_a_closed_bus_asks_in_vain(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    connected(world, asker, answerer)
    asker.close()
    assert isinstance(asker.ask(LEASE, REQUEST, 5.0).take(), NoAnswer)
    asker.publish(SCHEDULE, a_schedule(1))
    asker.close()


def test_a_key_without_its_field_is_the_callers_bug(world: Any) -> None:
    bus = world.join("actor-0")
    with pytest.raises(ValueError, match="needs agent"):
        bus.ask(dataclasses.replace(INCIDENT, key="league/{agent}"), REQUEST, 1.0)


def test_everything_sent_and_taken_is_counted(world: Any) -> None:
    asker, answerer = world.join("actor-0"), world.join("league")
    inbox = connected(world, asker, answerer)
    before = asker.counters
    pending = asker.ask(LEASE, REQUEST, 5.0)
    world.until(inbox.take).reply(a_lease("x"))
    world.until(pending.take)
    after = asker.counters
    change = {name: after[name] - before[name] for name in after}
    assert change["messages_out"] == change["messages_in"] == change["asks"] == 1
    assert change["bytes_out"] > 50 < change["bytes_in"]
