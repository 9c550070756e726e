"""A session's streams, read by LSL's own inlet as LabRecorder reads them."""

import json
from pathlib import Path
from typing import Any

import pytest

from services.study.lsl import EVENTS, HEART, LslOutlet
from shared.errors import ConfigError
from tests.unit.study.runner_stand import Stand

pylsl: Any = pytest.importorskip("pylsl", reason="pylsl is not installed (riposte[lsl])")
PATIENCE = 10.0


def inlet_of(name: str, source: str) -> Any:
    found = pylsl.resolve_byprop("source_id", f"{name}-{source}", 1, PATIENCE)
    if not found:
        pytest.skip("no stream is found: this machine lets no multicast through")
    inlet = pylsl.StreamInlet(found[0], recover=False)
    inlet.open_stream(PATIENCE)
    return inlet


def everything(inlet: Any, count: int) -> list[Any]:
    return [inlet.pull_sample(PATIENCE)[0][0] for _ in range(count)]


def test_a_session_tells_its_events_and_the_heart_rate_after_the_consent(tmp_path: Path):
    outlet = LslOutlet("sub-01", 1)
    events, heart = inlet_of(EVENTS, "sub-01-ses-01"), inlet_of(HEART, "sub-01-ses-01")
    stand = Stand(tmp_path / "study", outlet=outlet)
    stand.tick(3.0)  # a strap that is worn, and nobody has agreed to anything
    assert heart.pull_sample(0.3)[0] is None
    stand.walk("baseline-walking")
    stand.tick(3.0)
    told = [json.loads(text) for text in everything(events, len(stand.session.events))]
    assert [(one["number"], one["kind"], one["step"]) for one in told] == [
        (event.number, event.kind, event.step) for event in stand.session.events
    ]
    assert everything(heart, 1)[0] > 0.0
    text = json.dumps(told)
    assert not any(name in text for name in stand.session.plan.labels)


def test_without_pylsl_the_error_says_what_to_install(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setitem(__import__("sys").modules, "pylsl", None)
    with pytest.raises(ConfigError, match=r"riposte\[lsl\]"):
        LslOutlet("sub-01", 1)
