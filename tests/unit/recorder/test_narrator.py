"""What the recorder remembers of the processes it hears."""

import pytest

from services.recorder import narrator
from services.recorder.narrator import Narrator
from shared.clock import ManualClock
from shared.messages.live import ServiceStatus
from shared.telemetry.recording import Recording


def test_invented_processes_push_out_who_was_heard_longest_ago(
    monkeypatch: pytest.MonkeyPatch,
):
    monkeypatch.setattr(narrator, "MOST_PROCESSES", 3)
    said: list[str] = []

    def keep(_self: Recording, _source: str, text: str, *_rest: object) -> None:
        said.append(text)

    monkeypatch.setattr(Recording, "event", keep)
    recording = Recording("test", None, None, None)
    heard = Narrator(recording, ManualClock(1.0), status_period=1.0)
    for name in ("a", "b", "c", "a", "d", "b", "a"):
        heard.on_status(
            ServiceStatus(role="actor", name=name, boot="b", pid=1, host="h", state="plays")
        )
    recording.close()
    assert [text.split()[0] for text in said] == ["a", "b", "c", "d", "b"]
