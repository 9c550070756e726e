"""A learner on a memory bus, with a league and an actor played by hand."""

import resource
from pathlib import Path
from typing import Any

import msgpack
import msgspec
import numpy as np
import pytest

from services.learner.checkpoint import CheckpointStore
from services.learner.config import LearnerConfig
from services.learner.intake import UNKNOWN_LEASE_SECONDS
from services.learner.service import Learner, RunFacts
from shared.bus.base import Refused, Request
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.errors import CheckpointError, RiposteError
from shared.game.rules import RuleBook
from shared.messages.league import Incident, Leases, LeaseSummary, Schedule, Stage
from shared.messages.message import Message
from shared.messages.topics import INCIDENT, LEASES, POLICY, ROLLOUT, SCHEDULE, VERSION, Service
from shared.messages.training import (
    PolicyAnnouncement,
    Receipt,
    Rollout,
    VersionReceipt,
    VersionReport,
)
from shared.messages.wire import encode
from shared.policy.snapshot import unpack
from tests.unit.learner.making import BOUT_STEPS, MODEL, SMALL, rollout
from tests.unit.learner.test_gate import LEASE, STAGE
from tests.unit.policy.making import FIT

FACTS = RunFacts(run="run-1", seed=3, fit=FIT, rules=RuleBook(bout_steps=BOUT_STEPS))


class Table:
    """A learner with everybody it talks to, in one thread."""

    def __init__(self, folder: Path, cfg: LearnerConfig = SMALL) -> None:
        self.folder, self.cfg = folder, cfg
        self.clock = ManualClock(50.0)
        self.hub = MemoryHub(self.clock)
        self.league, self.actor = self.hub.join("league-0"), self.hub.join("actor-0")
        self.versions = self.league.answer(VERSION)
        self.incidents = self.league.answer(INCIDENT)
        self.policies = self.actor.subscribe(POLICY)
        self.sequence = -1
        self.boots = 0
        self.start()

    def start(self) -> None:
        self.bus = self.hub.join("learner-antagonist")
        self.learner = Learner(self.cfg, "antagonist", FACTS, self.folder, self.bus, self.clock)

    def kill(self) -> None:
        """End the process where it stands."""
        self.bus.close()

    def restart(self) -> None:
        self.kill()
        self.start()

    def schedule(
        self, stage: Stage | None = STAGE, leases: tuple[LeaseSummary, ...] = (LEASE,)
    ) -> None:
        self.league.publish(SCHEDULE, Schedule(stage=stage, versions={}))
        self.league.publish(LEASES, Leases(leases=leases))
        self.learner.tick()

    def report(self) -> Request[VersionReport, VersionReceipt]:
        """The version that the learner reports now."""
        self.learner.tick()
        request = self.versions.take()
        assert request is not None, "no version was reported"
        return request

    def accept(self, stage: int = 0) -> VersionReport:
        """Enter the version that is reported in the ledger, and tell."""
        request = self.report()
        request.reply(
            VersionReceipt(
                accepted=True, latest_version=request.message.policy_version, stage=stage
            )
        )
        self.learner.tick()
        return request.message

    def send(self, message: Rollout | None = None, **changes: Any) -> Any:
        """Hand a rollout over, as an actor does; return the pending answer."""
        if message is None:
            self.sequence += 1
            changes = {"policy_version": self.learner.version} | changes
            message = rollout(self.sequence, **changes)
        pending = self.actor.ask(ROLLOUT, message, 60.0, agent="antagonist")
        self.learner.tick()
        return pending

    def ready(self) -> None:
        """Version 0 is entered, the first stage runs."""
        self.accept(stage=0)
        self.schedule()

    def warm(self) -> None:
        """Version 1 is entered too: the next rollouts are learned from."""
        self.ready()
        self.send()
        self.accept()
        self.announced()

    def announced(self) -> list[int]:
        found: list[int] = []
        while (policy := self.policies.take()) is not None:
            found.append(policy.policy_version)
        return found

    @property
    def counters(self) -> dict[str, int]:
        return self.learner.health().counters


