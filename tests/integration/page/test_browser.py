"""A bout on the page: a real browser, and robot_io, referee, policy and page as processes.

The tests of this file follow each other in one site, as a visit does. Needs Chromium.
"""

import sys
import time
from collections.abc import Callable, Iterator
from itertools import count

import numpy as np
import pytest

from shared.messages.play import RefereeState
from tests.integration.page.browsing import Player, browser, find_chromium
from tests.integration.page.live import LiveSite

pytestmark = [
    pytest.mark.zenoh,
    pytest.mark.timeout(300),
    pytest.mark.skipif(find_chromium() is None, reason="no Chromium: apt install chromium"),
]

PATIENT = (
    "safety.ramp=0.5", "safety.tracker_hold=0.5", "safety.command_hold=0.5",
    "safety.command_trip=2.0", "safety.state_hold=0.5", "safety.state_trip=0.5",
    "policy.stale_after=1.0", "referee.stale_after=10.0", "referee.void_after=60.0",
    "game.bout_steps=100000", "page.countdown=1.0", 'page.players=[["Static", "scripted:static"]]',
)  # fmt: skip
"""A busy machine may hold everybody up; nothing is decided by that here."""


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LiveSite]:
    made = LiveSite(tmp_path_factory.mktemp("site"))
    settings = [word for one in PATIENT for word in ("--set", one)]
    made.service("robot_io", "--set", "robot_io.tracker=mouse", *settings)
    made.service("referee", *settings)
    made.service("policy", "--agent", "protagonist", "--name", "policy-protagonist", *settings)
    yield made
    made.close()


@pytest.fixture(scope="module")
def opened(site: LiveSite) -> Iterator[Callable[[], Player]]:
    url = site.page(*PATIENT)
    with browser(site.listen) as open_page:
        yield lambda: open_page(f"{url}/?quality=still")


@pytest.fixture(scope="module")
def player(opened: Callable[[], Player]) -> Player:
    return opened()


def grip(site: LiveSite) -> np.ndarray:
    return site.bats[-1].bats[0, :3]


def test_moving_the_pointer_moves_the_bat_on_the_bus(site: LiveSite, player: Player):
    player.point(0.42, 0.4, 1.3)
    site.until(lambda: site.bats and site.bats[-1].is_valid[0], 60.0)
    player.until(lambda: np.linalg.norm(site.bats[-1].bats[0, 7:10]) < 0.01)
    before = grip(site)
    player.point(0.42, -0.4, 1.3)
    player.until(lambda: site.bats[-1].is_valid[0] and grip(site)[1] < before[1] - 0.2)
    depth = player.read("depth()")
    player.page.mouse.wheel(0, -400)
    player.until(lambda: player.read("depth()") < depth - 0.15)
    player.until(lambda: site.bats[-1].is_valid[0] and grip(site)[0] < before[0] - 0.1)
    assert player.errors == []


def test_the_pages_own_kinematics_put_the_robots_bat_where_robot_io_has_it(player: Player):
    player.until(lambda: player.read("frame().joints"))
    player.read("askBat()")
    said = player.until(lambda: player.read("bat()"))
    frame = said["state"]
    centre, (w, x, y, z) = np.array(frame["bats"][1][:3]), frame["bats"][1][3:]
    along = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    back, front = centre - 0.05 * along, centre + 0.70 * along
    ends = np.array(said["ends"])
    for end in (back, front):
        assert np.linalg.norm(ends - end, axis=1).min() < 0.012  # drawn a picture ago


def test_arming_takes_a_click(site: LiveSite, player: Player):
    player.until(lambda: player.read("action()") == "arm")
    player.page.keyboard.press("Space")
    player.page.keyboard.press("Enter")
    time.sleep(0.3)
    assert player.until(lambda: player.read("frame()?.gate.mode")) == "disarmed"
    player.arm()
    assert "robot" in player.page.inner_text("#gate-words")


def strike(player: Player) -> None:
    """Go with the tip to where the robot's blade is nearest to the target."""
    pose = np.array(player.read("frame()")["bats"][1])
    w, x, y, z = pose[3:]
    along = np.array([1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)])
    points = pose[:3] + np.linspace(0.1, 0.68, 30)[:, None] * along
    place = points[np.argmin(np.linalg.norm(points - (0.0, 0.0, 1.05), axis=1))]
    player.page.mouse.wheel(0, (place[0] - player.read("depth()")) / 0.0005)
    player.point(*place)


