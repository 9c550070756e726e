"""The study's server over real sockets, with the client of the same library."""

import contextlib
import json
import stat
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from services.study.asks import MAX_WAITING, Asks
from services.study.view import MAX_BYTES, ParticipantAsk, Reply, ResearcherAsk
from services.study.web import MAX_PAGES, STATIC, TOO_MANY, Web, token_of
from shared.errors import ConfigError
from shared.runtime.talk import TAKEN_OVER
from tests.integration.study_pages.rig import TOKEN
from tests.integration.study_pages.views import participant, researcher

ARM = '{"id":"%s","action":"arm"}'
READY = '{"id":"%s","action":"ready","step":"s1"}'


@pytest.fixture
def web() -> Iterator[Web]:
    made = Web("127.0.0.1", 0, ("http://tablet:8766",), token=TOKEN, asks=Asks())
    yield made
    made.close()


def base(web: Web) -> str:
    return f"http://127.0.0.1:{web.port}"


def opened(web: Web, path: str, origin: str | None = None) -> ClientConnection:
    return connect(
        f"ws://127.0.0.1:{web.port}{path}", origin=origin or base(web),  # type: ignore[arg-type]
        compression=None, open_timeout=5, close_timeout=1,
    )  # fmt: skip


def steering(web: Web) -> ClientConnection:
    return opened(web, f"/researcher/socket?token={TOKEN}")


def answering(web: Web) -> ClientConnection:
    return opened(web, "/participant/socket")


def fetch(web: Web, path: str, **headers: str) -> tuple[int, bytes, dict[str, str]]:
    request = urllib.request.Request(base(web) + path, headers=headers)
    try:
        with urllib.request.urlopen(request, timeout=5) as answer:
            return answer.status, answer.read(), dict(answer.headers)
    except urllib.error.HTTPError as error:
        with error:
            return error.code, error.read(), dict(error.headers)