@pytest.fixture
def table(tmp_path: Path) -> Table:
    return Table(tmp_path)


def test_a_fresh_learner_announces_version_0_once_the_ledger_has_it(table: Table):
    request = table.report()
    assert (request.message.policy_version, request.message.stage) == (0, -1)
    assert request.message.rollouts == ()
    assert table.announced() == []
    assert table.learner.health().waiting_for.startswith("league")
    request.reply(VersionReceipt(accepted=True, latest_version=0, stage=0))
    table.learner.tick()
    policy: PolicyAnnouncement | None = table.policies.take()
    assert policy is not None
    card = unpack(policy.payload.tobytes(), policy.snapshot).card
    assert (card.agent, card.policy_version, card.run) == ("antagonist", 0, "run-1")
    assert (card.model, card.hidden_dims) == (MODEL, (16, 16))
    unpack(policy.payload.tobytes()).check_fits(FIT)


def test_a_silent_league_is_asked_again_and_nothing_is_announced(table: Table):
    first = table.report().message
    for _ in range(3):
        table.clock.advance(6.0)
        table.learner.tick()
        table.clock.advance(0.3)
        table.learner.tick()
    again = table.versions.take()
    assert again is not None
    assert again.message.snapshot == first.snapshot
    assert table.announced() == []


def test_a_rollout_is_acknowledged_after_the_checkpoint_and_the_ledger_and_not_before(
    table: Table,
):
    table.ready()
    table.announced()
    pending = table.send()
    assert CheckpointStore(table.folder, "run-1", "antagonist", 3).versions() == [1, 0]
    request = table.report()
    assert request.message.rollouts == ("b0:0",)
    assert pending.take() is None
    assert table.announced() == []
    request.reply(VersionReceipt(accepted=True, latest_version=1, stage=0))
    assert pending.take() is None
    table.learner.tick()
    assert pending.take() == Receipt(accepted=True)
    assert table.announced() == [1]


def test_warm_up_teaches_the_normaliser_and_the_next_version_learns(table: Table):
    table.ready()
    table.send()
    warmed = table.accept()
    assert warmed.metrics is None
    table.send()
    learned = table.accept()
    assert learned.metrics is not None
    assert learned.metrics.samples == learned.metrics.total_samples == 64
    assert learned.metrics.policy_lag_mean == 0.0
    assert learned.stage == 0
    weights = [unpack(r.payload.tobytes()).weights for r in (warmed, learned)]
    assert not np.array_equal(weights[0].layers[0][0], weights[1].layers[0][0])


def test_an_update_waits_for_enough_samples_and_takes_all_there_are(tmp_path: Path):
    table = Table(tmp_path, msgspec.structs.replace(SMALL, batch_samples=150))
    table.warm()
    pendings = [table.send() for _ in range(2)]
    assert table.learner.version == 1
    pendings.append(table.send())
    report = table.accept()
    assert report.policy_version == 2
    assert report.rollouts == ("b0:1", "b0:2", "b0:3")
    assert report.metrics is not None
    assert report.metrics.samples == 192
    assert all(pending.take() == Receipt(accepted=True) for pending in pendings)


def test_a_rollout_sent_again_before_the_update_counts_once(tmp_path: Path):
    table = Table(tmp_path, msgspec.structs.replace(SMALL, batch_samples=128))
    table.warm()
    message = rollout(5, policy_version=1)
    table.send(message)
    again = table.send(message)
    assert table.learner.version == 1
    table.send(rollout(6, policy_version=1))
    report = table.accept()
    assert report.rollouts == ("b0:5", "b0:6")
    assert again.take() == Receipt(accepted=True)
    assert table.counters["rollouts_repeated"] == 1


def test_a_rollout_sent_again_after_its_acknowledgement_is_answered_and_not_learned(
    table: Table,
):
    table.warm()
    message = rollout(5, policy_version=1)
    table.send(message)
    table.accept()
    again = table.send(message)
    assert again.take() == Receipt(accepted=True)
    assert table.learner.version == 2
    assert table.versions.take() is None


