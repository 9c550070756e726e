from services.study.asks import MAX_KNOWN, MAX_WAITING, Asks
from services.study.view import Reply, ResearcherAsk


def ask(name: str) -> ResearcherAsk:
    return ResearcherAsk(id=name, action="next")


def test_an_ask_is_let_through_once_and_its_reply_is_kept():
    asks = Asks()
    assert asks.put(ask("a")) is None
    assert asks.put(ask("a")) is None
    assert asks.take() == ask("a")
    assert asks.take() is None
    assert asks.put(ask("a")) is None  # taken, not answered yet
    assert asks.take() is None
    reply = Reply(id="a", is_done=True)
    asks.answer(reply)
    assert asks.put(ask("a")) == reply
    assert asks.take() is None


def test_asks_are_taken_in_their_order():
    asks = Asks()
    for name in ("c", "a", "b"):
        asks.put(ask(name))
    assert [taken.id for _ in range(3) if (taken := asks.take())] == ["c", "a", "b"]


def test_what_was_answered_before_a_restart_is_answered_and_not_let_through():
    reply = Reply(id="old", is_done=False, lines=("it was over",))
    asks = Asks([reply])
    assert asks.put(ask("old")) == reply
    assert asks.take() is None


def test_a_full_queue_drops_and_counts_and_takes_the_ask_when_it_is_said_again():
    asks = Asks()
    for k in range(MAX_WAITING):
        asks.put(ask(str(k)))
    assert asks.put(ask("late")) is None
    assert asks.dropped == 1
    assert asks.take() is not None
    asks.put(ask("late"))  # taken is not answered: it is under way
    assert asks.dropped == 2
    asks.answer(Reply(id="0", is_done=True))
    asks.put(ask("late"))
    taken = [taken.id for _ in range(MAX_WAITING) if (taken := asks.take())]
    assert taken[-1] == "late"


def test_whoever_follows_is_told_each_reply():
    asks, told = Asks(), list[Reply]()
    asks.follow(told.append)
    asks.put(ask("a"))
    asks.take()
    asks.answer(Reply(id="a", is_done=True))
    assert told == [Reply(id="a", is_done=True)]


def test_only_the_newest_replies_are_kept():
    asks = Asks(Reply(id=str(k), is_done=True) for k in range(MAX_KNOWN + 1))
    assert asks.put(ask("0")) is None
    assert asks.put(ask("1")) == Reply(id="1", is_done=True)