def test_the_target_scores_and_sounds_and_touching_bats_costs_ten_points(
    site: LiveSite, player: Player
):
    player.point(0.1, 0.3, 1.3)
    counted: set[str] = set()

    def is_running() -> bool:  # a machine that stands still for half a second trips the gate
        if player.read("action()") in ("reset", "arm", "start"):
            player.press()
        counted.add(player.page.inner_text("#big"))
        return bool(site.referee) and site.referee[-1].phase == "running"

    player.until(is_running)
    assert "1" in counted
    assert player.read("sound().level") < 1e-3

    def enter() -> None:  # follows the picture, as a hand would
        player.point(player.read("depth()"), 0.0, 1.05)

    enter()
    player.until(lambda: (enter(), site.referee[-1].score > 0)[1])

    def heard() -> bool:  # measured at the output
        sound = player.read("sound()")
        return sound["level"] > 0.05 and abs(sound["hz"] - 440.0) < 8.0

    player.until(lambda: (enter(), heard())[1])
    player.until(lambda: (strike(player), site.referee[-1].penalty_steps > 2)[1])
    said = [state for state in site.referee if state.phase == "running"]
    for state in said:
        assert state.score == state.attack_steps - 10.0 * state.penalty_steps
        caught = state.in_target[0] and state.contact
        assert state.tone_hz == (300.0 if caught else 440.0 if state.in_target[0] else 0.0)
    scores = [state.score for state in said]
    assert max(scores) > 0.0
    assert min(np.diff(scores)) <= -10.0
    player.point(player.read("depth()"), 0.8, 1.6)
    player.until(lambda: player.read("sound().level") < 1e-3)
    assert player.page.inner_text("#score") not in ("", "0")
    assert player.errors == []


def test_input_latency_is_measured_and_shown(player: Player, capsys: pytest.CaptureFixture[str]):
    angles = count()

    def moved() -> dict[str, float] | None:
        player.point(0.3, 0.3 + 0.2 * np.sin(next(angles) / 5), 1.3)
        said = player.read("latency(10)")
        return said if said and said["count"] > 20 else None

    latency = player.until(moved)
    with capsys.disabled():
        sys.stdout.write(f"\npointer to bat state, back in the page (ms): {latency}\n")
    assert 0.0 < latency["p50"] < 1000.0
    player.until(lambda: player.page.inner_text("#latency").endswith(" ms"))


def test_a_bout_is_abandoned_and_the_page_says_void(site: LiveSite, player: Player):
    player.page.keyboard.press("Escape")

    def phase() -> str:
        states: list[RefereeState] = site.referee
        return states[-1].phase

    player.until(lambda: phase() == "void")
    player.until(lambda: "abandon by a person" in player.read("frame().referee.reason"))
    player.until(lambda: player.read("frame().step") == "idle")


def test_a_second_page_takes_the_bat_and_the_first_is_told(
    site: LiveSite, player: Player, opened: Callable[[], Player]
):
    second = opened()
    player.until(lambda: "Another page plays now" in player.page.inner_text("#overlay"))
    source = site.bats[-1].tracker_source
    second.point(0.4, 0.3, 1.3)
    second.until(lambda: site.bats[-1].tracker_source not in ("", source))
    second.until(lambda: site.bats[-1].is_valid[0])
    second.page.close()
    site.until(lambda: not site.bats[-1].is_valid[0])  # nobody holds the bat any more
    player.page.click("#overlay-button")
    player.until(lambda: not player.page.is_visible("#overlay"))
    player.point(0.4, 0.35, 1.3)
    player.until(lambda: site.bats[-1].is_valid[0])


def test_a_hidden_page_has_lost_the_bat_at_once_and_finds_it_again(site: LiveSite, player: Player):
    hide = "Object.defineProperty(document, 'hidden', {value: %s, configurable: true});"
    tell = "document.dispatchEvent(new Event('visibilitychange'))"
    player.page.evaluate(hide % "true" + tell)
    player.until(lambda: not site.bats[-1].is_valid[0])
    player.until(lambda: player.read("frame().is_lost"))
    player.page.evaluate(hide % "false" + tell)
    player.until(lambda: site.bats[-1].is_valid[0])


def test_who_is_silent_is_named(site: LiveSite, player: Player):
    site.kill("referee")
    player.until(lambda: "Waiting for the referee" in player.page.inner_text("#overlay"))
    site.kill("robot_io")
    player.until(
        lambda: "Waiting for robot_io and the referee" in player.page.inner_text("#overlay")
    )
    site.kill("page")
    player.until(lambda: "No connection" in player.page.inner_text("#overlay"))
