"""Queues, keys and configuration of the bus."""

import json
from typing import Any

import msgspec
import pytest

from services.actor.config import ActorConfig
from shared.bus.config import MAX_MESSAGE, BusConfig, client_json, router_json
from shared.bus.keys import key_of, matches, pattern_of
from shared.bus.latest import LatestSent, read_stamp, stamp_of
from shared.bus.memory import MemoryHub
from shared.bus.queues import MAX_KEYS, Fifo, Newest
from shared.clock import ManualClock
from shared.errors import ConfigError, MessageError
from shared.messages.topics import SERVICES, TOPICS


def test_a_fifo_is_bounded_by_number_and_by_bytes() -> None:
    fifo = Fifo[str](max_items=3, max_bytes=10)
    assert fifo.offer("a", 4)
    assert fifo.offer("b", 6)
    assert not fifo.offer("c", 1)
    assert fifo.push("c", 1) == 1
    assert [fifo.pop(), fifo.pop(), fifo.pop()] == ["b", "c", None]
    assert fifo.offer("larger than all", 99)


def test_newest_keeps_one_value_a_key_and_never_goes_back() -> None:
    newest = Newest[str]()
    assert newest.offer("k", "b0", 3, "third")
    assert newest.offer("k", "b0", 4, "fourth")
    assert not newest.offer("k", "b0", 3, "third again")
    assert newest.pop() == "fourth"
    assert not newest.offer("k", "b0", 4, "fourth again")
    assert newest.offer("k", "b1", 0, "restarted")
    assert newest.pop() == "restarted"
    assert newest.pop() is None


def test_newest_is_bounded_in_keys_and_forgets_who_was_silent_longest() -> None:
    newest = Newest[int]()
    for number in range(MAX_KEYS):
        assert newest.offer(str(number), "b", 0, number)
    assert not newest.offer("0", "b", 0, 0)  # said again: alive
    assert newest.offer("one more", "b", 0, -1)
    assert not newest.offer("0", "b", 0, 0)
    waiting = [newest.pop() for _ in range(MAX_KEYS)]
    assert newest.pop() is None
    assert waiting == [0, *range(2, MAX_KEYS), -1]  # "1" is forgotten
    assert newest.offer("1", "b", 1, 1)


def test_names_that_change_for_ever_make_nobody_deaf() -> None:
    newest = Newest[int]()
    for number in range(3 * MAX_KEYS):
        assert newest.offer(f"actor-{number}", "b", 0, number)
        assert newest.pop() == number


def test_a_latest_value_is_due_again_after_its_period() -> None:
    latest = LatestSent(period=1.0)
    latest.keep("a", b"old", stamp_of("b0", 0), now=0.0)
    latest.keep("a", b"new", stamp_of("b0", 1), now=0.5)
    assert latest.due(1.4) == []
    assert [sent.payload for sent in latest.due(1.5)] == [b"new"]
    assert latest.due(2.4) == []
    assert len(latest.due(2.5)) == len(latest.all()) == 1


@pytest.mark.parametrize("stamp", [b"", b"b0", b"b0:", b":1", b"b0:-1", b"b0:1x", b"b" * 99])
def test_what_is_not_a_stamp_is_refused(stamp: bytes) -> None:
    assert read_stamp(stamp_of("b0", 12)) == ("b0", 12)
    with pytest.raises(MessageError, match="expected boot:count"):
        read_stamp(stamp)


def test_endpoints_of_a_command_line_are_checked_as_those_of_a_file() -> None:
    cfg = BusConfig().with_endpoints(connect=("tcp/127.0.0.2:1",), listen=("tcp/[::1]:2",))
    assert (cfg.connect, cfg.listen) == (("tcp/127.0.0.2:1",), ("tcp/[::1]:2",))
    assert BusConfig().with_endpoints() == BusConfig()
    with pytest.raises(ConfigError, match="connect has 'nowhere', expected an endpoint"):
        BusConfig().with_endpoints(connect=("nowhere",))


