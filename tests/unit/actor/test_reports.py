"""Finished bouts reach the league whole, in as few messages as their players allow."""

from typing import Any

import msgspec
import numpy as np

from services.actor.collector import Results
from services.actor.reports import GATHER_BOUTS, GATHER_SECONDS, WINDOW, Reports
from shared.bus.memory import MemoryHub
from shared.clock import ManualClock
from shared.messages.league import BoutResults
from shared.messages.topics import RESULTS
from shared.messages.training import Receipt
from tests.unit.actor.driving import STAGE, TRAIN

LEASE = msgspec.structs.replace(TRAIN, stage=STAGE)
PAIR = ("sha256:" + "a" * 64, "scripted:static")
LATER_PAIR = ("sha256:" + "b" * 64, "scripted:static")


def finished(*bouts: int) -> Results:
    numbers = np.array(bouts, np.int64)
    counts = numbers.astype(np.int32)
    return Results(
        numbers, counts.astype(np.float32), counts, 2 * counts, 3 * counts, counts % 2 == 0,
        np.zeros((0, 2, 8), np.float32),
    )  # fmt: skip


class Desk:
    """An actor's reports, and the league that enters them."""

    def __init__(self) -> None:
        self.clock = ManualClock(30.0)
        hub = MemoryHub(self.clock, max_messages=2 * WINDOW)
        self.inbox = hub.join("league-0").answer(RESULTS)
        self.reports = Reports(hub.join("actor-0"), self.clock, timeout=5.0, model="m" * 64)

    def entered(self, receipt: Receipt | None = None) -> list[BoutResults]:
        """Enter what has come, and let the actor hear it."""
        messages: list[Any] = []
        while (request := self.inbox.take()) is not None:
            messages.append(request.message)
            request.reply(receipt or Receipt(accepted=True))
        self.reports.tick()
        return messages


def test_bouts_of_the_same_players_share_a_message():
    desk = Desk()
    desk.reports.add(LEASE, PAIR, finished(4, 7))
    desk.reports.add(LEASE, PAIR, finished(5))
    assert desk.entered() == []
    assert desk.reports.outstanding == 1
    desk.clock.advance(GATHER_SECONDS)
    desk.reports.tick()
    (message,) = desk.entered()
    assert message.bouts.tolist() == [4, 7, 5]
    assert message.score.tolist() == [4.0, 7.0, 5.0]
    assert message.penalty_steps.tolist() == [8, 14, 10]
    assert message.camping_steps.tolist() == [12, 21, 15]
    assert message.complete.tolist() == [True, False, False]
    assert (message.lease, message.stage, message.kind) == (LEASE.lease, 0, "train")
    assert (message.antagonist, message.protagonist) == PAIR
    assert desk.reports.outstanding == 0


def test_other_players_and_another_lease_end_a_message():
    desk = Desk()
    other = msgspec.structs.replace(LEASE, lease="L000002")
    for lease, pair, bout in ((LEASE, PAIR, 1), (LEASE, LATER_PAIR, 2), (other, LATER_PAIR, 3)):
        desk.reports.add(lease, pair, finished(bout))
    desk.reports.flush()
    messages = desk.entered()
    assert [message.bouts.tolist() for message in messages] == [[1], [2], [3]]
    assert [message.sequence for message in messages] == [0, 1, 2]
    assert [message.lease for message in messages] == ["L000001", "L000001", "L000002"]
    assert [message.antagonist for message in messages] == [PAIR[0], LATER_PAIR[0], LATER_PAIR[0]]


def test_an_evaluation_and_many_bouts_do_not_wait():
    desk = Desk()
    desk.reports.add(msgspec.structs.replace(LEASE, stage=None), PAIR, finished(1, 2))
    (message,) = desk.entered()
    assert (message.kind, message.stage) == ("evaluate", -1)
    desk.reports.add(LEASE, PAIR, finished(*range(GATHER_BOUTS)))
    (message,) = desk.entered()
    assert len(message.bouts) == GATHER_BOUTS


def test_nothing_is_sent_when_nothing_ended():
    desk = Desk()
    desk.reports.flush()
    desk.clock.advance(2 * GATHER_SECONDS)
    assert not desk.reports.tick()
    assert desk.entered() == []


def test_a_league_that_does_not_answer_fills_the_window_and_loses_nothing():
    desk = Desk()
    added = 0
    while not desk.reports.full:
        pair = PAIR if added % 2 else LATER_PAIR
        desk.reports.add(LEASE, pair, finished(added))
        added += 1
    desk.reports.flush()
    assert desk.reports.outstanding >= WINDOW
    messages = desk.entered()
    assert [message.bouts.tolist() for message in messages] == [[n] for n in range(added)]
    assert desk.reports.outstanding == 0
    assert not desk.reports.full


def test_a_refusal_is_told():
    desk = Desk()
    desk.reports.add(LEASE, PAIR, finished(1))
    desk.reports.flush()
    desk.entered(Receipt(accepted=False, reason="no such lease"))
    assert desk.reports.last_error.endswith("dropped: no such lease")
