"""From the mouse to the bat state: on a machine with nothing else to do."""

import sys
from pathlib import Path

import numpy as np
import pytest

from tests.integration.page.browsing import browser, find_chromium
from tests.integration.page.live import LiveSite

MOVES = 1500
GOAL_MS = 15.0


@pytest.mark.slow
@pytest.mark.zenoh
@pytest.mark.timeout(180)
@pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium")
def test_the_bat_state_follows_the_pointer_within_fifteen_milliseconds(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    site = LiveSite(tmp_path)
    try:
        site.service("robot_io", "--set", "robot_io.tracker=mouse")
        site.service("referee")
        site.service("policy", "--agent", "protagonist", "--name", "policy-protagonist")
        with browser(site.listen) as open_page:
            player = open_page(f"{site.page()}/?quality=still")
            player.point(0.42, 0.3, 1.3)
            player.until(lambda: site.bats and site.bats[-1].is_valid[0])
            left, right = (
                player.read("seenAt([0.42, -0.3, 1.3])"),
                player.read("seenAt([0.42, 0.5, 1.3])"),
            )
            for k in range(MOVES):
                share = 0.5 + 0.5 * np.sin(k / 40)
                player.page.mouse.move(*(np.array(left) + share * (np.array(right) - left)))
            latency = player.read("latency(60)")
        with capsys.disabled():
            sys.stdout.write(f"\npointer to bat state, back in the page (ms): {latency}\n")
    finally:
        site.close()
    assert latency["count"] > 0.8 * MOVES
    assert latency["p50"] <= GOAL_MS