def until(condition: Callable[[], object], seconds: float = 5.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def test_both_pages_are_served_and_nothing_else(web: Web):
    status, body, headers = fetch(web, "/participant")
    assert status == 200
    assert b"participant.js" in body
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "unsafe" not in policy
    assert headers["Referrer-Policy"] == "no-referrer"  # the token is in the address
    assert fetch(web, web.researcher_url.removeprefix(base(web)))[0] == 200
    for path in ("/", "/view.py", "/../web.py", "/%2e%2e/web.py", "/researcher.html"):
        assert fetch(web, path)[0] == 404, path


def test_the_pages_make_no_html_of_text_and_fetch_nothing_from_elsewhere():
    for path in STATIC.iterdir():
        text = path.read_text("utf-8")
        for word in ("innerHTML", "outerHTML", "insertAdjacentHTML", "document.write", "eval("):
            assert word not in text, (path.name, word)
        assert "https://" not in text, path.name


@pytest.mark.parametrize("query", ["", "?token=", "?token=x", f"?token={TOKEN[:-1]}", "?token=%ff"])
@pytest.mark.parametrize("path", ["/researcher", "/researcher/socket"])
def test_without_its_token_nobody_has_the_researchers_page(web: Web, path: str, query: str):
    status, body, _ = fetch(web, path + query)
    assert status == 403
    assert b"open the address that the terminal shows" in body
    with pytest.raises(InvalidStatus) as caught:
        opened(web, "/researcher/socket" + query)
    assert caught.value.response.status_code == 403
    assert web.counters["pages"] == 0


@pytest.mark.parametrize("origin", ["http://evil.example", "http://127.0.0.1:1", "null"])
def test_a_foreign_page_is_refused_even_with_the_token(web: Web, origin: str):
    for path in ("/participant/socket", f"/researcher/socket?token={TOKEN}"):
        with pytest.raises(InvalidStatus) as caught:
            opened(web, path, origin)
        assert caught.value.response.status_code == 403
    assert "study.origins" in web.last_refusal


def test_a_foreign_name_for_this_machine_is_refused(web: Web):
    assert fetch(web, "/participant", Host="evil.example")[0] == 403
    assert fetch(web, "/participant", Host="tablet:8766")[0] == 200


def test_a_participant_cannot_steer(web: Web):
    with answering(web) as page:
        for k, action in enumerate(("begin", "next", "abort", "arm", "disarm", "reset", "void")):
            page.send(f'{{"id":"x{k}","action":"{action}","step":"s1"}}')
            page.send(f'{{"id":"y{k}","action":"{action}"}}')
        until(lambda: web.counters["messages_refused"] == 14)
        page.send(READY % "a")
        until(lambda: (ask := web._asks.take()) is None or ask.action == "ready")


def test_views_and_replies_reach_the_page_they_are_for(web: Web):
    with steering(web) as first, steering(web) as second, answering(web) as page:
        until(lambda: web.counters["pages"] == 3)
        web.show(researcher(), participant("rest", seconds_left=4.0))
        assert json.loads(first.recv(timeout=5))["view"]["participant"] == "sub-04"
        assert json.loads(second.recv(timeout=5))["view"]["participant"] == "sub-04"
        text = page.recv(timeout=5)
        assert json.loads(text)["view"]["screen"] == "rest"
        assert "warm-start" not in text
        first.send(ARM % "a1")
        page.send(READY % "b1")
        taken: dict[str, ResearcherAsk | ParticipantAsk] = {}

        def both() -> bool:
            while (ask := web._asks.take()) is not None:
                taken[ask.id] = ask
            return len(taken) == 2

        until(both)
        assert isinstance(taken["a1"], ResearcherAsk)
        assert isinstance(taken["b1"], ParticipantAsk)
        web._asks.answer(Reply(id="a1", is_done=False, lines=("the tool moves",)))
        web._asks.answer(Reply(id="b1", is_done=True))
        said = json.loads(first.recv(timeout=5))
        assert said["reply"] == {"id": "a1", "is_done": False, "lines": ["the tool moves"]}
        assert json.loads(page.recv(timeout=5))["reply"]["id"] == "b1"
        page.send(READY % "b1")  # the reply was lost: it is told again, and not asked again
        assert json.loads(page.recv(timeout=5))["reply"]["is_done"]
        assert web._asks.take() is None
        with pytest.raises(TimeoutError):
            second.recv(timeout=0.2)


def test_a_new_page_is_shown_the_newest_view_and_old_ones_are_skipped(web: Web):
    view = researcher()
    for k in range(50):
        web.show(view, participant("rest", seconds_left=float(k)))
    with answering(web) as page:
        assert json.loads(page.recv(timeout=5))["view"]["seconds_left"] == 49.0
        for k in range(200):
            web.show(view, participant("rest", seconds_left=float(k)))
        while json.loads(page.recv(timeout=5))["view"]["seconds_left"] != 199.0:
            pass
        assert web.counters["views_dropped"] > 100


def test_the_newest_participants_page_counts(web: Web):
    with answering(web) as first:
        until(lambda: web.is_participant_here)
        with answering(web) as second:
            with pytest.raises(ConnectionClosed) as caught:
                first.recv(timeout=5)
            assert caught.value.rcvd is not None
            assert caught.value.rcvd.code == TAKEN_OVER
            web.show(researcher(), participant("waiting"))
            assert json.loads(second.recv(timeout=5))["type"] == "view"
    until(lambda: not web.is_participant_here)


def test_researchers_pages_are_bounded(web: Web):
    with contextlib.ExitStack() as pages:
        for _ in range(MAX_PAGES):
            pages.enter_context(steering(web))
        until(lambda: web.counters["pages"] == MAX_PAGES)
        with steering(web) as further:
            with pytest.raises(ConnectionClosed) as caught:
                further.recv(timeout=5)
            assert caught.value.rcvd is not None
            assert caught.value.rcvd.code == TOO_MANY
        assert web.counters["pages_refused"] == 1


def test_asks_beyond_the_bound_wait_for_their_page_to_say_them_again(web: Web):
    with steering(web) as page:
        for k in range(MAX_WAITING + 8):
            page.send(ARM % f"k{k}")
        until(lambda: web.counters["asks_dropped"] == 8)
        for _ in range(MAX_WAITING):
            ask = web._asks.take()
            assert ask is not None
            web._asks.answer(Reply(id=ask.id, is_done=True))
        assert web._asks.take() is None
        page.send(ARM % f"k{MAX_WAITING}")
        until(lambda: web._asks.take() is not None)


def test_what_cannot_be_read_is_counted_and_what_is_too_long_ends_the_page(web: Web):
    with answering(web) as page:
        for text in ("{", b"bytes", '{"id":"a","action":"ready"}', READY % "a b", READY % ""):
            page.send(text)
        until(lambda: web.counters["messages_refused"] == 5)
        page.send("x" * (MAX_BYTES + 1))
        with pytest.raises(ConnectionClosed) as caught:
            page.recv(timeout=5)
        assert caught.value.rcvd is not None
        assert caught.value.rcvd.code == 1009


def test_the_token_of_a_folder_stays_and_is_its_owners(tmp_path: Path):
    token = token_of(tmp_path / "run")
    assert token_of(tmp_path / "run") == token
    assert len(token) >= 24
    (file,) = (tmp_path / "run").iterdir()
    assert stat.S_IMODE(file.stat().st_mode) == 0o600
    file.write_text("short")
    with pytest.raises(ConfigError, match="holds no token: delete it"):
        token_of(tmp_path / "run")


def test_a_taken_port_says_which_setting_to_change(web: Web):
    with pytest.raises(ConfigError, match=r"set study\.host and study\.port to what is free"):
        Web("127.0.0.1", web.port, (), token=TOKEN, asks=Asks())