def test_a_rollout_sent_again_while_its_version_is_being_entered_waits_for_that(table: Table):
    table.warm()
    message = rollout(5, policy_version=1)
    table.send(message)
    request = table.report()
    again = table.send(message)
    assert again.take() is None
    request.reply(VersionReceipt(accepted=True, latest_version=2, stage=0))
    table.learner.tick()
    assert again.take() == Receipt(accepted=True)
    assert table.send(message).take() == Receipt(accepted=True)


def test_a_learner_killed_before_its_update_gets_the_rollouts_again(tmp_path: Path):
    table = Table(tmp_path, msgspec.structs.replace(SMALL, batch_samples=128))
    table.warm()
    messages = [rollout(5, policy_version=1), rollout(6, policy_version=1)]
    table.send(messages[0])
    table.restart()
    table.accept()
    table.schedule()
    for message in messages:
        table.send(message)
    assert table.accept().rollouts == ("b0:5", "b0:6")


def test_a_learner_killed_between_checkpoint_and_ledger_reports_the_same_version_again(
    table: Table,
):
    table.warm()
    message = rollout(5, policy_version=1)
    table.send(message)
    before = table.report().message
    table.restart()
    table.schedule()
    again = table.send(message).take()
    assert isinstance(again, Refused)
    assert again.retry
    after = table.accept()
    assert (after.policy_version, after.snapshot) == (before.policy_version, before.snapshot)
    assert (after.rollouts, after.metrics) == (before.rollouts, before.metrics)
    assert table.send(message).take() == Receipt(accepted=True)
    assert table.learner.version == 2


def test_a_learner_killed_and_restarted_makes_the_same_versions_bit_for_bit(tmp_path: Path):
    digests: list[list[str]] = []
    for restarts in (False, True):
        table = Table(tmp_path / str(restarts))
        table.warm()
        made: list[str] = []
        for number in range(3):
            if restarts:
                table.restart()
                table.accept()
                table.schedule()
            table.send(rollout(10 + number, policy_version=table.learner.version))
            made.append(table.accept().snapshot)
        digests.append(made)
    assert digests[0] == digests[1]


def test_a_corrupt_newest_checkpoint_is_said_and_the_one_before_continues(table: Table):
    table.warm()
    table.send()
    table.accept()
    path = CheckpointStore(table.folder, "run-1", "antagonist", 3).path(2)
    path.write_bytes(path.read_bytes()[:-10])
    table.restart()
    assert table.learner.version == 1
    assert "damaged" in table.learner.health().last_error
    incident: Request[Incident, Receipt] | None = None
    table.learner.tick()
    incident = table.incidents.take()
    assert incident is not None
    assert incident.message.kind == "checkpoint_corrupt"
    assert "continued from version 1" in incident.message.detail


def test_without_a_usable_checkpoint_it_does_not_start(table: Table):
    table.warm()
    for path in table.folder.glob("*.safetensors"):
        path.write_bytes(b"")
    table.kill()
    with pytest.raises(CheckpointError, match="no usable checkpoint"):
        table.start()


def test_a_version_that_the_ledger_holds_with_other_weights_gets_the_next_number(table: Table):
    table.warm()
    pending = table.send()
    request = table.report()
    request.reply(VersionReceipt(accepted=False, latest_version=7, stage=0, reason="it is another"))
    renumbered = table.accept()
    assert renumbered.policy_version == 8
    assert renumbered.rollouts == request.message.rollouts
    assert pending.take() == Receipt(accepted=True)
    assert table.announced() == [8]
    incident = table.incidents.take()
    assert incident is not None
    assert incident.message.kind == "version_renumbered"
    assert CheckpointStore(table.folder, "run-1", "antagonist", 3).versions()[0] == 8


