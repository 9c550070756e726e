"""The researcher's token is in the address and in its file, and in nothing that is kept."""

import threading
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest

from services.study.__main__ import FILE, build, run
from services.study.web import TOKEN_FILE
from shared.bus.memory import MemoryHub
from shared.clock import SystemClock
from shared.runtime.logging import configure_logging
from shared.runtime.serve import parse_args
from shared.study.events import Aborted
from tests.integration.study.running import make

ENOUGH = 24
"""Letters of a token."""


@pytest.fixture(autouse=True)
def _own_log() -> Iterator[None]:
    yield
    configure_logging(None)


@pytest.mark.parametrize("is_over", [False, True])
def test_the_token_goes_with_the_session_and_is_in_nothing_that_is_kept(
    tmp_path: Path, is_over: bool
):
    study = make(tmp_path / "study")
    folder = study.session_folder("sub-01")
    words = (f'study.folder="{study.folder}"', 'study.participant="sub-01"', "study.port=0")
    sets = [part for word in words for part in ("--set", word)]
    args = parse_args("study", ["--run", str(folder), "--name", "study-0", *sets])
    clock, stop = SystemClock(), threading.Event()
    configure_logging(folder / "logs" / "study-0.jsonl")
    bus = MemoryHub(clock).join("study-0")
    service = build(args, bus, clock)
    try:
        token = (folder / TOKEN_FILE).read_bytes()
        assert len(token) >= ENOUGH
        address = (folder / FILE).read_text().split('"')[3]
        assert token.decode() in address
        with urllib.request.urlopen(address, timeout=10) as page:
            assert page.status == 200
        with pytest.raises(urllib.error.HTTPError, match="403"):
            urllib.request.urlopen(address.replace("token=", "token=x"), timeout=10)
        service.tick()
        service.session.write(service.session.plan.began)
        if is_over:
            service.session.write(Aborted(reason="the fire alarm"))
        service.tick()
        assert token.decode() not in repr(service.health())
        stop.set()
        run(service, bus, clock, args, stop)
    finally:
        service.close()
    kept = [path for path in study.folder.rglob("*") if path.is_file()]
    assert {"journal.jsonl", "study-0.jsonl"} <= {path.name for path in kept}
    expected = [] if is_over else [folder / TOKEN_FILE]
    assert [path for path in kept if token in path.read_bytes()] == expected
