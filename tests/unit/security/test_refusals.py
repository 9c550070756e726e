"""What a router says of those it refused."""

from shared.bus.peers import MOST_PEERS, Peers
from shared.bus.refusals import read_log

LOG = (
    b"\x1b[2m2026-11-21T14:05:29.022263Z\x1b[0m \x1b[35mTRACE\x1b[0m rx-0 ThreadId(08) "
    b"\x1b[1mdemux\x1b[0m\x1b[1m{\x1b[0m\x1b[3mzid\x1b[0m\x1b[2m=\x1b[0mf51402 "
    b"\x1b[3msrc\x1b[0m\x1b[2m=\x1b[0msouth:0:client/fa6be29:1\x1b[1m}\x1b[0m: "
    b"zenoh::net::routing::interceptor: Msg intercepted!\n"
    b"2026-11-21T14:05:29.0Z TRACE  rx-1 ThreadId(09) demux{zid=f514 src=south:0:client/fa6be29:1}:"
    b" zenoh::net::routing::interceptor: Msg intercepted!\n"
    b"2026-11-21T14:05:44.9Z  INFO acc-0 ThreadId(05) rt{zid=c3}: "
    b"zenoh::net::routing::interceptor::access_control: cb24cdc28b did not match any configured "
    b"ACL subject. Default permission `Deny` will be applied on all messages\n"
    b"2026-11-21T13:59:13.7Z  WARN acc-0 ThreadId(06) zenoh_link_tls::unicast: received corrupt "
    b"message of type InvalidContentType. Hint: increase the system open file limit.\n"
)


def test_each_kind_of_refusal_is_found_with_whom_it_befell() -> None:
    found = read_log(LOG)
    assert found.messages == {"fa6be29": 2}
    assert found.strangers == ("cb24cdc28b",)
    assert found.connections == {"received corrupt message of type InvalidContentType": 1}


def test_other_lines_say_nothing() -> None:
    found = read_log(b"\xff\xfe hello\n\nMsg intercepted!\nWARN zenoh::other: x\n")
    assert (found.messages, found.strangers, found.connections) == ({}, (), {})


def test_a_session_is_known_by_the_beginning_of_its_identity_also_after_it_left() -> None:
    peers = Peers()
    peers.note("fa6be290", "actor", "tls/10.0.0.2:1", came=True)
    peers.note("fb000000", "learner", "tls/10.0.0.3:1", came=True)
    peers.note("fa6be290", "actor", "tls/10.0.0.2:1", came=False)
    assert peers.who("fa6be29") == {"role": "actor", "address": "tls/10.0.0.2:1"}
    assert peers.who("f")["role"] == "unknown"
    assert peers.who("00")["role"] == "unknown"
    assert [(one.what, one.role) for one in peers.news()] == [
        ("opened", "actor"), ("opened", "learner"), ("closed", "actor"),
    ]  # fmt: skip
    assert peers.news() == []


def test_sessions_without_a_certificate_are_no_news_and_the_list_is_bounded() -> None:
    peers = Peers()
    for number in range(MOST_PEERS + 5):
        peers.note(f"{number:08x}", "", "tcp/127.0.0.1:1", came=True)
    assert peers.news() == []
    assert peers.who("00000000")["role"] == "unknown"
    assert peers.who("00000000") == {"role": "unknown", "zid": "00000000"}
    assert peers.who(f"{MOST_PEERS:08x}") == {"role": "unknown", "address": "tcp/127.0.0.1:1"}