def test_what_was_learned_elsewhere_is_never_learned_again_not_even_after_a_kill(table: Table):
    table.warm()
    lost = rollout(50, policy_version=1)
    table.send()
    request = table.report()
    elsewhere = (f"{lost.boot}:40-60", f"{lost.boot}:nonsense", f"{lost.boot}:9-1")
    request.reply(
        VersionReceipt(
            accepted=False, latest_version=7, stage=0, reason="it is another",
            learned_elsewhere=elsewhere,
        )
    )  # fmt: skip
    table.learner.tick()  # the checkpoint of version 8 is on the disk
    table.restart()
    table.accept()
    table.schedule()
    again = table.send(msgspec.structs.replace(lost, policy_version=8))
    assert again.take() == Receipt(accepted=True)
    assert table.counters["rollouts_accepted"] == 0


def test_what_the_ledger_has_behind_another_version_is_not_claimed_once_more(table: Table):
    table.warm()
    table.send()
    request = table.report()
    (name,) = request.message.rollouts
    boot, _, number = name.partition(":")
    request.reply(
        VersionReceipt(
            accepted=False, latest_version=7, stage=0, reason="it is another",
            learned_elsewhere=(f"{boot}:{number}-{number}",),
        )
    )  # fmt: skip
    renumbered = table.accept()
    assert (renumbered.policy_version, renumbered.rollouts, renumbered.metrics) == (8, (), None)


def test_whatever_a_rollout_quotes_the_learner_answers_and_lives(patient: Table):
    patient.warm()
    answer = patient.send(rollout(100, policy_version=1, actor="x" * 16_000)).take()
    assert isinstance(answer, Receipt)
    assert answer.reason.startswith("wrong actor: xxx")
    assert answer.reason.endswith("characters)")
    assert len(patient.learner.health().last_error) < 600


def test_a_version_that_the_league_will_never_take_ends_the_learner(table: Table):
    request = table.report()
    request.refuse("it is no snapshot")
    with pytest.raises(RiposteError, match="the league refused version 0: it is no snapshot"):
        table.learner.tick()


def test_a_full_disk_ends_the_learner_with_nothing_acknowledged_and_nothing_lost(table: Table):
    table.warm()
    message = rollout(5, policy_version=1)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (64, before[1]))
    try:
        with pytest.raises(RiposteError, match="no space left"):
            table.send(message)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert table.versions.take() is None
    table.restart()
    table.accept()
    table.schedule()
    pending = table.send(message)
    table.accept()
    assert pending.take() == Receipt(accepted=True)


def test_when_the_stage_ends_what_was_gathered_is_answered_and_not_learned(tmp_path: Path):
    table = Table(tmp_path, msgspec.structs.replace(SMALL, batch_samples=128))
    table.warm()
    pending = table.send()
    table.schedule(msgspec.structs.replace(STAGE, index=1, agent="protagonist"), ())
    assert pending.take() == Receipt(accepted=False, reason="the stage is over")
    assert table.learner.version == 1
    assert table.send().take() == Receipt(accepted=False, reason="stage 0 is over")


def test_the_receipt_of_a_version_may_end_the_stage_before_the_schedule_does(tmp_path: Path):
    table = Table(tmp_path)
    table.warm()
    table.send()
    left_over = table.send(rollout(9, policy_version=1))
    table.accept(stage=1)
    assert left_over.take() == Receipt(accepted=False, reason="the stage is over")
    assert table.learner.version == 2


# -- bad rollouts: each is dropped with its reason, and the good ones around it are learned from --


@pytest.fixture
def patient(tmp_path: Path) -> Table:
    """A learner that updates with two rollouts."""
    return Table(tmp_path, msgspec.structs.replace(SMALL, batch_samples=128))


