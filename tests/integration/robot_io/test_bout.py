"""A whole bout between processes: twin, two policies, a referee; no part knows another's code."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from shared.messages.play import PlayReply, PlayRequest, RefereeState
from shared.messages.topics import BOUT, REFEREE
from tests.integration.robot_io.site import Site

STEPS = 300

pytestmark = pytest.mark.zenoh


@pytest.fixture
def site(tmp_path: Path) -> Iterator[Site]:
    site = Site(tmp_path)
    yield site
    site.close()


def test_a_bout_is_fenced_judged_and_followed_by_the_way_home(site: Site):
    for agent in ("antagonist", "protagonist"):
        site.service("policy", "--name", f"policy-{agent}", "--agent", agent)
    site.service("referee", "--set", f"game.bout_steps={STEPS}")
    said = site.bus.subscribe(REFEREE)
    heard: list[RefereeState] = []

    def phase() -> str:
        while (state := said.take()) is not None:
            heard.append(state)
        return heard[-1].phase if heard else ""

    site.arm()
    home = site.states[-1].tools[1, :3]
    asked = PlayRequest(
        action="start", bout="one", antagonist="scripted:stab", protagonist="scripted:heuristic"
    )
    pending = site.bus.ask(BOUT, asked, timeout=3.0)
    site.until(lambda: pending.take() is not None)
    reply = pending.take()
    assert isinstance(reply, PlayReply)
    assert reply.accepted, reply.reason
    first = len(site.states)
    site.until(lambda: phase() == "finished")
    assert heard[-1].step == STEPS
    assert np.isfinite(heard[-1].score)
    played = [states for states in site.states[first:] if states.seconds > 0.0]
    seconds = np.array([states.seconds for states in played])
    ticks = np.array([states.tick for states in played])
    assert seconds[-1] == pytest.approx(0.01 * (STEPS - 1), abs=0.03)
    assert np.all(np.diff(seconds) >= 0.0)
    # Game time is the tick's, but where the referee was late to say that it has begun.
    assert np.median(np.abs(np.diff(seconds) - 0.01 * np.diff(ticks))) < 1e-9
    travelled = np.ptp([states.bats[:, :3] for states in played], axis=0).max(axis=1)
    assert travelled.min() > 0.02  # both moved

    site.until(lambda: float(np.linalg.norm(site.states[-1].tools[1, :3] - home)) < 0.03)
    assert site.is_mode("armed")