def test_keys_are_filled_in_completely() -> None:
    assert key_of("learner/{agent}/policy", {"agent": "antagonist"}) == "learner/antagonist/policy"
    assert pattern_of("status/{role}/{name}", {"role": "actor"}) == "status/actor/*"
    assert matches("status/actor/*", "status/actor/actor-0")
    assert not matches("status/actor/*", "status/actor/a/b")
    assert not matches("status/actor/*", "status/league/a")


@pytest.mark.parametrize(
    ("fields", "what"),
    [
        ({}, "needs agent"),
        ({"agent": "a", "name": "b"}, "has no field name"),
        ({"agent": "a/b"}, "must be 1 to 255 letters"),
        ({"agent": "*"}, "must be 1 to 255 letters"),
        ({"agent": ""}, "must be 1 to 255 letters"),
    ],
)
def test_a_key_that_cannot_be_is_refused(fields: dict[str, str], what: str) -> None:
    with pytest.raises(ValueError, match=what):
        key_of("learner/{agent}/policy", fields)


def test_no_two_topics_share_a_key() -> None:
    keys = [entry.key for entry in (*TOPICS, *SERVICES)]
    assert len(keys) == len(set(keys))


@pytest.mark.parametrize(
    ("change", "what"),
    [
        ({"connect": ("localhost:7447",)}, "expected an endpoint such as tcp/127.0.0.1:7447"),
        ({"connect": (), "listen": ()}, "connect and listen are both empty"),
        ({"lease_seconds": 0.0}, "lease_seconds (0.0 s) must be between 0.1 and 3600"),
        ({"watchdog_seconds": 9.0, "give_up_seconds": 5.0}, "give_up_seconds (5.0) must be at"),
        ({"inbox_messages": 0}, "inbox_messages (0) must be between 1 and 65536"),
    ],
)
def test_a_bus_section_out_of_range_is_refused(change: dict[str, Any], what: str) -> None:
    with pytest.raises(msgspec.ValidationError) as error:
        msgspec.convert(change, BusConfig)
    assert what in str(error.value)


def test_nobody_is_searched_for_and_clients_listen_to_nothing() -> None:
    cfg = BusConfig(connect=("tcp/127.0.0.2:7447",))
    client, router = json.loads(client_json(cfg, "operator")), json.loads(router_json(cfg))
    for config in (client, router):
        assert config["scouting"] == {
            "multicast": {"enabled": False}, "gossip": {"enabled": False},
        }  # fmt: skip
        assert config["adminspace"] == {"enabled": False}
        assert config["transport"]["link"]["rx"]["max_message_size"] == MAX_MESSAGE
    assert client["listen"] == {"endpoints": []}
    assert client["connect"]["endpoints"] == ["tcp/127.0.0.2:7447"]
    assert router["listen"]["endpoints"] == ["tcp/127.0.0.1:7447"]


def test_only_those_that_send_rollouts_hold_memory_for_others() -> None:
    def pool(text: str) -> dict[str, Any]:
        return json.loads(text)["transport"]["shared_memory"]["transport_optimization"]

    others = [client_json(BusConfig(), "learner"), router_json(BusConfig())]
    assert [pool(other)["enabled"] for other in others] == [False, False]
    actor = pool(client_json(BusConfig(), "actor"))
    sizes = ActorConfig()
    rollout = 168 * sizes.num_envs * sizes.rollout_steps  # bytes
    assert actor["enabled"]
    assert actor["pool_size"] > 4 * rollout  # what a batch consists of


def test_a_boot_in_memory_depends_only_on_the_name_and_how_often_it_joined() -> None:
    first, second = MemoryHub(ManualClock()), MemoryHub(ManualClock())
    first.join("other")
    assert first.join("a").boot == second.join("a").boot
    assert first.join("a").boot == second.join("a").boot
    assert second.join("a").boot != second.join("a").boot
    assert first.join("b", boot="f00d").boot == "f00d"