def drop_reason(table: Table, **changes: Any) -> str:
    """Send a bad rollout between two good ones; return why it was dropped."""
    table.warm()
    good = [table.send()]
    bad = table.send(rollout(100, **({"policy_version": 1} | changes)))
    good.append(table.send())
    report = table.accept()
    assert [pending.take() for pending in good] == [Receipt(accepted=True)] * 2
    assert report.rollouts == ("b0:1", "b0:2")
    answer = bad.take()
    assert isinstance(answer, Receipt)
    assert not answer.accepted
    assert table.counters["rollouts_dropped"] == 1
    came_late = answer.reason.startswith(("stale", "stage"))
    assert (answer.reason in table.learner.health().last_error) != came_late
    incident = table.incidents.take()
    assert (incident is None) == came_late  # only what somebody got wrong is for the report
    return answer.reason


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"opponent": "sha256:" + "b" * 64}, "mixed opponents"),
        ({"policy_version": 0}, "stale: version 0, now 1, oldest 1"),
        ({"model": "x" * 64}, "model xxxxxxxxxxxx"),
        ({"actor": "actor-7"}, "wrong actor"),
        ({"agent": "protagonist"}, "it is for the protagonist"),
        ({"log_probs": np.zeros((8, 8), np.float32)}, "log probabilities"),
        ({"truncated": np.ones(8, np.bool_)}, "truncated does not say"),
        ({"bouts": np.zeros(8, np.int64)}, "a bout stands in two worlds"),
        ({"stds": np.zeros(6, np.float32)}, "standard deviations"),
        ({"bouts": rollout(1).bouts}, "replayed: bout"),  # another name, the same play
    ],
)
def test_a_bad_rollout_is_dropped_and_the_good_ones_are_learned_from(
    patient: Table, changes: Any, reason: str
):
    assert reason in drop_reason(patient, **changes)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"lease": "L000777"}, "unknown bout: lease L000777"),
        ({"policy_version": 9}, "version 9 is not made here yet"),
        ({"stage": 5}, "stage 5 is not known here yet"),
    ],
)
def test_what_may_become_known_is_asked_again_for_a_while_and_then_dropped(
    table: Table, changes: Any, reason: str
):
    table.warm()
    odd = rollout(100, **({"policy_version": 1} | changes))
    answer = table.send(odd).take()
    assert answer == Refused(answer.reason, retry=True)
    assert reason in answer.reason
    table.clock.advance(UNKNOWN_LEASE_SECONDS + 0.1)
    answer = table.send(odd).take()
    assert isinstance(answer, Receipt)
    assert not answer.accepted
    assert reason in answer.reason
    good = table.send()
    table.accept()
    assert good.take() == Receipt(accepted=True)


def test_a_lease_that_becomes_known_is_learned_from(table: Table):
    table.warm()
    message = rollout(100, policy_version=1, lease="L000002")
    assert isinstance(table.send(message).take(), Refused)
    table.schedule(leases=(LEASE, msgspec.structs.replace(LEASE, lease="L000002")))
    pending = table.send(message)
    table.accept()
    assert pending.take() == Receipt(accepted=True)


def rewritten(message: Message, **changes: Any) -> bytes:
    """The bytes of a message with another header entry, and a checksum that is right."""
    import zlib

    payload = encode(message)
    length = int.from_bytes(payload[4:8], "little")
    header = msgpack.unpackb(payload[12 : 12 + length])
    base = 12 + length + -(12 + length) % 8
    header |= changes
    packed = msgpack.packb(header)
    start = payload[:4] + len(packed).to_bytes(4, "little")
    rest = packed + bytes(-(12 + len(packed)) % 8) + payload[base:]
    return start + zlib.crc32(rest, zlib.crc32(start)).to_bytes(4, "little") + rest


class Answered:
    """Keeps what comes back to an asker that sends raw bytes."""

    def __init__(self) -> None:
        self.outcome: Any = None

    def reply(self, payload: bytes) -> None:
        self.outcome = payload

    def refuse(self, refusal: Refused) -> None:
        self.outcome = refusal

    def drop(self) -> None:
        self.outcome = None


def send_raw(table: Table, payload: bytes) -> Refused:
    (inbox,) = table.bus.inboxes
    back = Answered()
    if inbox.accepts(len(payload), back):
        inbox.offer(payload, back)
    table.learner.tick()
    assert isinstance(back.outcome, Refused)
    assert not back.outcome.retry
    return back.outcome


