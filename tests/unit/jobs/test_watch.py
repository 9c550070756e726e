import os
from pathlib import Path

import msgspec
import pytest

from services.jobs import watch
from shared.errors import ConfigError
from shared.telemetry.door import LiveView


def test_a_run_that_goes_on_is_shown_live(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    view = LiveView(url="http://127.0.0.1:9090", page="http://127.0.0.1:1/?url=x", pid=os.getpid())
    (tmp_path / "viewer.json").write_bytes(msgspec.json.encode(view))

    assert watch.main([str(tmp_path), "--no-browser"]) == 0

    assert "http://127.0.0.1:9090" in capsys.readouterr().out


def test_a_view_left_behind_by_a_kill_is_not_believed(tmp_path: Path) -> None:
    gone = os.spawnlp(os.P_NOWAIT, "true", "true")
    os.waitpid(gone, 0)
    view = LiveView(url="http://127.0.0.1:9090", page="", pid=gone)
    (tmp_path / "viewer.json").write_bytes(msgspec.json.encode(view))

    with pytest.raises(ConfigError, match="has no recording"):
        watch.main([str(tmp_path), "--no-browser"])


def test_a_folder_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(ConfigError, match="there is no run"):
        watch.main([str(tmp_path / "nothing")])
