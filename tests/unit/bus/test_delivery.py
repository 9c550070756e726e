"""Acknowledged delivery: the outbox, the record of what was applied, and both under faults."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from shared.bus.base import Request
from shared.bus.delivery import Applied, Outbox
from shared.bus.faults import FaultPlan, FaultyBus
from shared.bus.memory import MemoryBus, MemoryHub
from shared.clock import ManualClock
from shared.errors import CheckpointError
from shared.messages.league import Incident
from shared.messages.topics import INCIDENT
from shared.messages.training import Receipt

OK = Receipt(accepted=True)


def an_incident(sequence: int, boot: str = "b0") -> Incident:
    return Incident(source="a", boot=boot, sequence=sequence, kind="k", detail="", at_ns=0)


class Site:
    """A sender and an answerer on one hub."""

    def __init__(self, window: int = 4, timeout: float = 1.0) -> None:
        self.clock = ManualClock()
        self.hub = MemoryHub(self.clock)
        self.bus = self.hub.join("actor-0")
        self.outbox = Outbox(self.bus, INCIDENT, self.clock, window=window, timeout=timeout)
        self.answerer = self.hub.join("league")


def test_an_outbox_gives_back_each_message_with_its_answer() -> None:
    site = Site()
    inbox = site.answerer.answer(INCIDENT)
    site.outbox.put(an_incident(0))
    assert site.outbox.pump() == []
    request = inbox.take()
    assert request is not None
    request.reply(OK)
    assert site.outbox.pump() == [(an_incident(0), OK)]
    assert site.outbox.unacknowledged == 0


def test_a_message_is_sent_when_it_is_put_and_an_answer_that_is_there_already_is_not_lost() -> None:
    clock = ManualClock()
    hub = MemoryHub(clock)
    league, actor = hub.join("league"), hub.join("actor")
    inbox = league.answer(INCIDENT)
    outbox: Outbox[Incident, Receipt] = Outbox(actor, INCIDENT, clock, window=1, timeout=5.0)
    outbox.put(an_incident(0))
    request = inbox.take()
    assert request is not None
    request.reply(Receipt(accepted=True))
    assert outbox.unacknowledged == 1
    assert outbox.pump() == [(an_incident(0), Receipt(accepted=True))]
    assert outbox.unacknowledged == 0


def test_a_full_outbox_takes_nothing_more_until_its_window_grows() -> None:
    site = Site(window=2)
    site.outbox.put(an_incident(0))
    site.outbox.put(an_incident(1))
    assert site.outbox.full
    with pytest.raises(ValueError, match=r"outbox of league/incident is full \(2 of 2\)"):
        site.outbox.put(an_incident(2))
    site.outbox.window = 3
    site.outbox.put(an_incident(2))
    assert site.outbox.unacknowledged == 3


def test_a_message_that_nobody_answers_is_asked_again_after_the_delay() -> None:
    site = Site()
    site.outbox.put(an_incident(0))
    site.outbox.pump()
    assert site.outbox.last_failure == "nobody answers league/incident"
    inbox = site.answerer.answer(INCIDENT)
    site.outbox.pump()
    assert inbox.take() is None
    site.clock.advance(0.25)
    site.outbox.pump()
    assert inbox.take() is not None


def test_a_message_without_an_answer_in_time_is_asked_again() -> None:
    site = Site(timeout=1.0)
    inbox = site.answerer.answer(INCIDENT)
    site.outbox.put(an_incident(0))
    for _ in range(2):
        site.outbox.pump()
        assert inbox.take() is not None
        site.clock.advance(1.0)
        site.outbox.pump()
        site.clock.advance(0.2)
    assert site.outbox.oldest_seconds == pytest.approx(2.4)


def test_a_busy_answerer_is_asked_again_and_one_that_refuses_is_not() -> None:
    site = Site()
    inbox = site.answerer.answer(INCIDENT)
    for retry in (True, False):
        site.outbox.put(an_incident(0))
        site.outbox.pump()
        request = inbox.take()
        assert request is not None
        request.refuse("not now", retry=retry)
        site.outbox.pump()
        assert site.outbox.unacknowledged == (1 if retry else 0)
        if retry:
            site.clock.advance(0.2)
            site.outbox.pump()
            again = inbox.take()
            assert again is not None
            again.reply(OK)
            assert len(site.outbox.pump()) == 1
    assert site.outbox.take_refused() == [(an_incident(0), "not now")]
    assert site.outbox.take_refused() == []


def test_a_message_that_is_refused_again_and_again_travels_ever_more_seldom() -> None:
    site = Site(timeout=10.0)
    inbox = site.answerer.answer(INCIDENT)
    site.outbox.put(an_incident(0))
    asked_at: list[float] = []
    for _ in range(1000):  # ten seconds
        if (request := inbox.take()) is not None:
            asked_at.append(round(site.clock.now(), 2))
            request.refuse("not now", retry=True)
        assert site.outbox.pump() == []
        site.clock.advance(0.01)
    waits = [round(later - earlier, 1) for earlier, later in itertools.pairwise(asked_at)]
    assert waits == [0.2, 0.4, 0.8, 1.6, 2.0, 2.0, 2.0]
    site.outbox.put(an_incident(1))  # another message does not wait for it
    request = inbox.take()
    assert request is not None
    assert request.message.sequence == 1


def test_applied_remembers_exactly_what_was_added() -> None:
    applied = Applied()
    for sequence in (5, 0, 1, 9, 4, 2):
        applied.add("b0", sequence)
    assert [s for s in range(12) if applied.contains("b0", s)] == [0, 1, 2, 4, 5, 9]
    assert not applied.contains("b1", 0)
    assert applied.to_json() == '{"b0":[[0,2],[4,5],[9,9]]}'


@given(st.lists(st.tuples(st.sampled_from("abc"), st.integers(0, 60)), max_size=120))
def test_applied_equals_a_set_of_names_and_survives_json(names: list[tuple[str, int]]) -> None:
    applied = Applied()
    for boot, sequence in names:
        applied.add(boot, sequence)
    back = Applied.from_json(applied.to_json())
    for boot in "abcd":
        for sequence in range(62):
            assert applied.contains(boot, sequence) == ((boot, sequence) in names)
            assert back.contains(boot, sequence) == ((boot, sequence) in names)
    assert back.to_json() == applied.to_json()


def test_applied_knows_messages_by_name() -> None:
    applied = Applied()
    applied.add("host:1", 7)
    assert applied.contains_name("host:1:7")
    assert not any(map(applied.contains_name, ("host:1:8", "1:7", "host:1:", "host:1:-7", "")))


def test_applied_is_bounded_and_forgets_only_the_oldest() -> None:
    applied = Applied(max_boots=2, max_ranges=3)
    for sequence in range(0, 100, 2):
        applied.add("b0", sequence)
    assert applied.contains("b0", 98)
    assert not applied.contains("b0", 97)
    assert not applied.contains("b0", 95)
    assert applied.to_json().count("[") == 4
    for boot in ("b1", "b0", "b2"):
        applied.add(boot, 1000)
    assert not applied.contains("b1", 1000)
    assert applied.contains("b0", 98)


@pytest.mark.parametrize(
    "text", ["", "[]", "1", '{"a":1}', '{"a":[[1]]}', '{"a":[[3,1]]}', '{"a":[[0,4],[5,6]]}',
             '{"a":[["0",4]]}', '{"a":[[0,true]]}', '{"a":[[-1,4]]}',
             '{"a":[[0,9223372036854775808]]}', "[" * 100_000]
)  # fmt: skip
def test_a_damaged_record_is_refused(text: str) -> None:
    with pytest.raises(CheckpointError, match="record of applied messages is damaged"):
        Applied.from_json(text)


class Receiver:
    """Applies each message once, and answers only what its last checkpoint holds."""

    def __init__(self, hub: MemoryHub) -> None:
        self._hub = hub
        self.saved: tuple[list[str], str] = ([], Applied().to_json())
        """What a crash leaves: the messages counted, and the record beside them."""
        self.start()

    def start(self) -> None:
        self.bus: MemoryBus = self._hub.join("league")
        self.inbox = self.bus.answer(INCIDENT)
        self.counted, record = list(self.saved[0]), self.saved[1]
        self.applied = Applied.from_json(record)
        self.waiting: list[Request[Incident, Receipt]] = []

    def crash(self) -> None:
        self.bus.close()

    def tick(self) -> None:
        while (request := self.inbox.take()) is not None:
            name = request.message
            if not self.applied.contains(name.boot, name.sequence):
                self.applied.add(name.boot, name.sequence)
                self.counted.append(f"{name.boot}:{name.sequence}")
            self.waiting.append(request)

    def save(self) -> None:
        self.saved = (list(self.counted), self.applied.to_json())
        for request in self.waiting:
            request.reply(OK)
        self.waiting = []


@pytest.mark.parametrize("seed", range(24))
def test_under_faults_and_crashes_nothing_is_lost_and_nothing_counts_twice(seed: int) -> None:
    rng = np.random.default_rng(seed)
    clock = ManualClock()
    hub = MemoryHub(clock, max_messages=int(rng.integers(2, 16)))
    receiver = Receiver(hub)
    plan = FaultPlan(seed=seed, drop=0.15, drop_answer=0.15, duplicate=0.2, delay=0.2, reorder=0.2)
    buses = [FaultyBus(hub.join(f"actor-{k}"), plan, clock) for k in range(2)]
    outboxes = [Outbox(bus, INCIDENT, clock, window=8, timeout=1.0) for bus in buses]
    sent = [0, 0]
    acknowledged: list[str] = []
    per_sender = 150
    for _ in range(100_000):
        for k, (bus, outbox) in enumerate(zip(buses, outboxes, strict=True)):
            while sent[k] < per_sender and not outbox.full:
                outbox.put(an_incident(sent[k], bus.boot))
                sent[k] += 1
            bus.wait(0.0)
            for message, _ in outbox.pump():
                acknowledged.append(f"{message.boot}:{message.sequence}")
                # The promise: acknowledged means that a crash cannot lose it any more.
                assert acknowledged[-1] in receiver.saved[0]
        receiver.tick()
        if rng.random() < 0.3:
            receiver.save()
        if rng.random() < 0.02:
            receiver.crash()
            if rng.random() < 0.5:
                clock.advance(0.5)
            receiver.start()
        clock.advance(0.1)
        if len(acknowledged) == 2 * per_sender:
            break
    else:
        pytest.fail(f"only {len(acknowledged)} acknowledged")
    assert sorted(acknowledged) == sorted(set(acknowledged))
    assert sorted(receiver.saved[0]) == sorted(acknowledged)
    assert min(buses[0].faults.values()) > 0


def test_the_same_seed_commits_the_same_faults() -> None:
    def faults(seed: int) -> dict[str, int]:
        clock = ManualClock()
        hub = MemoryHub(clock)
        bus = FaultyBus(hub.join("a"), FaultPlan(seed=seed, drop=0.3, duplicate=0.3), clock)
        for sequence in range(200):
            bus.ask(INCIDENT, an_incident(sequence), 1.0)
        return bus.faults

    assert faults(1) == faults(1)
    assert faults(1) != faults(2)