def with_nan() -> Rollout:
    rewards = np.zeros((8, 8), np.float32)
    rewards[2, 2] = np.nan
    return rollout(100, rewards=rewards)


def wrong_shape() -> bytes:
    table = [
        [name, dtype, [4, 16, 27] if name == "obs" else shape, offset]
        for name, dtype, shape, offset in _arrays(rollout(100))
    ]
    return rewritten(rollout(100), arrays=table)


def _arrays(message: Message) -> list[Any]:
    payload = encode(message)
    return msgpack.unpackb(payload[12 : 12 + int.from_bytes(payload[4:8], "little")])["arrays"]


@pytest.mark.parametrize(
    ("payload", "reason"),
    [
        (encode(with_nan()), "rewards is not finite"),
        (wrong_shape(), "shape"),
        (rewritten(rollout(100), schema="Rollout:0123456789abcdef"), "has schema"),
        (encode(rollout(100))[:-7], "B long"),
        (b"junk", "shorter than the prefix"),
        (bytes(ROLLOUT.max_bytes + 1), "over its limit"),
    ],
    ids=["nan", "shape", "schema", "cut", "junk", "oversize"],
)
def test_bytes_that_are_no_rollout_are_refused_by_name_and_the_good_ones_are_learned_from(
    patient: Table, payload: bytes, reason: str
):
    table = patient
    table.warm()
    good = [table.send()]
    refusal = send_raw(table, payload)
    assert reason in refusal.reason
    assert table.bus.counters["refused_messages"] == 1
    good.append(table.send())
    table.accept()
    assert [pending.take() for pending in good] == [Receipt(accepted=True)] * 2


def test_another_message_under_the_key_is_refused(table: Table):
    table.warm()
    other = Service(ROLLOUT.key, Incident, Receipt, 4096, 4096, "a", "b", "c")
    incident = Incident(source="a", boot="b", sequence=0, kind="c", detail="d", at_ns=0)
    pending = table.actor.ask(other, incident, 1.0, agent="antagonist")
    table.learner.tick()
    answer = pending.take()
    assert isinstance(answer, Refused)
    assert "has schema" in answer.reason


def test_more_rollouts_than_it_can_hold_are_asked_again(tmp_path: Path):
    table = Table(tmp_path)
    table.warm()
    table.send()
    table.report()  # never answered: the learner waits for the ledger
    answers = [table.send(rollout(20 + n, policy_version=1)).take() for n in range(6)]
    held = [answer for answer in answers if answer is None]
    turned_away = [answer for answer in answers if isinstance(answer, Refused) and answer.retry]
    assert (len(held), len(turned_away)) == (4, 2)
    table.clock.advance(UNKNOWN_LEASE_SECONDS + 0.1)  # the league is away for long: nobody's fault
    again = table.send(rollout(25, policy_version=1)).take()
    assert again == Refused("enough rollouts are held here", retry=True)
    assert not table.learner.health().last_error


def test_health_says_what_it_waits_for(table: Table):
    assert table.learner.health().waiting_for.startswith("league")
    table.ready()
    health = table.learner.health()
    assert health.waiting_for == "actors: rollouts"
    assert health.state == "version 0: 0 of 64 samples"
    table.schedule(msgspec.structs.replace(STAGE, index=1, agent="protagonist"), ())
    assert table.learner.health().state == "version 0, not in turn"


def test_the_learning_rate_falls_on_a_line_over_the_stage_and_a_restart_does_not_move_it(
    tmp_path: Path,
):
    cfg = msgspec.structs.replace(SMALL, learning_rate=1e-3, final_learning_rate=4e-4)
    table = Table(tmp_path, cfg)
    table.warm()  # the first of the stage's three updates
    rates: list[float] = []
    for _ in range(2):
        table.send()
        metrics = table.accept().metrics
        assert metrics is not None
        rates.append(metrics.learning_rate)
        table.restart()
        table.accept()
        table.schedule()
    assert rates == pytest.approx([8e-4, 6e-4])
