"""`riposte play` with no arguments, a browser, and a person at it, to the score in the summary."""

import time
from pathlib import Path

import pytest

from tests.integration.page.browsing import browser, find_chromium
from tests.integration.play_job.playing import QUICK, playing

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.slow,
    pytest.mark.timeout(300),
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]


def test_a_person_arms_starts_and_fences_a_bout_with_the_mouse(tmp_path: Path):
    folder = tmp_path / "match"
    overrides = (*QUICK, "game.bout_steps=300", "page.countdown=0.5", "safety.state_trip=0.5")
    with (
        playing(folder, "--bouts", "1", "--no-browser", overrides=overrides) as match,
        browser(lambda: time.sleep(0.01)) as open_page,
    ):
        url = match.until(lambda: "page: http" in match.said and match.said.split("page: ")[1])
        player = open_page(f"{url.split()[0]}/?quality=still")

        def do(action: str) -> None:
            player.point(0.42, 0.4, 1.3)
            if player.read("action()") == action and not player.read("frame().is_lost"):
                player.press()
            time.sleep(0.5)

        player.until(lambda: do("arm") or player.read("frame().gate.mode") == "armed", 90.0)
        player.until(lambda: do("start") or "running" in match.said, 90.0)
        for side in (0.2, -0.2, 0.0):
            player.point(0.1, side, 1.1)
            time.sleep(0.3)
        code, said = match.finish()
        assert player.errors == [] or "WebSocket" in player.errors[0]
    assert code == 0, said
    (bout,) = [bout for bout in match.summary["bouts"] if bout["outcome"] == "finished"]
    assert bout["bout"].startswith("page-")
    assert bout["antagonist"] == "person"
    assert bout["protagonist"].startswith("sha256:")
    assert bout["seconds"] == pytest.approx(3.0)
    assert "mouse v style-1: 1 bout" in said
